//! The common parts of all peripherals: registers, tasks, events, shorts, interrupts.
//!
//! nRF52840 Product Specification, section "Peripheral interface": tasks begin at offset 0x000, and events at 0x100.
//! SHORTS is at 0x200. INTEN, INTENSET and INTENCLR begin at 0x300. Bit n of INTEN stands for the event at 0x100 + 4 n.

use crate::MICROSECOND;
use crate::assumptions::Assumptions;
use crate::error::Refusal;
use crate::line::SerialLine;
use crate::memory::Memory;
use crate::trace::{Period, Pins};

/// HFXO's start-up time: at most 360 us, according to the section "64 MHz crystal oscillator (HFXO)".
const HFXO_STARTUP: u64 = 360 * MICROSECOND;

/// The behaviour that differs between peripherals. [`Common`] and the chip implement the rest.
pub(crate) trait Peripheral {
    /// Returns the peripheral's common state after a reset: name, events and shorts.
    fn common(&self) -> Common;

    /// Reads a register. Returns `None` if the register is not modelled.
    fn read(&mut self, offset: u32, context: &Context) -> Option<u32>;

    /// Writes a register. Returns `None` if the register or its value is not modelled.
    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()>;

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
    pub(crate) refusal: Option<Refusal>,
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
    pub(crate) fn refuse(&mut self, refusal: Refusal) {
        self.refusal.get_or_insert(refusal);
    }

    /// Returns the value, or records the refusal and returns `None`.
    pub(crate) fn check<T>(&mut self, outcome: Result<T, Refusal>) -> Option<T> {
        outcome.map_err(|refusal| self.refuse(refusal)).ok()
    }
}

/// Registers that read back the value that was written: see [`registers!`].
pub(crate) trait RegisterFile {
    /// Writes a register if there is a new value. Returns the register's value afterwards, or `None` if the
    /// register or its new value is not modelled.
    fn access(&mut self, offset: u32, new: Option<u32>) -> Option<u32>;

    fn read(&mut self, offset: u32) -> Option<u32> {
        self.access(offset, None)
    }

    fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        self.access(offset, Some(value)).map(|_| ())
    }
}

/// Declares the struct `Registers`, with those registers of a peripheral that read back the value that was written.
/// Each line has a register's offset, its field, its value after a reset, and its modelled values. An array has one
/// register for each word.
macro_rules! registers {
    ($($(#[$doc:meta])* $offset:literal $field:ident: $type:ty = $reset:expr, $values:expr;)+) => {
        #[derive(Clone, Debug)]
        struct Registers {
            $($(#[$doc])* $field: $type,)+
        }

        impl Default for Registers {
            fn default() -> Self {
                Self { $($field: $reset,)+ }
            }
        }

        impl $crate::peripheral::RegisterFile for Registers {
            fn access(&mut self, offset: u32, new: Option<u32>) -> Option<u32> {
                $(
                    let words = $crate::peripheral::Words::words(&mut self.$field);
                    if let Some(word) = words.get_mut(offset.wrapping_sub($offset) as usize / 4) {
                        if new.is_some_and(|new| !($values).contains(&new)) {
                            return None;
                        }
                        *word = new.unwrap_or(*word);
                        return Some(*word);
                    }
                )+
                None
            }
        }
    };
}
pub(crate) use registers;

/// A field of one word or several words.
pub(crate) trait Words {
    fn words(&mut self) -> &mut [u32];
}

impl Words for u32 {
    fn words(&mut self) -> &mut [u32] {
        std::slice::from_mut(self)
    }
}

impl<const N: usize> Words for [u32; N] {
    fn words(&mut self) -> &mut [u32] {
        self
    }
}

impl Words for Vec<u32> {
    fn words(&mut self) -> &mut [u32] {
        self
    }
}

/// A peripheral's events, shorts and interrupt enables.
#[derive(Clone, Debug)]
pub(crate) struct Common {
    /// The peripheral's name, for messages.
    pub(crate) name: &'static str,
    pub(crate) has_tasks: bool,
    /// The events that exist. Bit n is the event at 0x100 + 4 n.
    existing: u32,
    raised: u32,
    enabled: u32,
    raised_only_if_enabled: bool,
    modelled_shorts: Vec<Short>,
    shorts: u32,
}

/// A short: its bit in SHORTS, the event, and the task that the event triggers.
pub(crate) type Short = (u32, u32, u32);

impl Common {
    /// Creates the state after a reset, from the offsets of the events and the modelled shorts.
    pub(crate) fn new(name: &'static str, events: &[u32], shorts: &[Short]) -> Self {
        Self {
            name,
            has_tasks: true,
            existing: events.iter().fold(0, |mask, event| mask | bit(*event)),
            raised: 0,
            enabled: 0,
            raised_only_if_enabled: false,
            modelled_shorts: shorts.to_vec(),
            shorts: 0,
        }
    }

    /// Creates the state of a peripheral without tasks and events.
    pub(crate) fn registers_only(name: &'static str) -> Self {
        Self {
            has_tasks: false,
            ..Self::new(name, &[], &[])
        }
    }

    /// Makes the peripheral raise events only while their interrupts are enabled: section "RTC", "Event control
    /// feature".
    pub(crate) fn raised_only_if_enabled(self) -> Self {
        Self {
            raised_only_if_enabled: true,
            ..self
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

    fn modelled_shorts(&self) -> u32 {
        let shorts = self.modelled_shorts.iter();
        shorts.fold(0, |mask, (bit, ..)| mask | bit)
    }

    /// Returns whether the interrupt line is active.
    pub(crate) fn interrupts(&self) -> bool {
        self.raised & self.enabled != 0
    }

    /// Returns whether the offset belongs to a register that every peripheral with events has.
    pub(crate) fn owns(&self, offset: u32) -> bool {
        self.existing != 0 && matches!(offset, 0x100..=0x17C | 0x200 | 0x300 | 0x304 | 0x308)
    }

    /// Reads a common register. Returns `None` if there is no such event.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            0x100..=0x17C => {
                let mask = bit(offset);
                (self.existing & mask != 0).then_some(u32::from(self.raised & mask != 0))
            }
            0x200 => Some(self.shorts),
            _ => Some(self.enabled),
        }
    }

    /// Writes a common register. Returns `None` if there is no such event or short.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let existing = value & !self.existing == 0;
        match offset {
            0x100..=0x17C if self.existing & bit(offset) != 0 => {
                // Writing 1 to an event has no effect.
                if value == 0 {
                    self.raised &= !bit(offset);
                }
            }
            0x200 if value & !self.modelled_shorts() == 0 => self.shorts = value,
            0x300 if existing => self.enabled = value,
            0x304 if existing => self.enabled |= value,
            0x308 => self.enabled &= !value,
            _ => return None,
        }
        Some(())
    }
}

fn bit(event: u32) -> u32 {
    1 << ((event - 0x100) / 4)
}
