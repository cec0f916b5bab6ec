//! The main job without hardware: a simulated motion PC over a faulty line.
//!
//! The simulation runs in virtual time and does not know who looks at it: the live view paces it,
//! the plain lines run through it, and the same seed gives the same numbers under both.

mod bytes;
mod live;
mod plain;
mod recent;
mod script;
mod simulation;
mod station;
mod view;

use std::io::{self, Write};

use anyhow::Result;
use clap::value_parser;

use crate::line_rate;
use crate::numbers::{number, probability};
use crate::screen;
use crate::stream::Failure;
use simulation::{FRAME_LENGTH, Plan, Simulation};

/// The main job without hardware: a simulated motion PC sends frames over a faulty line to the
/// lecture's machine and to the receiver, each with the failsafe behind it.
///
/// In turn: motion over a line that loses and corrupts bytes; silence, in which the failsafe
/// holds, moves to park and comes back; motion; the simulator parked on payload 00 41 42 00, where
/// one lost byte makes the lecture's machine deaf; motion. It ends with a table.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Seed of the motion and of the line's faults: the same seed gives the same table
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    seed: u64,

    /// How long it lasts; the passages are parts of it
    #[arg(long, default_value_t = 26, value_name = "SECONDS", value_parser = value_parser!(u32).range(1..=86_400))]
    seconds: u32,

    /// Probability that the line loses a byte in motion, 0 to 1
    #[arg(long, default_value_t = 0.004, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    drop: f64,

    /// Probability that it inverts one bit of a byte in motion, 0 to 1
    #[arg(long, default_value_t = 0.0005, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    flip: f64,

    /// Bits in a second on the line, ten for each byte
    #[arg(long, default_value_t = 115_200, value_name = "NUMBER", value_parser = value_parser!(u32).range(300..=10_000_000))]
    baud: u32,

    /// Frames in a second
    #[arg(long, default_value_t = 50, value_name = "NUMBER", value_parser = value_parser!(u32).range(1..=100_000))]
    rate: u32,

    /// After so many byte times without a byte, drop the frame under way; not done unless given,
    /// since DMA and USB adapters deliver in batches
    #[arg(long, value_name = "BYTES", value_parser = value_parser!(u32).range(1..=1_000_000))]
    idle_gap: Option<u32>,

    /// The live view's speed: 0.1 for a tenth of real time
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = speed, allow_negative_numbers = true)]
    speed: f64,

    /// Lines of text, without waiting: as if standard output were no terminal
    #[arg(long)]
    plain: bool,
}

const EXAMPLES: &str = "\
Examples:
  framelock demo                            watch it (q quits, space pauses)
  framelock demo --speed 0.2                watch it slowly
  framelock demo --plain --seed 7           other faults, only the numbers
  framelock demo --drop 0 --flip 0          a line without faults
  framelock demo --plain --idle-gap 20      the lecture's machine with an idle-gap rule

The table:
  received  frames sent whose setpoint was committed with the frame's own last byte
  lost      all other frames sent
  wrong     all other commits: not with the last byte of a frame, or not its setpoint. Without a
            checksum no receiver notices an inverted bit in pitch, roll or yaw
  silence   time without a commit
  failsafe  engages after five frames' time without a commit, moves to park after twenty-five";

/// Runs `framelock demo`.
///
/// # Errors
/// If the frames do not fit on the line, or if the terminal or standard output fails. That the
/// reader of the output has gone is no error.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut simulation = Simulation::new(arguments.plan()?)?;
    let is_live = !arguments.plain && screen::is_there();
    if is_live {
        live::run(&mut simulation, arguments.speed)?;
    }
    print(&mut simulation, is_live)
        .or_else(|error| Failure::Write(error).told("", "standard output"))
}

/// The lines of text: all of them, or only what comes behind the live view.
fn print(simulation: &mut Simulation, is_live: bool) -> io::Result<()> {
    let mut out = io::BufWriter::new(io::stdout().lock());
    if !is_live {
        plain::run(simulation, &mut out)?;
    }
    plain::write_summary(simulation, &mut out)?;
    out.flush()
}

impl Arguments {
    fn plan(&self) -> Result<Plan> {
        let &Self {
            seed,
            seconds,
            drop,
            flip,
            baud,
            rate,
            idle_gap,
            ..
        } = self;
        line_rate::check(rate, FRAME_LENGTH, baud)?;
        Ok(Plan {
            seed,
            seconds,
            drop,
            flip,
            baud,
            rate,
            idle_gap,
        })
    }
}

fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.01, 100.0)
}
