//! The serial line as a level over time, and the sender at its other end.
//!
//! The sender has its own clock. Its baud rate has a resolution of a thousandth of a baud, and rounding errors do not
//! accumulate from bit to bit. The line stores the instants at which the level changes. So a receiver with its own
//! clock samples the same levels as on a real wire.

use std::collections::VecDeque;

use crate::CYCLES_PER_SECOND;

/// A signal that the sender can put on the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// A start bit, eight data bits with the lowest first, and a stop bit.
    Byte(u8),
    /// A byte whose stop bit is low, followed by a high bit: a framing error.
    BadStop(u8),
    /// A low level for this number of bits, then a high level for one bit.
    Break(u32),
    /// A high level for this number of bits.
    Idle(u32),
}

/// The line to the receiver. It is high while nothing is sent.
#[derive(Clone, Debug)]
pub struct SerialLine {
    /// The instants at which the level changes, in cycles, in order. Instants that lie in the receiver's past are
    /// removed.
    toggles: VecDeque<u64>,
    /// The level before the first toggle.
    level: bool,
    /// The level after the sender's last toggle.
    sender_level: bool,
    millibaud: u64,
    /// An instant at which a bit began.
    origin: u64,
    /// The number of bits that the sender has sent since `origin`.
    bits: u64,
    /// The beginnings and ends of the sender's characters, in order. Characters in the receiver's past are removed.
    characters: VecDeque<(u64, u64)>,
}

impl SerialLine {
    /// Creates a quiet line with a sender at 115200 baud, 8N1.
    pub(crate) fn new() -> Self {
        Self {
            toggles: VecDeque::new(),
            level: true,
            sender_level: true,
            millibaud: 115_200_000,
            origin: 0,
            bits: 0,
            characters: VecDeque::new(),
        }
    }

    /// Sets the sender's baud rate in thousandths of a baud, from the next symbol on.
    ///
    /// # Panics
    /// Panics if the rate is 0.
    pub fn set_millibaud(&mut self, millibaud: u64) {
        assert!(millibaud > 0, "a sender has a baud rate");
        self.origin = self.free_at();
        self.bits = 0;
        self.millibaud = millibaud;
    }

    /// Returns the instant at which the sender will have sent all symbols so far, in cycles.
    #[must_use]
    pub fn free_at(&self) -> u64 {
        self.instant(self.bits)
    }

    fn instant(&self, bits: u64) -> u64 {
        let cycles =
            u128::from(bits) * u128::from(CYCLES_PER_SECOND) * 1000 / u128::from(self.millibaud);
        self.origin + u64::try_from(cycles).unwrap_or(u64::MAX)
    }

    /// Sends a symbol after all earlier ones, but not before `from`. Returns the end of its last bit, in cycles.
    pub fn send(&mut self, from: u64, symbol: Symbol) -> u64 {
        if from > self.free_at() {
            self.origin = from;
            self.bits = 0;
        }
        let began = self.free_at();
        match symbol {
            Symbol::Byte(byte) => self.character(byte, true),
            Symbol::BadStop(byte) => self.character(byte, false),
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

    fn character(&mut self, byte: u8, stop: bool) {
        self.hold(false, 1);
        for bit in 0..8 {
            self.hold(byte >> bit & 1 == 1, 1);
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

    /// Inverts the line for `cycles` from the instant `at` on, as noise does. The instant must not lie in the
    /// receiver's past.
    pub fn invert(&mut self, at: u64, cycles: u64) {
        if cycles > 0 {
            self.toggle(at);
            self.toggle(at + cycles);
        }
    }

    /// Adds a change of the level at an instant. A second change at the same instant removes the first.
    fn toggle(&mut self, at: u64) {
        let place = self.toggles.partition_point(|toggle| *toggle < at);
        if self.toggles.get(place) == Some(&at) {
            self.toggles.remove(place);
        } else {
            self.toggles.insert(place, at);
        }
    }

    /// Returns the level at an instant that does not lie in the receiver's past.
    pub(crate) fn level_at(&self, at: u64) -> bool {
        let changes = self.toggles.iter().take_while(|toggle| **toggle <= at);
        self.level != (changes.count() % 2 == 1)
    }

    /// Returns the first instant, not before `since`, at which the line has this level.
    pub(crate) fn reaches(&self, level: bool, since: u64) -> Option<u64> {
        if self.level_at(since) == level {
            return Some(since);
        }
        self.toggles.iter().copied().find(|toggle| *toggle > since)
    }

    /// Returns the last change up to an instant, if it is still stored.
    pub(crate) fn change_before(&self, at: u64) -> Option<u64> {
        let changes = self.toggles.iter().take_while(|toggle| **toggle <= at);
        changes.last().copied()
    }

    /// Returns the end of the character that is on the line at the instant `at`, or `at` if there is none.
    pub(crate) fn character_ends(&self, at: u64) -> u64 {
        let mut characters = self.characters.iter();
        let character = characters.find(|(began, end)| *began < at && at < *end);
        character.map_or(at, |(_, end)| *end)
    }

    /// Removes all changes and characters before the instant `at`.
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
