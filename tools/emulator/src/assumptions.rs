//! The model's behaviour where the product specification (section "UARTE") is silent, or where chips are
//! reported to differ from it.

/// Behaviour of the chip that is not known for certain. Firmware should work with every choice.
///
/// A field `lost_…` or `doubled_…` is the number of events that will still be lost or doubled. Each such event
/// decrements the field, and resets do not restore the field's value. [`u32::MAX`] means every event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a question of its own"
)]
#[non_exhaustive]
pub struct Assumptions {
    /// Cycles from the end of a byte until it is in RAM. The specification says that RXDRDY "is likely to occur before
    /// the corresponding data has been transferred to Data RAM", but does not say how long before.
    pub dma_lag: u64,
    /// Cycles from the end of a byte until its RXDRDY, which always comes before the next byte. If this lag is at least
    /// `dma_lag` and not 0, RXDRDY comes after the byte is stored, and after the ENDRX of a full transfer. The
    /// specification says only that RXDRDY is "likely" to come first. Renode's model raises ENDRX first.
    pub ready_lag: u64,
    /// RXDRDY comes when a byte enters the FIFO. By default it comes when the byte reaches the FIFO's
    /// head, as a Nordic engineer says (Zephyr#27233).
    pub ready_at_store: bool,
    /// RXDRDY also comes for a byte with a framing error, which is not stored. The specification does not say whether
    /// RXDRDY comes for such a byte.
    pub ready_on_framing_error: bool,
    /// RXDRDY also comes for a byte that is lost to an overrun. The specification does not say whether RXDRDY comes for
    /// such a byte.
    pub ready_on_overrun: bool,
    /// Number of RXDRDY events that are lost. A trace in Zephyr#49021 lacks one RXDRDY.
    pub lost_ready: u32,
    /// Number of RXDRDY events that come twice.
    pub doubled_ready: u32,
    /// Number of ENDRX events of full transfers that are lost.
    pub lost_end: u32,
    /// Number of ENDRX events of full transfers that come twice.
    pub doubled_end: u32,
    /// Cycles from an ENDRX until its repetition.
    pub double_lag: u64,
    /// The second ENDRX comes even if the firmware has read ERRORSRC or started another transfer since the first ENDRX.
    /// By default the second ENDRX does not come in this case.
    pub doubled_when_open: bool,
    /// Cycles from STARTRX to RXSTARTED, before which no byte goes to RAM.
    pub start_lag: u64,
    /// Number of bytes that the FIFO holds. Zephyr's driver assumes five; the specification does not say.
    pub fifo: usize,
    /// An overrun drops the oldest byte of the FIFO ("previous data is lost"), as in `BabbleSim`'s model. By
    /// default it drops the new byte.
    pub overrun_drops_oldest: bool,
    /// An overrun comes at the start bit of the byte that finds no room, and the previous byte is lost. The
    /// specification says: "a start bit is received while the previous data still lies in RXD". By default the overrun
    /// comes at the end of the byte.
    pub overrun_at_start_bit: bool,
    /// Any write to ERRORSRC clears all causes, as in `BabbleSim`'s model. By default, writing 1 to a bit clears only
    /// this bit's cause.
    pub any_write_clears: bool,
    /// RXTO also comes with each ENDRX (Zephyr#103578).
    pub causeless_timeout: bool,
    /// Number of RXTO events after STOPRX that are lost.
    pub lost_timeout: u32,
    /// STARTRX in the middle of a byte drops the byte, as in `BabbleSim`'s model. By default the receiver mistakes the
    /// byte's next low bit for a start bit.
    pub start_drops_byte: bool,
    /// STARTRX during a transfer is ignored, as in `BabbleSim`'s model. By default it is an error.
    pub start_twice_is_ignored: bool,
    /// SEQSTART immediately begins a new period of the PWM. By default the new period begins at the end of the current
    /// one.
    pub start_cuts_period: bool,
    /// A task that is triggered twice at the same instant acts only once.
    pub twice_is_once: bool,
    /// Cycles of each instruction, in per cent of its default cycles, at least 100. Models wait states of flash without
    /// the instruction cache (section "NVMC"). Does not lengthen sleep.
    pub slowness: u32,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            dma_lag: 32,
            ready_lag: 0,
            ready_at_store: false,
            ready_on_framing_error: false,
            ready_on_overrun: false,
            lost_ready: 0,
            doubled_ready: 0,
            lost_end: 0,
            doubled_end: 0,
            double_lag: 0,
            doubled_when_open: false,
            start_lag: 0,
            fifo: 6,
            overrun_drops_oldest: false,
            overrun_at_start_bit: false,
            any_write_clears: false,
            causeless_timeout: false,
            lost_timeout: 0,
            start_drops_byte: false,
            start_twice_is_ignored: false,
            start_cuts_period: false,
            twice_is_once: false,
            slowness: 100,
        }
    }
}

/// The longest lag of EasyDMA, in cycles: less than three tenths of a byte time at 1 Mbaud. EasyDMA is probably never
/// slower.
const LONGEST_LAG: u64 = 190;
/// The longest lag of RXDRDY, in cycles. With this lag, RXDRDY comes just before the next byte at 1 Mbaud.
const LATEST_READY: u64 = 639;

