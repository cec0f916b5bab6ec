//! Shows what a receiver does with each byte: the lecture's table, one row per byte.

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, BufWriter, Cursor, IsTerminal, Write};
use std::path::Path;

use anyhow::{Result, anyhow, bail};
use framelock::LineEvent;
use framelock_description::hex;
use framelock_receiving::{AnyLine, Piece, Policy, Protocol, TrackedLine};

use crate::frame_writer::FrameWriter;
use crate::input::{Input, Spelling, for_each_arrival};
use crate::options::{ProtocolParser, check_has_no_breaks};
use crate::output::{Output, note};
use crate::serial::PortOptions;
use crate::view_parts::STATES;

/// Show what a receiver does with each byte: the lecture's table, one row per byte
#[derive(clap::Args)]
#[command(after_help = include_str!("help/trace.txt"))]
pub(crate) struct Arguments {
    /// Trace bytes in hex (with or without spaces), a file, a serial port, or - for standard input.
    /// Without an argument, trace the bytes of a pipe, or else the lecture's two worked examples
    #[arg(value_name = "HEX|FILE|PORT|-")]
    source: Vec<OsString>,
    /// Receive with lecture (the lecture's machine, which discards a broken frame) or framelock (which
    /// searches it again) [default: both, in one row where they do the same]
    #[arg(long, value_enum, hide_possible_values = true)]
    policy: Option<Policy>,
    /// Receive these frames: a name, or a description file [default: bin]. For frames other than bin, a
    /// row shows the number of pending bytes, the frames with their fields, and the discarded bytes
    /// with the reason
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = ProtocolParser, hide_possible_values = true)]
    frame: Protocol,
    /// Read a file, port or pipe as bytes or hex: text such as 41 42 00 or 0x41,0x42
    #[arg(long, value_name = "SPELLING", value_enum, default_value_t = Spelling::Bytes, hide_possible_values = true)]
    input: Spelling,
    #[command(flatten)]
    port: PortOptions,
}

impl Arguments {
    /// Writes the rows as the bytes arrive. Flushes all rows before it waits for more bytes. The memory in use does
    /// not grow with the number of bytes.
    fn print(&self, input: Input, out: &mut impl Write) -> Result<()> {
        check_has_no_breaks(&self.frame)?;
        let is_bin = is_bin(&self.frame);
        // The lecture's machine receives only BIN.
        let policies = match self.policy {
            Some(policy) => vec![policy],
            None if is_bin => vec![Policy::Lecture, Policy::Framelock],
            None => vec![Policy::Framelock],
        };
        let machines = policies
            .iter()
            .map(|&policy| Machine::new(&self.frame, policy));
        let mut machines = machines.collect::<Result<Vec<_>>>()?;
        let columns = if is_bin { BIN_COLUMNS } else { OTHER_COLUMNS };
        writeln!(out, "offset  byte{columns}  what happened")?;
        out.flush()?;
        for_each_arrival(input, |arrival| {
            for &byte in arrival.bytes() {
                let rows = machines.iter_mut().map(|machine| machine.push(byte));
                let rows: Vec<_> = rows.collect();
                write_rows(out, &policies, &rows, |[start, end], name| {
                    let label = if is_bin {
                        format!(" {name:<9} ")
                    } else {
                        String::new()
                    };
                    format!("{start}{label}{end}")
                })?;
            }
            Ok(out.flush()?)
        })?;
        if self.frame.description.ending_event().is_some() {
            // The line is silent after the last byte.
            let pieces = machines[0].line.line_event(LineEvent::Idle);
            let events = pieces.iter().map(|piece| machines[0].event(piece));
            let events: Vec<String> = events.collect();
            writeln!(
                out,
                "   end                0  {}",
                events.join(&format!("{GOES_ON}  "))
            )?;
        }
        writeln!(out)?;
        let rows: Vec<String> = machines.iter().map(Machine::balance).collect();
        write_rows(out, &policies, &rows, |row, name| {
            let label = if is_bin {
                format!("{name}:")
            } else {
                String::new()
            };
            let width = if is_bin { 11 } else { 0 };
            format!("{label:<width$}{row}")
        })?;
        Ok(out.flush()?)
    }

