//! The options of the simulation. The numeric options come from the library's table.

use std::str::FromStr;

use clap::error::ErrorKind;
use clap::{Arg, ArgMatches, Args, Command, FromArgMatches};
use framelock_simulation::{FrameFormat, Parameters, Payload};

use super::sweep::{self, Sweep};

/// The parameters of a simulation, or of all simulations of a sweep.
pub(super) struct Experiment {
    parameters: Parameters,
    pub(super) sweeps: Vec<Sweep>,
}

impl Experiment {
    /// Returns the parameters of every point.
    pub(super) fn points(&self) -> anyhow::Result<Vec<Parameters>> {
        sweep::points(self.parameters, &self.sweeps)
    }
}

/// The options that are not in the library's table.
#[derive(Args)]
struct Others {
    /// Seed the random numbers; the same seed gives the same results
    #[arg(long, default_value_t = Parameters::DEFAULT.seed, value_name = "NUMBER", value_parser = whole::<u64>, help_heading = "Run")]
    seed: u64,

    /// Vary any numeric option over a range: lose=0:0.1:0.02 (from, to, step),
    /// bit-flip=1e-6:1e-3:x10 (from, to, factor) or rate=25,50 (a list). May be given twice
    #[arg(
        long,
        value_name = "NAME=RANGE",
        help_heading = "Run",
        allow_hyphen_values = true
    )]
    sweep: Vec<Sweep>,

    /// Send these frames: bin or bin-crc8
    #[arg(
        long,
        value_enum,
        default_value_t = FrameFormat::Bin,
        hide_possible_values = true,
        help_heading = "Sender"
    )]
    frame: FrameFormat,

    /// Send this payload: motion, random (different bytes in each frame), repeated (the same bytes in
    /// each frame), random:40-43 or repeated:40-43 (only these byte values), 00414200 (this payload),
    /// ambiguous (N2 of docs/protocol.md) or noise (no frames)
    #[arg(long, default_value_t = Parameters::DEFAULT.payload, value_name = "WHAT", help_heading = "Sender")]
    payload: Payload,

    /// Do not report framing errors and breaks to the receivers
    #[arg(long, help_heading = "Line", display_order = 100)]
    unreported: bool,
}

/// Parses a whole number.
fn whole<T: FromStr>(text: &str) -> Result<T, &'static str> {
    text.parse()
        .map_err(|_| "expected a whole number, such as 7")
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
