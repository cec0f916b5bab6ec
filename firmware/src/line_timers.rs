//! What is timed and counted on the line without the processor: TIMER1, TIMER2, TIMER3, PPI.
//!
//! ```text
//!  a byte received ──► TIMER1 counts it, TIMER2 starts again from 0
//!  TIMER2: three byte times of silence ──► TIMER1's count is kept, interrupt
//!  TIMER2: a gap (L1) ──► TIMER2 stops, interrupt
//!  a half is full ──► TIMER1's count is kept
//!  a line error ──► TIMER1's count and TIMER2's time are kept, TIMER3 counts it
//! ```
//!
//! So the handler, however late it comes, knows what had been received when each thing happened.

use nrf52840_hal::pac::timer0::EVENTS_COMPARE;
use nrf52840_hal::pac::{PPI, TIMER1, TIMER2, TIMER3, UARTE0};
use nrf52840_hal::ppi::{ConfigurablePpi as _, Parts, Ppi as _};

use crate::settings::{BYTE_TIME, FLUSH_AFTER, GAP_AFTER};

/// TIMER1's registers for its count: now, and when something happened.
const NOW: usize = 0;
const AT_SILENCE: usize = 1;
const AT_ERROR: usize = 2;
const AT_END: usize = 3;

/// TIMER2's two times.
const SILENT: usize = 0;
const GAP: usize = 1;
/// TIMER2's register for the time since the last byte, when an error came.
const SINCE_BYTE: usize = 2;

/// The timers. Counts are of bytes since the start, and wrap.
pub(crate) struct LineTimers {
    bytes: TIMER1,
    silence: TIMER2,
    errors: TIMER3,
}

impl LineTimers {
    /// Connects them to the UARTE. From here on they work on their own.
    pub(crate) fn start(
        (bytes, silence, errors): (TIMER1, TIMER2, TIMER3),
        ppi: PPI,
        uarte: &UARTE0,
    ) -> Self {
        bytes.mode.write(|w| w.mode().low_power_counter());
        bytes.bitmode.write(|w| w.bitmode()._32bit());
        bytes.tasks_clear.write(|w| w.tasks_clear().set_bit());
        bytes.tasks_start.write(|w| w.tasks_start().set_bit());

        errors.mode.write(|w| w.mode().low_power_counter());
        errors.bitmode.write(|w| w.bitmode()._32bit());
        errors.tasks_clear.write(|w| w.tasks_clear().set_bit());
        errors.tasks_start.write(|w| w.tasks_start().set_bit());

        silence.mode.write(|w| w.mode().timer());
        silence.bitmode.write(|w| w.bitmode()._32bit());
        // SAFETY: 16 MHz / 2^4: a count is a microsecond. Any value is a time.
        unsafe {
            silence.prescaler.write(|w| w.prescaler().bits(4));
            silence.cc[SILENT].write(|w| w.bits(FLUSH_AFTER));
            silence.cc[GAP].write(|w| w.bits(GAP_AFTER));
        }
        silence.shorts.write(|w| w.compare1_stop().enabled());
        silence
            .intenset
            .write(|w| w.compare0().set().compare1().set());

        let Parts {
            mut ppi0,
            mut ppi1,
            mut ppi2,
            mut ppi3,
            mut ppi4,
            mut ppi5,
            ..
        } = Parts::new(ppi);
        // A byte received.
        ppi0.set_event_endpoint(&uarte.events_rxdrdy);
        ppi0.set_task_endpoint(&bytes.tasks_count);
        ppi0.set_fork_task_endpoint(&silence.tasks_clear);
        ppi1.set_event_endpoint(&uarte.events_rxdrdy);
        ppi1.set_task_endpoint(&silence.tasks_start);
        // Silence.
        ppi2.set_event_endpoint(&silence.events_compare[SILENT]);
        ppi2.set_task_endpoint(&bytes.tasks_capture[AT_SILENCE]);
        // A line error.
        ppi3.set_event_endpoint(&uarte.events_error);
        ppi3.set_task_endpoint(&bytes.tasks_capture[AT_ERROR]);
        ppi3.set_fork_task_endpoint(&errors.tasks_count);
        ppi4.set_event_endpoint(&uarte.events_error);
        ppi4.set_task_endpoint(&silence.tasks_capture[SINCE_BYTE]);
        // A half is full.
        ppi5.set_event_endpoint(&uarte.events_endrx);
        ppi5.set_task_endpoint(&bytes.tasks_capture[AT_END]);
        ppi0.enable();
        ppi1.enable();
        ppi2.enable();
        ppi3.enable();
        ppi4.enable();
        ppi5.enable();
        Self {
            bytes,
            silence,
            errors,
        }
    }

    /// Bytes received until now.
    #[inline]
    pub(crate) fn count(&self) -> u32 {
        self.bytes.tasks_capture[NOW].write(|w| w.tasks_capture().set_bit());
        self.bytes.cc[NOW].read().bits()
    }

    /// Bytes received when the last half was full.
    #[inline]
    pub(crate) fn count_at_end(&self) -> u32 {
        self.bytes.cc[AT_END].read().bits()
    }

    /// Bytes received when the last error came, without the one that it spoilt: whether that one is
    /// counted, the product specification does not say. If it was, it was counted just then.
    pub(crate) fn count_at_error(&self) -> u32 {
        let count = self.bytes.cc[AT_ERROR].read().bits();
        let since_byte = self.silence.cc[SINCE_BYTE].read().bits();
        if since_byte < BYTE_TIME / 2 {
            count.wrapping_sub(1)
        } else {
            count
        }
    }

    /// Errors until now.
    pub(crate) fn errors(&self) -> u32 {
        self.errors.tasks_capture[NOW].write(|w| w.tasks_capture().set_bit());
        self.errors.cc[NOW].read().bits()
    }

    /// Bytes received when the line had last been silent for three byte times.
    #[inline]
    pub(crate) fn count_at_silence(&self) -> u32 {
        self.bytes.cc[AT_SILENCE].read().bits()
    }

    /// The event of three byte times of silence.
    #[inline]
    pub(crate) fn silent(&self) -> &EVENTS_COMPARE {
        &self.silence.events_compare[SILENT]
    }

    /// The event of a gap.
    #[inline]
    pub(crate) fn gap(&self) -> &EVENTS_COMPARE {
        &self.silence.events_compare[GAP]
    }
}
