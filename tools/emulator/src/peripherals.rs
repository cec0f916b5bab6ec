//! The peripherals that have tasks and events, and where their registers are.

use crate::clock::Clock;
use crate::peripheral::{Common, Peripheral};
use crate::pwm::Pwm;
use crate::rtc::Rtc;
use crate::temp::Temp;
use crate::timer::Timer;
use crate::uarte::{Transmitter, Uarte};
use crate::watchdog::Watchdog;

/// A peripheral, and where it is.
#[derive(Clone, Debug)]
pub(crate) struct Unit<P: ?Sized> {
    /// Its registers begin there.
    pub(crate) base: u32,
    /// Its events, shorts and interrupts.
    pub(crate) common: Common,
    pub(crate) own: P,
}

impl<P: Peripheral> Unit<P> {
    fn at(base: u32, own: P) -> Self {
        let common = own.common();
        Self { base, common, own }
    }
}

/// The peripherals that have tasks and events.
#[derive(Clone, Debug)]
pub(crate) struct Peripherals {
    pub(crate) clock: Unit<Clock>,
    pub(crate) uarte: Unit<Uarte>,
    pub(crate) transmitter: Unit<Transmitter>,
    pub(crate) watchdog: Unit<Watchdog>,
    pub(crate) pwm: Unit<Pwm>,
    rtc: Unit<Rtc>,
    temp: Unit<Temp>,
    timers: [Unit<Timer>; 5],
}

impl Peripherals {
    /// As after power-on.
    pub(crate) fn new(line_pin: u32) -> Self {
        Self {
            clock: Unit::at(0x4000_0000, Clock::new()),
            uarte: Unit::at(0x4000_2000, Uarte::new(line_pin)),
            transmitter: Unit::at(0x4002_8000, Transmitter::new()),
            watchdog: Unit::at(0x4001_0000, Watchdog::new()),
            pwm: Unit::at(0x4001_C000, Pwm::new()),
            rtc: Unit::at(0x4001_1000, Rtc::default()),
            temp: Unit::at(0x4000_C000, Temp),
            timers: [
                Unit::at(0x4000_8000, Timer::new("TIMER0", 4)),
                Unit::at(0x4000_9000, Timer::new("TIMER1", 4)),
                Unit::at(0x4000_A000, Timer::new("TIMER2", 4)),
                Unit::at(0x4001_A000, Timer::new("TIMER3", 6)),
                Unit::at(0x4001_B000, Timer::new("TIMER4", 6)),
            ],
        }
    }

    pub(crate) fn all(&mut self) -> [&mut Unit<dyn Peripheral>; 12] {
        let [timer0, timer1, timer2, timer3, timer4] = &mut self.timers;
        [
            &mut self.clock,
            &mut self.uarte,
            &mut self.transmitter,
            &mut self.watchdog,
            &mut self.pwm,
            &mut self.rtc,
            &mut self.temp,
            timer0,
            timer1,
            timer2,
            timer3,
            timer4,
        ]
    }

    /// The one whose registers are there.
    pub(crate) fn at(&mut self, base: u32) -> Option<&mut Unit<dyn Peripheral>> {
        self.all().into_iter().find(|unit| unit.base == base)
    }
}
