//! Shows what a receiver does with each byte: one row per byte.

use std::ffi::{OsStr, OsString};
use std::io::{self, BufWriter, Cursor, Write};
use std::path::Path;

use anyhow::{Result, anyhow, bail};
use framelock::LineEvent;
use framelock_description::hex;
use framelock_receiving::{AnyLine, Piece, Policy, Protocol, TrackedLine};

use crate::frame_writer::FrameWriter;
use crate::input::{Arrival, Arrivals, Input, InputNotation};
use crate::options::{check_has_no_breaks, protocol};
use crate::output::Output;
use crate::serial::PortOptions;

/// Show what a receiver does with each byte: the number of pending bytes, the frames with their fields,
/// and the discarded bytes with the reason
#[derive(clap::Args)]
#[command(after_help = include_str!("help/trace.txt"))]
pub(crate) struct Arguments {
    /// Trace bytes in hex (with or without spaces), a file, or - for standard input
    #[arg(value_name = "HEX|FILE|-", default_value = "-")]
    source: Vec<OsString>,
    /// Receive with lecture (the lecture's machine, which discards a broken frame) or framelock (which
    /// searches it again) [default: both, in one row where they do the same]
    #[arg(long, value_enum, hide_possible_values = true)]
    policy: Option<Policy>,
    /// Receive these frames: a name, or a description file [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,
}

/// Runs `framelock trace`. Flushes all rows before it waits for more bytes. The memory in use does not grow with the
/// number of bytes.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let arrivals = Arrivals::new(arguments.input()?, None)?;
    if arrivals.notation == InputNotation::Bytes {
        check_has_no_breaks(&arguments.frame)?;
    }
    let mut out = BufWriter::new(Output::standard()?);
    // The lecture's machine receives only BIN.
    let is_bin = arguments.frame.name == "bin";
    let policies = match arguments.policy {
        Some(policy) => vec![policy],
        None if is_bin => vec![Policy::Lecture, Policy::Framelock],
        None => vec![Policy::Framelock],
    };
    let machine = |&policy| Machine::new(&arguments.frame, policy);
    let mut machines = policies.iter().map(machine).collect::<Result<Vec<_>>>()?;
    let label = if is_bin { "   policy  " } else { "" };
    writeln!(out, "offset  byte{label}    pending  what happened")?;
    out.flush()?;
    // The name of the machine takes this many columns.
    let width = label.len();
    let named = |[start, end]: &[String; 2], name: &str| {
        format!("{start}{:width$.width$}{end}", format!(" {name}"))
    };
    for arrival in arrivals {
        let Arrival { bytes, event, .. } = arrival?;
        let mut write = |row: &mut dyn FnMut(&mut Machine) -> [String; 2]| {
            let rows: Vec<_> = machines.iter_mut().map(row).collect();
            write_rows(&mut out, &policies, &rows, named)
        };
        for byte in bytes {
            write(&mut |machine| machine.push(byte, width))?;
        }
        if let Some(event) = event {
            write(&mut |machine| machine.line_event(event, &event.to_string(), width))?;
        }
        out.flush()?;
    }
    if arguments.frame.description.ending_event() == Some(LineEvent::Idle) {
        // The line is silent after the last byte.
        let row = machines[0].line_event(LineEvent::Idle, "   end", width);
        writeln!(out, "{}", row.concat())?;
    }
    writeln!(out)?;
    let sums: Vec<String> = machines.iter().map(|machine| machine.sum(width)).collect();
    write_rows(&mut out, &policies, &sums, |sum, name| {
        format!("{:width$.width$}{sum}", format!("{name}:"))
    })?;
    Ok(out.flush()?)
}

impl Arguments {
    /// Returns the bytes if the arguments are hex, and otherwise opens the file.
    fn input(&self) -> Result<Input<'static>> {
        let text = self.source.join(OsStr::new(" "));
        match (hex::parse_printed(&text.to_string_lossy()), &*self.source) {
            (Ok(bytes), _) if bytes.is_empty() => {
                bail!("there are no bytes in the arguments: give bytes in hex such as 41 42 00 7F")
            }
            (Ok(bytes), _) => Ok(Input::new("", Cursor::new(bytes))),
            (Err(why), [only]) => {
                Input::open(Path::new(only), &PortOptions::default()).map_err(|error| {
                    anyhow!("the argument is not hex: {why}; nor is it a file: {error:#}")
                })
            }
            (Err(why), _) => bail!(why),
        }
    }
}

