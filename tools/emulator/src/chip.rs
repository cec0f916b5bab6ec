//! Connects all peripherals: decodes addresses, passes events through PPI, and advances the time.

use crate::clock::{CLOCK, Clock, DISABLE, RESETREAS};
use crate::counter::Counter;
use crate::gpio::Gpio;
use crate::memory::Memory;
use crate::nonvolatile::{APPROTECT, CONFIG, NVMC, UICR, UNPROTECTED, ficr, nvmc, temp, uicr};
use crate::peripheral::{Common, Context, Peripheral};
use crate::ppi::{PPI, Ppi, tasks};
use crate::pwm::Pwm;
use crate::trace::{Pins, ResetCause};
use crate::uarte::{Reception, Transmission};
use crate::watchdog::{WATCHDOG, Watchdog};

#[derive(Debug)]
pub(crate) struct Chip {
    pub(crate) context: Context,
    units: Vec<Box<dyn Peripheral>>,
}

/// Returns all peripherals as they are after power-on.
fn units() -> Vec<Box<dyn Peripheral>> {
    vec![
        Box::new(Clock::new()),
        Box::new(Reception::new()),
        Box::new(Transmission::new()),
        Box::new(Watchdog::new()),
        Box::new(Pwm::new()),
        Box::new(Counter::rtc()),
        Box::new(Counter::timer("TIMER0", TIMER0)),
        Box::new(Counter::timer("TIMER1", 0x4000_9000)),
        Box::new(Counter::timer("TIMER2", 0x4000_A000)),
        Box::new(Ppi::new()),
        Box::new(Gpio::new()),
        Box::new(ficr()),
        Box::new(uicr()),
        Box::new(temp()),
        Box::new(nvmc()),
    ]
}

pub(crate) const TIMER0: u32 = 0x4000_8000;

/// Returns the peripheral whose registers begin at `base`.
fn at(units: &mut [Box<dyn Peripheral>], base: u32) -> Option<&mut Box<dyn Peripheral>> {
    let mut units = units.iter_mut();
    units.find_map(|unit| (unit.common().base == base).then_some(unit))
}

impl Chip {
    pub(crate) fn new(memory: Memory, line_pin: u32) -> Self {
        Self {
            context: Context::new(memory, line_pin),
            units: units(),
        }
    }

    /// Returns the peripheral whose registers begin at `base`.
    pub(crate) fn unit(&mut self, base: u32) -> &mut dyn Peripheral {
        &mut **at(&mut self.units, base).expect("the peripheral exists")
    }

    fn common(&mut self, base: u32) -> &mut Common {
        self.unit(base).common()
    }

    /// Resets the chip: section "Reset behavior". A soft reset and a lockup leave the watchdog running. UICR survives
    /// every reset. RESETREAS, in which bits accumulate, survives every reset except a brown-out. A brown-out clears
    /// RESETREAS, as power-on does. RAM keeps its contents, but on silicon a brown-out may destroy them.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let reasons = self.common(CLOCK)[RESETREAS];
        let reasons = match cause {
            ResetCause::Pin => reasons | 1,
            ResetCause::Watchdog => reasons | 1 << 1,
            ResetCause::Soft => reasons | 1 << 2,
            ResetCause::Lockup => reasons | 1 << 3,
            ResetCause::BrownOut => 0,
        };
        let keeps_watchdog = matches!(cause, ResetCause::Soft | ResetCause::Lockup);
        for (unit, new) in self.units.iter_mut().zip(units()) {
            let base = unit.common().base;
            if base != UICR && !(base == WATCHDOG && keeps_watchdog) {
                *unit = new;
            }
        }
        self.common(CLOCK).set(RESETREAS, reasons);
        self.context.protection = self.common(UICR)[APPROTECT];
        self.context.show(Pins::default());
    }

    /// If `done` is `None`, records that the access is not modelled.
    fn check<T>(&mut self, done: Option<T>, access: &str, address: u32) -> Option<T> {
        if done.is_none() {
            let unit = at(&mut self.units, address & !0xFFF);
            let unit = unit.map_or("peripheral", |unit| unit.common().name);
            self.context.refuse(format!(
                "{access} {unit} at {address:#010x}, which is not modelled"
            ));
        }
        done
    }

    /// Reads a register, as the firmware would. If the register is not modelled, records this and returns `None`.
    pub(crate) fn read(&mut self, address: u32) -> Option<u32> {
        let unit = at(&mut self.units, address & !0xFFF);
        let value = unit.and_then(|unit| unit.read(address & 0xFFF, &self.context));
        self.check(value, "read of", address)
    }

    /// Writes a register, as the firmware would. If the register or the value is not modelled, records this and returns
    /// `None`. A task that is not modelled is also recorded, but the result is then `Some`.
    pub(crate) fn write(&mut self, address: u32, value: u32) -> Option<()> {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        if base == UICR && self.common(NVMC)[CONFIG] == 0 {
            let refusal = "UICR: written while NVMC.CONFIG does not enable writing";
            self.context.refuse(refusal.to_owned());
        }
        let done = if base != UICR && offset < 0x100 && value & 1 == 1 {
            // `trigger` itself rejects unknown tasks.
            self.trigger(address);
            Some(())
        } else {
            let unit = at(&mut self.units, base);
            unit.and_then(|unit| unit.write(offset, value, &mut self.context))
        };
        self.follow();
        self.check(done, &format!("write of {value:#x} to"), address)
    }

    /// Returns whether the debug port is open on a chip of build code F or later.
    pub(crate) fn debug_port_is_open(&mut self) -> bool {
        [self.context.protection, self.common(CLOCK)[DISABLE]] == [UNPROTECTED; 2]
    }

    /// Triggers a task.
    fn trigger(&mut self, address: u32) {
        let unit = at(&mut self.units, address & !0xFFF);
        let done = unit.and_then(|unit| unit.task(address & 0xFFF, &mut self.context));
        // The task itself may have recorded a more specific refusal, which `check` does not overwrite.
        self.check(done, "task of", address);
    }

    /// Triggers the tasks that PPI connects to the raised events, until no raised event is left.
    fn follow(&mut self) {
        while let Some(event) = self.context.raised.pop_front() {
            for task in tasks(self.common(PPI), event) {
                self.trigger(task);
            }
        }
    }

    /// Lets the peripherals act up to and including the instant `to`. Returns the next instant at which a peripheral
    /// acts by itself.
    pub(crate) fn advance(&mut self, to: u64) -> u64 {
        let mut next = u64::MAX;
        loop {
            let line = &self.context.line;
            let due = self.units.iter_mut();
            let due = due.filter_map(|unit| Some((unit.next(line)?, unit)));
            let Some((at, unit)) = due.min_by_key(|(at, _)| *at) else {
                break;
            };
            if at > to {
                next = at;
                break;
            }
            // Noise that a test adds can make an event due in the past. Such an event happens now.
            self.context.now = self.context.now.max(at);
            unit.advance(&mut self.context);
            self.follow();
            if self.context.refusal.is_some() {
                break;
            }
        }
        self.context.now = to;
        next
    }

    /// Returns the active interrupt lines, one bit for each. Bits 12 to 17 of a peripheral's address are the
    /// number of its line.
    pub(crate) fn interrupts(&mut self) -> u64 {
        let units = self.units.iter_mut().map(|unit| unit.common());
        let units = units.filter(|common| common.interrupts());
        units.fold(0, |lines, common| lines | 1 << (common.base >> 12 & 0x3F))
    }
}
