//! The serial line as a level over time, and the sender at its other end.
//!
//! The sender has its own clock: its baud rate is set to a thousandth of a baud, and
//! bits follow each other without drift. The level is kept as the instants at which it changes, so
//! that a receiver with another clock samples what it would on a wire.

use std::collections::VecDeque;

use crate::CYCLES_PER_SECOND;

/// The bit that makes the number of ones even or odd.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parity {
    /// No such bit.
    #[default]
    None,
    /// Even, the only one that the nRF52840 has.
    Even,
}

/// What the sender can put on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// Start bit, eight bits from the lowest on, parity bit if any, stop bit.
    Byte(u8),
    /// The same with a stop bit that is low, and then one that is high: a framing error.
    BadStop(u8),
    /// The same with the wrong parity bit; without parity the same as [`Symbol::Byte`].
    BadParity(u8),
    /// The line is low for that many bits, then high for one.
    Break(u32),
    /// The line is high for that many bits.
    Idle(u32),
}

/// The line that leads to the receiver. It is high as long as nothing is sent.
#[derive(Clone, Debug)]
pub struct Line {
    /// When the level changes, in cycles, in order; what lies behind the receiver is forgotten.
    toggles: VecDeque<u64>,
    /// The level before the first of them.
    level: bool,
    /// The level after the last of them that the sender made.
    sender_level: bool,
    millibaud: u64,
    parity: Parity,
    /// When the sender's bit 0 began, and how many it has sent since.
    origin: u64,
    bits: u64,
    /// When the sender's characters begin and end, in order. The receiver forgets those that it no longer needs.
    characters: VecDeque<(u64, u64)>,
    /// Nobody drives the line: it is as the pin's pull-up has it.
    pub(crate) floats: bool,
}

impl Line {
    /// A quiet line, and a sender at 115200 baud, 8N1.
    #[must_use]
    pub fn new() -> Self {
        Self {
            toggles: VecDeque::new(),
            level: true,
            sender_level: true,
            millibaud: 115_200_000,
            parity: Parity::None,
            origin: 0,
            bits: 0,
            characters: VecDeque::new(),
            floats: false,
        }
    }

    /// Takes the sender away: the line is high if the pin pulls it up, and else low. Real ones pick up noise.
    pub fn unplug(&mut self) {
        self.floats = true;
    }

    /// Nobody drives it, and from now on the pin pulls it up, or does not.
    pub(crate) fn float(&mut self, now: u64, high: bool) {
        if self.floats && self.level_at(now) != high {
            self.toggles.retain(|toggle| *toggle <= now);
            self.toggle(now);
        }
    }

    /// Sets the sender's baud rate in thousandths of a baud, from the next symbol on.
    ///
    /// # Panics
    /// If it is 0.
    pub fn set_millibaud(&mut self, millibaud: u64) {
        assert!(millibaud > 0, "a sender has a baud rate");
        self.origin = self.free_at();
        self.bits = 0;
        self.millibaud = millibaud;
    }

    /// Sets the sender's parity.
    pub fn set_parity(&mut self, parity: Parity) {
        self.parity = parity;
    }

    /// When all that was given to the sender so far is sent, in cycles.
    #[must_use]
    pub fn free_at(&self) -> u64 {
        self.instant(self.bits)
    }

    fn instant(&self, bits: u64) -> u64 {
        let cycles =
            u128::from(bits) * u128::from(CYCLES_PER_SECOND) * 1000 / u128::from(self.millibaud);
        self.origin + u64::try_from(cycles).unwrap_or(u64::MAX)
    }

    /// Sends a symbol as soon as those before it are sent, at the earliest at `from`. Returns when
    /// it is over: the end of its stop bit, in cycles.
    pub fn send(&mut self, from: u64, symbol: Symbol) -> u64 {
        if from > self.free_at() {
            self.origin = from;
            self.bits = 0;
        }
        let began = self.free_at();
        match symbol {
            Symbol::Byte(byte) => self.character(byte, false, true),
            Symbol::BadStop(byte) => self.character(byte, false, false),
            Symbol::BadParity(byte) => self.character(byte, true, true),
            Symbol::Break(bits) => {
                self.hold(false, bits);
                self.hold(true, 1);
            }
            Symbol::Idle(bits) => self.hold(true, bits),
        }
        if !matches!(symbol, Symbol::Break(_) | Symbol::Idle(_)) {
            self.characters.push_back((began, self.free_at()));
        }
        self.free_at()
    }

    fn character(&mut self, byte: u8, wrong_parity: bool, stop: bool) {
        self.hold(false, 1);
        for bit in 0..8 {
            self.hold(byte >> bit & 1 == 1, 1);
        }
        if self.parity == Parity::Even {
            self.hold((byte.count_ones() % 2 == 1) != wrong_parity, 1);
        }
        self.hold(stop, 1);
        if !stop {
            self.hold(true, 1);
        }
    }

    fn hold(&mut self, level: bool, bits: u32) {
        if level != self.sender_level {
            self.toggle(self.free_at());
            self.sender_level = level;
        }
        self.bits += u64::from(bits);
    }

    /// Inverts the line for that many cycles: noise. It should lie ahead of the receiver.
    pub fn invert(&mut self, at: u64, cycles: u64) {
        if cycles > 0 {
            self.toggle(at);
            self.toggle(at + cycles);
        }
    }

    /// Two changes at one instant are none.
    fn toggle(&mut self, at: u64) {
        let place = self.toggles.partition_point(|toggle| *toggle < at);
        if self.toggles.get(place) == Some(&at) {
            self.toggles.remove(place);
        } else {
            self.toggles.insert(place, at);
        }
    }

    /// The level at that instant, which must not be forgotten yet.
    pub(crate) fn level_at(&self, at: u64) -> bool {
        let changes = self.toggles.iter().take_while(|toggle| **toggle <= at);
        self.level != (changes.count() % 2 == 1)
    }

    /// Returns the first instant, not before `since`, at which the line has that level.
    pub(crate) fn reaches(&self, level: bool, since: u64) -> Option<u64> {
        if self.level_at(since) == level {
            return Some(since);
        }
        self.toggles.iter().copied().find(|toggle| *toggle > since)
    }

    /// The last change up to that instant, if it is not forgotten.
    pub(crate) fn change_before(&self, at: u64) -> Option<u64> {
        let changes = self.toggles.iter().take_while(|toggle| **toggle <= at);
        changes.last().copied()
    }

    /// Returns the end of the character that is on the line at that instant, or the instant if there is none.
    pub(crate) fn character_ends(&self, at: u64) -> u64 {
        let mut characters = self.characters.iter();
        let character = characters.find(|(began, end)| *began < at && at < *end);
        character.map_or(at, |(_, end)| *end)
    }

    /// Forgets all changes and characters before that instant.
    pub(crate) fn forget_before(&mut self, at: u64) {
        while self.characters.front().is_some_and(|(_, end)| *end < at) {
            self.characters.pop_front();
        }
        while self.toggles.front().is_some_and(|toggle| *toggle < at) {
            self.toggles.pop_front();
            self.level = !self.level;
        }
    }
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}
