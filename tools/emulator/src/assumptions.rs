//! The model's behaviour where the product specification is silent (mostly in its section "UARTE"), or where chips are
//! reported to differ from it.

/// Behaviour of the chip that is not known for certain. Firmware should work with every choice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(
    clippy::struct_excessive_bools,
    reason = "each is a question of its own"
)]
pub struct Assumptions {
    /// Cycles from the stop bit of a byte until EasyDMA can move the byte to RAM. The specification says that RXDRDY
    /// "is likely to occur before the corresponding data has been transferred to Data RAM", but does not say how long
    /// before.
    pub dma_lag: u64,
    /// Cycles from the instant at which a full transfer's last byte is in RAM until ENDRX.
    pub end_lag: u64,
    /// Number of ENDRX events of full transfers that will still be lost. Each lost event decrements the number, and
    /// resets do not restore it. [`u32::MAX`] means every event.
    pub lost_end: u32,
    /// Cycles from the ENDRX of a full transfer until a second ENDRX for the same transfer; `None` if there is no
    /// second one. The second ENDRX does not come if the firmware reads ERRORSRC or starts another transfer first.
    pub doubled_end: Option<u64>,
    /// Cycles from STARTRX to RXSTARTED. No byte goes to RAM before RXSTARTED.
    pub start_lag: u64,
    /// Number of bytes that the FIFO holds. Zephyr's driver assumes five; the specification does not say.
    pub fifo: usize,
    /// An overrun drops the oldest byte of the FIFO ("previous data is lost"), as in `BabbleSim`'s model. By
    /// default it drops the new byte.
    pub overrun_drops_oldest: bool,
    /// An overrun comes at the start bit of the byte that finds no room. It drops the previous byte, or the oldest byte
    /// with [`Self::overrun_drops_oldest`]. The specification says: "a start bit is received while the previous data
    /// still lies in RXD". By default the overrun comes at the end of the byte.
    pub overrun_at_start_bit: bool,
    /// Any write to ERRORSRC clears all causes, as in `BabbleSim`'s model. By default, writing 1 to a bit clears only
    /// this bit's cause.
    pub any_write_clears: bool,
    /// RXTO also comes with each ENDRX of a full transfer (Zephyr#103578).
    pub causeless_timeout: bool,
    /// Bits from STOPRX to RXTO. The default, 50, is the length of five bytes. The receiver stops after 50 bits, or at
    /// RXTO if RXTO comes later. So if RXTO comes less than 50 bits after STOPRX, the receiver runs on after RXTO.
    pub bits_to_timeout: u64,
    /// A parity bit makes the time from STOPRX to RXTO longer, as in `BabbleSim`'s model, which counts whole
    /// characters.
    pub timeout_counts_parity: bool,
    /// STOPRX is ignored: the receiver runs on, and RXTO does not come.
    pub stop_is_ignored: bool,
    /// FLUSHRX does not raise RXSTARTED, as in `BabbleSim`'s model.
    pub flush_is_silent: bool,
    /// A receiver that STARTRX starts in the middle of a byte drops the byte, as in `BabbleSim`'s model. By default it
    /// mistakes the byte's next low bit for a start bit.
    pub start_drops_byte: bool,
    /// STARTRX during a transfer is ignored, as in `BabbleSim`'s model. By default it is an error.
    pub start_twice_is_ignored: bool,
    /// SEQSTART immediately begins a new period of the PWM. By default the new period begins at the end of the current
    /// one.
    pub start_cuts_period: bool,
    /// Cycles of each instruction and of each entry into an exception, in per cent of the default cycles, at least 100.
    /// Models wait states of flash without the instruction cache (section "NVMC"). Does not lengthen sleep.
    pub slowness: u32,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            dma_lag: 32,
            end_lag: 0,
            lost_end: 0,
            doubled_end: None,
            start_lag: 0,
            fifo: 6,
            overrun_drops_oldest: false,
            overrun_at_start_bit: false,
            any_write_clears: false,
            causeless_timeout: false,
            bits_to_timeout: 50,
            timeout_counts_parity: false,
            stop_is_ignored: false,
            flush_is_silent: false,
            start_drops_byte: false,
            start_twice_is_ignored: false,
            start_cuts_period: false,
            slowness: 100,
        }
    }
}

