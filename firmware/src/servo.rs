//! Three servos' pulses: PWM0, 50 Hz, 1 to 2 ms.

use core::ptr::{addr_of, addr_of_mut};

use framelock::motion::Setpoint;
use nrf52840_hal::gpio::{Output, Pin, PushPull};
use nrf52840_hal::pac::PWM0;

use crate::settings::{PULSE, PULSE_PERIOD, TICK};

/// How long after a period has begun new widths are handed over, in microseconds: late, so that they are
/// new. The pulses are over by then, so none is cut if the PWM begins a new period at once.
const HANDOVER: u32 = PULSE_PERIOD as u32 - 2 * TICK;

/// One sequence of one step: a pulse width for each of the four channels.
type Widths = [u16; 4];

/// Sets the pulse, rather than clears it, at the start of each period.
const PULSE_FIRST: u16 = 1 << 15;

/// The servos' outputs.
pub(crate) struct Servos {
    pwm: PWM0,
    /// In RAM, where the PWM fetches them; two, so that none is written while it is fetched.
    widths: &'static mut [Widths; 2],
    /// The one that the PWM was given last.
    given: usize,
    shown: Setpoint,
    /// When the period began, as far as was seen, or widths were last handed over.
    since: u32,
}

impl Servos {
    /// The pulses begin now.
    pub(crate) fn start(
        pwm: PWM0,
        pins: impl IntoIterator<Item = Pin<Output<PushPull>>>,
        widths: &'static mut [Widths; 2],
        (now, setpoint): (u32, Setpoint),
    ) -> Self {
        for (out, pin) in pwm.psel.out.iter().zip(pins) {
            // SAFETY: the value is a pin's own, and the pin is given up here.
            out.write(|w| unsafe { w.bits(pin.psel_bits()) });
        }
        pwm.enable.write(|w| w.enable().enabled());
        // 16 MHz / 16: a count is a microsecond.
        pwm.prescaler.write(|w| w.prescaler().div_16());
        // SAFETY: below 2^15, as the settings assert.
        pwm.countertop
            .write(|w| unsafe { w.countertop().bits(PULSE_PERIOD) });
        pwm.decoder
            .write(|w| w.load().individual().mode().refresh_count());
        // SAFETY: the four widths of one step.
        pwm.seq0.cnt.write(|w| unsafe { w.cnt().bits(4) });
        let mut servos = Self {
            pwm,
            widths,
            given: 0,
            shown: setpoint,
            since: now,
        };
        servos.hand_over(setpoint);
        servos
    }

    /// The next pulses say this, if it is time to hand it over: once a period, and behind its pulses. What
    /// SEQSTART does in the middle of a period is not specified: the next begins when this one is over,
    /// or at once, which makes this one shorter. The PWM's events say when a period began either way.
    pub(crate) fn show(&mut self, now: u32, setpoint: Setpoint) {
        let [started, _] = &self.pwm.events_seqstarted;
        let ended = &self.pwm.events_pwmperiodend;
        if started.read().bits() | ended.read().bits() != 0 {
            started.reset();
            ended.reset();
            self.since = now;
        }
        if now.wrapping_sub(self.since) >= HANDOVER && setpoint != self.shown {
            self.since = now;
            self.shown = setpoint;
            self.hand_over(setpoint);
        }
    }

    /// Whether a period is over; for the self-test.
    #[allow(dead_code, reason = "shared with the self-test")]
    pub(crate) fn period_has_ended(&self) -> bool {
        self.pwm.events_pwmperiodend.read().bits() != 0
    }

    /// Gives the PWM the widths for the next period.
    #[inline(never)]
    pub(crate) fn hand_over(&mut self, setpoint: Setpoint) {
        self.given ^= 1;
        let Some(widths) = self.widths.get_mut(self.given) else {
            return;
        };
        let [pitch, roll, yaw] =
            <[u8; 3]>::from(setpoint).map(|demand| PULSE_FIRST | width(demand));
        // SAFETY: ours, by the mutable reference; volatile, since the PWM reads it.
        unsafe { addr_of_mut!(*widths).write_volatile([pitch, roll, yaw, PULSE_FIRST]) };
        let address = addr_of!(*widths) as u32;
        // SAFETY: the widths are in RAM and are never moved. They are not written before the PWM was given
        // the others, a period from now.
        self.pwm.seq0.ptr.write(|w| unsafe { w.bits(address) });
        self.pwm.tasks_seqstart[0].write(|w| w.tasks_seqstart().set_bit());
    }
}

/// Microseconds of the pulse.
#[expect(
    clippy::cast_possible_truncation,
    reason = "between the two pulses, which are u16"
)]
fn width(demand: u8) -> u16 {
    let [shortest, longest] = PULSE;
    let travel = u32::from(longest - shortest);
    shortest + (travel * u32::from(demand) / 255) as u16
}

/// Ends the pulses after the one under way, which servos answer by going limp; for panics, so
/// it owns nothing.
pub(crate) fn stop() {
    // SAFETY: one task and one event of the PWM, and the caller never returns to anyone who uses it.
    let pwm = unsafe { &*PWM0::ptr() };
    pwm.events_stopped.reset();
    pwm.tasks_stop.write(|w| w.tasks_stop().set_bit());
    // At most a period, or never if it was not running; each round takes more than six cycles.
    for _ in 0..u32::from(PULSE_PERIOD) * 11 {
        if pwm.events_stopped.read().bits() != 0 {
            break;
        }
    }
}
