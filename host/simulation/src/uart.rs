//! The receiving UART, sample by sample.
//!
//! Its clock runs sixteen times as fast as its bits. It looks for a low level at each tick; a start
//! bit and every bit behind it is what two of the ticks 7, 8 and 9 of that bit say. A start bit
//! that is high is none. A stop bit that is low is a framing error; what it does then is what the
//! nRF52840's UARTE does: the byte is not stored, a line that stays low for longer than a character
//! is a break, and nothing begins before the line has been high again.

use std::collections::VecDeque;

use framelock::LineEvent;

/// Time: the smallest step there is. A tick has 2^16 of them, so that the sender's clock can be set
/// to a millionth.
pub(crate) const TICK: u64 = 1 << 16;

/// Ticks in one of the receiver's bits.
const OVERSAMPLING: u64 = 16;

/// A bit of the receiver's, in time steps.
pub(crate) const BIT: u64 = OVERSAMPLING * TICK;

/// Start bit, eight data bits, stop bit.
pub(crate) const BITS_PER_BYTE: u64 = 10;

const STOP_BIT: u64 = BITS_PER_BYTE - 1;

/// The ticks of a bit that are sampled.
const FIRST_SAMPLE: u64 = 7;
const LAST_SAMPLE: u64 = 9;

/// What the receiver makes of the line, and when.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Heard {
    /// A byte. Its start bit was seen, and its stop bit decided, at these times.
    Byte { byte: u8, start: u64, at: u64 },
    /// A stop bit that was low; or, behind that, a line that is low for longer than a character.
    Error { event: LineEvent, at: u64 },
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    /// Waits for a low level.
    #[default]
    Hunting,
    Character(Character),
    /// Waits for a high level; reports a break at that tick.
    Low {
        break_at: u64,
    },
}

/// The character that is coming in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Character {
    /// The tick at which its start bit was seen.
    start: u64,
    /// How many samples of the current bit were high.
    high: u64,
    /// The bits decided, the last one highest.
    bits: u16,
    /// Behind the last sample that was high.
    low_since: u64,
}

/// The receiver. It begins at time 0.
#[derive(Debug, Default)]
pub(crate) struct Uart {
    state: State,
    /// The next tick at which it looks at the line.
    tick: u64,
    heard: VecDeque<Heard>,
}

impl Uart {
    /// What it has made of the line, in order.
    pub(crate) fn hear(&mut self) -> Option<Heard> {
        self.heard.pop_front()
    }

    /// The line has `level` from where the last call ended until the time `until`.
    pub(crate) fn advance(&mut self, level: bool, until: u64) {
        let end = until.div_ceil(TICK);
        while self.tick < end {
            match self.state {
                State::Hunting | State::Low { .. } if level => {
                    self.state = State::Hunting;
                    self.tick = end;
                }
                State::Hunting => {
                    self.state = State::Character(Character {
                        start: self.tick,
                        high: 0,
                        bits: 0,
                        low_since: self.tick,
                    });
                    self.tick += FIRST_SAMPLE;
                }
                State::Low { break_at } => {
                    if (self.tick..end).contains(&break_at) {
                        self.error(LineEvent::Break, break_at);
                    }
                    self.tick = end;
                }
                State::Character(character) => self.state = self.sample(character, level, end),
            }
        }
    }

    /// Takes samples of one bit of a character, up to the tick `end`; the last one decides the bit.
    fn sample(&mut self, mut character: Character, level: bool, end: u64) -> State {
        let bit = (self.tick - character.start) / OVERSAMPLING;
        let last = character.start + bit * OVERSAMPLING + LAST_SAMPLE;
        let end = end.min(last + 1);
        if level {
            character.high += end - self.tick;
            character.low_since = end;
        }
        self.tick = end;
        if end <= last {
            return State::Character(character);
        }
        let is_high = character.high >= 2;
        match bit {
            0 if is_high => State::Hunting,
            STOP_BIT if is_high => {
                // The start bit has moved on to the lower half.
                let [_, byte] = character.bits.to_le_bytes();
                let (start, at) = (character.start * TICK, last * TICK);
                self.heard.push_back(Heard::Byte { byte, start, at });
                State::Hunting
            }
            STOP_BIT => {
                self.error(LineEvent::Framing, last);
                let break_at = character.low_since + BITS_PER_BYTE * OVERSAMPLING + 1;
                State::Low { break_at }
            }
            _ => {
                // Data bits come lowest first.
                character.bits = character.bits >> 1 | u16::from(is_high) << 15;
                character.high = 0;
                self.tick += OVERSAMPLING - (LAST_SAMPLE + 1) + FIRST_SAMPLE;
                State::Character(character)
            }
        }
    }

    fn error(&mut self, event: LineEvent, tick: u64) {
        let at = tick * TICK;
        self.heard.push_back(Heard::Error { event, at });
    }
}

#[cfg(test)]
mod tests;
