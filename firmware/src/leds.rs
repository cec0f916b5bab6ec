//! What the LEDs say: in lock, line error, failsafe.

use embedded_hal::digital::{OutputPin, PinState};
use framelock::motion::Phase;
use nrf52840_hal::gpio::{Output, Pin, PushPull};

/// How long LED2 stays on after an error, in microseconds: long enough to see.
const ERROR_SHOWN: u32 = 100_000;

/// The LEDs, and what they show.
pub(crate) struct Leds {
    pins: [Pin<Output<PushPull>>; 3],
    line_errors: u32,
    error_at: Option<u32>,
}

impl Leds {
    /// All dark.
    pub(crate) fn new(pins: [Pin<Output<PushPull>>; 3]) -> Self {
        Self {
            pins,
            line_errors: 0,
            error_at: None,
        }
    }

    /// LED1: in lock. LED2: an error on the line a moment ago. LED3: the failsafe has the outputs.
    pub(crate) fn show(&mut self, now: u32, in_lock: bool, line_errors: u32, phase: Phase) {
        if line_errors != self.line_errors {
            self.line_errors = line_errors;
            self.error_at = Some(now);
        }
        self.error_at = self
            .error_at
            .filter(|at| now.wrapping_sub(*at) < ERROR_SHOWN);
        let failsafe = !matches!(phase, Phase::Live | Phase::Approach);
        let lit = [in_lock, self.error_at.is_some(), failsafe];
        for (pin, lit) in self.pins.iter_mut().zip(lit) {
            // Cannot fail: the error is uninhabited.
            let _ = pin.set_state(PinState::from(!lit));
        }
    }
}
