//! What is simulated, as options: the numbers from the library's table.

use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use framelock_simulation::{FrameFormat, Parameters, Payload};

use super::sweep::{self, Sweep};

/// What is simulated: a point, or all points of a sweep.
pub(super) struct Experiment {
    parameters: Parameters,
    pub(super) sweeps: Vec<Sweep>,
}

impl Experiment {
    /// The parameters at every point.
    pub(super) fn points(&self) -> anyhow::Result<Vec<Parameters>> {
        sweep::points(self.parameters, &self.sweeps)
    }
}

/// The options that are no numbers.
#[derive(Args)]
struct Others {
    /// The same seed gives the same numbers
    #[arg(long, default_value_t = Parameters::DEFAULT.seed, value_name = "NUMBER", value_parser = whole::<u64>, help_heading = "Run")]
    seed: u64,

    /// Run over a range of any numeric option, once or twice: lose=0:0.1:0.02 (from, to, step),
    /// bit-flip=1e-6:1e-3:x10 (factor), rate=25,50
    #[arg(
        long,
        value_name = "NAME=RANGE",
        help_heading = "Run",
        allow_hyphen_values = true
    )]
    sweep: Vec<Sweep>,

    /// The frame: bin or bin-crc8
    #[arg(
        long,
        value_enum,
        default_value_t = FrameFormat::Bin,
        hide_possible_values = true,
        help_heading = "Sender"
    )]
    frame: FrameFormat,

    /// What is sent: motion, random (other bytes in each frame), repeated (the same in each),
    /// random:40-43 or repeated:40-43 (of these bytes), 00414200 (this payload), ambiguous (N2 of
    /// docs/protocol.md) or noise (no frames)
    #[arg(long, default_value_t = Parameters::DEFAULT.payload, value_name = "WHAT", help_heading = "Sender")]
    payload: Payload,

    /// Receivers hear nothing of framing errors and breaks
    #[arg(long, help_heading = "Line", display_order = 100)]
    unreported: bool,
}

/// A whole number as an option has it.
fn whole<T: FromStr>(text: &str) -> Result<T, &'static str> {
    text.parse()
        .map_err(|_| "a whole number is wanted, such as 7")
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
                .value_parser(|text: &str| number.parse(text))
                .allow_negative_numbers(true)
        });
        Others::augment_args(command).args(numbers)
    }

    fn augment_args_for_update(command: Command) -> Command {
        Self::augment_args(command)
    }
}

impl FromArgMatches for Experiment {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let others = Others::from_arg_matches(matches)?;
        let mut parameters = Parameters {
            seed: others.seed,
            frame: others.frame,
            payload: others.payload,
            unreported: others.unreported,
            ..Parameters::DEFAULT
        };
        for number in Parameters::NUMBERS {
            if let Some(&value) = matches.get_one::<f64>(number.name) {
                let is_set = number.set(&mut parameters, value);
                is_set.map_err(|error| {
                    clap::Error::raw(ErrorKind::ValueValidation, format!("{error}\n"))
                })?;
            }
        }
        Ok(Self {
            parameters,
            sweeps: others.sweep,
        })
    }

    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}
