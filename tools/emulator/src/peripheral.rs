//! The common parts of all peripherals: plain registers, tasks, events, shorts, interrupts.
//!
//! nRF52840 Product Specification, section "Peripheral interface": tasks begin at offset 0x000, and events at 0x100.
//! SHORTS is at 0x200. INTEN, INTENSET and INTENCLR begin at 0x300. Bit n of INTEN stands for the event at 0x100 + 4 n.

use std::ops::{Index, RangeInclusive};

use crate::MICROSECOND;
use crate::assumptions::Assumptions;
use crate::line::SerialLine;
use crate::memory::Memory;
use crate::trace::{Period, Pins};

/// HFXO's start-up time: at most 360 us, according to the section "64 MHz crystal oscillator (HFXO)".
const HFXO_STARTUP: u64 = 360 * MICROSECOND;

/// A peripheral. Its [`Common`] part has tables of its registers. The functions implement the rest.
pub(crate) trait Peripheral {
    fn common(&mut self) -> &mut Common;

    /// Reads a register. Returns `None` if the register is not modelled.
    fn read(&mut self, offset: u32, _context: &Context) -> Option<u32> {
        self.common().load(offset)
    }

    /// Writes a register. Returns `None` if the register or its value is not modelled.
    fn write(&mut self, offset: u32, value: u32, _context: &mut Context) -> Option<()> {
        self.common().store(offset, value)
    }

    /// Triggers a task. Returns `None` if the task is not modelled.
    fn task(&mut self, _offset: u32, _context: &mut Context) -> Option<()> {
        None
    }

    /// Returns the next instant at which the peripheral acts by itself, in cycles.
    fn next(&self, _line: &SerialLine) -> Option<u64> {
        None
    }

    /// Performs the action that is due at `context.now`.
    fn advance(&mut self, _context: &mut Context) {}
}

/// A peripheral that has only plain registers.
impl Peripheral for Common {
    fn common(&mut self) -> &mut Common {
        self
    }
}

/// The state that peripherals share, and the chip's surroundings. Resets do not change this state.
#[derive(Debug)]
pub(crate) struct Context {
    /// Cycles of 64 MHz since power-on.
    pub(crate) now: u64,
    pub(crate) memory: Memory,
    pub(crate) assumptions: Assumptions,
    pub(crate) line: SerialLine,
    /// The pin to which the line is wired: 32 * port + pin.
    pub(crate) line_pin: u32,
    /// A second pin that is wired to the line, on which UARTE1 sends.
    pub(crate) loopback_pin: Option<u32>,
    /// Cycles that the crystal takes to start; `None` if it never does.
    pub(crate) crystal_startup: Option<u64>,
    /// All periods of the PWM so far.
    pub(crate) pwm_periods: Vec<Period>,
    /// The current outputs, and all changes of them with their instants.
    pub(crate) pins: Pins,
    pub(crate) pin_changes: Vec<(u64, Pins)>,
    /// Offsets of the events that the acting peripheral has raised.
    pub(crate) raised: Vec<u32>,
    /// The first action that was rejected, if any.
    pub(crate) refusal: Option<String>,
}

impl Context {
    pub(crate) fn new(memory: Memory, line_pin: u32) -> Self {
        Self {
            now: 0,
            memory,
            assumptions: Assumptions::default(),
            line: SerialLine::new(),
            line_pin,
            loopback_pin: None,
            crystal_startup: Some(HFXO_STARTUP),
            pwm_periods: Vec::new(),
            pins: Pins::default(),
            pin_changes: Vec::new(),
            raised: Vec::new(),
            refusal: None,
        }
    }

    pub(crate) fn raise(&mut self, event: u32) {
        self.raised.push(event);
    }

    /// Records only the first refusal, because later refusals are consequences of the first one.
    pub(crate) fn refuse(&mut self, refusal: String) {
        self.refusal.get_or_insert(refusal);
    }

    /// Returns the value, or records the refusal and returns `None`.
    pub(crate) fn check<T>(&mut self, outcome: Result<T, String>) -> Option<T> {
        outcome.map_err(|refusal| self.refuse(refusal)).ok()
    }
}

/// A register that reads back the value that was written: its offset, its value after a reset, and its modelled values.
pub(crate) type Plain = (u32, u32, RangeInclusive<u32>);
/// A short: its bit in SHORTS, the event, and the task that the event triggers.
pub(crate) type Short = (u32, u32, u32);

