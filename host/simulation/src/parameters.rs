//! The parameters of a simulation. Together, they determine the simulation's results completely.

use std::ops::RangeInclusive;

use anyhow::{Context, Result, ensure};
use framelock_receiving::FrameFormat;
use serde::Serialize;

use crate::line::check_rate;
use crate::payload::Payload;

/// A numeric parameter, with all that a program needs to offer it as an option or to sweep it.
#[derive(Debug)]
pub struct NumericParameter {
    /// The parameter's name, with hyphens between words.
    pub name: &'static str,
    /// The parameter's help text.
    pub help: &'static str,
    /// The parameter's unit, as the help names it.
    pub unit: &'static str,
    /// The heading of the help under which the parameter is listed.
    pub group: &'static str,
    range: RangeInclusive<f64>,
    get: fn(&Parameters) -> Option<f64>,
    set: fn(&mut Parameters, f64),
}

impl NumericParameter {
    /// Returns the parameter's value, if it has one.
    #[must_use]
    pub fn get(&self, parameters: &Parameters) -> Option<f64> {
        (self.get)(parameters)
    }

    /// Sets the parameter.
    ///
    /// # Errors
    /// Returns an error if the value is out of its range or not a whole number where one is required.
    pub fn set(&self, parameters: &mut Parameters, value: f64) -> Result<()> {
        self.check(value)?;
        (self.set)(parameters, value);
        let (name, is_set) = (self.name, self.get(parameters) == Some(value));
        ensure!(is_set, "--{name} is {value}: expected a whole number");
        Ok(())
    }

    /// Parses a value of this parameter.
    ///
    /// # Errors
    /// Returns an error if the text is not a number, or the number is out of the parameter's range.
    pub fn parse(&self, text: &str) -> Result<f64> {
        let (least, most) = (self.range.start(), self.range.end());
        let example = self.get(&Parameters::DEFAULT).unwrap_or(*least);
        let wanted = || format!("expected a number from {least} to {most}, such as {example}");
        let value = text.parse().ok().with_context(wanted)?;
        self.set(&mut { Parameters::DEFAULT }, value)?;
        Ok(value)
    }

    fn check(&self, value: f64) -> Result<()> {
        let (name, least, most) = (self.name, self.range.start(), self.range.end());
        ensure!(
            self.range.contains(&value),
            "--{name} is {value}: expected a number from {least} to {most}"
        );
        Ok(())
    }
}

