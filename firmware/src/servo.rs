//! The pulses for three servos: PWM0 generates them at 50 Hz, 1 to 2 ms wide.

use core::ptr::{addr_of, addr_of_mut};

use framelock::motion::Setpoint;
use nrf52840_hal::gpio::{Output, Pin, PushPull};
use nrf52840_hal::pac::PWM0;

use crate::settings::{PULSE, PULSE_PERIOD, TICK};

/// The earliest time in a period at which the PWM gets new widths, in microseconds. The handover is late in the period,
/// so that the widths are recent. By then the pulses have ended, so no pulse is cut short, even if the PWM immediately
/// begins a new period.
const HANDOVER: u32 = PULSE_PERIOD as u32 - 2 * TICK;

/// A PWM sequence of one step: a pulse width for each of the four channels.
type Widths = [u16; 4];

/// The polarity bit: the output is high at the start of each period, and low after the pulse width.
const PULSE_FIRST: u16 = 1 << 15;

/// The servos' outputs.
pub(crate) struct Servos {
    pwm: PWM0,
    /// Two sets of widths, in RAM, from which the PWM fetches them. The program writes one set while the PWM may
    /// fetch the other.
    widths: &'static mut [Widths; 2],
    /// The index of the set that was handed over to the PWM last.
    given: usize,
    shown: Setpoint,
    /// The later of two times: when a period last began, and when the PWM last got widths.
    since: u32,
}

impl Servos {
    /// Starts the pulses.
    pub(crate) fn start(
        pwm: PWM0,
        pins: impl IntoIterator<Item = Pin<Output<PushPull>>>,
        widths: &'static mut [Widths; 2],
        (now, setpoint): (u32, Setpoint),
    ) -> Self {
        for (out, pin) in pwm.psel.out.iter().zip(pins) {
            // SAFETY: the value comes from a pin, and this function consumes the pin.
            out.write(|w| unsafe { w.bits(pin.psel_bits()) });
        }
        pwm.enable.write(|w| w.enable().enabled());
        // 16 MHz / 16: the counter counts microseconds.
        pwm.prescaler.write(|w| w.prescaler().div_16());
        // SAFETY: the period is below 2^15, as the settings assert.
        pwm.countertop
            .write(|w| unsafe { w.countertop().bits(PULSE_PERIOD) });
        pwm.decoder
            .write(|w| w.load().individual().mode().refresh_count());
        // SAFETY: the sequence contains four widths.
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

    /// Hands this setpoint over to the PWM for the next pulses, but at most once a period, and only after the period's
    /// pulses.
    ///
    /// The effect of SEQSTART in the middle of a period is not specified. Either the next period begins when the
    /// current one has ended, or it begins immediately and shortens the current one. In both cases the PWM's events
    /// show when a period has begun.
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

    /// Returns whether a period has ended. Only the self-test uses it.
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
        // SAFETY: the mutable reference gives exclusive access. The write is volatile because the PWM reads the
        // widths.
        unsafe { addr_of_mut!(*widths).write_volatile([pitch, roll, yaw, PULSE_FIRST]) };
        let address = addr_of!(*widths) as u32;
        // SAFETY: the widths are in RAM and never move. The program does not write them again before it has handed over
        // the other set, a period later.
        self.pwm.seq0.ptr.write(|w| unsafe { w.bits(address) });
        self.pwm.tasks_seqstart[0].write(|w| w.tasks_seqstart().set_bit());
    }
}

/// Returns the width of the pulse for this demand, in microseconds.
#[expect(
    clippy::cast_possible_truncation,
    reason = "between the two pulses, which are u16"
)]
fn width(demand: u8) -> u16 {
    let [shortest, longest] = PULSE;
    let travel = u32::from(longest - shortest);
    shortest + (travel * u32::from(demand) / 255) as u16
}

/// Stops the pulses after the current one. Servos without pulses go limp. Panics and faults use this function,
/// so it needs no [`Servos`].
pub(crate) fn stop() {
    // SAFETY: only one task and one event of the PWM are used, and no code uses the PWM after this call.
    let pwm = unsafe { &*PWM0::ptr() };
    pwm.events_stopped.reset();
    pwm.tasks_stop.write(|w| w.tasks_stop().set_bit());
    // If the PWM was running, the event comes within a period. Otherwise no event comes, and the loop ends by its
    // count. The count lasts for at least one period, because each iteration takes more than six cycles.
    for _ in 0..u32::from(PULSE_PERIOD) * 11 {
        if pwm.events_stopped.read().bits() != 0 {
            break;
        }
    }
}
