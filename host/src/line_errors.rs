//! Line errors at a serial port: the operating system marks them in the bytes that it gives.
//!
//! With `PARMRK` set, Unix gives a byte that came with a framing or parity error as `FF 00 byte`,
//! a break as `FF 00 00`, and so that these can be told from data, FF as `FF FF`. It has no mark
//! for an overrun. A framing error whose eight bits are all 0 looks like a break, and nearly is one.

use framelock::LineEvent;

use crate::serial::Device;

/// While it lives, line errors are marked; then the port is as before.
pub(crate) struct Marking {
    #[cfg(unix)]
    before: (Device, rustix::termios::Termios),
}

impl Marking {
    /// Begins to mark, where the operating system can. What has come until now is thrown away.
    #[cfg(unix)]
    pub(crate) fn begin(device: Device) -> Option<Self> {
        use rustix::termios::{InputModes, OptionalActions, tcgetattr, tcsetattr};

        let before = tcgetattr(&device).ok()?;
        let mut settings = before.clone();
        settings.input_modes |= InputModes::PARMRK | InputModes::INPCK;
        settings.input_modes -= InputModes::IGNBRK | InputModes::BRKINT | InputModes::IGNPAR;
        // What has come so far is without marks, and would be misread.
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
        // A port that is gone has no settings either.
        let _ = rustix::termios::tcsetattr(device, rustix::termios::OptionalActions::Now, settings);
    }
}

/// What a line brought.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Received {
    /// A byte, as far as anybody noticed a good one.
    Byte(u8),
    /// Something in place of a byte.
    Event(LineEvent),
}

/// Reads the marks.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) enum Marks {
    /// None is under way.
    #[default]
    Between,
    /// FF has come.
    Begun,
    /// FF 00 has come.
    Error,
}

impl Marks {
    /// Takes what the operating system gave; gives `take` what the line brought.
    pub(crate) fn feed(&mut self, bytes: &[u8], mut take: impl FnMut(Received)) {
        for &byte in bytes {
            *self = match (*self, byte) {
                (Self::Between, 0xFF) => Self::Begun,
                (Self::Begun, 0x00) => Self::Error,
                (Self::Error, byte) => {
                    take(Received::Event(if byte == 0 {
                        LineEvent::Break
                    } else {
                        // There is no parity on this line.
                        LineEvent::Framing
                    }));
                    Self::Between
                }
                (Self::Begun, byte) => {
                    take(Received::Byte(0xFF));
                    if byte != 0xFF {
                        // No mark that there is: nothing is lost.
                        take(Received::Byte(byte));
                    }
                    Self::Between
                }
                (Self::Between, byte) => {
                    take(Received::Byte(byte));
                    Self::Between
                }
            };
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
        let expected = [
            Received::Byte(0x41),
            Received::Byte(0xFF),
            Received::Byte(0x00),
            Received::Event(LineEvent::Framing),
            Received::Event(LineEvent::Break),
            Received::Event(LineEvent::Framing),
            Received::Byte(0x0D),
            Received::Byte(0xFF),
            Received::Byte(0xFF),
            Received::Byte(0xFF),
            Received::Byte(0x12),
        ];
        for length in 1..=given.len() {
            let mut marks = Marks::default();
            let mut received = Vec::new();
            for piece in given.chunks(length) {
                marks.feed(piece, |it| received.push(it));
            }
            assert_eq!(received, expected, "{length}");
        }
    }
}
