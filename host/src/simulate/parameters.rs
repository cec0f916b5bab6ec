//! All that determines a simulation.

use anyhow::{bail, ensure};
use serde::{Serialize, Serializer};

use super::payload::Payload;
use super::uart::BITS_PER_BYTE;
use crate::names::FrameName;

/// All that determines what comes out. Times, rates and lengths in the units that users think in.
#[derive(clap::Args, Clone, PartialEq, Debug, Serialize)]
pub(super) struct Parameters {
    /// Seed of everything random: the same seed gives the same numbers, however many cores there
    /// are
    #[arg(long, default_value_t = DEFAULT.seed, value_name = "NUMBER", help_heading = RUN)]
    pub(super) seed: u64,

    /// Runs that know nothing of each other; each begins with receivers at reset
    #[arg(long, default_value_t = DEFAULT.trials, value_name = "NUMBER", help_heading = RUN)]
    pub(super) trials: u32,

    /// Frames sent in each trial
    #[arg(long, default_value_t = DEFAULT.frames, value_name = "NUMBER", help_heading = RUN)]
    pub(super) frames: u32,

    /// The frame format
    #[arg(long, value_enum, default_value_t = DEFAULT.frame, help_heading = SENDER)]
    #[serde(serialize_with = "by_its_name")]
    pub(super) frame: FrameName,

    /// What is sent: motion, random (other bytes in each frame), repeated (the same in every frame of
    /// a trial), random:40-43 or repeated:40-43 (bytes from 40 to 43, hexadecimal), 00414200 (this
    /// payload), ambiguous (one of the 512 ambiguous payloads, repeated), noise (no frames)
    #[arg(long, default_value_t = DEFAULT.payload, value_name = "WHAT", help_heading = SENDER)]
    pub(super) payload: Payload,

    /// Bits in a second on the line, ten for each byte
    #[arg(long, default_value_t = DEFAULT.baud, value_name = "NUMBER", help_heading = SENDER)]
    pub(super) baud: u32,

    /// Frames in a second
    #[arg(long, default_value_t = DEFAULT.rate, value_name = "NUMBER", help_heading = SENDER)]
    pub(super) rate: f64,

    /// Idle bits between the bytes of a frame
    #[arg(long, default_value_t = DEFAULT.byte_gap, value_name = "BITS", help_heading = SENDER)]
    pub(super) byte_gap: u32,

    /// By how much the sender's clock is faster than the receiver's
    #[arg(long, default_value_t = DEFAULT.baud_error, value_name = "PERCENT", help_heading = LINE, allow_negative_numbers = true)]
    pub(super) baud_error: f64,

    /// Probability that a bit on the line is inverted, 0 to 1; idle bits too
    #[arg(long, default_value_t = DEFAULT.bit_flip, value_name = "PROBABILITY", help_heading = LINE)]
    pub(super) bit_flip: f64,

    /// Bursts of noise in a second, in which each half bit is high or low at random
    #[arg(long, default_value_t = DEFAULT.burst_rate, value_name = "NUMBER", help_heading = LINE)]
    pub(super) burst_rate: f64,

    /// How long a burst lasts
    #[arg(long, default_value_t = DEFAULT.burst_length, value_name = "MILLISECONDS", help_heading = LINE)]
    pub(super) burst_length: f64,

    /// One burst in each trial at this time; those at random come behind it
    #[arg(long, value_name = "SECONDS", help_heading = LINE)]
    pub(super) burst_at: Option<f64>,

    /// Breaks in a second: the line is held low
    #[arg(long, default_value_t = DEFAULT.break_rate, value_name = "NUMBER", help_heading = LINE)]
    pub(super) break_rate: f64,

    /// How long a break lasts
    #[arg(long, default_value_t = DEFAULT.break_length, value_name = "BITS", help_heading = LINE)]
    pub(super) break_length: u32,

    /// Probability that a byte is lost behind the UART and nobody is told, 0 to 1
    #[arg(long, default_value_t = DEFAULT.lose, value_name = "PROBABILITY", help_heading = LINE)]
    pub(super) lose: f64,

