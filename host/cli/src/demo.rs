//! Demonstrates framelock without hardware: a simulated motion PC sends frames over a faulty line.
//!
//! The demonstration runs in virtual time, so the results do not depend on the way in which they are shown. The live
//! view advances in real time, and the plain text is printed without waiting. Both show the same numbers.

mod bytes;
mod demonstration;
mod lane;
mod live;
mod plain;
mod script;
mod story;
mod view;

use std::io::{BufWriter, Write};

use anyhow::Result;

use crate::output::Output;
use crate::screen;
use demonstration::Demonstration;

/// Show the story of a lost byte, without hardware. A simulated PC sends a motion seat's position over
/// a faulty line to the lecture's machine and to framelock, each followed by the failsafe.
///
/// The demo has four parts. First the seat stands still, and one lost byte makes the lecture's machine
/// deaf. Then the seat moves, over a line that loses and changes bytes. Then the PC is silent, and the
/// failsafe holds the seat and moves it to the middle. Then the seat moves again. A table of counts
/// ends the demo. On a terminal of at least 80 columns and 23 rows the demo runs live, for 20 seconds.
/// If standard output is not a terminal, it prints text without waiting.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/demo.txt"))]
pub(crate) struct Arguments {}

/// Runs `framelock demo`.
pub(crate) fn run(_: &Arguments) -> Result<()> {
    let mut demonstration = Demonstration::new()?;
    let is_live = screen::is_there();
    if is_live {
        live::run(&mut demonstration)?;
    }
    let mut out = BufWriter::new(Output::standard()?);
    if !is_live {
        plain::run(&mut demonstration, &mut out)?;
    }
    plain::write_summary(&demonstration, &mut out)?;
    Ok(out.flush()?)
}
