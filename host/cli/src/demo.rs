//! The main job without hardware: a simulated motion PC over a faulty line.
//!
//! The demonstration runs in virtual time and does not know who looks at it: the live view paces it,
//! the plain lines run through it, and the same seed gives the same numbers under both.

mod bytes;
mod demonstration;
mod lane;
mod live;
mod plain;
mod script;
mod story;
mod view;

use std::io::{BufWriter, Write};
use std::time::Duration;

use anyhow::Result;
use clap::{Args, Command, FromArgMatches};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::buffer::Buffer;

use crate::options::{number, probability, whole};
use crate::output::Output;
use crate::screen;
pub use crate::view_parts::{BLUE, EIGHTHS, VERMILLION};
use demonstration::Demonstration;

/// The story of a lost byte, without hardware: a simulated PC sends a motion seat's position over a
/// faulty line to the lecture's machine and to framelock, each with the failsafe behind it.
///
/// In turn: the seat stands still, and one lost byte makes the lecture's machine deaf; a ride, over
/// a line that loses and changes bytes; silence, in which the failsafe holds the seat and moves it
/// to the middle; the ride again. It ends with a table. A terminal of 80 columns and 24 rows shows
/// all of it, one of 60 and 16 the most.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = include_str!("help/demo.txt"))]
pub(crate) struct Arguments {
    /// Seed of the motion and of the line's faults: the same seed gives the same table
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    seed: u64,

    /// How long it lasts; the passages are parts of it
    #[arg(long, default_value_t = 20, value_name = "SECONDS", value_parser = |text: &str| whole::<u32>(text, 1, 86_400))]
    seconds: u32,

    /// Probability that the line loses a byte of the ride, 0 to 1
    #[arg(long, default_value_t = 0.02, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    drop: f64,

    /// Probability that it inverts one bit of a byte of the ride, 0 to 1
    #[arg(long, default_value_t = 0.002, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    flip: f64,

    /// Bits in a second on the line, ten for each byte
    #[arg(long, default_value_t = 115_200, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 300, 10_000_000))]
    baud: u32,

    /// Frames in a second: few enough to watch each; motion software sends 50 and more
    #[arg(long, default_value_t = 10, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 1, 100_000))]
    rate: u32,

    /// Byte times without a byte after which the frame under way is dropped; not done unless given,
    /// since DMA and USB adapters deliver in batches
    #[arg(long, value_name = "BYTES", value_parser = |text: &str| whole::<u32>(text, 1, 1_000_000))]
    idle_gap: Option<u32>,

    /// The live view's speed: 0.1 for a tenth of real time
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = speed, allow_negative_numbers = true)]
    speed: f64,

    /// Lines of text, without waiting: as if standard output were no terminal
    #[arg(long)]
    plain: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.01, 100.0)
}

/// Runs `framelock demo`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut demonstration = Demonstration::new(arguments.clone())?;
    let is_live = !arguments.plain && screen::is_there();
    if is_live {
        live::run(&mut demonstration, arguments.speed)?;
    }
    print(&mut demonstration, is_live)
}

/// The lines of text: all of them, or only what comes behind the live view.
fn print(demonstration: &mut Demonstration, is_live: bool) -> Result<()> {
    let mut out = BufWriter::new(Output::standard()?);
    if !is_live {
        plain::run(demonstration, &mut out)?;
    }
    plain::write_summary(demonstration, &mut out)?;
    Ok(out.flush()?)
}

/// Draws the live view of a demonstration without options on a screen of this many columns and rows: `count` times,
/// one `step` apart.
///
/// # Errors
/// The demonstration cannot be drawn.
pub fn drawings((columns, rows): (u16, u16), step: Duration, count: usize) -> Result<Vec<Buffer>> {
    let without_options = Arguments::augment_args(Command::new("demo")).get_matches_from(["demo"]);
    let mut demonstration = Demonstration::new(Arguments::from_arg_matches(&without_options)?)?;
    let mut terminal = Terminal::new(TestBackend::new(columns, rows))?;
    let drawing = |_| {
        terminal.draw(|frame| {
            view::draw(frame, &demonstration, false);
        })?;
        demonstration.advance_to(demonstration.now + step);
        Ok(terminal.backend().buffer().clone())
    };
    (0..count).map(drawing).collect()
}
