//! The peripherals together: address decoding, events through shorts and PPI, time.

use std::collections::VecDeque;

use crate::assumptions::Assumptions;
use crate::clock::{RESETREAS_PIN, RESETREAS_SOFT, RESETREAS_WATCHDOG};
use crate::error::{Access, Refusal};
use crate::gpio::{Pins, Port};
use crate::memory::Memory;
use crate::nonvolatile::{FICR, NVMC, Nonvolatile, UICR, UNPROTECTED};
use crate::peripheral::{Common, Context, Peripheral};
use crate::peripherals::Peripherals;
use crate::ppi::{self, Ppi};

const GPIO: u32 = 0x5000_0000;
/// P1's registers lie so far behind P0's, in the same block.
const P1: u32 = 0x300;

/// More events than this at one instant are a loop.
const MOST_EVENTS: usize = 1000;

/// Why the chip was reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The reset pin: [`crate::Board::reset`].
    Pin,
    /// The watchdog was not fed.
    Watchdog,
    /// The firmware asked for it (AIRCR.SYSRESETREQ).
    Soft,
    /// The supply was too low for a moment: [`crate::Board::brown_out`].
    BrownOut,
}

impl std::fmt::Display for ResetCause {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Pin => "pin",
            Self::Watchdog => "watchdog",
            Self::Soft => "soft",
            Self::BrownOut => "brown-out",
        })
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Chip {
    pub(crate) now: u64,
    memory: Memory,
    pub(crate) peripherals: Peripherals,
    ppi: Ppi,
    pub(crate) nonvolatile: Nonvolatile,
    ports: [Port; 2],
    /// Every change of the outputs, and when.
    pub(crate) pin_changes: Vec<(u64, Pins)>,
    /// The outputs at the last of them.
    last_pins: Pins,
    /// Events that were raised and whose shorts and channels are still to be followed: the
    /// peripheral's base, and the event.
    raised: VecDeque<(u32, u32)>,
    /// The tasks triggered at this instant, if one that is triggered twice acts once.
    triggered: Option<(u64, Vec<u32>)>,
    /// The first thing that went wrong.
    pub(crate) refusal: Option<Refusal>,
}

impl Chip {
    pub(crate) fn new(memory: Memory, line_pin: u32) -> Self {
        Self {
            now: 0,
            memory,
            peripherals: Peripherals::new(line_pin),
            ppi: Ppi::default(),
            nonvolatile: Nonvolatile::default(),
            ports: [Port::new(), Port::new()],
            pin_changes: Vec::new(),
            last_pins: Pins::default(),
            raised: VecDeque::new(),
            triggered: None,
            refusal: None,
        }
    }