/// The modelled values of a register for which every value is modelled.
pub(crate) const ANY: RangeInclusive<u32> = 0..=u32::MAX;
/// The modelled values of a register that cannot be written.
#[expect(clippy::reversed_empty_ranges, reason = "no value")]
pub(crate) const READ_ONLY: RangeInclusive<u32> = 1..=0;

/// A peripheral's plain registers, events, shorts and interrupt enables.
#[derive(Clone, Debug)]
pub(crate) struct Common {
    /// The peripheral's name, for messages.
    pub(crate) name: &'static str,
    /// The address of its first register.
    pub(crate) base: u32,
    /// The events that exist. Bit n is the event at 0x100 + 4 n.
    existing: u32,
    raised: u32,
    enabled: u32,
    /// Whether events are raised only while their interrupts are enabled: section "RTC", "Event control feature".
    pub(crate) raised_only_if_enabled: bool,
    modelled_shorts: Vec<Short>,
    shorts: u32,
    plain: Vec<Plain>,
}

impl Common {
    /// Creates the state after a reset, from the offsets of the events, the modelled shorts, and the plain registers.
    pub(crate) fn new(
        name: &'static str,
        base: u32,
        events: &[u32],
        shorts: &[Short],
        plain: &[Plain],
    ) -> Self {
        Self {
            name,
            base,
            existing: events.iter().fold(0, |mask, event| mask | bit(*event)),
            raised: 0,
            enabled: 0,
            raised_only_if_enabled: false,
            modelled_shorts: shorts.to_vec(),
            shorts: 0,
            plain: plain.to_vec(),
        }
    }

    pub(crate) fn raise(&mut self, event: u32) {
        if !self.raised_only_if_enabled || self.enabled & bit(event) != 0 {
            self.raised |= bit(event);
        }
    }

    /// Returns the tasks that the enabled shorts trigger at this event.
    pub(crate) fn shorted(&self, event: u32) -> impl Iterator<Item = u32> {
        let shorts = self.modelled_shorts.iter();
        let taken = shorts.filter(move |(bit, at, _)| self.shorts & bit != 0 && *at == event);
        taken.map(|(.., task)| *task)
    }

    /// Returns whether the interrupt line is active.
    pub(crate) fn interrupts(&self) -> bool {
        self.raised & self.enabled != 0
    }

    /// Reads a register. Returns `None` if the register is not in the tables.
    pub(crate) fn load(&self, offset: u32) -> Option<u32> {
        match offset {
            0x100..=0x17C if self.existing & bit(offset) != 0 => {
                Some(u32::from(self.raised & bit(offset) != 0))
            }
            0x200 if !self.modelled_shorts.is_empty() => Some(self.shorts),
            0x300 | 0x304 | 0x308 if self.existing != 0 => Some(self.enabled),
            _ => {
                let mut plain = self.plain.iter();
                plain
                    .find(|(at, ..)| *at == offset)
                    .map(|(_, value, _)| *value)
            }
        }
    }

    /// Writes a register. Returns `None` if the register is not in the tables, or its value is not modelled.
    pub(crate) fn store(&mut self, offset: u32, value: u32) -> Option<()> {
        let shorts = self.modelled_shorts.iter();
        let modelled_shorts = shorts.fold(0, |mask, (bit, ..)| mask | bit);
        let are_events = self.existing != 0 && value & !self.existing == 0;
        match offset {
            0x100..=0x17C if self.existing & bit(offset) != 0 => {
                // Writing 1 to an event has no effect.
                if value == 0 {
                    self.raised &= !bit(offset);
                }
            }
            0x200 if value & !modelled_shorts == 0 => self.shorts = value,
            0x300 if are_events => self.enabled = value,
            0x304 if are_events => self.enabled |= value,
            0x308 if self.existing != 0 => self.enabled &= !value,
            _ => {
                let mut plain = self.plain.iter_mut();
                let (_, word, modelled) = plain.find(|(at, ..)| *at == offset)?;
                if !modelled.contains(&value) {
                    return None;
                }
                *word = value;
            }
        }
        Some(())
    }
}

/// The value of the plain register at an offset.
impl Index<u32> for Common {
    type Output = u32;

    fn index(&self, offset: u32) -> &u32 {
        let mut plain = self.plain.iter();
        let found = plain.find(|(at, ..)| *at == offset);
        found.map(|(_, value, _)| value).expect("a plain register")
    }
}

fn bit(event: u32) -> u32 {
    1 << ((event - 0x100) / 4)
}
