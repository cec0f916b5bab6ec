//! The rows, written as the bytes come. Memory does not grow with their number.

use std::fmt;
use std::io::{self, Write};

use framelock::{Lecture, Receiver};
use serde::Serialize;

use super::observed::{Observed, Step};
use super::{Format, Policy};

/// Whichever machines are asked for, and how far the stream has come.
pub(super) struct Table {
    discard: Option<Observed<Lecture>>,
    rescan: Option<Observed<Receiver<framelock::Bin>>>,
    format: Format,
    offset: u64,
}

impl Table {
    pub(super) fn new(policy: Policy, format: Format) -> Self {
        Self {
            discard: (policy != Policy::Rescan).then(|| Observed::new(Lecture::new())),
            rescan: (policy != Policy::Discard).then(|| Observed::new(Receiver::new())),
            format,
            offset: 0,
        }
    }

    /// What stands above the rows.
    pub(super) fn begin(&self, out: &mut impl Write) -> io::Result<()> {
        if self.format == Format::Jsonl {
            return Ok(());
        }
        writeln!(
            out,
            "offset  byte    policy   state     temp (P R Y)  SP (P R Y)  what happened"
        )
    }

    /// The row of the next byte; two rows if the machines differ.
    pub(super) fn push(&mut self, byte: u8, out: &mut impl Write) -> io::Result<()> {
        let steps = by_policy(
            self.discard.as_mut().map(|machine| machine.push(byte)),
            self.rescan.as_mut().map(|machine| machine.push(byte)),
            self.format == Format::Text,
        );
        for (policy, step) in steps.into_iter().flatten() {
            match self.format {
                Format::Text => write_row(out, self.offset, byte, policy, &step)?,
                Format::Jsonl => write_object(out, self.offset, byte, policy, &step)?,
            }
        }
        self.offset += 1;
        Ok(())
    }

    /// Where every byte has gone.
    pub(super) fn end(&self, out: &mut impl Write) -> io::Result<()> {
        if self.format == Format::Jsonl {
            return Ok(());
        }
        writeln!(out)?;
        let balances = by_policy(
            self.discard.as_ref().map(Observed::balance),
            self.rescan.as_ref().map(Observed::balance),
            true,
        );
        for (policy, balance) in balances.into_iter().flatten() {
            writeln!(out, "{:<9}{balance}", format!("{policy}:"))?;
        }
        Ok(())
    }
}

/// Each machine's, by the name of its policy; once if they are to be merged and are the same.
fn by_policy<T: PartialEq>(
    discard: Option<T>,
    rescan: Option<T>,
    merge: bool,
) -> [Option<(&'static str, T)>; 2] {
    if merge && discard.is_some() && discard == rescan {
        return [discard.map(|both| ("both", both)), None];
    }
    [
        discard.map(|value| ("discard", value)),
        rescan.map(|value| ("rescan", value)),
    ]
}

fn write_row(
    out: &mut impl Write,
    offset: u64,
    byte: u8,
    policy: &str,
    step: &Step,
) -> io::Result<()> {
    writeln!(
        out,
        "{offset:>6}  {byte:02X} {:<3}  {policy:<7}  {:>2} -> {:<2}  {}      {}    {}",
        Character(byte).to_string(),
        step.before,
        step.after,
        Axes(step.temp),
        Axes(match step.in_force {
            Some(setpoint) => <[u8; 3]>::from(setpoint).map(Some),
            None => [None; 3],
        }),
        step.event,
    )
}

/// What a byte is as text, if it is anything.
struct Character(u8);

impl fmt::Display for Character {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            b'\r' => f.write_str("CR"),
            b' '..=b'~' => write!(f, "'{}'", char::from(self.0)),
            _ => Ok(()),
        }
    }
}

/// Three values in hex, dashes where there is none yet.
struct Axes([Option<u8>; 3]);

impl fmt::Display for Axes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for axis in self.0 {
            match axis {
                Some(value) => write!(f, "{separator}{value:02X}")?,
                None => write!(f, "{separator}--")?,
            }
            separator = " ";
        }
        Ok(())
    }
}

/// A row as JSON: numbers as numbers, states by the lecture's names.
#[derive(Serialize)]
struct Object<'a> {
    offset: u64,
    byte: u8,
    policy: &'a str,
    state_before: &'a str,
    state_after: &'a str,
    /// Pitch, roll, yaw; null where nothing is stored yet.
    temp: [Option<u8>; 3],
    /// Pitch, roll, yaw; null while there is none.
    setpoint: Option<[u8; 3]>,
    discarded: u64,
    what: String,
}

fn write_object(
    out: &mut impl Write,
    offset: u64,
    byte: u8,
    policy: &str,
    step: &Step,
) -> io::Result<()> {
    let object = Object {
        offset,
        byte,
        policy,
        state_before: step.before.lecture_name(),
        state_after: step.after.lecture_name(),
        temp: step.temp,
        setpoint: step.in_force.map(Into::into),
        discarded: step.discarded,
        what: step.event.to_string(),
    };
    serde_json::to_writer(&mut *out, &object)?;
    writeln!(out)
}
