//! The clocks' start: nRF52840 Product Specification, section "CLOCK".
//!
//! CLOCK and POWER share one block of registers and one interrupt, and so they do here: RESETREAS,
//! DCDCEN and the retained GPREGRET are POWER's.

use crate::peripheral::{Common, Context, Peripheral};

const HFCLKSTART: u32 = 0x000;
const HFCLKSTOP: u32 = 0x004;
const LFCLKSTART: u32 = 0x008;
const LFCLKSTOP: u32 = 0x00C;
const HFCLKSTARTED: u32 = 0x100;
const LFCLKSTARTED: u32 = 0x104;
const RESETREAS: u32 = 0x400;
const HFCLKRUN: u32 = 0x408;
const HFCLKSTAT: u32 = 0x40C;
const LFCLKRUN: u32 = 0x414;
const LFCLKSTAT: u32 = 0x418;
const LFCLKSRC: u32 = 0x518;
const GPREGRET: u32 = 0x51C;
const GPREGRET2: u32 = 0x520;
const DCDCEN: u32 = 0x578;

/// HFXO's start-up time: 360 us at most by the section's "64 MHz crystal oscillator (HFXO)".
const HFXO_STARTUP: u64 = 360 * crate::MICROSECOND;
/// LFRC's start-up time: 600 us by "32.768 kHz RC oscillator (LFRC)". A crystal takes longer, which
/// nothing here waits for.
const LFCLK_STARTUP: u64 = 600 * crate::MICROSECOND;

/// Bits of RESETREAS: section "POWER".
pub(crate) const RESETREAS_PIN: u32 = 1;
pub(crate) const RESETREAS_WATCHDOG: u32 = 1 << 1;
pub(crate) const RESETREAS_SOFT: u32 = 1 << 2;

/// One oscillator.
#[derive(Clone, Copy, Debug, Default)]
struct Oscillator {
    requested: bool,
    runs_at: Option<u64>,
    running: bool,
}

impl Oscillator {
    fn start(&mut self, at: u64) {
        self.requested = true;
        self.runs_at = Some(at);
    }

    fn due(&mut self, now: u64) -> bool {
        let due = self.runs_at.is_some_and(|at| at <= now);
        if due {
            self.runs_at = None;
            self.running = true;
        }
        due
    }
}

#[derive(Clone, Debug)]
pub(crate) struct Clock {
    common: Common,
    high: Oscillator,
    low: Oscillator,
    low_source: u32,
    /// Survives every reset but power-on: the bits of RESETREAS add up.
    pub(crate) reset_reason: u32,
    retained: [u32; 2],
    dcdc: u32,
}

impl Clock {
    pub(crate) fn new() -> Self {
        Self {
            common: Common::new(&[HFCLKSTARTED, LFCLKSTARTED], 0),
            high: Oscillator::default(),
            low: Oscillator::default(),
            low_source: 0,
            reset_reason: 0,
            retained: [0; 2],
            dcdc: 0,
        }
    }

    pub(crate) fn reset(&mut self) {
        self.common.reset();
        self.high = Oscillator::default();
        self.low = Oscillator::default();
        self.low_source = 0;
        self.dcdc = 0;
    }
}

impl Peripheral for Clock {
    fn name(&self) -> &'static str {
        "CLOCK/POWER"
    }

    fn common(&self) -> &Common {
        &self.common
    }

    fn common_mut(&mut self) -> &mut Common {
        &mut self.common
    }

    fn read(&self, offset: u32) -> Option<u32> {
        Some(match offset {
            RESETREAS => self.reset_reason,
            HFCLKRUN => u32::from(self.high.requested),
            // The RC oscillator always runs: state running, source by what has started.
            HFCLKSTAT => 1 << 16 | u32::from(self.high.running),
            LFCLKRUN => u32::from(self.low.requested),
            LFCLKSTAT => u32::from(self.low.running) << 16 | self.low_source,
            LFCLKSRC => self.low_source,
            GPREGRET => self.retained[0],
            GPREGRET2 => self.retained[1],
            DCDCEN => self.dcdc,
            _ => return None,
        })
    }

    fn write(&mut self, offset: u32, value: u32, _: &mut Context) -> Option<()> {
        match offset {
            // "A field is cleared by writing '1' to it."
            RESETREAS => self.reset_reason &= !value,
            LFCLKSRC if value <= 2 => self.low_source = value,
            GPREGRET => self.retained[0] = value & 0xFF,
            GPREGRET2 => self.retained[1] = value & 0xFF,
            DCDCEN if value <= 1 => self.dcdc = value,
            _ => return None,
        }
        Some(())
    }

    fn task(&mut self, offset: u32, context: &mut Context) -> Option<()> {
        match offset {
            HFCLKSTART => self.high.start(context.now + HFXO_STARTUP),
            HFCLKSTOP => self.high = Oscillator::default(),
            LFCLKSTART => self.low.start(context.now + LFCLK_STARTUP),
            LFCLKSTOP => self.low = Oscillator::default(),
            _ => return None,
        }
        Some(())
    }

    fn next(&self) -> Option<u64> {
        [self.high.runs_at, self.low.runs_at]
            .into_iter()
            .flatten()
            .min()
    }

    fn advance(&mut self, context: &mut Context) {
        if self.high.due(context.now) {
            self.common.raise(HFCLKSTARTED, context);
        }
        if self.low.due(context.now) {
            self.common.raise(LFCLKSTARTED, context);
        }
    }
}
