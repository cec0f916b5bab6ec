//! Connects all peripherals: decodes addresses, passes events through shorts and PPI, and advances the time.

use std::collections::VecDeque;

use crate::clock::{Clock, RESETREAS_LOCKUP, RESETREAS_PIN, RESETREAS_SOFT, RESETREAS_WATCHDOG};
use crate::error::{Access, Refusal};
use crate::gpio::Gpio;
use crate::memory::Memory;
use crate::nonvolatile::{self, Nonvolatile, UNPROTECTED};
use crate::peripheral::{Common, Context, Peripheral};
use crate::ppi::Ppi;
use crate::pwm::Pwm;
use crate::rtc::Rtc;
use crate::timer::Timer;
use crate::trace::ResetCause;
use crate::uarte::{Reception, Transmission};
use crate::watchdog::Watchdog;

/// The limit on the number of events at one instant. More events count as a loop.
const MOST_EVENTS: usize = 1000;

#[derive(Debug)]
pub(crate) struct Chip {
    pub(crate) context: Context,
    pub(crate) peripherals: Peripherals,
    pub(crate) nonvolatile: Nonvolatile,
    /// Raised events whose shorts and PPI channels have not taken effect yet. Each entry is the peripheral's base and
    /// the event.
    raised: VecDeque<(u32, u32)>,
    /// The last instant at which a task was triggered, and the tasks of that instant. Used only with
    /// `Assumptions::twice_is_once`.
    triggered: (u64, Vec<u32>),
}

impl Chip {
    pub(crate) fn new(memory: Memory, line_pin: u32) -> Self {
        Self {
            context: Context::new(memory, line_pin),
            peripherals: Peripherals::new(),
            nonvolatile: Nonvolatile::default(),
            raised: VecDeque::new(),
            triggered: (0, Vec::new()),
        }
    }

