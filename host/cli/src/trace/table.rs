//! The rows, written as the bytes come. Memory does not grow with their number.

use std::io::{self, Write};

use anyhow::Result;

use super::observed::{Observed, Step};
use crate::input::{Input, for_each_arrival};
use crate::names::{PolicyName, name};

/// How the steps are written.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(super) enum Format {
    /// A table to read
    Text,
    /// One JSON object per line
    Jsonl,
}

/// Writes the rows as the bytes come: whatever is there is shown before more is waited for.
pub(super) fn print(
    policies: &[PolicyName],
    format: Format,
    input: Input,
    out: &mut impl Write,
) -> Result<()> {
    let machines = policies.iter().map(|&policy| Observed::new(policy));
    let mut machines = machines.collect::<Result<Vec<_>>>()?;
    if format == Format::Text {
        writeln!(
            out,
            "offset  byte    policy   state     temp      setpoint  what happened"
        )?;
        out.flush()?;
    }
    for_each_arrival(input, |arrival| {
        for &byte in arrival.bytes() {
            let steps = machines.iter_mut().map(|machine| machine.push(byte));
            let steps: Vec<Step> = steps.collect();
            match format {
                Format::Text => write_rows(out, policies, &steps, row)?,
                Format::Jsonl => {
                    for step in steps {
                        writeln!(out, "{}", serde_json::to_string(&step)?)?;
                    }
                }
            }
        }
        Ok(out.flush()?)
    })?;
    if format == Format::Text {
        writeln!(out)?;
        write_rows(out, policies, &machines, |machine, policy| {
            format!("{:<9}{}", format!("{policy}:"), machine.balance())
        })?;
    }
    Ok(out.flush()?)
}

/// A row for each machine, or one for both if they do the same.
fn write_rows<T>(
    out: &mut impl Write,
    policies: &[PolicyName],
    machines: &[T],
    row: impl Fn(&T, &str) -> String,
) -> io::Result<()> {
    if let [first, second] = machines
        && row(first, "both") == row(second, "both")
    {
        return writeln!(out, "{}", row(first, "both"));
    }
    let rows = machines.iter().zip(policies);
    rows.map(|(machine, policy)| row(machine, &name(policy)))
        .try_for_each(|row| writeln!(out, "{row}"))
}

/// A row of eighty columns; where the machine goes on stands in a line of its own.
fn row(step: &Step, policy: &str) -> String {
    let what = match step.what.split_once("; ") {
        Some((what, goes_on)) if step.discarded > 1 => format!("{what}\n{:25}{goes_on}", ""),
        _ => step.what.clone(),
    };
    format!(
        "{:>6}  {:02X} {:<3}  {policy:<7}  {:>2} -> {:<2}  {}  {}  {what}",
        step.offset,
        step.byte,
        character(step.byte),
        step.state_before,
        step.state_after,
        axes(step.temp),
        axes(step.setpoint.map_or([None; 3], |axes| axes.map(Some))),
    )
}

/// What a byte is as text, if it is anything.
pub(super) fn character(byte: u8) -> String {
    match byte {
        b'\r' => "CR".into(),
        b' '..=b'~' => format!("'{}'", char::from(byte)),
        _ => String::new(),
    }
}

/// Three values in hex, dashes where there is none yet.
fn axes(axes: [Option<u8>; 3]) -> String {
    axes.map(|axis| axis.map_or_else(|| "--".into(), |value| format!("{value:02X}")))
        .join(" ")
}
