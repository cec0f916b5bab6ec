//! What is simulated, as options: the numbers from the library's table.

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches, value_parser};
use framelock_simulation::{FrameFormat, Parameters, Payload};

use super::sweep::{self, Sweep};

/// What is simulated: a point, or all points of a sweep.
pub(super) struct Experiment {
    parameters: Parameters,
    pub(super) sweeps: Vec<Sweep>,
}

impl Experiment {
    /// The parameters at every point.
    ///
    /// # Errors
    /// A parameter is out of its range or contradicts another.
    pub(super) fn points(&self) -> anyhow::Result<Vec<Parameters>> {
        sweep::points(self.parameters, &self.sweeps)
    }
}

/// The options in front of the numbers.
#[derive(Args)]
struct First {
    /// Seed of everything random: the same seed gives the same numbers, however many cores there
    /// are
    #[arg(long, default_value_t = Parameters::DEFAULT.seed, value_name = "NUMBER", help_heading = "Run")]
    seed: u64,

    /// The frame format
    #[arg(long, value_enum, default_value_t = FrameFormat::Bin, help_heading = "Sender")]
    frame: FrameFormat,

    /// What is sent: motion, random (other bytes in each frame), repeated (the same in every frame of
    /// a trial), random:40-43 or repeated:40-43 (bytes from 40 to 43, hexadecimal), 00414200 (this
    /// payload), ambiguous (one of the 512 ambiguous payloads, repeated), noise (no frames)
    #[arg(long, default_value_t = Parameters::DEFAULT.payload, value_name = "WHAT", help_heading = "Sender")]
    payload: Payload,
}

/// The options behind them.
#[derive(Args)]
struct Last {
    /// Do not inform the receivers of framing errors and breaks
    #[arg(long, help_heading = "Receivers and failsafe")]
    unreported: bool,

    /// Go through a range: NAME=FROM:TO:STEP, NAME=FROM:TO:xFACTOR or NAME=VALUE,VALUE,... with the
    /// name of any option that is a number, but the seed; once or twice
    #[arg(
        long,
        value_name = "NAME=RANGE",
        help_heading = "Run",
        allow_hyphen_values = true
    )]
    sweep: Vec<Sweep>,
}

impl Args for Experiment {
    fn augment_args(command: Command) -> Command {
        let numbers = Parameters::NUMBERS.iter().map(|number| {
            let default = number.get(&Parameters::DEFAULT);
            let default = default.map_or_else(String::new, |value| format!(" [default: {value}]"));
            Arg::new(number.name)
                .long(number.name)
                .help(format!("{}{default}", number.help.trim_start()))
                .value_name(number.unit)
                .help_heading(number.group)
                .value_parser(value_parser!(f64))
                .allow_negative_numbers(true)
        });
        Last::augment_args(First::augment_args(command).args(numbers))
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Experiment {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let First {
            seed,
            frame,
            payload,
        } = First::from_arg_matches(matches)?;
        let Last {
            unreported,
            sweep: sweeps,
        } = Last::from_arg_matches(matches)?;
        let mut parameters = Parameters {
            seed,
            frame,
            payload,
            unreported,
            ..Parameters::DEFAULT
        };
        for number in Parameters::NUMBERS {
            if let Some(&value) = matches.get_one(number.name) {
                let is_set = number.set(&mut parameters, value);
                is_set.map_err(|error| {
                    clap::Error::raw(ErrorKind::ValueValidation, format!("{error}\n"))
                })?;
            }
        }
        Ok(Self { parameters, sweeps })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
