//! What all peripherals have in common: tasks, events, shorts, interrupts.
//!
//! nRF52840 Product Specification, section "Peripheral interface": tasks lie at 0x000, events at
//! 0x100, SHORTS at 0x200, INTEN, INTENSET and INTENCLR at 0x300; bit n of INTEN is the event at
//! 0x100 + 4 n.

use crate::error::Refusal;
use crate::memory::Memory;

/// One peripheral's own behaviour. What is common to all is done by [`Common`] and the chip.
pub(crate) trait Peripheral {
    /// Its name, events and shorts, as they are after a reset.
    fn common(&self) -> Common;

    /// A register of its own at `now`; `None` if it is not modelled.
    fn read(&self, offset: u32, now: u64) -> Option<u32>;

    /// A register of its own; `None` if it, or that value of it, is not modelled.
    fn write(&mut self, offset: u32, value: u32, context: &mut Context) -> Option<()>;

    /// A task; `None` if it is not modelled.
    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()>;

    /// The tasks that these shorts trigger at this event.
    fn shorted(&self, _event: u32, _shorts: u32) -> [Option<u32>; 2] {
        [None, None]
    }

    /// When it does something next by itself, in cycles.
    fn next(&self) -> Option<u64> {
        None
    }

    /// Does what is due at `context.now`.
    fn advance(&mut self, _context: &mut Context) {}
}

/// What a peripheral sees of the chip while it acts.
pub(crate) struct Context<'a> {
    /// Cycles of 64 MHz since power-on.
    pub(crate) now: u64,
    pub(crate) memory: &'a Memory,
    /// Offsets of the events that it raised.
    pub(crate) raised: Vec<u32>,
    /// When its output is low, and for how many cycles each time.
    pub(crate) low: Vec<(u64, u64)>,
    /// What it was made to do wrong, if anything.
    pub(crate) refusal: Option<Refusal>,
}

impl<'a> Context<'a> {
    pub(crate) fn new(now: u64, memory: &'a Memory) -> Self {
        Self {
            now,
            memory,
            raised: Vec::new(),
            low: Vec::new(),
            refusal: None,
        }
    }

    pub(crate) fn raise(&mut self, event: u32) {
        self.raised.push(event);
    }

    /// Keeps the first refusal; what is wrong after it is its consequence.
    pub(crate) fn check<T>(&mut self, outcome: Result<T, Refusal>) -> Option<T> {
        match outcome {
            Ok(value) => Some(value),
            Err(refusal) => {
                self.refusal.get_or_insert(refusal);
                None
            }
        }
    }
}

/// Events, shorts, interrupt enables.
#[derive(Clone, Debug)]
pub(crate) struct Common {
    /// For messages.
    pub(crate) name: &'static str,
    /// Which events there are; bit n is the one at 0x100 + 4 n.
    existing: u32,
    raised: u32,
    enabled: u32,
    raised_only_if_enabled: bool,
    modelled_shorts: u32,
    pub(crate) shorts: u32,
}

impl Common {
    /// `events` are offsets, `shorts` the modelled bits of SHORTS.
    pub(crate) fn new(name: &'static str, events: &[u32], shorts: u32) -> Self {
        Self {
            name,
            existing: events.iter().fold(0, |mask, event| mask | bit(*event)),
            raised: 0,
            enabled: 0,
            raised_only_if_enabled: false,
            modelled_shorts: shorts,
            shorts: 0,
        }
    }

    /// Events do not come unless the interrupt is enabled: section "RTC", "Event control feature".
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

    /// Whether the interrupt line is up.
    pub(crate) fn interrupts(&self) -> bool {
        self.raised & self.enabled != 0
    }

    /// Whether the register is one of those that all peripherals have.
    pub(crate) fn owns(offset: u32) -> bool {
        matches!(offset, 0x100..=0x17C | 0x200 | 0x300 | 0x304 | 0x308)
    }

    /// Reads a register that it owns; `None` if there is no such event.
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

    /// Writes a register that it owns; `None` if there is no such event, or no such short.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        let existing = value & !self.existing == 0;
        match offset {
            0x100..=0x17C if self.existing & bit(offset) != 0 => {
                // Writing 1 to an event has no effect.
                if value == 0 {
                    self.raised &= !bit(offset);
                }
            }
            0x200 if value & !self.modelled_shorts == 0 => self.shorts = value,
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