    /// Resets the chip: section "Reset behavior". A soft reset and a lockup leave the watchdog running. UICR survives every
    /// reset. RESETREAS survives every reset except a brown-out. A brown-out clears RESETREAS, as power-on does. RAM
    /// keeps its contents, but on silicon a brown-out may destroy them.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let old = std::mem::replace(&mut self.peripherals, Peripherals::new());
        let new = &mut self.peripherals;
        new.clock.own.reset_reason = match cause {
            ResetCause::Pin => old.clock.own.reset_reason | RESETREAS_PIN,
            ResetCause::Watchdog => old.clock.own.reset_reason | RESETREAS_WATCHDOG,
            ResetCause::Soft => old.clock.own.reset_reason | RESETREAS_SOFT,
            ResetCause::Lockup => old.clock.own.reset_reason | RESETREAS_LOCKUP,
            ResetCause::BrownOut => 0,
        };
        if matches!(cause, ResetCause::Soft | ResetCause::Lockup) {
            new.watchdog = old.watchdog;
        }
        new.gpio.own.show(&mut self.context);
        self.nonvolatile.reset();
    }

    /// Returns whether the task has already acted at this instant and must not act again.
    fn acts_no_more(&mut self, task: u32) -> bool {
        if !self.context.assumptions.twice_is_once {
            return false;
        }
        let (at, tasks) = &mut self.triggered;
        if std::mem::replace(at, self.context.now) != self.context.now {
            tasks.clear();
        }
        let acted = tasks.contains(&task);
        tasks.push(task);
        acted
    }

    /// If `done` is `None`, records that the access is not modelled.
    fn check<T>(&mut self, done: Option<T>, access: Access, address: u32) -> Option<T> {
        if done.is_none() {
            let base = address & !0xFFF;
            let unit = self.peripherals.at(base).map(|unit| unit.common.name);
            let peripheral = unit.or(nonvolatile::name(base)).unwrap_or("peripheral");
            self.context.refuse(Refusal::Unmodelled {
                access,
                peripheral,
                address,
            });
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
        let done = act(&mut unit.own, &mut self.context);
        for event in self.context.raised.drain(..) {
            unit.common.raise(event);
            self.raised.push_back((base, event));
        }
        done
    }

    /// Reads a register, as the firmware would. If the register is not modelled, records this and returns `None`.
    pub(crate) fn read(&mut self, address: u32) -> Option<u32> {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let value = match self.peripherals.at(base) {
            Some(unit) if unit.common.owns(offset) => unit.common.read(offset),
            Some(unit) => unit.own.read(offset, &self.context),
            None => self.nonvolatile.read(base, offset),
        };
        self.check(value, Access::Read, address)
    }

    /// Writes a register, as the firmware would. If the register is not modelled, records this and returns `None`.
    pub(crate) fn write(&mut self, address: u32, value: u32) -> Option<()> {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let done = match self.peripherals.at(base) {
            Some(unit) if unit.common.has_tasks && offset < 0x100 => {
                if value & 1 == 1 {
                    // `trigger` itself rejects unknown tasks.
                    self.trigger(address);
                }
                Some(())
            }
            Some(unit) if unit.common.owns(offset) => unit.common.write(offset, value),
            Some(_) => self.act(base, |peripheral, context| {
                peripheral.write(offset, value, context)
            }),
            None => (self.nonvolatile).write(base, offset, value, &mut self.context),
        };
        self.follow();
        self.check(done, Access::Write(value), address)
    }

    /// Returns whether the debug port is open on a chip of build code F or later.
    pub(crate) fn debug_port_is_open(&self) -> bool {
        self.nonvolatile.protection == UNPROTECTED && self.peripherals.clock.own.opens_debug_port()
    }

    /// Triggers a task.
    fn trigger(&mut self, address: u32) {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let done = self.act(base, |peripheral, context| peripheral.task(offset, context));
        // If the task itself has recorded a refusal, `check` keeps the task's refusal, because this refusal is more
        // specific.
        self.check(done, Access::Task, address);
    }

    /// Triggers the tasks that follow from the raised events by shorts and PPI, until no event is left.
    fn follow(&mut self) {
        let mut seen = 0;
        while let Some((base, event)) = self.raised.pop_front() {
            seen += 1;
            if seen > MOST_EVENTS {
                self.raised.clear();
                return self.context.refuse(Refusal::Loop(MOST_EVENTS));
            }
            let unit = self.peripherals.at(base).into_iter();
            let shorted = unit.flat_map(|unit| unit.common.shorted(event));
            let mut tasks: Vec<u32> = shorted.map(|task| base + task).collect();
            tasks.extend(self.peripherals.ppi.own.tasks(base + event));
            for task in tasks {
                if !self.acts_no_more(task) {
                    self.trigger(task);
                }
            }
        }
    }

    /// Returns the earliest instant at which a peripheral acts by itself, and the base of this peripheral.
    fn due(&mut self) -> Option<(u64, u32)> {
        let all = self.peripherals.all().into_iter();
        let line = &self.context.line;
        all.filter_map(|unit| Some((unit.own.next(line)?, unit.base)))
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
            self.act(base, |peripheral, context| {
                peripheral.advance(context);
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
        let units = self.peripherals.all().into_iter();
        units
            .filter(|unit| unit.common.interrupts())
            .fold(0, |lines, unit| lines | 1 << (unit.base >> 12 & 0x3F))
    }
}

/// A peripheral and its base address.
#[derive(Debug)]
pub(crate) struct Unit<P: ?Sized> {
    /// The address of its first register.
    pub(crate) base: u32,
    /// The peripheral's events, shorts and interrupts.
    pub(crate) common: Common,
    pub(crate) own: P,
}

impl<P: Peripheral> Unit<P> {
    fn at(base: u32, own: P) -> Self {
        let common = own.common();
        Self { base, common, own }
    }
}

/// The peripherals that have tasks, events or pins.
#[derive(Debug)]
pub(crate) struct Peripherals {
    pub(crate) clock: Unit<Clock>,
    uarte0: Unit<Reception>,
    uarte1: Unit<Transmission>,
    pub(crate) watchdog: Unit<Watchdog>,
    pwm: Unit<Pwm>,
    rtc: Unit<Rtc>,
    pub(crate) timers: [Unit<Timer>; 5],
    pub(crate) ppi: Unit<Ppi>,
    pub(crate) gpio: Unit<Gpio>,
}

impl Peripherals {
    /// Returns all peripherals as they are after power-on.
    pub(crate) fn new() -> Self {
        Self {
            clock: Unit::at(0x4000_0000, Clock::default()),
            uarte0: Unit::at(0x4000_2000, Reception::new()),
            uarte1: Unit::at(0x4002_8000, Transmission::new()),
            watchdog: Unit::at(0x4001_0000, Watchdog::default()),
            pwm: Unit::at(0x4001_C000, Pwm::default()),
            rtc: Unit::at(0x4001_1000, Rtc::new()),
            timers: [
                Unit::at(0x4000_8000, Timer::new("TIMER0", 4)),
                Unit::at(0x4000_9000, Timer::new("TIMER1", 4)),
                Unit::at(0x4000_A000, Timer::new("TIMER2", 4)),
                Unit::at(0x4001_A000, Timer::new("TIMER3", 6)),
                Unit::at(0x4001_B000, Timer::new("TIMER4", 6)),
            ],
            ppi: Unit::at(0x4001_F000, Ppi::default()),
            gpio: Unit::at(0x5000_0000, Gpio::default()),
        }
    }

    pub(crate) fn all(&mut self) -> [&mut Unit<dyn Peripheral>; 13] {
        let [timer0, timer1, timer2, timer3, timer4] = &mut self.timers;
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
            timer3,
            timer4,
            &mut self.ppi,
            &mut self.gpio,
        ]
    }

    /// Returns the peripheral whose registers begin at `base`.
    pub(crate) fn at(&mut self, base: u32) -> Option<&mut Unit<dyn Peripheral>> {
        self.all().into_iter().find(|unit| unit.base == base)
    }
}
