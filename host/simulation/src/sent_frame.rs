//! A sent frame, and what really arrived of it: known to the simulation, and to no receiver.

use crate::payload::Transmission;
use crate::uart::BITS_PER_BYTE;

/// A byte's place in what was sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Origin {
    /// The frame's number.
    pub frame: u64,
    /// The byte's place in it, from 0.
    pub place: usize,
}

/// A frame that is or was sent, and what has become of it.
#[derive(Debug, Default)]
pub(crate) struct SentFrame {
    pub(crate) number: u64,
    pub(crate) transmission: Transmission,
    /// The bit at which it begins.
    pub(crate) begin: u64,
    /// How many of its bytes have been sent.
    pub(crate) sent: usize,
    /// The bytes delivered last are the first of this frame, this many.
    pub(crate) arrived: usize,
    /// Not all of these are as they were sent, or a line error came between them.
    pub(crate) is_broken: bool,
    /// Whether all of it arrived, unbroken.
    pub(crate) is_intact: bool,
}

impl SentFrame {
    pub(crate) fn is_sent(&self) -> bool {
        self.sent == self.transmission.bytes.len()
    }

    /// The place of the byte that is on the line at that bit, and the byte. Bytes begin `step` bits
    /// apart.
    pub(crate) fn byte_at(&self, bit: u64, step: u64) -> Option<(Origin, u8)> {
        let bit = bit.checked_sub(self.begin)?;
        let (frame, place) = (self.number, usize::try_from(bit / step).ok()?);
        let &byte = self.transmission.bytes.get(place)?;
        let is_on_line = bit % step < BITS_PER_BYTE && self.transmission.setpoint.is_some();
        is_on_line.then_some((Origin { frame, place }, byte))
    }

    /// A byte is delivered: where it comes from, if it does come from a frame, and whether it is as
    /// it was sent. True if it ends this frame, of which every byte has come in its order, but some
    /// perhaps with another value.
    pub(crate) fn deliver(&mut self, origin: Option<Origin>, is_as_sent: bool) -> bool {
        let own = origin.filter(|origin| origin.frame == self.number);
        self.arrived = match own.map(|origin| origin.place) {
            Some(0) => {
                self.is_broken = false;
                1
            }
            Some(place) if place == self.arrived => place + 1,
            _ => 0,
        };
        self.is_broken |= !is_as_sent;
        let ends = self.arrived == self.transmission.bytes.len();
        self.is_intact |= ends && !self.is_broken;
        ends
    }

    /// The UART reports an error: if not all of it has come, it does not arrive intact.
    pub(crate) fn line_error(&mut self) {
        self.is_broken = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of three bytes.
    fn frame() -> SentFrame {
        let bytes = vec![1, 2, 3];
        let setpoint = Some(crate::LEVEL);
        SentFrame {
            transmission: Transmission { bytes, setpoint },
            begin: 100,
            ..SentFrame::default()
        }
    }

    #[test]
    fn a_byte_is_found_by_the_bit_at_which_it_is_on_the_line() {
        let byte_at = |bit| {
            frame()
                .byte_at(bit, 12)
                .map(|(origin, byte)| (origin.place, byte))
        };
        let expected = [
            (99, None),
            (100, Some((0, 1))),
            (109, Some((0, 1))),
            (110, None),
        ];
        assert_eq!(expected.map(|(bit, _)| (bit, byte_at(bit))), expected);
        assert_eq!(byte_at(112), Some((1, 2)));
        assert_eq!(byte_at(133), Some((2, 3)));
        assert_eq!(byte_at(136), None);
    }

    /// Whether the bytes leave frame 0 intact, and how often they end it.
    fn arrived(bytes: &[(u64, usize, bool)]) -> (bool, usize) {
        let mut frame = frame();
        let ended = bytes.iter().filter(|&&(number, place, is_as_sent)| {
            let origin = Origin {
                frame: number,
                place,
            };
            frame.deliver(Some(origin), is_as_sent)
        });
        let ended = ended.count();
        (frame.is_intact, ended)
    }

    #[test]
    fn a_frame_is_intact_if_all_of_it_came_as_it_was_sent() {
        let whole = [(0, 0, true), (0, 1, true), (0, 2, true)];
        assert_eq!(arrived(&whole), (true, 1));
        let corrupted = [(0, 0, true), (0, 1, false), (0, 2, true)];
        assert_eq!(arrived(&corrupted), (false, 1));
        let lost = [(0, 0, true), (0, 2, true), (1, 0, true)];
        assert_eq!(arrived(&lost), (false, 0));
        let across = [(0, 0, true), (1, 1, true), (0, 2, true)];
        assert_eq!(arrived(&across), (false, 0));
        // A doubled first byte leaves a whole frame behind the double; any other does not.
        let first_doubled = [(0, 0, true), (0, 0, true), (0, 1, true), (0, 2, true)];
        assert_eq!(arrived(&first_doubled), (true, 1));
        let doubled = [(0, 0, true), (0, 1, true), (0, 1, true), (0, 2, true)];
        assert_eq!(arrived(&doubled), (false, 0));
    }

    #[test]
    fn what_comes_between_breaks_a_frame() {
        let byte = |place| Some(Origin { frame: 0, place });
        let mut frame = frame();
        frame.deliver(byte(0), true);
        frame.deliver(byte(1), true);
        frame.deliver(None, true);
        assert!(!frame.deliver(byte(2), true) && !frame.is_intact);
        frame.deliver(byte(0), true);
        frame.deliver(byte(1), true);
        frame.line_error();
        assert!(frame.deliver(byte(2), true) && !frame.is_intact);
        // What came before its first byte does not.
        for place in 0..3 {
            frame.deliver(byte(place), true);
        }
        assert!(frame.is_intact);
    }
}