    /// Section "Reset behavior": a soft reset leaves the watchdog running, the others do not; UICR
    /// survives all of them, RESETREAS all but a brown-out, which looks like power-on. RAM is kept: after a
    /// brown-out it may or may not be.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        let new = Peripherals::new(self.peripherals.uarte.own.line_pin);
        let old = std::mem::replace(&mut self.peripherals, new);
        let new = &mut self.peripherals;
        new.clock.own.reset_reason = match cause {
            ResetCause::Pin => old.clock.own.reset_reason | RESETREAS_PIN,
            ResetCause::Watchdog => old.clock.own.reset_reason | RESETREAS_WATCHDOG,
            ResetCause::Soft => old.clock.own.reset_reason | RESETREAS_SOFT,
            ResetCause::BrownOut => 0,
        };
        // Outside the chip: the crystal, the line and who sends on it, those who look at the pins.
        new.clock.own.crystal_startup = old.clock.own.crystal_startup;
        new.uarte.own.line = old.uarte.own.line;
        new.uarte.own.assumptions = old.uarte.own.assumptions;
        new.transmitter.own.wired_pin = old.transmitter.own.wired_pin;
        new.pwm.own.periods = old.pwm.own.periods;
        new.pwm.own.start_cuts_period = old.pwm.own.start_cuts_period;
        if cause == ResetCause::Soft {
            new.watchdog = old.watchdog;
        }
        self.nonvolatile.reset();
        self.ppi = Ppi::default();
        self.ports = [Port::new(), Port::new()];
        self.note_pins();
    }

    /// Assumes that from now on.
    pub(crate) fn assume(&mut self, assumptions: Assumptions) {
        self.peripherals.uarte.own.assumptions = assumptions;
        self.peripherals.pwm.own.start_cuts_period = assumptions.start_cuts_period;
        self.triggered = assumptions.twice_is_once.then(|| (self.now, Vec::new()));
    }

    /// Whether that task acted at this instant already, and acts only once.
    fn acts_no_more(&mut self, task: u32) -> bool {
        let Some((at, tasks)) = &mut self.triggered else {
            return false;
        };
        if std::mem::replace(at, self.now) != self.now {
            tasks.clear();
        }
        let acted = tasks.contains(&task);
        tasks.push(task);
        acted
    }

    /// Outputs as they are.
    pub(crate) fn pins(&self) -> Pins {
        let [p0, p1] = &self.ports;
        let ((outputs0, high0), (outputs1, high1)) = (p0.driven(), p1.driven());
        Pins {
            outputs: [outputs0, outputs1],
            high: [high0, high1],
        }
    }

    fn note_pins(&mut self) {
        let line_pin = self.peripherals.uarte.own.line_pin;
        let port = self.ports.get((line_pin / 32) as usize);
        let high = port.is_some_and(|port| port.pulls_up(line_pin % 32));
        self.peripherals.uarte.own.line.float(self.now, high);
        let pins = self.pins();
        if std::mem::replace(&mut self.last_pins, pins) != pins {
            self.pin_changes.push((self.now, pins));
        }
    }

    /// Keeps the first refusal; what is wrong after it is its consequence.
    fn refuse(&mut self, refusal: Refusal) {
        self.refusal.get_or_insert(refusal);
    }

    /// Refuses an access that came to nothing.
    fn check<T>(&mut self, done: Option<T>, access: Access, address: u32) -> Option<T> {
        if done.is_none() {
            let peripheral = self.name(address);
            self.refuse(Refusal::Unmodelled {
                access,
                peripheral,
                address,
            });
        }
        done
    }

    /// What lies there, for messages.
    fn name(&mut self, address: u32) -> &'static str {
        match address & !0xFFF {
            ppi::BASE => "PPI",
            GPIO => "GPIO",
            FICR => "FICR",
            UICR => "UICR",
            NVMC => "NVMC",
            base => (self.peripherals.at(base)).map_or("peripheral", |unit| unit.common.name),
        }
    }

    /// Lets a peripheral act, and keeps the events that it raises in `raised`; `None` if there is
    /// none, or if it refuses.
    fn act(
        &mut self,
        base: u32,
        act: impl FnOnce(&mut dyn Peripheral, &mut Context) -> Option<()>,
    ) -> Option<()> {
        let mut context = Context::new(self.now, &self.memory);
        let unit = self.peripherals.at(base)?;
        let done = act(&mut unit.own, &mut context);
        for event in context.raised {
            unit.common.raise(event);
            self.raised.push_back((base, event));
        }
        self.refusal = self.refusal.take().or(context.refusal);
        for (at, cycles) in context.low {
            self.peripherals.uarte.own.line.invert(at, cycles);
        }
        done
    }

    /// Reads a register, as the guest would; `None`, and a refusal, if it is not modelled.
    pub(crate) fn read(&mut self, address: u32) -> Option<u32> {
        let value = self.read_register(address & !0xFFF, address & 0xFFF);
        self.check(value, Access::Read, address)
    }

    fn read_register(&mut self, base: u32, offset: u32) -> Option<u32> {
        match base {
            ppi::BASE => self.ppi.read(offset),
            GPIO => self.read_port(offset),
            FICR | UICR | NVMC => self.nonvolatile.read(base, offset),
            _ => {
                let unit = self.peripherals.at(base)?;
                if Common::owns(offset) {
                    return unit.common.read(offset);
                }
                unit.own.read(offset, self.now)
            }
        }
    }

    fn read_port(&mut self, offset: u32) -> Option<u32> {
        let (n, offset) = port(offset);
        let pin = self.peripherals.uarte.own.line_pin;
        let outside = if pin / 32 == n {
            let high = self.peripherals.uarte.own.line.level_at(self.now);
            (1 << (pin % 32), u32::from(high) << (pin % 32))
        } else {
            (0, 0)
        };
        self.ports.get(n as usize)?.read(offset, outside)
    }

    /// Writes a register, as the guest would; `None`, and a refusal, if it is not modelled.
    pub(crate) fn write(&mut self, address: u32, value: u32) -> Option<()> {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let done = match base {
            GPIO => {
                let (n, offset) = port(offset);
                let port = self.ports.get_mut(n as usize);
                let done = port.and_then(|port| port.write(offset, value));
                self.note_pins();
                done
            }
            UICR if !self.nonvolatile.is_writable() => {
                self.refuse(Refusal::UicrNotWritable { address });
                None
            }
            UICR | NVMC => self.nonvolatile.write(base, offset, value),
            _ if offset < 0x100 => {
                if value & 1 == 1 {
                    // It refuses by itself what it does not know.
                    self.trigger(address);
                    self.follow();
                }
                Some(())
            }
            ppi::BASE => self.ppi.write(offset, value),
            _ => self.write_register(base, offset, value),
        };
        self.check(done, Access::Write(value), address)
    }

    fn write_register(&mut self, base: u32, offset: u32, value: u32) -> Option<()> {
        if Common::owns(offset) {
            return self.peripherals.at(base)?.common.write(offset, value);
        }
        let done = self.act(base, |peripheral, context| {
            peripheral.write(offset, value, context)
        });
        self.follow();
        done
    }

    /// Whether the debug port is open on a chip of build code F or later.
    pub(crate) fn debug_port_is_open(&self) -> bool {
        self.nonvolatile.protection == UNPROTECTED && self.peripherals.clock.own.opens_debug_port()
    }

    /// Triggers a task.
    fn trigger(&mut self, address: u32) {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let done = if base == ppi::BASE {
            self.ppi.task(offset)
        } else {
            self.act(base, |peripheral, context| peripheral.task(offset, context))
        };
        // If it has been refused already, that says more.
        self.check(done, Access::Task, address);
    }

    /// Lets the events that were raised do what they do, and the events that follow from these.
    fn follow(&mut self) {
        let mut seen = 0;
        while let Some((base, event)) = self.raised.pop_front() {
            seen += 1;
            if seen > MOST_EVENTS {
                self.raised.clear();
                return self.refuse(Refusal::Loop(MOST_EVENTS));
            }
            let unit = self.peripherals.at(base);
            let shorted = unit.map(|unit| unit.own.shorted(event, unit.common.shorts));
            let shorted = shorted.into_iter().flatten().flatten();
            let shorted = shorted.map(|task| base + task);
            let tasks: Vec<u32> = shorted.chain(self.ppi.tasks(base + event)).collect();
            for task in tasks {
                if !self.acts_no_more(task) {
                    self.trigger(task);
                }
            }
        }
    }

    /// The earliest instant at which a peripheral does something by itself, and which one.
    fn due(&mut self) -> Option<(u64, u32)> {
        let all = self.peripherals.all().into_iter();
        all.filter_map(|unit| Some((unit.own.next()?, unit.base)))
            .min_by_key(|(at, _)| *at)
    }

    /// Lets everything happen that is due up to and including that instant; returns when something happens
    /// next without the core.
    pub(crate) fn advance(&mut self, to: u64) -> u64 {
        let mut next = u64::MAX;
        while let Some((at, base)) = self.due() {
            if at > to {
                next = at;
                break;
            }
            // What noise made happen in the past happens now.
            self.now = self.now.max(at);
            self.act(base, |peripheral, context| {
                peripheral.advance(context);
                Some(())
            });
            self.follow();
            if self.refusal.is_some() {
                break;
            }
        }
        self.now = to;
        next
    }

    /// A bit for each interrupt line that is up: number n of the vector table, which is bits 12 to
    /// 17 of the peripheral's address.
    pub(crate) fn interrupts(&mut self) -> u64 {
        let units = self.peripherals.all().into_iter();
        units
            .filter(|unit| unit.common.interrupts())
            .fold(0, |lines, unit| lines | 1 << (unit.base >> 12 & 0x3F))
    }
}

/// Which port, and the offset as if it were P0.
fn port(offset: u32) -> (u32, u32) {
    // P0's last register is at 0x77C, P1's first one at 0x804.
    if offset < 0x780 {
        (0, offset)
    } else {
        (1, offset - P1)
    }
}