impl Assumptions {
    /// Returns these assumptions with some fields changed by `change`. Other crates need this function, because they
    /// cannot write a literal of a `non_exhaustive` struct.
    ///
    /// ```
    /// use nrf52840_emulator::Assumptions;
    ///
    /// let small_fifo = Assumptions::default().with(|a| a.fifo = 5);
    /// ```
    #[must_use]
    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }

    /// Returns deviations from the default, each alone and with its name. Leaves out `doubled_when_open` and
    /// `lost_timeout`.
    #[must_use]
    pub fn each() -> Vec<(&'static str, Self)> {
        let change = |name, change: fn(&mut Self)| (name, Self::default().with(change));
        // Two deviations are left out. With `doubled_when_open`, firmware cannot distinguish the second ENDRX from the
        // first one, so the firmware takes a byte that nobody sent. `lost_timeout` only matters if the firmware stops
        // the receiver. The firmware then waits longer before it starts the receiver again.
        vec![
            change("dma_lag", |a| a.dma_lag = LONGEST_LAG),
            change("end_before_ready", |a| a.ready_lag = a.dma_lag),
            change("ready_lag", |a| a.ready_lag = LATEST_READY),
            change("ready_at_store", |a| a.ready_at_store = true),
            change("ready_on_framing_error", |a| {
                a.ready_on_framing_error = true;
            }),
            change("ready_on_overrun", |a| a.ready_on_overrun = true),
            change("lost_ready", |a| a.lost_ready = 1),
            change("doubled_ready", |a| a.doubled_ready = 1),
            change("lost_end", |a| a.lost_end = 1),
            change("doubled_end", |a| {
                (a.doubled_end, a.double_lag) = (u32::MAX, 64);
            }),
            change("start_lag", |a| a.start_lag = LONGEST_LAG),
            change("fifo", |a| a.fifo = 5),
            change("overrun_drops_oldest", |a| a.overrun_drops_oldest = true),
            change("overrun_at_start_bit", |a| a.overrun_at_start_bit = true),
            change("any_write_clears", |a| a.any_write_clears = true),
            change("causeless_timeout", |a| a.causeless_timeout = true),
            change("start_drops_byte", |a| a.start_drops_byte = true),
            change("start_twice_is_ignored", |a| {
                a.start_twice_is_ignored = true;
            }),
            change("start_cuts_period", |a| a.start_cuts_period = true),
            change("twice_is_once", |a| a.twice_is_once = true),
            change("slowness", |a| a.slowness = 150),
        ]
    }

    /// Returns the deviation with this name: see [`Self::each`].
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let found = Self::each().into_iter().find(|(known, _)| *known == name);
        found.map(|(_, assumptions)| assumptions)
    }

    /// Returns a random mix of all deviations except `doubled_when_open`. The same seed always gives the same mix. Lags
    /// are at most as long as in [`Assumptions::each`]. At most three RXDRDY and three ENDRX are lost. In a quarter of
    /// the mixes, every RXTO after STOPRX is lost. Instructions take at most 1.5 times their default cycles.
    #[must_use]
    pub fn mixed(seed: u64) -> Self {
        let mut state = seed;
        let mut up_to = |most: u64| {
            // SplitMix64: Steele, Lea, Flood, 2014.
            state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
            let mut mixed = state;
            mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
            mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
            (mixed ^ mixed >> 31) % (most + 1)
        };
        // In half of the mixes, the lag of EasyDMA is at most 64 cycles, so that both orders of RXDRDY and ENDRX are
        // common.
        let longest_lag = if up_to(1) == 1 { 64 } else { LONGEST_LAG };
        let mut few = |most| u32::try_from(up_to(most)).unwrap_or_default();
        let (lost_ready, doubled_ready, slower) = (few(3), few(3), few(50));
        // Only one mix in four loses an ENDRX, because each lost ENDRX may also lose bytes.
        let lost_end = few(3) / 3 * (1 + few(2));
        let doubled_end = few(1) * u32::MAX;
        Self {
            dma_lag: up_to(longest_lag),
            ready_lag: up_to(1) * up_to(LATEST_READY),
            ready_at_store: up_to(1) == 1,
            ready_on_framing_error: up_to(1) == 1,
            ready_on_overrun: up_to(1) == 1,
            lost_ready,
            doubled_ready,
            lost_end,
            doubled_end,
            double_lag: up_to(80),
            start_lag: up_to(LONGEST_LAG),
            fifo: 5 + usize::from(up_to(1) == 1),
            overrun_drops_oldest: up_to(1) == 1,
            overrun_at_start_bit: up_to(1) == 1,
            any_write_clears: up_to(1) == 1,
            causeless_timeout: up_to(1) == 1,
            lost_timeout: if up_to(3) == 0 { u32::MAX } else { 0 },
            start_drops_byte: up_to(1) == 1,
            start_twice_is_ignored: up_to(1) == 1,
            // If this field were true, a doubled ENDRX could lose a byte.
            doubled_when_open: false,
            start_cuts_period: up_to(1) == 1,
            twice_is_once: up_to(1) == 1,
            slowness: 100 + slower,
        }
    }
}