    /// Probability that a byte is delivered twice, 0 to 1
    #[arg(long, default_value_t = DEFAULT.duplicate, value_name = "PROBABILITY", help_heading = LINE)]
    pub(super) duplicate: f64,

    /// Lose one byte in each trial, at a random place of this frame, counted from 0
    #[arg(long, value_name = "FRAME", help_heading = LINE)]
    pub(super) lose_one_in: Option<u32>,

    /// Do not tell the receivers of framing errors and breaks
    #[arg(long, help_heading = RECEIVER)]
    pub(super) unreported: bool,

    /// Byte times without a byte after which the receivers with an idle-gap rule drop the frame
    /// under way
    #[arg(long, default_value_t = DEFAULT.idle_gap, value_name = "BYTES", help_heading = RECEIVER)]
    pub(super) idle_gap: u32,

    /// Silence after which the failsafe holds the output
    #[arg(long, default_value_t = DEFAULT.hold_after, value_name = "MILLISECONDS", help_heading = RECEIVER)]
    pub(super) hold_after: f64,

    /// Silence after which it moves the output to park, the middle of each axis
    #[arg(long, default_value_t = DEFAULT.ramp_after, value_name = "MILLISECONDS", help_heading = RECEIVER)]
    pub(super) ramp_after: f64,

    /// How long it takes from one end of an axis to the other
    #[arg(long, default_value_t = DEFAULT.full_travel, value_name = "MILLISECONDS", help_heading = RECEIVER)]
    pub(super) full_travel: f64,
}

const RUN: &str = "Run";
const SENDER: &str = "Sender";
const LINE: &str = "Line";
const RECEIVER: &str = "Receivers and failsafe";

/// A line without faults; the failsafe as the firmware has it.
pub(super) const DEFAULT: Parameters = Parameters {
    seed: 1,
    trials: 32,
    frames: 1_000,
    frame: FrameName::Bin,
    payload: Payload::Motion,
    baud: 115_200,
    rate: 50.0,
    byte_gap: 0,
    baud_error: 0.0,
    bit_flip: 0.0,
    burst_rate: 0.0,
    burst_length: 5.0,
    burst_at: None,
    break_rate: 0.0,
    break_length: 20,
    lose: 0.0,
    duplicate: 0.0,
    lose_one_in: None,
    unreported: false,
    idle_gap: 20,
    hold_after: 100.0,
    ramp_after: 500.0,
    full_travel: 1_000.0,
};

impl Default for Parameters {
    fn default() -> Self {
        DEFAULT
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde wants it so")]
fn by_its_name<S: Serializer>(frame: &FrameName, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(frame_name(*frame))
}

/// As the command line names it.
pub(super) fn frame_name(frame: FrameName) -> &'static str {
    match frame {
        FrameName::Bin => "bin",
        FrameName::BinCrc8 => "bin-crc8",
    }
}

/// A parameter that is a number: what a sweep can go through.
pub(super) struct Number {
    /// The option, without its two dashes.
    pub(super) name: &'static str,
    least: f64,
    most: f64,
    is_whole: bool,
    get: fn(&Parameters) -> Option<f64>,
    set: fn(&mut Parameters, f64),
}

macro_rules! number {
    (f64 $name:literal, $field:ident, $least:expr, $most:expr) => {
        Number {
            name: $name,
            least: $least,
            most: $most,
            is_whole: false,
            get: |parameters| Some(parameters.$field),
            set: |parameters, value| parameters.$field = value,
        }
    };
    (u32 $name:literal, $field:ident, $least:expr, $most:expr) => {
        Number {
            is_whole: true,
            get: |parameters| Some(f64::from(parameters.$field)),
            set: |parameters, value| parameters.$field = to_whole(value),
            ..number!(f64 $name, rate, $least, $most)
        }
    };
}

/// Every number but the seed.
pub(super) const NUMBERS: [Number; 19] = [
    number!(u32 "trials", trials, 1.0, 1e9),
    number!(u32 "frames", frames, 1.0, 1e9),
    number!(u32 "baud", baud, 300.0, 1e7),
    number!(f64 "rate", rate, 0.01, 1e5),
    number!(u32 "byte-gap", byte_gap, 0.0, 1e6),
    number!(f64 "baud-error", baud_error, -50.0, 50.0),
    number!(f64 "bit-flip", bit_flip, 0.0, 1.0),
    number!(f64 "burst-rate", burst_rate, 0.0, 1e6),
    number!(f64 "burst-length", burst_length, 0.1, 1e6),
    Number {
        get: |parameters| parameters.burst_at,
        set: |parameters, value| parameters.burst_at = Some(value),
        ..number!(f64 "burst-at", rate, 0.0, 1e6)
    },
    number!(f64 "break-rate", break_rate, 0.0, 1e6),
    number!(u32 "break-length", break_length, 1.0, 1e6),
    number!(f64 "lose", lose, 0.0, 1.0),
    number!(f64 "duplicate", duplicate, 0.0, 1.0),
    Number {
        get: |parameters| parameters.lose_one_in.map(f64::from),
        set: |parameters, value| parameters.lose_one_in = Some(to_whole(value)),
        ..number!(u32 "lose-one-in", frames, 0.0, 1e9)
    },
    number!(u32 "idle-gap", idle_gap, 1.0, 1e6),
    number!(f64 "hold-after", hold_after, 0.001, 1e6),
    number!(f64 "ramp-after", ramp_after, 0.001, 1e6),
    number!(f64 "full-travel", full_travel, 1.0, 1e6),
];

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "its range is checked, and a cast saturates"
)]
fn to_whole(value: f64) -> u32 {
    value as u32
}