    /// Returns standard input if bytes are piped in.
    fn piped(&self) -> Result<Option<Input<'static>>> {
        if io::stdin().is_terminal() {
            return Ok(None);
        }
        let mut input = BufReader::new(Input::open(Path::new("-"), &PortOptions::default())?);
        if input.fill_buf()?.is_empty() {
            return Ok(None);
        }
        self.port.check_none("standard input")?;
        Ok(Some(
            Input::new("standard input", input).spelled(self.input),
        ))
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

/// The lecture's two worked examples: a title, the bytes sent and the bytes received.
const EXAMPLES: [[&str; 3]; 2] = [
    [
        "The lecture's first example: one frame, and the line loses nothing.",
        "41 42 00 7F C8 4A 0D",
        "41 42 00 7F C8 4A 0D",
    ],
    [
        "The lecture's second example: two frames; the line loses 7F and C8 of the first.",
        "41 42 00 7F C8 4A 0D 41 42 00 82 C4 4A 0D",
        "41 42 00 -- -- 4A 0D 41 42 00 82 C4 4A 0D",
    ],
];

/// Runs `framelock trace`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut out = BufWriter::new(Output::standard()?);
    let mut print = |heading: &str, input| {
        write!(out, "{heading}")?;
        arguments.print(input, &mut out)
    };
    match (hex::parse(&arguments.source), &*arguments.source) {
        (_, []) => {
            if let Some(input) = arguments.piped()? {
                return print("", input);
            }
            if !is_bin(&arguments.frame) {
                bail!(
                    "nothing to trace: the built-in examples are bin frames; otherwise \
                     give HEX|FILE|PORT|-, for example framelock trace --frame crsf capture.bin"
                );
            }
            arguments.port.check_none("the example")?;
            for (number, [title, sent, received]) in EXAMPLES.into_iter().enumerate() {
                let space = "\n\n".repeat(number);
                let heading =
                    format!("{space}{title}\n\n  sent      {sent}\n  received  {received}\n\n");
                let bytes = hex::parse(&[received.replace("--", "")])?;
                print(&heading, Input::new("", Cursor::new(bytes)))?;
            }
            Ok(())
        }
        (Ok(bytes), _) if bytes.is_empty() => {
            bail!("there are no bytes in the arguments: give bytes in hex such as 41 42 00 7F")
        }
        (Ok(bytes), words) => {
            if let [only] = words
                && Path::new(only).exists()
            {
                let name = only.display();
                note(&format!(
                    "tracing the hex bytes {name}; to trace the file of that name, write ./{name}"
                ));
            }
            print("", Input::new("", Cursor::new(bytes)))
        }
        (Err(why), [only]) => {
            let input = Input::open(Path::new(only), &arguments.port).map_err(|error| {
                anyhow!("the argument is not hex: {why}; nor is it a file: {error:#}")
            })?;
            print("", input.spelled(arguments.input))
        }
        (Err(why), _) => bail!(why),
    }
}

/// The columns of BIN: the receiver, the lecture's state before and after the byte, the stored values and the setpoint.
const BIN_COLUMNS: &str = "   policy    state     temp      setpoint";

/// The header of the table for frames other than BIN: its only column has the pending bytes.
const OTHER_COLUMNS: &str = "    pending";

/// The separator between events of the same byte. The separator begins a new row for each further event.
const GOES_ON: &str = "\n                       ";

/// The offset of pitch in a frame; roll and yaw follow.
const AXES_AT: usize = 3;
const AXES: [&str; 3] = ["pitch", "roll", "yaw"];

/// Returns whether the frames are BIN, which the lecture's machine receives.
fn is_bin(protocol: &Protocol) -> bool {
    protocol.name == "bin"
}

/// A receiver that is traced.
struct Machine {
    frames: FrameWriter,
    line: TrackedLine,
    bin: Option<BinColumns>,
}

/// The lecture's values, which only BIN has. An axis is `None` until it is stored.
#[derive(Default)]
struct BinColumns {
    /// The last stored pitch, roll and yaw.
    temp: [Option<u8>; 3],
    /// The setpoint of the last frame.
    setpoint: [Option<u8>; 3],
}

