//! The common parts of all peripherals: registers, tasks, events, interrupts.
//!
//! nRF52840 Product Specification, section "Peripheral interface": tasks begin at offset 0x000, and events at 0x100.
//! INTEN, INTENSET and INTENCLR begin at 0x300. Bit n of INTEN stands for the event at 0x100 + 4 n.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fmt::Debug;
use std::ops::{Index, RangeInclusive};

use crate::MICROSECOND;
use crate::assumptions::Assumptions;
use crate::line::SerialLine;
use crate::memory::Memory;
use crate::trace::{Period, Pins};

/// HFXO's start-up time: at most 360 us, according to the section "64 MHz crystal oscillator (HFXO)".
const HFXO_STARTUP: u64 = 360 * MICROSECOND;

/// A peripheral. Its [`Common`] part has tables of its registers. The trait's functions implement the effects that
/// these tables do not describe.
pub(crate) trait Peripheral: Debug + Send {
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

    /// Pauses the peripheral while a debugger halts the core for this number of cycles. Only the watchdog pauses.
    fn pause(&mut self, _cycles: u64) {}

    /// Moves a counter and its compare registers forward by this number of counts.
    fn skip(&mut self, _counts: u32) {}
}

/// A peripheral that has only registers.
impl Peripheral for Common {
    fn common(&mut self) -> &mut Common {
        self
    }
}

/// The state that peripherals share, and the chip's surroundings. A reset changes only `pins`, `pin_changes` and
/// `protection`.
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
    /// The PWM's periods since the last call of [`crate::Board::trace`].
    pub(crate) pwm_periods: Vec<Period>,
    /// The current levels of the output pins.
    pub(crate) pins: Pins,
    /// The changes of the output pins since the last call of [`crate::Board::trace`].
    pub(crate) pin_changes: Vec<(u64, Pins)>,
    /// The names of the deviations that have had an effect since the last call of [`crate::Board::trace`].
    pub(crate) deviations: BTreeSet<&'static str>,
    /// The addresses of raised events whose PPI channels have not taken effect yet.
    pub(crate) raised: VecDeque<u32>,
    /// UICR.APPROTECT at the last reset. Later changes take effect at the next reset.
    pub(crate) protection: u32,
    /// Whether the watchdog must reset the chip now.
    pub(crate) bites: bool,
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
            deviations: BTreeSet::new(),
            raised: VecDeque::new(),
            protection: u32::MAX,
            bites: false,
            refusal: None,
        }
    }

    /// Records the levels of the output pins.
    pub(crate) fn show(&mut self, pins: Pins) {
        if std::mem::replace(&mut self.pins, pins) != pins {
            self.pin_changes.push((self.now, pins));
        }
    }

    /// Records the name of a deviation from the default if `deviates` is true. Returns `deviates`.
    pub(crate) fn deviates(&mut self, name: &'static str, deviates: bool) -> bool {
        if deviates {
            self.deviations.insert(name);
        }
        deviates
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

/// The effect of writing a register.
#[derive(Clone, Debug)]
pub(crate) enum Access {
    /// The register gets the value, which must be one of the modelled values.
    Plain(RangeInclusive<u32>),
    /// The value's ones set the bits of the register at this offset. A read returns the value of the register at this
    /// offset.
    Set(u32),
    /// The value's ones clear the bits of the register at this offset. A read returns the value of the register at this
    /// offset.
    Clear(u32),
    /// The value's ones clear the register's bits.
    ClearOnes,
    /// The value's zeros clear the register's bits, as in flash, except the broken bits in this mask.
    Flash(u32),
}

/// A register: its offset, its value after a reset, and the effect of writing.
pub(crate) type Register = (u32, u32, Access);

/// A register for which every value is modelled.
pub(crate) const ANY: Access = Access::Plain(0..=u32::MAX);
/// A register that cannot be written.
#[expect(clippy::reversed_empty_ranges, reason = "no value")]
pub(crate) const READ_ONLY: Access = Access::Plain(1..=0);

/// A peripheral's registers, events and interrupt enables.
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
    registers: BTreeMap<u32, (u32, Access)>,
}

impl Common {
    /// Creates the state after a reset, from the offsets of the events and the registers.
    pub(crate) fn new(
        name: &'static str,
        base: u32,
        events: &[u32],
        registers: impl IntoIterator<Item = Register>,
    ) -> Self {
        let registers = registers.into_iter();
        Self {
            name,
            base,
            existing: events.iter().fold(0, |mask, event| mask | bit(*event)),
            raised: 0,
            enabled: 0,
            raised_only_if_enabled: false,
            registers: registers
                .map(|(at, value, access)| (at, (value, access)))
                .collect(),
        }
    }

    pub(crate) fn raise(&mut self, event: u32, context: &mut Context) {
        if !self.raised_only_if_enabled || self.enabled & bit(event) != 0 {
            self.raised |= bit(event);
        }
        context.raised.push_back(self.base + event);
    }

    /// Returns whether the interrupt line is active.
    pub(crate) fn interrupts(&self) -> bool {
        self.raised & self.enabled != 0
    }

    /// Sets a register, as the peripheral itself does.
    pub(crate) fn set(&mut self, offset: u32, value: u32) {
        let (word, _) = self.registers.get_mut(&offset).expect("a register");
        *word = value;
    }

    /// Breaks bits of a word of flash, so that writing does not clear them.
    pub(crate) fn break_bits(&mut self, offset: u32, bits: u32) {
        self.registers
            .insert(offset, (self[offset], Access::Flash(bits)));
    }

    /// Reads a register. Returns `None` if the register is not in the tables.
    pub(crate) fn load(&self, offset: u32) -> Option<u32> {
        match offset {
            0x100..=0x17C if self.existing & bit(offset) != 0 => {
                Some(u32::from(self.raised & bit(offset) != 0))
            }
            0x300 | 0x304 | 0x308 if self.existing != 0 => Some(self.enabled),
            _ => match self.registers.get(&offset)? {
                (_, Access::Set(of) | Access::Clear(of)) => self.load(*of),
                (value, _) => Some(*value),
            },
        }
    }

    /// Writes a register. Returns `None` if the register is not in the tables, or its value is not modelled.
    pub(crate) fn store(&mut self, offset: u32, value: u32) -> Option<()> {
        let are_events = self.existing != 0 && value & !self.existing == 0;
        match offset {
            0x100..=0x17C if self.existing & bit(offset) != 0 => {
                // Writing 1 to an event has no effect.
                if value == 0 {
                    self.raised &= !bit(offset);
                }
            }
            0x300 if are_events => self.enabled = value,
            0x304 if are_events => self.enabled |= value,
            0x308 if self.existing != 0 => self.enabled &= !value,
            _ => match self.registers.get_mut(&offset)? {
                (word, Access::Plain(modelled)) if modelled.contains(&value) => *word = value,
                (_, Access::Plain(_)) => return None,
                (word, Access::ClearOnes) => *word &= !value,
                (word, Access::Flash(broken)) => *word &= value | *broken,
                (_, Access::Set(of)) => {
                    let of = *of;
                    return self.store(of, self[of] | value);
                }
                (_, Access::Clear(of)) => {
                    let of = *of;
                    return self.store(of, self[of] & !value);
                }
            },
        }
        Some(())
    }
}

/// The value of the register at an offset.
impl Index<u32> for Common {
    type Output = u32;

    fn index(&self, offset: u32) -> &u32 {
        let (value, _) = self.registers.get(&offset).expect("a register");
        value
    }
}

fn bit(event: u32) -> u32 {
    1 << ((event - 0x100) / 4)
}
