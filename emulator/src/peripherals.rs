//! The peripherals that have tasks and events, and where their registers are.

use crate::clock::Clock;
use crate::peripheral::Peripheral;
use crate::pwm::Pwm;
use crate::rtc::Rtc;
use crate::temp::Temp;
use crate::timer::Timer;
use crate::uarte::{Transmitter, Uarte};
use crate::watchdog::Watchdog;

const CLOCK: u32 = 0x4000_0000;
const UARTE0: u32 = 0x4000_2000;
const TIMER0: u32 = 0x4000_8000;
const TIMER1: u32 = 0x4000_9000;
const TIMER2: u32 = 0x4000_A000;
const TEMP: u32 = 0x4000_C000;
pub(crate) const WDT: u32 = 0x4001_0000;
const RTC1: u32 = 0x4001_1000;
const TIMER3: u32 = 0x4001_A000;
const TIMER4: u32 = 0x4001_B000;
const PWM0: u32 = 0x4001_C000;
const UARTE1: u32 = 0x4002_8000;

/// The peripherals that have tasks and events.
#[derive(Clone, Debug)]
pub(crate) struct Peripherals {
    pub(crate) clock: Clock,
    pub(crate) uarte: Uarte,
    pub(crate) transmitter: Transmitter,
    timers: [Timer; 5],
    pub(crate) watchdog: Watchdog,
    pub(crate) pwm: Pwm,
    rtc: Rtc,
    temp: Temp,
}

/// Where their registers are, in the order in which [`Peripherals::all`] has them.
pub(crate) const BASES: [u32; 12] = [
    CLOCK, UARTE0, UARTE1, WDT, PWM0, RTC1, TEMP, TIMER0, TIMER1, TIMER2, TIMER3, TIMER4,
];

impl Peripherals {
    /// As after power-on.
    pub(crate) fn new(line_pin: u32) -> Self {
        Self {
            clock: Clock::new(),
            uarte: Uarte::new(line_pin),
            transmitter: Transmitter::new(),
            timers: [
                Timer::new("TIMER0", 4),
                Timer::new("TIMER1", 4),
                Timer::new("TIMER2", 4),
                Timer::new("TIMER3", 6),
                Timer::new("TIMER4", 6),
            ],
            watchdog: Watchdog::new(),
            pwm: Pwm::new(),
            rtc: Rtc::default(),
            temp: Temp,
        }
    }

    pub(crate) fn all(&self) -> [&dyn Peripheral; 12] {
        let [t0, t1, t2, t3, t4] = &self.timers;
        let (clock, watchdog, pwm) = (&self.clock, &self.watchdog, &self.pwm);
        let (uarte, transmitter) = (&self.uarte, &self.transmitter);
        let (rtc, temp) = (&self.rtc, &self.temp);
        [
            clock,
            uarte,
            transmitter,
            watchdog,
            pwm,
            rtc,
            temp,
            t0,
            t1,
            t2,
            t3,
            t4,
        ]
    }

    pub(crate) fn get_mut(&mut self, n: usize) -> Option<&mut dyn Peripheral> {
        Some(match n {
            0 => &mut self.clock,
            1 => &mut self.uarte,
            2 => &mut self.transmitter,
            3 => &mut self.watchdog,
            4 => &mut self.pwm,
            5 => &mut self.rtc,
            6 => &mut self.temp,
            _ => self.timers.get_mut(n - 7)?,
        })
    }
}

/// The number of the peripheral with registers there, if it has tasks and events.
pub(crate) fn number(base: u32) -> Option<usize> {
    BASES.iter().position(|known| *known == base)
}
