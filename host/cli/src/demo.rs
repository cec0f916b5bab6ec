//! The main job without hardware: a simulated motion PC over a faulty line.
//!
//! The demonstration runs in virtual time and does not know who looks at it: the live view paces it,
//! the plain lines run through it, and the same seed gives the same numbers under both.

mod arguments;
mod bytes;
mod demonstration;
mod lane;
mod live;
mod plain;
mod record;
mod script;
mod story;
mod view;

use std::io::{BufWriter, Write};

use anyhow::Result;

use crate::output::Output;
use crate::screen;
pub(crate) use arguments::Arguments;
use demonstration::Demonstration;

/// Runs `framelock demo`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut demonstration = Demonstration::new(arguments.clone())?;
    if let Some(path) = &arguments.record {
        let picture = record::picture(&mut demonstration)?;
        return Ok(Output::create(path)?.write_all(picture.as_bytes())?);
    }
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
