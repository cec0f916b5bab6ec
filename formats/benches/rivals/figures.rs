//! Compares the formats' costs on the chip with the costs in a file, on every commit. The costs do not vary from run
//! to run.
//!
//! After an intended change, `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated` writes the file again. The
//! costs are compared only if the compiler is the one that the file names.

use std::error::Error;
use std::fmt::Write;
use std::fs;

use crate::chip::Program;
use crate::{costs, tables};

const BEGINNING: &str = "\
Costs of framelock's receivers on the emulated Cortex-M4, measured as in docs/costs.md. The columns are the bytes of code
and of constants, the instructions and cycles for 200 clean frames, the cycles for the most expensive hostile stream,
and the cycles for the most expensive byte of any stream.
";

/// Returns an error if the costs differ from those in the file.
pub(crate) fn compare(file: &str) -> Result<(), Box<dyn Error>> {
    let compiler = tables::compiler()?;
    let mut text = format!("{BEGINNING}{compiler}\n\n");
    writeln!(
        text,
        "{:<12}{:>6}{:>11}{:>14}{:>10}{:>10}{:>10}",
        "", "code", "constants", "instructions", "cycles", "hostile", "a byte"
    )?;
    let nothing = Program::build("nothing")?;
    for case in costs::cases() {
        // The first contender is the receiver alone, without a `Line`.
        let receiver = case.contenders.first().and_then(|it| it.on_chip.as_deref());
        let program = Program::build(receiver.ok_or("a format without a receiver")?)?;
        let [code, constants] = program.more_than(&nothing);
        let mut runs = Vec::new();
        for (stream, skipped) in case.streams() {
            runs.push(program.take(stream, skipped)?);
        }
        let clean = runs[0].all;
        let hostile = runs[2..].iter().map(|run| run.all.cycles).max();
        let costliest = runs.iter().map(|run| run.costliest).max();
        writeln!(
            text,
            "{:<12}{code:>6}{constants:>11}{:>14}{:>10}{:>10}{:>10}",
            case.format,
            clean.instructions,
            clean.cycles,
            hostile.unwrap_or_default(),
            costliest.unwrap_or_default()
        )?;
    }
    if std::env::var_os("FRAMELOCK_WRITE_FIGURES").is_some() {
        fs::write(file, &text)?;
    }
    let written = fs::read_to_string(file).unwrap_or_default();
    if written.contains(&compiler) && written != text {
        return Err(format!("the costs differ from those in {file}:\n{text}").into());
    }
    Ok(())
}