impl Machine {
    fn new(protocol: &Protocol, policy: Policy) -> Result<Self> {
        Ok(Self {
            line: TrackedLine::new(AnyLine::new(protocol, policy)?),
            frames: FrameWriter::new(protocol.clone()),
            bin: is_bin(protocol).then(BinColumns::default),
        })
    }

    /// Takes the next byte, and returns its row in two parts: the byte, and its effect. The first line of the second
    /// part has the columns, and each further line has one more event.
    fn push(&mut self, byte: u8) -> [String; 2] {
        let before = self.line.pending().len();
        let offset = self.line.decided() + before;
        let pieces = self.line.push(byte);
        let pending = self.line.pending();
        let after = pending.len();
        let (columns, events) = if let Some(bin) = &mut self.bin {
            bin.store(pending, &pieces);
            let [state, next] = [before, after].map(|pending| STATES[pending]);
            let [temp, setpoint] = [bin.temp, bin.setpoint].map(|axes| joined(axes, " "));
            let columns = format!("{state:>2} -> {next:<2}  {temp}  {setpoint}");
            (columns, bin.events(offset, byte, [before, after], &pieces))
        } else {
            let events = pieces.iter().map(|piece| self.event(piece));
            (format!("  {after:>7}"), events.collect())
        };
        let events: Vec<String> = events.iter().map(|event| format!("  {event}")).collect();
        let start = format!("{offset:>6}  {byte:02X} {:<3}", character(byte));
        [start, columns + &events.join(GOES_ON)]
    }

    /// Returns the text for a frame or for discarded bytes.
    fn event(
        &self,
        Piece {
            from,
            bytes,
            frame,
            discarded,
        }: &Piece,
    ) -> String {
        if let Some(why) = discarded {
            return format!("discarded {} from offset {from}: {why}", hex::glued(bytes));
        }
        let mut fields = Vec::new();
        self.frames.append_text(&mut fields, frame);
        let fields = String::from_utf8_lossy(&fields);
        format!("frame from offset {from}:{fields}")
    }

    /// Returns the sums that account for every byte.
    fn balance(&self) -> String {
        let counters = self.line.counters();
        let (bytes, frames) = (counters.bytes, counters.frames);
        let (discarded, pending) = (&counters.discarded, self.line.pending().len());
        let rest = format!("{} discarded + {pending} pending", discarded.total());
        let Some(bin) = &self.bin else {
            let frame_bytes = counters.frame_bytes;
            return format!("{bytes} bytes = {frame_bytes} in {frames} frames + {rest}");
        };
        let plural = if bytes == 1 { "" } else { "s" };
        let setpoint = joined(bin.setpoint, ",");
        let reasons = [
            ("no sync", discarded.no_sync),
            ("broken sync", discarded.broken_sync),
            ("no CR", discarded.wrong_terminator),
        ];
        let counted = reasons.iter().filter(|(_, count)| *count > 0);
        let reasons: Vec<String> = counted
            .map(|(why, count)| format!("; {why}: {count}"))
            .collect();
        format!(
            "{bytes} byte{plural} = {} x {frames} committed + {rest}\n{:11}SP=({setpoint}){}",
            STATES.len(),
            "",
            reasons.concat()
        )
    }
}

impl BinColumns {
    fn store(&mut self, pending: &[u8], pieces: &[Piece]) {
        for (stored, &new) in self.temp.iter_mut().zip(pending.iter().skip(AXES_AT)) {
            *stored = Some(new);
        }
        let mut frames = pieces.iter().filter(|piece| piece.discarded.is_none());
        if let Some(frame) = frames.next_back() {
            self.setpoint = std::array::from_fn(|axis| Some(frame.bytes[AXES_AT + axis]));
        }
    }

