//! The receiving UART, sample by sample.
//!
//! The UART's clock has sixteen ticks per bit. While it waits for a byte, the UART looks for a low
//! level at each tick. It decides the start bit and every following bit by a majority of the levels
//! at the ticks 7, 8 and 9 of that bit. If the start bit is decided as high, it was noise and is
//! ignored. A low stop bit is a framing error. The UART then behaves like the nRF52840's UARTE: it
//! does not store the byte, and receives nothing more before the line has been high again.

use std::collections::VecDeque;

/// The length of a tick in time steps. A tick has 2^16 steps, so that the sender's clock can be set
/// with a resolution of a millionth.
pub(crate) const TICK: u64 = 1 << 16;

/// Ticks in one of the receiver's bits.
const OVERSAMPLING: u64 = 16;

/// The length of one of the receiver's bits, in time steps.
pub(crate) const BIT: u64 = OVERSAMPLING * TICK;

/// Start bit, eight data bits, stop bit.
pub(crate) const BITS_PER_BYTE: u64 = 10;

const STOP_BIT: u64 = BITS_PER_BYTE - 1;

/// The first and the last tick of a bit at which the UART samples the line.
const FIRST_SAMPLE: u64 = 7;
const LAST_SAMPLE: u64 = 9;

/// An event that the UART reports.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Heard {
    /// A byte. The UART saw the byte's start bit at `start` and decided the byte's stop bit at
    /// `at`.
    Byte { byte: u8, start: u64, at: u64 },
    /// A low stop bit.
    FramingError,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
enum State {
    /// Waits for a low level.
    #[default]
    Hunting,
    Character(Character),
    /// Waits for a high level.
    Low,
}

/// The character being received.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Character {
    /// The tick at which the character's start bit was seen.
    start: u64,
    /// The number of high samples of the current bit.
    high: u64,
    /// The bits decided so far. The last one is the most significant.
    bits: u16,
}

/// A receiving UART that starts at time 0.
#[derive(Debug, Default)]
pub(crate) struct Uart {
    state: State,
    /// The next tick at which the UART looks at the line.
    tick: u64,
    heard: VecDeque<Heard>,
}

impl Uart {
    /// Returns the next event that the UART has reported.
    pub(crate) fn hear(&mut self) -> Option<Heard> {
        self.heard.pop_front()
    }

    /// Advances to the time `until`. Since the time of the last call, the line has had this
    /// `level`.
    pub(crate) fn advance(&mut self, level: bool, until: u64) {
        let end = until.div_ceil(TICK);
        while self.tick < end {
            match self.state {
                State::Hunting | State::Low if level => {
                    self.state = State::Hunting;
                    self.tick = end;
                }
                State::Hunting => {
                    self.state = State::Character(Character {
                        start: self.tick,
                        high: 0,
                        bits: 0,
                    });
                    self.tick += FIRST_SAMPLE;
                }
                State::Low => self.tick = end,
                State::Character(character) => self.state = self.sample(character, level, end),
            }
        }
    }

    /// Samples one bit of a character up to the tick `end`. Decides the bit after its last sample.
    fn sample(&mut self, mut character: Character, level: bool, end: u64) -> State {
        let bit = (self.tick - character.start) / OVERSAMPLING;
        let last = character.start + bit * OVERSAMPLING + LAST_SAMPLE;
        let end = end.min(last + 1);
        if level {
            character.high += end - self.tick;
        }
        self.tick = end;
        if end <= last {
            return State::Character(character);
        }
        let is_high = character.high >= 2;
        match bit {
            0 if is_high => State::Hunting,
            STOP_BIT if is_high => {
                // The start bit has been shifted into the lower byte.
                let [_, byte] = character.bits.to_le_bytes();
                let (start, at) = (character.start * TICK, last * TICK);
                self.heard.push_back(Heard::Byte { byte, start, at });
                State::Hunting
            }
            STOP_BIT => {
                self.heard.push_back(Heard::FramingError);
                State::Low
            }
            _ => {
                // Data bits arrive least significant first.
                character.bits = character.bits >> 1 | u16::from(is_high) << 15;
                character.high = 0;
                self.tick += OVERSAMPLING - (LAST_SAMPLE + 1) + FIRST_SAMPLE;
                State::Character(character)
            }
        }
    }
}

#[cfg(test)]
mod tests;
