//! Demonstrates framelock without hardware: a simulated motion PC sends frames over a faulty line.
//!
//! The demonstration runs in virtual time, so the results do not depend on the way in which they are shown. The live
//! view advances in real time, and the plain text is printed without waiting. A seed gives the same numbers in the live
//! view and in the plain text.

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

/// Show the story of a lost byte, without hardware. A simulated PC sends a motion seat's position over
/// a faulty line to the lecture's machine and to framelock, each followed by the failsafe.
///
/// The demo has four parts. First the seat stands still, and one lost byte makes the lecture's machine
/// deaf. Then the seat moves, over a line that loses and changes bytes. Then the PC is silent, and the
/// failsafe holds the seat and moves it to the middle. Then the seat moves again. A table of counts
/// ends the demo. A terminal of 80 columns and 24 rows shows everything; 60 columns and 16 rows are
/// the minimum.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = include_str!("help/demo.txt"))]
pub(crate) struct Arguments {
    /// Seed the motion and the line's faults; the same seed gives the same table
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    seed: u64,

    /// Run for this time; all parts scale with it
    #[arg(long, default_value_t = 20, value_name = "SECONDS", value_parser = |text: &str| whole::<u32>(text, 1, 86_400))]
    seconds: u32,

    /// Lose each byte with this probability (0 to 1) while the seat moves
    #[arg(long, default_value_t = 0.02, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    drop: f64,

    /// Invert one bit of each byte with this probability (0 to 1) while the seat moves
    #[arg(long, default_value_t = 0.002, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    flip: f64,

    /// Set the rate of the line in bits per second; each byte takes ten bits
    #[arg(long, default_value_t = 115_200, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 300, 10_000_000))]
    baud: u32,

    /// Send this many frames per second. The default is slow enough to watch each frame; motion
    /// software sends 50 or more
    #[arg(long, default_value_t = 10, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 1, 100_000))]
    rate: u32,

    /// After a pause of this many byte times, drop the incomplete frame. Off by default, because DMA and
    /// USB adapters send in bursts, so a frame may contain pauses
    #[arg(long, value_name = "BYTES", value_parser = |text: &str| whole::<u32>(text, 1, 1_000_000))]
    idle_gap: Option<u32>,

    /// Run the live view at this speed; 0.1 is a tenth of real time
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = speed, allow_negative_numbers = true)]
    speed: f64,

    /// Print text without waiting, as if standard output were not a terminal
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

/// Prints the demonstration as text. After a live view, prints only the table.
fn print(demonstration: &mut Demonstration, is_live: bool) -> Result<()> {
    let mut out = BufWriter::new(Output::standard()?);
    if !is_live {
        plain::run(demonstration, &mut out)?;
    }
    plain::write_summary(demonstration, &mut out)?;
    Ok(out.flush()?)
}

/// Draws the live view of a demonstration without options on a screen of this many columns and rows. Returns `count`
/// drawings, one `step` apart.
///
/// # Errors
/// Returns an error if the demonstration cannot be drawn.
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
