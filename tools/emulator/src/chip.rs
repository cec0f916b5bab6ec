//! Connects all peripherals: decodes addresses, passes events through shorts and PPI, and advances the time.

use std::collections::VecDeque;

use crate::clock::{Clock, RESETREAS_LOCKUP, RESETREAS_PIN, RESETREAS_SOFT, RESETREAS_WATCHDOG};
use crate::gpio::Gpio;
use crate::memory::Memory;
use crate::nonvolatile::{CONFIG, UICR, Uicr, ficr, nvmc, temp};
use crate::peripheral::{Common, Context, Peripheral};
use crate::ppi::Ppi;
use crate::pwm::Pwm;
use crate::rtc::Rtc;
use crate::timer::Timer;
use crate::trace::ResetCause;
use crate::uarte::{Reception, Transmission};
use crate::watchdog::Watchdog;

#[derive(Debug)]
pub(crate) struct Chip {
    pub(crate) context: Context,
    pub(crate) peripherals: Peripherals,
    pub(crate) uicr: Uicr,
    /// Raised events whose shorts and PPI channels have not taken effect yet. Each entry is the peripheral's base and
    /// the event.
    raised: VecDeque<(u32, u32)>,
}

impl Chip {
    pub(crate) fn new(memory: Memory, line_pin: u32) -> Self {
        Self {
            context: Context::new(memory, line_pin),
            peripherals: Peripherals::new(),
            uicr: Uicr::default(),
            raised: VecDeque::new(),
        }
    }

    /// Resets the chip: section "Reset behavior". A soft reset and a lockup leave the watchdog running. UICR survives every
    /// reset. RESETREAS survives every reset except a brown-out. A brown-out clears RESETREAS, as power-on does. RAM
    /// keeps its contents, but on silicon a brown-out may destroy them.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let old = std::mem::replace(&mut self.peripherals, Peripherals::new());
        let new = &mut self.peripherals;
        let reason = match cause {
            ResetCause::Pin => RESETREAS_PIN,
            ResetCause::Watchdog => RESETREAS_WATCHDOG,
            ResetCause::Soft => RESETREAS_SOFT,
            ResetCause::Lockup => RESETREAS_LOCKUP,
            ResetCause::BrownOut => 0,
        };
        if cause != ResetCause::BrownOut {
            new.clock.reset_reason = old.clock.reset_reason | reason;
        }
        if matches!(cause, ResetCause::Soft | ResetCause::Lockup) {
            new.watchdog = old.watchdog;
        }
        new.gpio.show(&mut self.context);
        self.uicr.reset();
    }

    /// If `done` is `None`, records that the access is not modelled.
    fn check<T>(&mut self, done: Option<T>, access: &str, address: u32) -> Option<T> {
        if done.is_none() {
            let base = address & !0xFFF;
            let unit = self.peripherals.at(base).map(|unit| unit.common().name);
            let unit = unit.unwrap_or(if base == UICR { "UICR" } else { "peripheral" });
            self.context.refuse(format!(
                "{access} {unit} at {address:#010x}, which is not modelled"
            ));
        }
        done
    }

    /// Lets a peripheral act, and appends the events that it raises to `raised`. Returns `None` if there is no
    /// peripheral at `base`, or if the peripheral does not model the action.
    fn act(
        &mut self,
        base: u32,
        act: impl FnOnce(&mut dyn Peripheral, &mut Context) -> Option<()>,
    ) -> Option<()> {
        let unit = self.peripherals.at(base)?;
        let done = act(unit, &mut self.context);
        for event in self.context.raised.drain(..) {
            unit.common().raise(event);
            self.raised.push_back((base, event));
        }
        done
    }

    /// Reads a register, as the firmware would. If the register is not modelled, records this and returns `None`.
    pub(crate) fn read(&mut self, address: u32) -> Option<u32> {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let value = match self.peripherals.at(base) {
            Some(unit) => unit.read(offset, &self.context),
            None if base == UICR => self.uicr.read(offset),
            None => None,
        };
        self.check(value, "read of", address)
    }

    /// Writes a register, as the firmware would. If the register is not modelled, records this and returns `None`.
    pub(crate) fn write(&mut self, address: u32, value: u32) -> Option<()> {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let done = if base == UICR {
            if self.peripherals.nvmc[CONFIG] == 0 {
                let refusal = "UICR: written while NVMC.CONFIG does not enable writing";
                self.context.refuse(refusal.to_owned());
            }
            self.uicr.write(offset, value)
        } else if offset < 0x100 && value & 1 == 1 {
            // `trigger` itself rejects unknown tasks.
            self.trigger(address);
            Some(())
        } else {
            self.act(base, |unit, context| unit.write(offset, value, context))
        };
        self.follow();
        self.check(done, &format!("write of {value:#x} to"), address)
    }

    /// Returns whether the debug port is open on a chip of build code F or later.
    pub(crate) fn debug_port_is_open(&self) -> bool {
        self.uicr.opens_debug_port() && self.peripherals.clock.opens_debug_port()
    }

    /// Triggers a task.
    fn trigger(&mut self, address: u32) {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let done = self.act(base, |unit, context| unit.task(offset, context));
        // If the task itself has recorded a refusal, `check` keeps the task's refusal, because this refusal is more
        // specific.
        self.check(done, "task of", address);
    }

    /// Triggers the tasks that follow from the raised events by shorts and PPI, until no event is left.
    fn follow(&mut self) {
        while let Some((base, event)) = self.raised.pop_front() {
            let unit = self.peripherals.at(base).into_iter();
            let shorted = unit.flat_map(|unit| unit.common().shorted(event));
            let mut tasks: Vec<u32> = shorted.map(|task| base + task).collect();
            tasks.extend(self.peripherals.ppi.tasks(base + event));
            for task in tasks {
                self.trigger(task);
            }
        }
    }

    /// Returns the earliest instant at which a peripheral acts by itself, and the base of this peripheral.
    fn due(&mut self) -> Option<(u64, u32)> {
        let all = self.peripherals.all().into_iter();
        let line = &self.context.line;
        all.filter_map(|unit| Some((unit.next(line)?, unit.common().base)))
            .min_by_key(|(at, _)| *at)
    }

    /// Lets the peripherals act up to and including the instant `to`. Returns the next instant at which a peripheral
    /// acts by itself.
    pub(crate) fn advance(&mut self, to: u64) -> u64 {
        let mut next = u64::MAX;
        while let Some((at, base)) = self.due() {
            if at > to {
                next = at;
                break;
            }
            // Noise that a test adds can make an event due in the past. Such an event happens now.
            self.context.now = self.context.now.max(at);
            self.act(base, |unit, context| {
                unit.advance(context);
                Some(())
            });
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
        let units = self.peripherals.all().into_iter().map(Peripheral::common);
        let units = units.filter(|common| common.interrupts());
        units.fold(0, |lines, common| lines | 1 << (common.base >> 12 & 0x3F))
    }
}

