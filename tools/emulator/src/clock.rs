//! The start of the clocks: nRF52840 Product Specification, section "CLOCK".
//!
//! CLOCK, POWER and APPROTECT share one block of registers and one interrupt, so one struct models them. RESETREAS
//! belongs to POWER, and the debug port's protection is described in "Debug and trace". The model of the low-frequency
//! clock covers only its start. In the model, RTC1 and the watchdog run even if this clock was not started. On silicon,
//! firmware must start this clock for RTC1, but the watchdog starts the clock itself.

use crate::MICROSECOND;
use crate::line::SerialLine;
use crate::nonvolatile::UNPROTECTED;
use crate::peripheral::{Common, Context, Peripheral};

const HFCLKSTART: u32 = 0x000;
const HFCLKSTOP: u32 = 0x004;
const LFCLKSTART: u32 = 0x008;
const LFCLKSTOP: u32 = 0x00C;
const CONSTLAT: u32 = 0x078;
const HFCLKSTARTED: u32 = 0x100;
const LFCLKSTARTED: u32 = 0x104;
const RESETREAS: u32 = 0x400;
const HFCLKRUN: u32 = 0x408;
const HFCLKSTAT: u32 = 0x40C;
const LFCLKSRC: u32 = 0x518;
const FORCEPROTECT: u32 = 0x550;
const DISABLE: u32 = 0x558;

/// Start-up time of the 32 768 Hz RC oscillator. A crystal would take a quarter of a second.
const LFRC_STARTUP: u64 = 600 * MICROSECOND;

/// Bits of RESETREAS: section "POWER".
pub(crate) const RESETREAS_PIN: u32 = 1;
pub(crate) const RESETREAS_WATCHDOG: u32 = 1 << 1;
pub(crate) const RESETREAS_SOFT: u32 = 1 << 2;
pub(crate) const RESETREAS_LOCKUP: u32 = 1 << 3;

/// The high-frequency clock (the RC oscillator until the crystal runs), the low-frequency clock's
/// start, RESETREAS, and the debug port's protection.
#[derive(Clone, Debug, Default)]
pub(crate) struct Clock {
    crystal_requested: bool,
    crystal_runs_at: Option<u64>,
    crystal_runs: bool,
    /// The instant at which the low-frequency clock will have started.
    low_runs_at: Option<u64>,
    /// RESETREAS, in which bits accumulate. It survives every reset except power-on and a brown-out.
    pub(crate) reset_reason: u32,
    /// APPROTECT.DISABLE, and whether FORCEPROTECT overrides it until the next reset.
    protection: u32,
    forces_protection: bool,
}

impl Clock {
    /// Returns whether the firmware has opened the debug port.
    pub(crate) fn opens_debug_port(&self) -> bool {
        self.protection == UNPROTECTED && !self.forces_protection
    }
}

impl Peripheral for Clock {
    fn common(&self) -> Common {
        Common::new("CLOCK/POWER", &[HFCLKSTARTED, LFCLKSTARTED], &[])
    }

    fn read(&mut self, offset: u32, _: &Context) -> Option<u32> {
        Some(match offset {
            RESETREAS => self.reset_reason,
            HFCLKRUN => u32::from(self.crystal_requested),
            // One oscillator always runs. The source is the crystal once it has started.
            HFCLKSTAT => 1 << 16 | u32::from(self.crystal_runs),
            LFCLKSRC => 0,
            FORCEPROTECT if self.forces_protection => 0,
            FORCEPROTECT => u32::MAX,
            DISABLE => self.protection,
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        match offset {
            // "A field is cleared by writing '1' to it."
            RESETREAS => self.reset_reason &= !value,
            // Only the RC oscillator is modelled. The start-up times of the other sources differ.
            LFCLKSRC if value == 0 => {}
            FORCEPROTECT => self.forces_protection |= value == 0,
            DISABLE => self.protection = value,
            _ => return None,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            HFCLKSTART => {
                self.crystal_requested = true;
                self.crystal_runs_at = context.crystal_startup.map(|time| context.now + time);
            }
            HFCLKSTOP => {
                self.crystal_requested = false;
                self.crystal_runs_at = None;
                self.crystal_runs = false;
            }
            LFCLKSTART => self.low_runs_at = Some(context.now + LFRC_STARTUP),
            LFCLKSTOP => self.low_runs_at = None,
            // In the model, the core always wakes without delay.
            CONSTLAT => {}
            _ => return None,
        }
        Some(())
    }

    fn next(&self, _: &SerialLine) -> Option<u64> {
        let starts = [self.crystal_runs_at, self.low_runs_at];
        starts.into_iter().flatten().min()
    }

    fn advance(&mut self, context: &mut Context) {
        let now = context.now;
        let due = |at: &mut u64| *at <= now;
        if self.crystal_runs_at.take_if(due).is_some() {
            self.crystal_runs = true;
            context.raise(HFCLKSTARTED);
        }
        if self.low_runs_at.take_if(due).is_some() {
            context.raise(LFCLKSTARTED);
        }
    }
}
