//! framelock on the nRF52840: UARTE0 receives setpoints, and PWM0 drives three servos.
//!
//! ```text
//!  UARTE0 ──► receive handler ──► setpoint ──► main loop: failsafe ──► servos, LEDs, log, watchdog
//! ```
//!
//! The receive handler runs the receiver, and passes the setpoint to the main loop in a single word. The main loop does
//! everything else.
//!
//! This firmware is no safety function. Whatever it moves needs a switch that cuts the power without software.
#![no_std]
#![no_main]

mod clock;
mod debug_port;
mod receive;
mod reset;
mod servo;
mod setpoint;
mod settings;
mod telemetry;

use cortex_m::peripheral::{NVIC, SCB};
use cortex_m_rt::entry;
use embedded_hal::digital::InputPin as _;
use framelock::motion::{Failsafe, Output, Pace, Phase};
use nrf52840_hal::clocks::Clocks;
use nrf52840_hal::gpio::{p0, p1};
use nrf52840_hal::pac::{self, Interrupt};

use crate::clock::Clock;
use crate::reset::Watchdog;
use crate::servo::Servos;
use crate::setpoint::Published;
use crate::settings::{FAILSAFE, Line, TICK};
use crate::telemetry::{COUNTERS, Leds, OutputState};

/// Interval between two log entries of the counters, in microseconds.
const LOG_EVERY: u32 = 1_000_000;

#[entry]
fn main() -> ! {
    static mut WIDTHS: [[u16; 4]; 2] = [[0; 4]; 2];
    static mut LINE: Line = receive::NOTHING_YET;

    // Nothing has taken the peripherals yet, so neither call can fail. If a call failed, only a reset could help.
    let (Some(chip), Some(mut core)) = (pac::Peripherals::take(), pac::CorePeripherals::take())
    else {
        SCB::sys_reset()
    };
    // Drive the servos' wires low before anything that waits: a servo must not see a floating wire.
    let mut pins = settings::pins(p0::Parts::new(chip.P0), p1::Parts::new(chip.P1));
    debug_port::keep_open(&chip.FICR, &chip.UICR, &chip.NVMC);
    // Turn on the instruction cache, because flash has wait states. After a reset the cache is off.
    chip.NVMC.icachecnf.write(|w| w.cacheen().enabled());
    // Wake from sleep without delay. Otherwise each wake takes up to 3 us, which is a third of a byte at 1 Mbaud.
    chip.POWER
        .tasks_constlat
        .write(|w| w.tasks_constlat().set_bit());
    // Start the watchdog before the crystal, which might never start.
    let Some(mut watchdog) = Watchdog::start(chip.WDT) else {
        SCB::sys_reset()
    };
    // Start the crystal, because the UARTE's baud rate is only as accurate as this clock. If the crystal
    // does not start, the watchdog resets the chip.
    let _clocks = Clocks::new(chip.CLOCK).enable_ext_hfosc();
    let reset_cause = reset::cause(&chip.POWER);
    telemetry::booted(reset_cause);

    let clock = Clock::start(chip.TIMER0);
    let output = reset::last_output().unwrap_or(FAILSAFE.park.into());
    let now = clock.now();
    // Keep the failsafe inside the `Result`, because moving it out would take more flash than the failsafe itself.
    let Ok(failsafe) = &mut Failsafe::resumed(FAILSAFE, now, output) else {
        SCB::sys_reset() // The settings assert the same at compile time.
    };
    let mut servos = Servos::start(chip.PWM0, pins.servos, WIDTHS, (now, output));
    let mut leds = Leds::new(pins.leds);
    receive::start(chip.UARTE0, chip.TIMER2, &pins.receive, LINE);
    unmask_interrupts(&mut core.NVIC);

    let mut seen = Published::now();
    let mut lock = Lock::default();
    let mut line_break = LineBreak::default();
    let mut pace = Pace::default();
    let mut logged_at = now;
    // One pass per tick. A new setpoint waits for the next tick. This wait costs nothing, because the PWM takes new
    // pulse widths less often than once a tick.
    loop {
        let now = clock.now();
        clock.wake_at(now.wrapping_add(TICK));
        let published = Published::now();
        if published != seen {
            seen = published;
            failsafe.frame(published.setpoint());
        }
        let output = poll(failsafe, now);
        servos.show(now, output.axes.into());
        reset::keep_output(output.axes.into());
        let receives = receive::tick();
        line_break.update(pins.receive.is_low() == Ok(true));
        lock.update(COUNTERS.frames.get(), COUNTERS.discarded(), output.phase);
        COUNTERS.show_failsafe(failsafe);
        let state = output_state(output.phase, pace);
        leds.show(now, lock.held, COUNTERS.line_errors(), state);
        watchdog.feed(receives);
        if now.wrapping_sub(logged_at) >= LOG_EVERY {
            logged_at = now;
            pace.period_ended(failsafe.slow_frames());
            telemetry::log(state);
        }
        clock::sleep();
    }
}

/// Returns the failsafe's output. This is a separate function, because the main loop would otherwise take more stack.
#[inline(never)]
fn poll(failsafe: &mut Failsafe<u8, 3>, now: u32) -> Output<u8, 3> {
    failsafe.poll(now)
}

/// The lock. It begins with a frame in the phase Approach or Live. A discarded byte or another phase ends it.
#[derive(Default)]
struct Lock {
    held: bool,
    frames: u32,
    discarded: u32,
}

impl Lock {
    fn update(&mut self, frames: u32, discarded: u32, phase: Phase) {
        let silent = !matches!(phase, Phase::Live | Phase::Approach);
        let held = if silent || discarded != self.discarded {
            false
        } else {
            self.held || frames != self.frames
        };
        (self.frames, self.discarded) = (frames, discarded);
        if held != self.held {
            self.held = held;
            telemetry::lock(held);
        }
    }
}

/// The measurement of how long a break lasts. It counts ticks from the report of the break, until a tick finds the line
/// high or a byte has arrived.
#[derive(Default)]
struct LineBreak {
    lasts: bool,
    breaks: u32,
    bytes: u32,
}

impl LineBreak {
    fn update(&mut self, is_low: bool) {
        let (breaks, bytes) = (COUNTERS.line_break.get(), COUNTERS.bytes.get());
        let goes_on = self.lasts && bytes == self.bytes;
        self.lasts = is_low && (goes_on || breaks != self.breaks);
        (self.breaks, self.bytes) = (breaks, bytes);
        if self.lasts {
            COUNTERS.break_ticks.count();
        }
    }
}

/// Returns the state of the outputs to show.
fn output_state(phase: Phase, pace: Pace) -> OutputState {
    match phase {
        Phase::Live => OutputState::Live,
        Phase::Approach => OutputState::Approach,
        _ if pace.is_slow() => OutputState::SlowFrames,
        _ => OutputState::NoFrames,
    }
}

/// Sets the interrupt priorities and unmasks the interrupts. The receiver's two handlers share one priority, which is
/// higher than that of the tick's handler.
fn unmask_interrupts(nvic: &mut NVIC) {
    for (interrupt, priority) in [
        (Interrupt::UARTE0_UART0, 1 << 5),
        (Interrupt::TIMER2, 1 << 5),
        (Interrupt::TIMER0, 2 << 5),
    ] {
        // SAFETY: no critical section relies on priorities, and all state that the handlers use is initialised.
        unsafe {
            nvic.set_priority(interrupt, priority);
            NVIC::unmask(interrupt);
        }
    }
}
