//! The peripherals together: address decoding, events through shorts and PPI, time.

use std::collections::VecDeque;

use crate::clock::{Clock, RESETREAS_PIN, RESETREAS_SOFT, RESETREAS_WATCHDOG};
use crate::error::{Access, Misuse};
use crate::factory;
use crate::gpio::Port;
use crate::memory::Memory;
use crate::peripheral::{Common, Context, Peripheral};
use crate::ppi::{self, Ppi};
use crate::pwm::Pwm;
use crate::timer::Timer;
use crate::uarte::Uarte;
use crate::watchdog::Watchdog;

const FICR: u32 = 0x1000_0000;
const UICR: u32 = 0x1000_1000;
const CLOCK: u32 = 0x4000_0000;
const UARTE0: u32 = 0x4000_2000;
const TIMERS: [(u32, &str, u32); 5] = [
    (0x4000_8000, "TIMER0", 4),
    (0x4000_9000, "TIMER1", 4),
    (0x4000_A000, "TIMER2", 4),
    (0x4001_A000, "TIMER3", 6),
    (0x4001_B000, "TIMER4", 6),
];
const WDT: u32 = 0x4001_0000;
const PWM0: u32 = 0x4001_C000;
const NVMC: u32 = 0x4001_E000;
const GPIO: u32 = 0x5000_0000;
/// P1's registers lie so far behind P0's, in the same block.
const P1: u32 = 0x300;

/// More events than this at one instant are a loop.
const MOST_EVENTS: usize = 1000;

/// Why the chip was reset.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// The reset pin, or whoever holds it: [`crate::Board::reset`].
    Pin,
    /// The watchdog was not fed.
    Watchdog,
    /// The firmware asked for it (AIRCR.SYSRESETREQ).
    Soft,
}

/// Levels of the pins that are outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pins {
    /// A bit for each pin of P0 and P1 that is an output.
    pub outputs: [u32; 2],
    /// A bit for each of these that is high.
    pub high: [u32; 2],
}

/// What went wrong at an access, before it is known which function did it.
#[derive(Clone, Debug)]
pub(crate) enum Refusal {
    Unmodelled {
        access: Access,
        peripheral: &'static str,
        address: u32,
    },
    Misuse(Misuse),
}

#[derive(Clone, Debug)]
pub(crate) struct Chip {
    pub(crate) now: u64,
    memory: Memory,
    clock: Clock,
    pub(crate) uarte: Uarte,
    timers: [Timer; 5],
    ppi: Ppi,
    pub(crate) watchdog: Watchdog,
    pub(crate) pwm: Pwm,
    ports: [Port; 2],
    /// Every change of the outputs, and when.
    pub(crate) pin_changes: Vec<(u64, Pins)>,
    /// The outputs at the last of them.
    last_pins: Pins,
    /// The first thing that went wrong.
    pub(crate) refusal: Option<Refusal>,
}

impl Chip {
    pub(crate) fn new(memory: Memory, line_pin: u32) -> Self {
        Self {
            now: 0,
            memory,
            clock: Clock::new(),
            uarte: Uarte::new(line_pin),
            timers: TIMERS.map(|(_, name, compares)| Timer::new(name, compares)),
            ppi: Ppi::default(),
            watchdog: Watchdog::new(),
            pwm: Pwm::new(),
            ports: [Port::new(), Port::new()],
            pin_changes: Vec::new(),
            last_pins: Pins::default(),
            refusal: None,
        }
    }