impl Number {
    /// Its value, if it has one.
    pub(super) fn get(&self, parameters: &Parameters) -> Option<f64> {
        (self.get)(parameters)
    }

    /// Sets it.
    ///
    /// # Errors
    /// If the value is out of its range.
    pub(super) fn set(&self, parameters: &mut Parameters, value: f64) -> anyhow::Result<()> {
        self.check(value)?;
        (self.set)(parameters, value);
        Ok(())
    }

    fn check(&self, value: f64) -> anyhow::Result<()> {
        let &Self {
            name, least, most, ..
        } = self;
        if !(least..=most).contains(&value) {
            bail!("--{name} is {value}: a number from {least} to {most} is wanted");
        }
        if self.is_whole && value.fract() != 0.0 {
            bail!("--{name} is {value}: a whole number is wanted");
        }
        Ok(())
    }
}

impl Parameters {
    /// Bytes in a frame.
    pub(super) fn frame_length(&self) -> u32 {
        match self.frame {
            FrameName::Bin => 7,
            FrameName::BinCrc8 => 8,
        }
    }

    /// Bits from the first of a frame to its last.
    fn frame_bits(&self) -> f64 {
        let length = f64::from(self.frame_length());
        #[expect(clippy::cast_precision_loss, reason = "10")]
        let byte = BITS_PER_BYTE as f64;
        length * byte + (length - 1.0) * f64::from(self.byte_gap)
    }

    /// # Errors
    /// If a number is out of its range, or two contradict each other.
    pub(super) fn check(&self) -> anyhow::Result<()> {
        for number in &NUMBERS {
            if let Some(value) = number.get(self) {
                number.check(value)?;
            }
        }
        let (needed, baud) = (self.frame_bits() * self.rate, f64::from(self.baud));
        ensure!(
            needed <= baud,
            "{} frames of {} bytes in a second need {} baud: raise --baud from {baud}, or lower \
             --rate to {} at most",
            self.rate,
            self.frame_length(),
            needed.ceil(),
            (baud / self.frame_bits() * 1000.0).floor() / 1000.0
        );
        ensure!(
            self.ramp_after >= self.hold_after,
            "--ramp-after is {} ms, less than --hold-after, {} ms: raise the one or lower the other",
            self.ramp_after,
            self.hold_after
        );
        if let Some(frame) = self.lose_one_in {
            ensure!(
                frame < self.frames,
                "--lose-one-in is {frame}, but the last of {} frames is {}: raise --frames",
                self.frames,
                self.frames - 1
            );
        }
        Ok(())
    }
}
