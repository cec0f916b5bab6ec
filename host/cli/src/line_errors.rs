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

/// Reads the marks.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Marks {
    /// What a byte that came with an error means: with a parity bit most likely that it is wrong.
    pub(crate) error: LineEvent,
    state: State,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    /// None is under way.
    #[default]
    Between,
    /// FF has come.
    Begun,
    /// FF 00 has come.
    Error,
}

impl Marks {
    /// Of a line with or without a parity bit.
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

    /// Takes what the operating system gave; gives `take` what the line brought: bytes, and line
    /// errors in place of bytes.
    pub(crate) fn feed(&mut self, bytes: &[u8], mut take: impl FnMut(Result<u8, LineEvent>)) {
        for &byte in bytes {
            let before = std::mem::take(&mut self.state);
            match (before, byte) {
                (State::Between, 0xFF) => self.state = State::Begun,
                (State::Between, byte) => take(Ok(byte)),
                (State::Begun, 0x00) => self.state = State::Error,
                (State::Begun, 0xFF) => take(Ok(0xFF)),
                // No mark that there is: nothing is lost.
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
                    marks.feed(piece, |it| received.push(it));
                }
                assert_eq!(received, expected, "{length}");
            }
        }
    }
}
