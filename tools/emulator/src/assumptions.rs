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
pub struct Assumptions {
    /// Cycles from the end of a byte until it is in RAM. The specification says that RXDRDY "is likely to occur before
    /// the corresponding data has been transferred to Data RAM", but does not say how long before.
    pub dma_lag: u64,
    /// Number of ENDRX events of full transfers that are lost.
    pub lost_end: u32,
    /// Number of ENDRX events of full transfers that come twice. The second one does not come if the firmware has read
    /// ERRORSRC or started another transfer since the first one.
    pub doubled_end: u32,
    /// Cycles from an ENDRX until its repetition.
    pub double_lag: u64,
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
    /// Cycles of each instruction, in per cent of its default cycles, at least 100. Models wait states of flash without
    /// the instruction cache (section "NVMC"). Does not lengthen sleep.
    pub slowness: u32,
}

impl Default for Assumptions {
    fn default() -> Self {
        Self {
            dma_lag: 32,
            lost_end: 0,
            doubled_end: 0,
            double_lag: 0,
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
            slowness: 100,
        }
    }
}

/// The longest lag of EasyDMA, in cycles: less than three tenths of a byte time at 1 Mbaud. EasyDMA is probably never
/// slower.
const LONGEST_LAG: u64 = 190;

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

    /// Returns deviations from the default, each alone and with its name. Leaves out `lost_timeout`.
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

    /// Returns a random mix of all deviations. The same seed always gives the same mix.
    /// Numbers are at most as large as in [`Assumptions::each`]. In a quarter of the mixes an ENDRX is lost, and in another
    /// quarter every RXTO after STOPRX.
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
            // Each lost ENDRX may also lose bytes, so only one mix in four has one.
            let rarity = if name == "lost_end" { 3 } else { 1 };
            if up_to(rarity) == 0 {
                deviate(&mut mix, &mut up_to);
            }
        }
        if up_to(3) == 0 {
            mix.lost_timeout = u32::MAX;
        }
        mix
    }
}

/// Changes an assumption. The argument is a function that returns a number from 0 to its argument.
type Deviate = fn(&mut Assumptions, &mut dyn FnMut(u64) -> u64);

/// All deviations except `lost_timeout`, which only matters if the firmware stops the receiver. The firmware then waits
/// longer before it starts the receiver again.
const DEVIATIONS: [(&str, Deviate); 13] = [
    ("dma_lag", |a, up_to| a.dma_lag = up_to(LONGEST_LAG)),
    ("lost_end", |a, up_to| a.lost_end = few(up_to)),
    ("doubled_end", |a, up_to| {
        (a.doubled_end, a.double_lag) = (u32::MAX, up_to(80));
    }),
    ("start_lag", |a, up_to| a.start_lag = up_to(LONGEST_LAG)),
    ("fifo", |a, _| a.fifo = 5),
    ("overrun_drops_oldest", |a, _| a.overrun_drops_oldest = true),
    ("overrun_at_start_bit", |a, _| a.overrun_at_start_bit = true),
    ("any_write_clears", |a, _| a.any_write_clears = true),
    ("causeless_timeout", |a, _| a.causeless_timeout = true),
    ("start_drops_byte", |a, _| a.start_drops_byte = true),
    ("start_twice_is_ignored", |a, _| {
        a.start_twice_is_ignored = true;
    }),
    ("start_cuts_period", |a, _| a.start_cuts_period = true),
    ("slowness", |a, up_to| {
        a.slowness = 100 + u32::try_from(up_to(50)).expect("a small number");
    }),
];

/// Returns a number of events to lose or to double.
fn few(up_to: &mut dyn FnMut(u64) -> u64) -> u32 {
    1 + u32::try_from(up_to(2)).expect("a small number")
}