/// Writes a row for each receiver, or one row for both if the rows are equal. `named` adds the receiver's name.
fn write_rows<R: PartialEq>(
    out: &mut impl Write,
    policies: &[Policy],
    rows: &[R],
    named: impl Fn(&R, &str) -> String,
) -> io::Result<()> {
    if let [first, second] = rows
        && first == second
    {
        return writeln!(out, "{}", named(first, "both"));
    }
    for (row, policy) in rows.iter().zip(policies) {
        writeln!(out, "{}", named(row, &policy.to_string()))?;
    }
    Ok(())
}

/// A receiver that is traced.
struct Machine {
    frames: FrameWriter,
    line: TrackedLine,
    /// The setpoint of the last frame, in hex.
    setpoint: String,
}

impl Machine {
    fn new(protocol: &Protocol, policy: Policy) -> Result<Self> {
        Ok(Self {
            line: TrackedLine::new(AnyLine::new(protocol, policy)?),
            frames: FrameWriter::new(protocol.clone(), &[])?,
            setpoint: "--,--,--".to_owned(),
        })
    }

    /// Takes the next byte, and returns its row in two parts: the byte, and its effect. Each further event of the same
    /// byte begins a new line.
    fn push(&mut self, byte: u8, width: usize) -> [String; 2] {
        let offset = self.line.decided() + self.line.pending().len();
        let events = self.events(|line| line.push(byte), width);
        let start = format!("{offset:>6}  {byte:02X} {:<3}", character(byte));
        [start, format!("  {:>7}{events}", self.line.pending().len())]
    }

    /// Takes a line event, and returns its row in two parts, like [`push`](Self::push). The row begins with the name.
    fn line_event(&mut self, event: LineEvent, name: &str, width: usize) -> [String; 2] {
        let events = self.events(|line| line.line_event(event), width);
        let pending = self.line.pending().len();
        [format!("{name:<14}"), format!("  {pending:>7}{events}")]
    }

    /// Passes a byte or a line event to the line, and returns the text for what happens.
    fn events(
        &mut self,
        step: impl FnOnce(&mut TrackedLine) -> Vec<Piece>,
        width: usize,
    ) -> String {
        let pieces = step(&mut self.line);
        let events: Vec<String> = pieces.iter().map(|piece| self.event(piece)).collect();
        events.join(&format!("\n{:1$}", "", 23 + width))
    }

    /// Returns the text for a frame or for discarded bytes.
    fn event(&mut self, piece: &Piece) -> String {
        let from = piece.from;
        if let Some(why) = piece.discarded {
            let bytes = hex::glued(&piece.bytes);
            return format!("  discarded {bytes} from offset {from}: {why}");
        }
        if let Some(setpoint) = self.frames.protocol.setpoint(&piece.bytes) {
            let axes = <[u8; 3]>::from(setpoint);
            self.setpoint = axes.map(|axis| format!("{axis:02X}")).join(",");
        }
        let mut fields = Vec::new();
        self.frames.append_text(&mut fields, &piece.frame);
        let fields = String::from_utf8_lossy(&fields);
        format!("  frame from offset {from}:{fields}")
    }

    /// Returns the sum that accounts for every byte. For BIN, adds the current setpoint and the reasons.
    fn sum(&self, width: usize) -> String {
        let counters = self.line.counters();
        let (bytes, frames) = (counters.bytes, counters.frames);
        let (discarded, pending) = (&counters.discarded, self.line.pending().len());
        let rest = format!("{} discarded + {pending} pending", discarded.total());
        if width == 0 {
            let frame_bytes = counters.frame_bytes;
            return format!("{bytes} bytes = {frame_bytes} in {frames} frames + {rest}");
        }
        let counts = [
            ("no sync", discarded.no_sync),
            ("broken sync", discarded.broken_sync),
            ("no CR", discarded.wrong_terminator),
        ];
        let mut reasons = Vec::new();
        for (why, count) in counts.iter().filter(|(_, count)| *count > 0) {
            reasons.push(format!("; {why}: {count}"));
        }
        let (setpoint, reasons) = (&self.setpoint, reasons.concat());
        format!(
            "{bytes} bytes = 7 x {frames} committed + {rest}\n{:width$}SP=({setpoint}){reasons}",
            ""
        )
    }
}

/// Returns a byte as text, or an empty text if the byte is not printable.
fn character(byte: u8) -> String {
    match byte {
        b'\r' => "CR".into(),
        b' '..=b'~' => format!("'{}'", char::from(byte)),
        _ => String::new(),
    }
}
