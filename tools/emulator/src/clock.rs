//! The start of the clocks: nRF52840 Product Specification, section "CLOCK".
//!
//! CLOCK, POWER and APPROTECT share one block of registers and one interrupt, so one struct models them. RESETREAS
//! belongs to POWER, and the debug port's protection is described in "Debug and trace". The model of the low-frequency
//! clock covers only its start. In the model, RTC1 and the watchdog run even if this clock was not started. On silicon,
//! firmware must start this clock for RTC1, but the watchdog starts the clock itself. Clocks are never stopped.

use crate::MICROSECOND;
use crate::line::SerialLine;
use crate::peripheral::{ANY, Access, Common, Context, Peripheral};

pub(crate) const CLOCK: u32 = 0x4000_0000;

const HFCLKSTART: u32 = 0x000;
const LFCLKSTART: u32 = 0x008;
const CONSTLAT: u32 = 0x078;
const HFCLKSTARTED: u32 = 0x100;
const LFCLKSTARTED: u32 = 0x104;
pub(crate) const RESETREAS: u32 = 0x400;
const LFCLKSRC: u32 = 0x518;
pub(crate) const DISABLE: u32 = 0x558;

/// Start-up time of the 32 768 Hz RC oscillator. A crystal would take a quarter of a second.
const LFRC_STARTUP: u64 = 600 * MICROSECOND;

/// The clocks' start, RESETREAS, and the debug port's protection.
#[derive(Debug)]
pub(crate) struct Clock {
    common: Common,
    /// The instants at which the crystal and the low-frequency clock will have started.
    starts: [Option<u64>; 2],
}

impl Clock {
    pub(crate) fn new() -> Self {
        let registers = [
            // "A field is cleared by writing '1' to it."
            (RESETREAS, 0, Access::ClearOnes),
            // Only the RC oscillator is modelled. The start-up times of the other sources differ.
            (LFCLKSRC, 0, Access::Plain(0..=0)),
            (DISABLE, 0, ANY),
        ];
        let events = [HFCLKSTARTED, LFCLKSTARTED];
        Self {
            common: Common::new("CLOCK/POWER", CLOCK, &events, registers),
            starts: [None; 2],
        }
    }
}

impl Peripheral for Clock {
    fn common(&mut self) -> &mut Common {
        &mut self.common
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        let [crystal, low_frequency] = &mut self.starts;
        match offset {
            HFCLKSTART => *crystal = context.crystal_startup.map(|time| context.now + time),
            LFCLKSTART => *low_frequency = Some(context.now + LFRC_STARTUP),
            // This task has no effect, because the core of the model always wakes without delay.
            CONSTLAT => {}
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        self.starts.into_iter().flatten().min()
    }

    fn advance(&mut self, context: &mut Context) {
        let events = [HFCLKSTARTED, LFCLKSTARTED];
        for (start, event) in self.starts.iter_mut().zip(events) {
            if start.take_if(|at| *at <= context.now).is_some() {
                self.common.raise(event, context);
            }
        }
    }
}