/// The peripherals, except UICR.
#[derive(Debug)]
pub(crate) struct Peripherals {
    pub(crate) clock: Clock,
    uarte0: Reception,
    uarte1: Transmission,
    pub(crate) watchdog: Watchdog,
    pwm: Pwm,
    rtc: Rtc,
    pub(crate) timers: [Timer; 3],
    ppi: Ppi,
    gpio: Gpio,
    ficr: Common,
    temp: Common,
    nvmc: Common,
}

impl Peripherals {
    /// Returns all peripherals as they are after power-on.
    fn new() -> Self {
        Self {
            clock: Clock::new(),
            uarte0: Reception::new(),
            uarte1: Transmission::new(),
            watchdog: Watchdog::new(),
            pwm: Pwm::new(),
            rtc: Rtc::new(),
            timers: [
                Timer::new("TIMER0", 0x4000_8000),
                Timer::new("TIMER1", 0x4000_9000),
                Timer::new("TIMER2", 0x4000_A000),
            ],
            ppi: Ppi::new(),
            gpio: Gpio::new(),
            ficr: ficr(),
            temp: temp(),
            nvmc: nvmc(),
        }
    }

    fn all(&mut self) -> [&mut dyn Peripheral; 14] {
        let [timer0, timer1, timer2] = &mut self.timers;
        [
            &mut self.clock,
            &mut self.uarte0,
            &mut self.uarte1,
            &mut self.watchdog,
            &mut self.pwm,
            &mut self.rtc,
            timer0,
            timer1,
            timer2,
            &mut self.ppi,
            &mut self.gpio,
            &mut self.ficr,
            &mut self.temp,
            &mut self.nvmc,
        ]
    }

    /// Returns the peripheral whose registers begin at `base`.
    fn at(&mut self, base: u32) -> Option<&mut dyn Peripheral> {
        let mut all = self.all().into_iter();
        all.find_map(|unit| (unit.common().base == base).then_some(unit))
    }
}
