//! Line errors at a serial port. The operating system marks them among the bytes that it delivers.
//!
//! With `PARMRK` set, Unix delivers a byte with a framing or parity error as `FF 00 byte`, and a break as `FF 00 00`. A
//! data byte FF is delivered as `FF FF`, to distinguish it from a mark. There is no mark for an overrun. A framing
//! error in a zero byte has the same mark as a break, because both hold the line low at least from the start bit to the
//! stop bit.

use framelock::LineEvent;

use crate::serial::Device;

/// A port that marks line errors. Dropping this value restores the port's earlier settings.
pub(crate) struct Marking {
    #[cfg(unix)]
    before: (Device, rustix::termios::Termios),
}

impl Marking {
    /// Begins to mark line errors, if the operating system supports this. Discards the bytes that have already arrived.
    #[cfg(unix)]
    pub(crate) fn begin(device: Device) -> Option<Self> {
        use rustix::termios::{InputModes, OptionalActions, tcgetattr, tcsetattr};

        let before = tcgetattr(&device).ok()?;
        let mut settings = before.clone();
        settings.input_modes |= InputModes::PARMRK | InputModes::INPCK;
        settings.input_modes -= InputModes::IGNBRK | InputModes::BRKINT | InputModes::IGNPAR;
        // Bytes that have already arrived have no marks, and would be misread.
        tcsetattr(&device, OptionalActions::Flush, &settings).ok()?;
        Some(Self {
            before: (device, before),
        })
    }

    #[cfg(windows)]
    pub(crate) fn begin((): Device) -> Option<Self> {
        None
    }
}

#[cfg(unix)]
impl Drop for Marking {
    fn drop(&mut self) {
        let (device, settings) = &self.before;
        // This fails if the port is gone, and then there is nothing to restore.
        let _ = rustix::termios::tcsetattr(device, rustix::termios::OptionalActions::Now, settings);
    }
}

/// Decodes the marks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Marks {
    /// The event to report for a byte with an error. On a line with a parity bit, most errors are parity errors.
    pub(crate) error: LineEvent,
    state: State,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    /// No mark has begun.
    #[default]
    Between,
    /// FF has arrived.
    Begun,
    /// FF 00 has arrived.
    Error,
}

impl Marks {
    /// Makes a decoder for a line with or without a parity bit.
    pub(crate) fn new(has_parity: bool) -> Self {
        Self {
            error: if has_parity {
                LineEvent::Parity
            } else {
                LineEvent::Framing
            },
            state: State::Between,
        }
    }

    /// Decodes bytes from the operating system. Calls `take` with each byte of the line. For a byte that had an error,
    /// calls `take` with this error instead.
    pub(crate) fn feed(&mut self, bytes: &[u8], mut take: impl FnMut(Result<u8, LineEvent>)) {
        for &byte in bytes {
            let before = std::mem::take(&mut self.state);
            match (before, byte) {
                (State::Between, 0xFF) => self.state = State::Begun,
                (State::Between, byte) => take(Ok(byte)),
                (State::Begun, 0x00) => self.state = State::Error,
                (State::Begun, 0xFF) => take(Ok(0xFF)),
                // This is not a mark; pass both bytes on, so that nothing is lost.
                (State::Begun, byte) => [0xFF, byte].map(Ok).into_iter().for_each(&mut take),
                (State::Error, 0x00) => take(Err(LineEvent::Break)),
                (State::Error, _) => take(Err(self.error)),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_read_wherever_the_bytes_are_cut() {
        let given = [
            0x41, 0xFF, 0xFF, 0x00, 0xFF, 0x00, 0x7F, 0xFF, 0x00, 0x00, 0xFF, 0x00, 0xFF, 0x0D,
            0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0x12,
        ];
        for (has_parity, error) in [(false, LineEvent::Framing), (true, LineEvent::Parity)] {
            let expected = [
                Ok(0x41),
                Ok(0xFF),
                Ok(0x00),
                Err(error),
                Err(LineEvent::Break),
                Err(error),
                Ok(0x0D),
                Ok(0xFF),
                Ok(0xFF),
                Ok(0xFF),
                Ok(0x12),
            ];
            for length in 1..=given.len() {
                let mut marks = Marks::new(has_parity);
                let mut received = Vec::new();
                for piece in given.chunks(length) {
                    marks.feed(piece, |outcome| received.push(outcome));
                }
                assert_eq!(received, expected, "{length}");
            }
        }
    }
}
