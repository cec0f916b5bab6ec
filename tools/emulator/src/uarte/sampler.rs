//! Samples the line bit by bit, and turns its levels into bytes and errors.
//!
//! The product specification (section "UARTE", "Reception" and "Error conditions") defines the errors, but not how the
//! line is sampled. The model samples as UARTs usually do. It sees the start bit's edge with a resolution of a
//! sixteenth of a bit. Then it samples each bit once, in the middle, as timed by the receiver's own clock. If a start
//! bit is high in the middle, the model ignores it as noise.

use crate::line::SerialLine;

/// The number of the stop bit, or of the parity bit if there is one. Bit 0 is the start bit.
const STOP_BIT: u64 = 9;

/// A byte or an error that the sampler found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Heard {
    /// A byte whose stop bit was high, and whether its parity bit, if any, was right.
    Byte(u8, bool),
    /// A character without a stop bit.
    FramingError,
    /// The line was low for longer than a whole character. The sampler has already reported the framing error.
    Break,
}

#[derive(Clone, Copy, Debug, Default)]
enum State {
    #[default]
    Off,
    /// Looks for a low level from the instant `since` on.
    Hunting { since: u64 },
    /// Receives a character whose start bit began at `start`.
    Character { start: u64 },
    /// Found no stop bit, and waits for a high level.
    Low { break_at: Option<u64>, since: u64 },
}

#[derive(Clone, Debug, Default)]
pub(super) struct Sampler {
    state: State,
    /// Cycles of a bit.
    bit: u64,
    /// Number of parity bits in a character.
    parity: u64,
}

impl Sampler {
    /// Starts sampling at `now`, with `bit` cycles per bit, and with an even parity bit before each stop bit if
    /// `parity` is true.
    pub(super) fn start(&mut self, now: u64, bit: u64, parity: bool) {
        (self.bit, self.parity) = (bit, parity.into());
        // A line that is low when the receiver starts counts as a start bit. So if the RX pin floats and is low, a
        // framing error and a break come within about one character after the receiver has started.
        self.state = State::Hunting { since: now };
    }

    pub(super) fn stop(&mut self) {
        self.state = State::Off;
    }

    pub(super) fn runs(&self) -> bool {
        !matches!(self.state, State::Off)
    }

    /// Returns whether the sampler looks for a start bit.
    pub(super) fn is_between(&self) -> bool {
        matches!(self.state, State::Hunting { .. })
    }

    /// Returns the middle of a bit. Bit 0 is the start bit.
    fn middle(&self, start: u64, bit: u64) -> u64 {
        start + self.bit * bit + self.bit / 2
    }

    /// Returns the next instant at which the sampler must act.
    pub(super) fn next(&self, line: &SerialLine) -> Option<u64> {
        match self.state {
            State::Off => None,
            State::Hunting { since } => line.reaches(false, since),
            State::Character { start } => Some(self.middle(start, STOP_BIT + self.parity)),
            State::Low { break_at, since } => {
                let high = line.reaches(true, since);
                [break_at, high].into_iter().flatten().min()
            }
        }
    }

    /// Acts at `at`, the instant that [`Sampler::next`] returned.
    pub(super) fn advance(&mut self, at: u64, line: &mut SerialLine) -> Option<Heard> {
        match self.state {
            State::Off => None,
            State::Hunting { .. } => {
                line.forget_before(at);
                // The sampling clock always runs, so the edge is seen at the next sixteenth of a
                // bit.
                let start = at.next_multiple_of((self.bit / 16).max(1));
                self.state = State::Character { start };
                None
            }
            State::Character { start } => self.end_of_character(start, at, line),
            State::Low { break_at, since } => {
                if break_at == Some(at) {
                    self.state = State::Low {
                        break_at: None,
                        since,
                    };
                    return Some(Heard::Break);
                }
                self.state = State::Hunting { since: at };
                None
            }
        }
    }

    fn end_of_character(&mut self, start: u64, now: u64, line: &SerialLine) -> Option<Heard> {
        let sample = |bit| line.level_at(self.middle(start, bit));
        if sample(0) {
            // This low level was noise, not a start bit. From here on the sampler looks for the next start bit.
            let since = self.middle(start, 0);
            self.state = State::Hunting { since };
            return None;
        }
        let byte = (0..8).fold(0, |byte, bit| byte | u8::from(sample(1 + bit)) << bit);
        let stop_bit = STOP_BIT + self.parity;
        if sample(stop_bit) {
            let is_odd = byte.count_ones() % 2 == 1;
            let is_right = self.parity == 0 || sample(STOP_BIT) == is_odd;
            self.state = State::Hunting { since: now };
            return Some(Heard::Byte(byte, is_right));
        }
        // The line has been low since its last change, or since the character began.
        let low_since = line
            .change_before(now)
            .map_or(start, |change| change.max(start));
        let break_at = low_since + (stop_bit + 1) * self.bit + 1;
        self.state = State::Low {
            break_at: Some(break_at.max(now + 1)),
            since: now,
        };
        Some(Heard::FramingError)
    }
}
