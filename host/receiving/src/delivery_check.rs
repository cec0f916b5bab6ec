//! Checks whether a receiver delivers each frame that arrives whole. The caller must know the sent frames.

use std::collections::VecDeque;
use std::ops::Range;

/// The sent frames that have arrived whole and that the receiver may still deliver. Each frame has a value that the
/// caller chooses.
#[derive(Clone, Debug)]
pub struct DeliveryCheck<T> {
    open: VecDeque<(Range<usize>, T)>,
}

impl<T> Default for DeliveryCheck<T> {
    fn default() -> Self {
        let open = VecDeque::new();
        Self { open }
    }
}

impl<T> DeliveryCheck<T> {
    /// Records that a sent frame has arrived in these bytes of the received stream. Call this method in the order of
    /// the stream, before the receiver takes the frame's last byte.
    pub fn arrived(&mut self, bytes: Range<usize>, frame: T) {
        self.open.push_back((bytes, frame));
    }

    /// Records that the receiver has delivered these bytes as a frame. Returns the sent frame that arrived in exactly
    /// these bytes, or `None` if there is no such sent frame. Call [`missed`](Self::missed) before this method.
    pub fn delivered(&mut self, bytes: &Range<usize>) -> Option<T> {
        self.oldest_if(|arrived| arrived == bytes)
    }

    /// Removes and returns the oldest frame that begins before byte number `decided`. All bytes before `decided` must
    /// have an outcome, so the receiver can no longer deliver this frame.
    pub fn missed(&mut self, decided: usize) -> Option<T> {
        self.oldest_if(|bytes| bytes.start < decided)
    }

    fn oldest_if(&mut self, is_wanted: impl Fn(&Range<usize>) -> bool) -> Option<T> {
        let is_wanted = self.open.front().is_some_and(|(bytes, _)| is_wanted(bytes));
        let (_, frame) = is_wanted.then(|| self.open.pop_front())??;
        Some(frame)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_whole_frame_is_delivered_or_missed_and_others_are_neither() {
        let mut check = DeliveryCheck::default();
        for (number, start) in [2, 9, 16].into_iter().enumerate() {
            check.arrived(start..start + 7, number);
        }
        // Nobody sent the frame that is delivered next.
        assert_eq!(check.delivered(&(0..7)), None);
        assert_eq!(check.missed(2), None);
        assert_eq!(check.delivered(&(2..9)), Some(0));
        assert_eq!(check.missed(10), Some(1));
        assert_eq!(check.missed(10), None);
        // The start is right, but the length is wrong.
        assert_eq!(check.delivered(&(16..24)), None);
        assert_eq!(check.missed(24), Some(2));
        assert_eq!(check.missed(usize::MAX), None);
    }
}
