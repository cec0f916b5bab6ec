//! The firmware's reports, for LEDs and a debugger. The feature `defmt` adds a log over RTT.

use core::panic::Location;
use core::sync::atomic::{AtomicU32, Ordering};

use embedded_hal::digital::{OutputPin, PinState};
use framelock::Counters;
use framelock::motion::Failsafe;
use nrf52840_hal::gpio::{Output, Pin, PushPull};

use crate::settings::Line;

macro_rules! shown {
    ($($(#[$attribute:meta])* $name:ident $(= $counter:ident$(.$of_it:ident)?)?;)*) => {
        /// The counters. A debugger shows them with `print COUNTERS`.
        #[repr(C)]
        pub(crate) struct Shown {
            $($(#[$attribute])* pub(crate) $name: Count,)*
        }

        /// The counters. The main loop updates the receiver's counters here once a tick.
        #[unsafe(no_mangle)]
        pub(crate) static COUNTERS: Shown = Shown { $($name: Count(AtomicU32::new(0)),)* };

        impl Shown {
            /// Copies the receiver's counters.
            fn show_counters(&self, counters: &Counters) {
                $($(self.$name.set(counters.$counter$(.$of_it)?);)?)*
            }
        }

        const NAMES: &str = concat!($(stringify!($name), " "),*);
        /// The names of the counters, in their order in memory, for programs that read the counters from outside
        /// the chip. The names are only in the ELF file, not in flash (see `memory.x`).
        #[used]
        #[unsafe(link_section = ".counters")]
        static COUNTER_NAMES: [u8; NAMES.len()] = *NAMES.as_bytes().first_chunk().unwrap();
    };
}

shown! {
    bytes = bytes;
    frames = frames;
    no_sync = discarded.no_sync;
    broken_sync = discarded.broken_sync;
    checksum_mismatch = discarded.checksum_mismatch;
    wrong_terminator = discarded.wrong_terminator;
    line_event = discarded.line_event;
    resynchronisations = resynchronisations;
    framing = events.framing;
    parity = events.parity;
    overrun = events.overrun;
    line_break = events.line_break;
    idle = events.idle;
    /// Bytes that the receiver holds because they may still be part of a frame.
    pending;
    /// Bytes that were received and dropped, because they may have come before an error.
    skipped;
    /// How often the UARTE was switched off and on because an ENDRX was lost.
    restarts;
    /// Ticks of 2 ms at which the line was still low after a break.
    break_ticks;
    /// How often this program could not access the receiver, which indicates a bug.
    unserved;
    /// Number of polls that came so late that the outputs moved more slowly than the settings say, plus the number of
    /// polls at which the failsafe's clock had gone backwards.
    late_polls;
}

/// A counter, which single instructions read and write.
#[repr(transparent)]
pub(crate) struct Count(AtomicU32);

impl Count {
    pub(crate) fn get(&self) -> u32 {
        self.0.load(Ordering::Relaxed)
    }

    /// Adds one. No other code may write to this counter at the same time.
    pub(crate) fn count(&self) {
        self.0.store(self.get().wrapping_add(1), Ordering::Relaxed);
    }

    fn set(&self, count: u32) {
        self.0.store(count, Ordering::Relaxed);
    }
}

impl Shown {
    #[expect(
        clippy::cast_possible_truncation,
        reason = "less than a frame is pending"
    )]
    pub(crate) fn show(&self, line: &Line, skipped: u32, restarts: u32) {
        self.show_counters(line.counters());
        self.pending.set(line.pending() as u32);
        self.skipped.set(skipped);
        self.restarts.set(restarts);
    }

    pub(crate) fn show_failsafe(&self, failsafe: &Failsafe<u8, 3>) {
        let late_polls = failsafe.late_polls();
        (self.late_polls).set(late_polls.wrapping_add(failsafe.clock_faults()));
    }

    /// Returns the number of line errors, modulo 2^32. Gaps are not errors.
    pub(crate) fn line_errors(&self) -> u32 {
        (self.framing.get())
            .wrapping_add(self.parity.get())
            .wrapping_add(self.overrun.get())
            .wrapping_add(self.line_break.get())
    }

    /// Returns the number of discarded bytes, modulo 2^32.
    pub(crate) fn discarded(&self) -> u32 {
        (self.no_sync.get())
            .wrapping_add(self.broken_sync.get())
            .wrapping_add(self.checksum_mismatch.get())
            .wrapping_add(self.wrong_terminator.get())
            .wrapping_add(self.line_event.get())
    }
}

/// How long LED2 stays on after an error, in microseconds: long enough to be seen.
const ERROR_SHOWN: u32 = 100_000;

/// The state of the outputs, which LED3 and the log show.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum OutputState {
    /// No frames: the servos hold, move to park, or are parked.
    NoFrames,
    /// Frames arrive, but too far apart to start the servos.
    SlowFrames,
    /// The servos approach the demand slowly.
    Approach,
    /// The servos follow the demand.
    Live,
}

impl OutputState {
    /// Returns whether LED3 is lit. Its patterns repeat after eight steps of 2^17 us, which is about a second.
    fn lights(self, now: u32) -> bool {
        let step = now >> 17 & 7;
        match self {
            Self::NoFrames => true,
            // Two flashes a second.
            Self::SlowFrames => step == 0 || step == 2,
            // Even blinking, four times a second.
            Self::Approach => step & 1 == 0,
            Self::Live => false,
        }
    }
}

/// The LEDs, and the state of the error indicator.
pub(crate) struct Leds {
    pins: [Pin<Output<PushPull>>; 3],
    line_errors: u32,
    error_at: Option<u32>,
}

impl Leds {
    /// Takes the LEDs' pins, which are high, so that all LEDs are off.
    pub(crate) fn new(pins: [Pin<Output<PushPull>>; 3]) -> Self {
        Self {
            pins,
            line_errors: 0,
            error_at: None,
        }
    }

    /// Lights LED1 while in lock, LED2 after a recent line error, and LED3 according to the outputs' state.
    pub(crate) fn show(&mut self, now: u32, in_lock: bool, line_errors: u32, state: OutputState) {
        if line_errors != self.line_errors {
            self.line_errors = line_errors;
            self.error_at = Some(now);
        }
        self.error_at = self
            .error_at
            .filter(|at| now.wrapping_sub(*at) < ERROR_SHOWN);
        let lit = [in_lock, self.error_at.is_some(), state.lights(now)];
        for (pin, lit) in self.pins.iter_mut().zip(lit) {
            // Setting a pin cannot fail, because the error type is uninhabited.
            let _ = pin.set_state(PinState::from(!lit));
        }
    }
}

#[cfg(feature = "defmt")]
use defmt_rtt as _;

/// Logs the start of the program and the cause of the reset.
pub(crate) fn booted(reset_cause: u32) {
    #[cfg(feature = "defmt")]
    let named = |is_cause: bool, name| if is_cause { name } else { "" };
    #[cfg(feature = "defmt")]
    defmt::info!(
        "boot at {=u32} baud; reset by{=str}{=str}{=str}{=str}{=str} (RESETREAS {=u32:#x})",
        crate::settings::BAUD,
        named(reset_cause == 0, " power"),
        named(reset_cause & 1 != 0, " pin"),
        named(reset_cause & 2 != 0, " watchdog"),
        named(reset_cause & 4 != 0, " software"),
        named(reset_cause & 8 != 0, " lockup"),
        reset_cause,
    );
    #[cfg(not(feature = "defmt"))]
    let _ = reset_cause;
}

/// Logs that the lock was gained or lost.
pub(crate) fn lock(gained: bool) {
    #[cfg(feature = "defmt")]
    if gained {
        defmt::info!("lock gained");
    } else {
        defmt::warn!("lock lost");
    }
    #[cfg(not(feature = "defmt"))]
    let _ = gained;
}

/// Logs the outputs' state and the counters. The main loop calls it once a second.
pub(crate) fn log(state: OutputState) {
    #[cfg(feature = "defmt")]
    {
        const HOLD_AFTER: u32 = crate::settings::FAILSAFE.hold_after;
        match state {
            OutputState::NoFrames => defmt::info!("no frames"),
            OutputState::SlowFrames => defmt::warn!(
                "frames arrive too far apart: {=u32} ms or more (hold_after)",
                HOLD_AFTER / 1_000
            ),
            OutputState::Approach => defmt::info!("approach"),
            OutputState::Live => defmt::info!("live"),
        }
        log_counters();
    }
    #[cfg(not(feature = "defmt"))]
    let _ = state;
}

/// Logs the counters.
#[cfg(feature = "defmt")]
pub(crate) fn log_counters() {
    let c = &COUNTERS;
    defmt::info!(
        "bytes {=u32} frames {=u32} pending {=u32}",
        c.bytes.get(),
        c.frames.get(),
        c.pending.get()
    );
    defmt::info!(
        "discarded: no sync {=u32} broken sync {=u32} check {=u32} terminator {=u32} line event {=u32}; resynchronised {=u32}",
        c.no_sync.get(),
        c.broken_sync.get(),
        c.checksum_mismatch.get(),
        c.wrong_terminator.get(),
        c.line_event.get(),
        c.resynchronisations.get()
    );
    defmt::info!(
        "line: framing {=u32} parity {=u32} overrun {=u32} break {=u32} low for {=u32} ms idle {=u32} skipped {=u32} restarts {=u32} unserved {=u32}",
        c.framing.get(),
        c.parity.get(),
        c.overrun.get(),
        c.line_break.get(),
        c.break_ticks.get() * (crate::settings::TICK / 1_000),
        c.idle.get(),
        c.skipped.get(),
        c.restarts.get(),
        c.unserved.get()
    );
}

/// Logs the location of a panic.
pub(crate) fn panicked(location: Option<&Location>) {
    #[cfg(feature = "defmt")]
    if let Some(location) = location {
        defmt::error!("panic at {=str}:{=u32}", location.file(), location.line());
    }
    #[cfg(not(feature = "defmt"))]
    let _ = location;
}