/// Makes the struct `Parameters`, its default and the table of numeric parameters from one list.
macro_rules! parameters {
    ($($group:literal {$(
        $(#[doc = $help:literal])+
        $field:ident: $type:ty = $default:expr, $name:literal $unit:literal $number:ident $least:literal to $most:literal;
    )+})+) => {
        /// All parameters of a simulation. Together, they determine the simulation's results completely. Times, rates
        /// and lengths are in the units that users think in.
        #[derive(Clone, Copy, PartialEq, Debug, Serialize)]
        pub struct Parameters {
            /// Seed of all random numbers: the same seed gives the same results
            pub seed: u64,
            /// The frame format
            pub frame: FrameFormat,
            /// The payload that the sender sends
            pub payload: Payload,
            /// Receivers are not informed of framing errors and breaks
            pub unreported: bool,
            $($($(#[doc = $help])+ pub $field: $type,)+)+
        }

        impl Parameters {
            /// A line without faults, with the failsafe parameters of the firmware.
            pub const DEFAULT: Self = Self {
                seed: 1,
                frame: FrameFormat::Bin,
                payload: Payload::Motion,
                unreported: false,
                $($($field: $default,)+)+
            };

            /// Every numeric parameter except the seed.
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "all are within their ranges"
            )]
            pub const NUMBERS: &[NumericParameter] = &[$($(NumericParameter {
                name: $name,
                help: concat!($($help),+),
                unit: $unit,
                group: $group,
                range: $least..=$most,
                get: |parameters| Option::<$number>::from(parameters.$field).map(f64::from),
                set: |parameters, value| parameters.$field = (value as $number).into(),
            },)+)+];
        }
    };
}

parameters! {
    "Run" {
        /// Independent runs, each beginning at reset
        trials: u32 = 32, "trials" "NUMBER" u32 1.0 to 1e9;
        /// Frames sent in each trial
        frames: u32 = 1_000, "frames" "NUMBER" u32 1.0 to 1e9;
    }
    "Sender" {
        /// Bits per second, ten for each byte
        baud: u32 = 115_200, "baud" "NUMBER" u32 300.0 to 1e7;
        /// Frames per second
        rate: f64 = 50.0, "rate" "NUMBER" f64 0.01 to 1e5;
    }
    "Line" {
        /// Share of bytes lost without a report
        lose: f64 = 0.0, "lose" "SHARE" f64 0.0 to 1.0;
        /// Lose one byte of this frame in each trial
        lose_one_in: Option<u32> = None, "lose-one-in" "FRAME" u32 0.0 to 1e9;
        /// Share of bits inverted
        bit_flip: f64 = 0.0, "bit-flip" "SHARE" f64 0.0 to 1.0;
        /// How much faster the sender's clock is than the receiver's
        baud_error: f64 = 0.0, "baud-error" "PERCENT" f64 -50.0 to 50.0;
        /// Bursts of noise per second
        burst_rate: f64 = 0.0, "burst-rate" "NUMBER" f64 0.0 to 1e6;
        /// Length of a burst
        burst_length: f64 = 5.0, "burst-length" "MS" f64 0.1 to 1e6;
    }
    "Receivers and failsafe" {
        /// Silence in byte times after which receivers with an idle-gap rule drop the current frame
        idle_gap: u32 = 20, "idle-gap" "BYTES" u32 1.0 to 1e6;
        /// Silence after which the failsafe holds
        hold_after: f64 = 100.0, "hold-after" "MS" f64 0.001 to 1e6;
        /// Silence after which the failsafe moves to park
        ramp_after: f64 = 500.0, "ramp-after" "MS" f64 0.001 to 1e6;
    }
    "Rarely used" {
        /// Time that an axis takes from one end to the other
        full_travel: f64 = 1_000.0, "full-travel" "MS" f64 1.0 to 1e6;
        /// Idle bits between the bytes of a frame
        byte_gap: u32 = 0, "byte-gap" "BITS" u32 0.0 to 1e6;
        /// Share of bytes that arrive twice
        duplicate: f64 = 0.0, "duplicate" "SHARE" f64 0.0 to 1.0;
        /// Time of the first burst; random ones follow
        burst_at: Option<f64> = None, "burst-at" "SECONDS" f64 0.0 to 1e6;
        /// Breaks (the line held low) per second
        break_rate: f64 = 0.0, "break-rate" "NUMBER" f64 0.0 to 1e6;
        /// Length of a break
        break_length: u32 = 20, "break-length" "BITS" u32 1.0 to 1e6;
    }
}

impl Parameters {
    /// Checks each parameter and the relations between them. Errors name parameters as the command
    /// line names its options.
    ///
    /// # Errors
    /// Returns an error if a number is out of its range, or two parameters contradict each other.
    pub fn check(&self) -> Result<()> {
        for number in Self::NUMBERS {
            if let Some(value) = number.get(self) {
                number.check(value)?;
            }
        }
        let length = self.frame.length();
        check_rate(self.rate, length, self.byte_gap, self.baud, 1e3)?;
        ensure!(
            self.ramp_after >= self.hold_after,
            "--ramp-after is {} ms, less than --hold-after, {} ms: raise --ramp-after or lower --hold-after",
            self.ramp_after,
            self.hold_after
        );
        ensure!(
            self.lose_one_in.is_none_or(|frame| frame < self.frames),
            "--lose-one-in is {}, but the last of {} frames is {}: raise --frames",
            self.lose_one_in.unwrap_or_default(),
            self.frames,
            self.frames - 1
        );
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn each_number_is_set_alone_and_within_its_range() {
        for number in Parameters::NUMBERS {
            let mut parameters = Parameters::DEFAULT;
            let (least, most) = (*number.range.start(), *number.range.end());
            for value in [least, most] {
                number.set(&mut parameters, value).unwrap();
                assert_eq!(number.get(&parameters), Some(value), "{}", number.name);
            }
            for other in Parameters::NUMBERS
                .iter()
                .filter(|other| other.name != number.name)
            {
                assert_eq!(other.get(&parameters), other.get(&Parameters::DEFAULT));
            }
            for value in [least - 1.0, most + 1.0, f64::NAN] {
                let complaint = number.set(&mut parameters, value).unwrap_err().to_string();
                assert!(complaint.starts_with(&format!("--{} is ", number.name)));
            }
        }
        let trials = Parameters::NUMBERS
            .iter()
            .find(|number| number.name == "trials");
        let mut parameters = Parameters::DEFAULT;
        let complaint = trials.unwrap().set(&mut parameters, 1.5);
        let complaint = complaint.unwrap_err().to_string();
        assert_eq!(complaint, "--trials is 1.5: expected a whole number");
        Parameters::DEFAULT.check().unwrap();
    }
}
