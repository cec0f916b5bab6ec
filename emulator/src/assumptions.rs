//! Where the product specification (section "UARTE") is silent, or chips are said to differ from it:
//! what the model does.

/// What is not known for certain about the chip. Firmware should work either way.
///
/// What is lost is a count of how often it is lost from now on, resets included; [`u32::MAX`] means
/// every time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a question of its own"
)]
pub struct Assumptions {
    /// Cycles from the end of a byte until it is in RAM. RXDRDY "is likely to occur before the
    /// corresponding data has been transferred to Data RAM": by how much is not said.
    pub dma_lag: u64,
    /// Cycles from the end of a byte until its RXDRDY, which comes before the next byte in any case.
    /// From `dma_lag` on, unless both are 0, RXDRDY comes after the byte is stored and, if the
    /// transfer is full, after its ENDRX. The specification only says "likely"; Renode's model
    /// raises ENDRX first.
    pub ready_lag: u64,
    /// RXDRDY comes when a byte reaches the head of the FIFO, not when it enters it (Zephyr#27233).
    pub ready_at_head: bool,
    /// RXDRDY comes for a byte with a framing error too, which is not stored. The specification does
    /// not say.
    pub ready_on_framing_error: bool,
    /// RXDRDY comes for a byte that is lost to an overrun. The specification does not say.
    pub ready_on_overrun: bool,
    /// How many RXTO do not come, though the receiver stops (Zephyr#31266: after an error).
    pub lost_timeout: u32,
    /// RXTO comes with each ENDRX though nobody has stopped the receiver (Zephyr#103578: "may occur
    /// on all platforms").
    pub spurious_timeout: bool,
    /// How many ENDRX of FLUSHRX do not come (Zephyr#31266).
    pub lost_flush_end: u32,
    /// FLUSHRX gives no ENDRX when the FIFO is empty. The specification says it does; drivers do not
    /// all wait for it.
    pub lost_empty_flush_end: bool,
    /// RXD.AMOUNT keeps its value when STOPRX ends a transfer that stored nothing, as it does when
    /// FLUSHRX finds nothing (nrfx's driver works around the latter).
    pub stale_amount: bool,
    /// Cycles from FLUSHRX until its bytes are in RAM and ENDRX comes. The specification names none.
    pub slow_flush: u64,
    /// STOPRX ends the transfer at once. What is received until RXTO stays in the FIFO, where
    /// FLUSHRX finds it. The specification has ENDRX "before the RXTO event", not how long before.
    pub early_end: bool,
    /// Bytes in the FIFO: Zephyr's driver reckons with five, the specification does not say.
    pub fifo: usize,
    /// Cycles of each instruction in per cent of the model's own, at least 100: flash without the
    /// instruction cache has wait states (section "NVMC"). Sleep is not stretched.
    pub slowness: u32,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            dma_lag: 32,
            ready_lag: 0,
            ready_at_head: false,
            ready_on_framing_error: false,
            ready_on_overrun: false,
            lost_timeout: 0,
            spurious_timeout: false,
            lost_flush_end: 0,
            lost_empty_flush_end: false,
            stale_amount: false,
            slow_flush: 0,
            early_end: false,
            fifo: 6,
            slowness: 100,
        }
    }
}

/// A byte is in RAM before the next at 1 Mbaud is over: EasyDMA is not believed to be slower.
const LONGEST_LAG: u64 = 600;
/// Until just before the next byte at 1 Mbaud.
const LATEST_READY: u64 = 639;

impl Assumptions {
    /// Every deviation from the default alone, with its name.
    #[must_use]
    pub fn each() -> Vec<(&'static str, Self)> {
        let change = |name, change: fn(&mut Self)| {
            let mut assumptions = Self::default();
            change(&mut assumptions);
            (name, assumptions)
        };
        vec![
            change("dma_lag", |a| a.dma_lag = LONGEST_LAG),
            change("end_before_ready", |a| a.ready_lag = a.dma_lag),
            change("ready_lag", |a| a.ready_lag = LATEST_READY),
            change("ready_at_head", |a| a.ready_at_head = true),
            change("ready_on_framing_error", |a| {
                a.ready_on_framing_error = true;
            }),
            change("ready_on_overrun", |a| a.ready_on_overrun = true),
            change("lost_timeout", |a| a.lost_timeout = 1),
            change("lost_timeout_always", |a| a.lost_timeout = u32::MAX),
            change("spurious_timeout", |a| a.spurious_timeout = true),
            change("lost_flush_end", |a| a.lost_flush_end = 1),
            change("lost_flush_end_always", |a| a.lost_flush_end = u32::MAX),
            change("lost_empty_flush_end", |a| a.lost_empty_flush_end = true),
            change("stale_amount", |a| a.stale_amount = true),
            change("slow_flush", |a| a.slow_flush = LONGEST_LAG),
            change("early_end", |a| a.early_end = true),
            change("fifo", |a| a.fifo = 5),
            change("slowness", |a| a.slowness = 150),
        ]
    }

    /// A mix of all, the same for the same seed: lags up to those of [`Assumptions::each`], at most
    /// three losses of a kind, a core slower by at most a half.
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
        // Every second lag is short, so that both orders of RXDRDY and ENDRX are common.
        let longest_lag = if up_to(1) == 1 { 64 } else { LONGEST_LAG };
        let mut few = |most| u32::try_from(up_to(most)).unwrap_or_default();
        let (lost_timeout, lost_flush_end, slower) = (few(3), few(3), few(50));
        Self {
            dma_lag: up_to(longest_lag),
            ready_lag: up_to(1) * up_to(LATEST_READY),
            ready_at_head: up_to(1) == 1,
            ready_on_framing_error: up_to(1) == 1,
            ready_on_overrun: up_to(1) == 1,
            lost_timeout,
            spurious_timeout: up_to(1) == 1,
            lost_flush_end,
            lost_empty_flush_end: up_to(1) == 1,
            stale_amount: up_to(1) == 1,
            slow_flush: up_to(LONGEST_LAG),
            early_end: up_to(1) == 1,
            fifo: 5 + usize::from(up_to(1) == 1),
            slowness: 100 + slower,
        }
    }
}