/// The longest lag of EasyDMA, and of RXSTARTED, in the deviations, in cycles. It is less than three tenths of a byte
/// time at 1 Mbaud. EasyDMA's lag on silicon is probably never longer.
const LONGEST_LAG: u64 = 190;
/// The longest lag of ENDRX in the deviations, in cycles. The sum of this lag and [`LONGEST_LAG`] is less than the
/// firmware's `NONE_WAITS_AFTER` at 1 Mbaud, as assumption A1 of theorem 12 requires.
const LONGEST_END_LAG: u64 = 60;

impl Assumptions {
    /// Returns these assumptions with some fields changed by `change`.
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

    /// Returns deviations from the default, each alone and with its name.
    #[must_use]
    pub fn each() -> Vec<(&'static str, Self)> {
        let deviations = DEVIATIONS.into_iter().map(|(name, deviate)| {
            let deviation = Self::default().with(|all| deviate(all, &mut |most| most));
            (name, deviation)
        });
        deviations.collect()
    }

    /// Returns the deviation with this name: see [`Self::each`].
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        let found = Self::each().into_iter().find(|(known, _)| *known == name);
        found.map(|(_, assumptions)| assumptions)
    }

    /// Returns a random mix of deviations. The same seed always gives the same mix. No number deviates further from its
    /// default than in [`Assumptions::each`]. In about a quarter of the mixes an ENDRX is lost, and in about a quarter
    /// STOPRX is ignored.
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
        let mut mix = Self::default();
        for (name, deviate) in DEVIATIONS {
            // These deviations are rarer. A lost ENDRX may also lose bytes, and the other two make other deviations
            // ineffective.
            let rare = ["lost_end", "stop_is_ignored", "oldest_lost_at_start_bit"];
            let is_rare = rare.contains(&name);
            if up_to(if is_rare { 3 } else { 1 }) == 0 {
                deviate(&mut mix, &mut up_to);
            }
        }
        mix
    }
}

/// Changes an assumption. The second argument is a function that returns a number from 0 to a given maximum.
type Deviate = fn(&mut Assumptions, &mut dyn FnMut(u64) -> u64);

const DEVIATIONS: [(&str, Deviate); 20] = [
    ("dma_lag", |a, up_to| a.dma_lag = up_to(LONGEST_LAG)),
    ("end_lag", |a, up_to| a.end_lag = up_to(LONGEST_END_LAG)),
    ("lost_end", |a, up_to| {
        a.lost_end = 1 + u32::try_from(up_to(2)).expect("a small number");
    }),
    ("doubled_end", |a, up_to| {
        a.doubled_end = Some(up_to(80));
    }),
    ("start_lag", |a, up_to| a.start_lag = up_to(LONGEST_LAG)),
    ("fifo", |a, _| a.fifo = 5),
    ("overrun_drops_oldest", |a, _| a.overrun_drops_oldest = true),
    ("overrun_at_start_bit", |a, _| a.overrun_at_start_bit = true),
    ("oldest_lost_at_start_bit", |a, _| {
        (a.overrun_drops_oldest, a.overrun_at_start_bit) = (true, true);
    }),
    ("any_write_clears", |a, _| a.any_write_clears = true),
    ("causeless_timeout", |a, _| a.causeless_timeout = true),
    ("early_timeout", |a, up_to| {
        a.bits_to_timeout = 49 - up_to(49);
    }),
    ("late_timeout", |a, up_to| {
        a.bits_to_timeout = 51 + up_to(2_000);
    }),
    ("timeout_counts_parity", |a, _| {
        a.timeout_counts_parity = true;
    }),
    ("stop_is_ignored", |a, _| a.stop_is_ignored = true),
    ("flush_is_silent", |a, _| a.flush_is_silent = true),
    ("start_drops_byte", |a, _| a.start_drops_byte = true),
    ("start_twice_is_ignored", |a, _| {
        a.start_twice_is_ignored = true;
    }),
    ("start_cuts_period", |a, _| a.start_cuts_period = true),
    ("slowness", |a, up_to| {
        a.slowness = 100 + u32::try_from(up_to(50)).expect("a small number");
    }),
];