    /// Returns the effect of a byte in the lecture's words. `before` and `after` are the numbers of pending bytes.
    fn events(
        &self,
        offset: usize,
        byte: u8,
        [before, after]: [usize; 2],
        pieces: &[Piece],
    ) -> Vec<String> {
        if pieces.iter().any(|piece| piece.discarded.is_none()) {
            return vec![format!("SP=({})", joined(self.setpoint, ","))];
        }
        let stored = before.checked_sub(AXES_AT).and_then(|axis| AXES.get(axis));
        let what = match (before, stored) {
            (0 | 1, _) if after > before => "sync".into(),
            (0, _) => "no sync: discarded".into(),
            (1, _) if after == 1 => "sync; the 'A' discarded".into(),
            (1, _) => "no sync: both discarded".into(),
            (2, _) => "reserved, not kept".into(),
            (_, Some(axis)) => format!("temp {axis}={byte:02X}"),
            (_, None) => {
                let discarded: usize = pieces.iter().map(|piece| piece.bytes.len()).sum();
                format!("not CR: {discarded} bytes discarded")
            }
        };
        let is_resynchronised = before + 1 == STATES.len() && after > 0;
        let goes_on = is_resynchronised.then(|| {
            let start = if after == 1 { "A" } else { "AB" };
            let start_offset = offset + 1 - after;
            format!("resynchronised to the {start} at offset {start_offset}")
        });
        [what].into_iter().chain(goes_on).collect()
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

/// Returns three values in hex, with dashes for a value that is not known yet.
fn joined(axes: [Option<u8>; 3], separator: &str) -> String {
    axes.map(|axis| axis.map_or_else(|| "--".into(), |value| format!("{value:02X}")))
        .join(separator)
}

#[cfg(test)]
mod tests {
    #![allow(
        clippy::unwrap_used,
        clippy::indexing_slicing,
        reason = "a panic fails the test"
    )]

    use rand::seq::IndexedRandom;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    /// The streams contain many starts of frames and many false starts.
    #[test]
    fn the_rows_match_the_bytes() {
        let bin = Protocol::named("bin").unwrap();
        for policy in [Policy::Lecture, Policy::Framelock] {
            let (mut starts, mut frames) = ([0; 7], 0);
            for seed in 0..2_000 {
                let mut random = ChaCha8Rng::seed_from_u64(seed);
                let length = random.random_range(0..60);
                let byte = |_| *b"AABB\r\0x".choose(&mut random).unwrap();
                let stream: Vec<u8> = (0..length).map(byte).collect();
                let mut machine = Machine::new(&bin, policy).unwrap();
                let mut setpoint = "-- -- --".to_owned();
                for (offset, &byte) in stream.iter().enumerate() {
                    let [_, row] = machine.push(byte);
                    let in_hex = |bytes: &[u8]| {
                        let digits = bytes.iter().map(|byte| format!("{byte:02X}"));
                        digits.collect::<Vec<_>>().join(" ")
                    };
                    if let Some((_, axes)) = row.split_once("SP=(") {
                        let frame = &stream[offset - 6..=offset];
                        assert!(frame.starts_with(b"AB") && frame.ends_with(b"\r"));
                        setpoint = in_hex(&frame[3..6]);
                        assert_eq!(axes, setpoint.replace(' ', ",") + ")");
                        assert!(row.starts_with(&format!("CR -> A   {setpoint}  ")), "{row}");
                        frames += 1;
                    } else if let Some((_, at)) = row.split_once("at offset ") {
                        let start = &stream[at.parse().unwrap()..=offset];
                        assert!(row.starts_with(&format!("CR -> {:<2}  ", STATES[start.len()])));
                        assert!(b"AB".starts_with(start) || start.starts_with(b"AB"));
                        // The machine has already stored values of the incomplete frame.
                        let stored = start.get(3..).unwrap_or(&[]);
                        assert!(row[10..].starts_with(&in_hex(stored)), "{row}");
                        starts[start.len()] += 1;
                    }
                    assert_eq!(row[20..28], setpoint);
                }
            }
            assert!(frames > 0);
            // framelock's receiver may find a new start at any of the five bytes after the AB of a failed frame. The
            // lecture's machine never does.
            let may_begin = |count: &i32| (*count > 0) == (policy == Policy::Framelock);
            assert!(starts[1..=5].iter().all(may_begin), "{starts:?}");
        }
    }
}
