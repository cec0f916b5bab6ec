//! A sent frame, and which of its bytes really arrived. The simulation knows this, but no receiver
//! does.

use crate::frames::Transmission;
use crate::uart::BITS_PER_BYTE;

/// A byte's position among the bytes sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Origin {
    /// The frame's number.
    pub frame: u64,
    /// The byte's index in the frame, from 0.
    pub place: usize,
}

/// A frame that is being sent or was sent, and the state of its arrival.
#[derive(Debug, Default)]
pub(crate) struct SentFrame {
    pub(crate) number: u64,
    pub(crate) transmission: Transmission,
    /// The bit at which the frame begins.
    pub(crate) begin: u64,
    /// The number of the frame's bytes that have been sent.
    pub(crate) sent: usize,
    /// The received stream now ends with this number of the frame's first bytes.
    pub(crate) arrived: usize,
    /// Whether one of these bytes differs from the byte sent, or a line error occurred between two
    /// of them.
    pub(crate) is_broken: bool,
    /// Whether the whole frame has arrived unbroken.
    pub(crate) is_intact: bool,
}

impl SentFrame {
    pub(crate) fn is_sent(&self) -> bool {
        self.sent == self.transmission.bytes.len()
    }

    /// Returns the byte of this frame that is on the line at this bit, and the byte's position.
    pub(crate) fn byte_at(&self, bit: u64) -> Option<(Origin, u8)> {
        let bit = bit.checked_sub(self.begin)?;
        let (frame, place) = (self.number, usize::try_from(bit / BITS_PER_BYTE).ok()?);
        let &byte = self.transmission.bytes.get(place)?;
        let is_frame = self.transmission.setpoint.is_some();
        is_frame.then_some((Origin { frame, place }, byte))
    }

    /// Records a byte that arrived. `origin` is the byte's position if the byte belongs to a frame.
    /// `is_as_sent` states whether the byte's value is unchanged. Returns true if this byte
    /// completes the frame and no byte was lost, added or reordered. Values may differ.
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

    /// Records a line error of the UART. A frame that is still arriving does not count as intact.
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
            let found = frame().byte_at(bit);
            found.map(|(origin, byte)| (origin.place, byte))
        };
        let expected = [
            (99, None),
            (100, Some((0, 1))),
            (109, Some((0, 1))),
            (110, Some((1, 2))),
            (129, Some((2, 3))),
            (130, None),
        ];
        assert_eq!(expected.map(|(bit, _)| (bit, byte_at(bit))), expected);
    }

    /// Returns whether these bytes leave frame 0 intact, and how often the bytes complete frame 0.
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
        // If the first byte comes twice, a whole frame begins with the second copy. If any other
        // byte comes twice, no whole frame arrives.
        let first_doubled = [(0, 0, true), (0, 0, true), (0, 1, true), (0, 2, true)];
        assert_eq!(arrived(&first_doubled), (true, 1));
        let doubled = [(0, 0, true), (0, 1, true), (0, 1, true), (0, 2, true)];
        assert_eq!(arrived(&doubled), (false, 0));
    }

    #[test]
    fn bytes_and_errors_within_a_frame_break_it() {
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
        // Bytes before the frame's first byte do not break the frame.
        for place in 0..3 {
            frame.deliver(byte(place), true);
        }
        assert!(frame.is_intact);
    }
}
