//! The crystal's start: nRF52840 Product Specification, section "CLOCK".
//!
//! CLOCK and POWER share one block of registers and one interrupt, and so they do here: RESETREAS is
//! POWER's. The low-frequency clock is not modelled: the watchdog starts it by itself.

use crate::peripheral::{Common, Context, Peripheral};
use crate::time::MICROSECOND;

const HFCLKSTART: u32 = 0x000;
const HFCLKSTOP: u32 = 0x004;
const HFCLKSTARTED: u32 = 0x100;
const RESETREAS: u32 = 0x400;
const HFCLKRUN: u32 = 0x408;
const HFCLKSTAT: u32 = 0x40C;

/// HFXO's start-up time: 360 us at most by the section's "64 MHz crystal oscillator (HFXO)".
const HFXO_STARTUP: u64 = 360 * MICROSECOND;

/// Bits of RESETREAS: section "POWER".
pub(crate) const RESETREAS_PIN: u32 = 1;
pub(crate) const RESETREAS_WATCHDOG: u32 = 1 << 1;
pub(crate) const RESETREAS_SOFT: u32 = 1 << 2;

/// The high-frequency oscillators: the one with the crystal, and the RC oscillator until it runs.
#[derive(Clone, Debug)]
pub(crate) struct Clock {
    crystal_requested: bool,
    crystal_runs_at: Option<u64>,
    crystal_runs: bool,
    /// Survives every reset but power-on: the bits of RESETREAS add up.
    pub(crate) reset_reason: u32,
}

impl Clock {
    pub(crate) fn new() -> Self {
        Self {
            crystal_requested: false,
            crystal_runs_at: None,
            crystal_runs: false,
            reset_reason: 0,
        }
    }
}

impl Peripheral for Clock {
    fn common(&self) -> Common {
        Common::new("CLOCK/POWER", &[HFCLKSTARTED], 0)
    }

    fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            RESETREAS => self.reset_reason,
            HFCLKRUN => u32::from(self.crystal_requested),
            // One of them always runs: state running, source by what has started.
            HFCLKSTAT => 1 << 16 | u32::from(self.crystal_runs),
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        // "A field is cleared by writing '1' to it."
        (offset == RESETREAS).then(|| self.reset_reason &= !value)
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            HFCLKSTART => {
                self.crystal_requested = true;
                self.crystal_runs_at = Some(context.now + HFXO_STARTUP);
            }
            HFCLKSTOP => {
                let reset_reason = self.reset_reason;
                *self = Self {
                    reset_reason,
                    ..Self::new()
                };
            }
            _ => return None,
        }
        Some(())
    }

    fn next(&self) -> Option<u64> {
        self.crystal_runs_at
    }

    fn advance(&mut self, context: &mut Context) {
        self.crystal_runs_at = None;
        self.crystal_runs = true;
        context.raise(HFCLKSTARTED);
    }
}