    /// Section "Reset behavior": a soft reset leaves the watchdog running, the others do not; RAM
    /// and RESETREAS survive all of them.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        self.clock.reset();
        self.clock.reset_reason |= match cause {
            ResetCause::Pin => RESETREAS_PIN,
            ResetCause::Watchdog => RESETREAS_WATCHDOG,
            ResetCause::Soft => RESETREAS_SOFT,
        };
        self.uarte.reset();
        for timer in &mut self.timers {
            timer.reset();
        }
        self.ppi = Ppi::default();
        self.pwm.reset();
        self.ports = [Port::new(), Port::new()];
        if cause != ResetCause::Soft {
            self.watchdog = Watchdog::new();
        }
        self.note_pins();
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
        let pins = self.pins();
        if std::mem::replace(&mut self.last_pins, pins) != pins {
            self.pin_changes.push((self.now, pins));
        }
    }

    fn refuse(&mut self, refusal: Refusal) {
        self.refusal.get_or_insert(refusal);
    }

    /// The peripheral with registers there, if it has tasks and events.
    fn peripheral(&mut self, base: u32) -> Option<&mut dyn Peripheral> {
        Some(match base {
            CLOCK => &mut self.clock,
            UARTE0 => &mut self.uarte,
            WDT => &mut self.watchdog,
            PWM0 => &mut self.pwm,
            _ => {
                let n = TIMERS.iter().position(|timer| timer.0 == base)?;
                self.timers.get_mut(n)?
            }
        })
    }

    /// What lies there, for messages.
    fn name(&mut self, address: u32) -> &'static str {
        match address & !0xFFF {
            ppi::BASE => "PPI",
            NVMC => "NVMC",
            GPIO => "GPIO",
            FICR => "FICR",
            UICR => "UICR",
            base => self.peripheral(base).map_or("peripheral", |p| p.name()),
        }
    }

    /// Reads a register, as the guest would; `None`, and a refusal, if it is not modelled.
    pub(crate) fn read(&mut self, address: u32) -> Option<u32> {
        let value = self.read_register(address & !0xFFF, address & 0xFFF);
        if value.is_none() {
            let peripheral = self.name(address);
            self.refuse(Refusal::Unmodelled {
                access: Access::Read,
                peripheral,
                address,
            });
        }
        value
    }

    fn read_register(&mut self, base: u32, offset: u32) -> Option<u32> {
        match base {
            FICR => factory::read_ficr(offset),
            UICR => factory::read_uicr(offset),
            NVMC => factory::read_nvmc(offset),
            ppi::BASE => self.ppi.read(offset),
            GPIO => self.read_port(offset),
            _ => {
                let peripheral = self.peripheral(base)?;
                if Common::owns(offset) {
                    peripheral.common().read(offset)
                } else {
                    peripheral.read(offset)
                }
            }
        }
    }

    fn read_port(&mut self, offset: u32) -> Option<u32> {
        let (n, offset) = port(offset);
        let pin = self.uarte.line_pin;
        let outside = if pin / 32 == n {
            let high = self.uarte.line.level_at(self.now);
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
            ppi::BASE if offset < 0x100 => {
                if value & 1 == 1 {
                    self.ppi.task(offset)
                } else {
                    Some(())
                }
            }
            ppi::BASE => self.ppi.write(offset, value),
            _ if offset < 0x100 => {
                if value & 1 == 1 {
                    // It refuses by itself what it does not know.
                    self.task(address);
                }
                Some(())
            }
            _ => self.write_register(base, offset, value),
        };
        if done.is_none() {
            let peripheral = self.name(address);
            self.refuse(Refusal::Unmodelled {
                access: Access::Write(value),
                peripheral,
                address,
            });
        }
        done
    }

    fn write_register(&mut self, base: u32, offset: u32, value: u32) -> Option<()> {
        let memory = self.memory.clone();
        let mut context = Context::new(self.now, &memory);
        let peripheral = self.peripheral(base)?;
        let done = if Common::owns(offset) {
            peripheral.common_mut().write(offset, value)
        } else {
            peripheral.write(offset, value, &mut context)
        };
        let mut pending = VecDeque::new();
        self.collect(base, context, &mut pending);
        self.follow(pending);
        done
    }

    /// Triggers a task, and what follows from it.
    pub(crate) fn task(&mut self, address: u32) {
        let mut pending = VecDeque::new();
        self.trigger(address, &mut pending);
        self.follow(pending);
    }

    /// Triggers a task, and collects the events that it raises.
    fn trigger(&mut self, address: u32, pending: &mut VecDeque<(u32, u32)>) {
        let (base, offset) = (address & !0xFFF, address & 0xFFF);
        let memory = self.memory.clone();
        let mut context = Context::new(self.now, &memory);
        let done = if base == ppi::BASE {
            self.ppi.task(offset)
        } else {
            let peripheral = self.peripheral(base);
            peripheral.and_then(|peripheral| peripheral.task(offset, &mut context))
        };
        if done.is_none() && context.misuse.is_none() {
            let peripheral = self.name(address);
            self.refuse(Refusal::Unmodelled {
                access: Access::Task,
                peripheral,
                address,
            });
        }
        self.collect(base, context, pending);
    }

    /// Lets the events that were raised do what they do, and the events that follow from these.
    fn follow(&mut self, mut pending: VecDeque<(u32, u32)>) {
        let mut seen = 0;
        while let Some((base, event)) = pending.pop_front() {
            seen += 1;
            if seen > MOST_EVENTS {
                return self.refuse(Refusal::Misuse(Misuse::Loop(MOST_EVENTS)));
            }
            let shorted = self.peripheral(base).map(|p| p.shorted(event));
            let shorted = shorted
                .into_iter()
                .flatten()
                .flatten()
                .map(|task| base + task);
            let tasks: Vec<u32> = shorted.chain(self.ppi.tasks(base + event)).collect();
            for task in tasks {
                self.trigger(task, &mut pending);
            }
        }
    }

    fn collect(&mut self, base: u32, context: Context, pending: &mut VecDeque<(u32, u32)>) {
        if let Some(misuse) = context.misuse {
            self.refuse(Refusal::Misuse(misuse));
        }
        pending.extend(context.raised.into_iter().map(|event| (base, event)));
    }

    /// The earliest instant at which a peripheral does something by itself, and which one.
    fn due(&self) -> Option<(u64, u32)> {
        let own: [(Option<u64>, u32); 4] = [
            (self.clock.next(), CLOCK),
            (self.uarte.next(), UARTE0),
            (self.watchdog.next(), WDT),
            (self.pwm.next(), PWM0),
        ];
        let timers = self
            .timers
            .iter()
            .map(Peripheral::next)
            .zip(TIMERS.map(|t| t.0));
        own.into_iter()
            .chain(timers)
            .filter_map(|(at, base)| Some((at?, base)))
            .min_by_key(|(at, _)| *at)
    }

    /// When something happens next without the core.
    pub(crate) fn next(&self) -> u64 {
        self.due().map_or(u64::MAX, |(at, _)| at)
    }

    /// Lets everything happen that is due up to and including that instant.
    pub(crate) fn advance(&mut self, to: u64) {
        while let Some((at, base)) = self.due().filter(|(at, _)| *at <= to) {
            // What noise made happen in the past happens now.
            self.now = self.now.max(at);
            let memory = self.memory.clone();
            let mut context = Context::new(self.now, &memory);
            if let Some(peripheral) = self.peripheral(base) {
                peripheral.advance(&mut context);
            }
            let mut pending = VecDeque::new();
            self.collect(base, context, &mut pending);
            self.follow(pending);
            if self.refusal.is_some() {
                break;
            }
        }
        self.now = to;
    }

    /// A bit for each interrupt line that is up: number n of the vector table, which is bits 12 to
    /// 17 of the peripheral's address.
    pub(crate) fn interrupts(&self) -> u64 {
        let own: [(&Common, u32); 4] = [
            (self.clock.common(), CLOCK),
            (self.uarte.common(), UARTE0),
            (self.watchdog.common(), WDT),
            (self.pwm.common(), PWM0),
        ];
        let timers = self
            .timers
            .iter()
            .map(Peripheral::common)
            .zip(TIMERS.map(|t| t.0));
        own.into_iter()
            .chain(timers)
            .filter(|(common, _)| common.interrupts())
            .fold(0, |lines, (_, base)| lines | 1 << (base >> 12 & 0x3F))
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
