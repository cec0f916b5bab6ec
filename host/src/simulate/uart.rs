//! The receiving UART, sample by sample.
//!
//! Its clock runs sixteen times as fast as its bits. It looks for a low level at each tick; a start
//! bit and every bit behind it is what two of the ticks 7, 8 and 9 of that bit say. A start bit
//! that is high is none. A stop bit that is low is a framing error; what it does then is what the
//! nRF52840's UARTE does: the byte is not stored, a line that stays low for longer than a character
//! is a break, and nothing begins before the line has been high again.

/// Time: the smallest step there is. A tick has 2^16 of them, so that the sender's clock can be set
/// to a millionth.
pub(super) const TICK: u64 = 1 << 16;

/// Ticks in one of the receiver's bits.
const OVERSAMPLING: u64 = 16;

/// A bit of the receiver's, in time steps.
pub(super) const BIT: u64 = OVERSAMPLING * TICK;

/// Start bit, eight data bits, stop bit.
pub(super) const BITS_PER_BYTE: u64 = 10;

/// The tick of a bit that is sampled first, of three that follow each other.
const FIRST_SAMPLE: u64 = 7;
const SAMPLES: u64 = 3;

/// What the receiver makes of the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Heard {
    /// A byte. Its start bit was seen, and its stop bit decided, at these times.
    Byte { byte: u8, start: u64, at: u64 },
    /// A stop bit that was low.
    FramingError { at: u64 },
    /// The line has been low for longer than a character; a framing error came before.
    Break { at: u64 },
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum State {
    /// Waits for a low level.
    Hunting,
    Character(Character),
    /// Waits for a high level. The tick at which a break is reported, unless it has been.
    Low {
        break_at: Option<u64>,
    },
}

/// A character under way.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
struct Character {
    /// The tick at which its start bit was seen.
    start: u64,
    bit: u64,
    /// How many samples of the bit have been taken, and how many of them were high.
    samples: u64,
    high: u64,
    /// The bits decided, the last one highest.
    bits: u16,
    /// Behind the last tick that was seen high.
    low_since: u64,
}

/// The receiver.
#[derive(Clone, Debug)]
pub(super) struct Uart {
    state: State,
    /// The next tick at which it looks at the line.
    tick: u64,
}

impl Uart {
    /// It begins at time 0.
    pub(super) fn new() -> Self {
        Self {
            state: State::Hunting,
            tick: 0,
        }
    }

    /// The line has `level` from where the last call ended until the time `until`.
    pub(super) fn advance(&mut self, level: bool, until: u64, heard: &mut impl FnMut(Heard)) {
        // The first tick that is not in this piece.
        let end = until.div_ceil(TICK);
        while self.tick < end {
            match self.state {
                State::Hunting | State::Low { break_at: None } if level => {
                    self.state = State::Hunting;
                    self.tick = end;
                }
                State::Hunting => {
                    let start = self.tick;
                    self.state = State::Character(Character::new(start));
                    self.tick = start + FIRST_SAMPLE;
                }
                State::Character(character) => self.sample(character, level, heard),
                State::Low { .. } if level => self.state = State::Hunting,
                State::Low {
                    break_at: Some(break_at),
                } if break_at < end => {
                    heard(Heard::Break {
                        at: break_at * TICK,
                    });
                    self.state = State::Low { break_at: None };
                    self.tick = self.tick.max(break_at);
                }
                State::Low { .. } => self.tick = end,
            }
        }
    }

    fn sample(&mut self, mut character: Character, level: bool, heard: &mut impl FnMut(Heard)) {
        character.samples += 1;
        if level {
            character.high += 1;
            character.low_since = self.tick + 1;
        }
        if character.samples < SAMPLES {
            self.state = State::Character(character);
            self.tick += 1;
            return;
        }
        let at = self.tick * TICK;
        let bit = 2 * character.high > SAMPLES;
        let is_start = character.bit == 0;
        let is_stop = character.bit == BITS_PER_BYTE - 1;
        if is_start && bit {
            self.state = State::Hunting;
            self.tick += 1;
        } else if is_stop && bit {
            // The start bit has moved on to the lower half.
            heard(Heard::Byte {
                byte: (character.bits >> 8).to_le_bytes()[0],
                start: character.start * TICK,
                at,
            });
            self.state = State::Hunting;
            self.tick += 1;
        } else if is_stop {
            heard(Heard::FramingError { at });
            let break_at = character.low_since + BITS_PER_BYTE * OVERSAMPLING + 1;
            self.state = State::Low {
                break_at: Some(break_at),
            };
            self.tick += 1;
        } else {
            // Data bits come lowest first.
            character.bits = character.bits >> 1 | u16::from(bit) << 15;
            character.bit += 1;
            character.samples = 0;
            character.high = 0;
            self.state = State::Character(character);
            self.tick = character.start + character.bit * OVERSAMPLING + FIRST_SAMPLE;
        }
    }

    /// Takes a character that nothing disturbs at once: the byte is on the line from `begin` on, and
    /// each bit of it lasts for `bit`. No if the receiver is busy or might misread it, in which case
    /// nothing has happened.
    ///
    /// The same as [`advance`](Self::advance) over each of its bits, several times as fast.
    pub(super) fn take_whole(
        &mut self,
        byte: u8,
        begin: u64,
        bit: u64,
        heard: &mut impl FnMut(Heard),
    ) -> bool {
        let start = begin.div_ceil(TICK);
        if self.state != State::Hunting || self.tick != start {
            return false;
        }
        // Every sample lies in the bit it is for: if it does in the first and in the last bit, it
        // does in those between.
        let is_within = |number: u64| {
            let sample = |place| (start + number * OVERSAMPLING + place) * TICK - begin;
            sample(FIRST_SAMPLE) >= number * bit
                && sample(FIRST_SAMPLE + SAMPLES - 1) < (number + 1) * bit
        };
        if !is_within(0) || !is_within(BITS_PER_BYTE - 1) {
            return false;
        }
        let stop = start + (BITS_PER_BYTE - 1) * OVERSAMPLING + FIRST_SAMPLE + SAMPLES - 1;
        heard(Heard::Byte {
            byte,
            start: start * TICK,
            at: stop * TICK,
        });
        self.tick = (begin + BITS_PER_BYTE * bit).div_ceil(TICK).max(stop + 1);
        true
    }
}

impl Character {
    fn new(start: u64) -> Self {
        Self {
            start,
            bit: 0,
            samples: 0,
            high: 0,
            bits: 0,
            low_since: start,
        }
    }
}

#[cfg(test)]
mod tests;
