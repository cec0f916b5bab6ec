//! Shows what a receiver does with each byte: the lecture's table, one row per byte.

mod traced;

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, BufWriter, Cursor, IsTerminal, Write};
use std::path::Path;

use anyhow::{Error, Result, anyhow, bail};
use framelock_description::hex;
use framelock_receiving::{Policy, Protocol};

use crate::input::{Input, Spelling, for_each_arrival};
use crate::options::ProtocolParser;
use crate::output::{Output, note};
use crate::serial::PortOptions;
use traced::{Step, Traced, is_bin};

/// Show what a receiver does with each byte: the lecture's table, one row per byte
#[derive(clap::Args)]
#[command(after_help = include_str!("help/trace.txt"))]
pub(crate) struct Arguments {
    /// Trace bytes in hex (with or without spaces), a file, a serial port, or - for standard input.
    /// Without an argument, trace the bytes of a pipe, or else the lecture's two worked examples
    #[arg(value_name = "HEX|FILE|PORT|-")]
    source: Vec<OsString>,
    /// Receive with lecture (the lecture's machine, which discards a broken frame), framelock (searches
    /// it again), or both, in one row where they do the same
    #[arg(long, value_enum, default_value_t = Machines::Both, hide_possible_values = true)]
    policy: Machines,
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

/// The receivers whose steps are shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
enum Machines {
    /// The lecture's machine, which discards a broken frame
    Lecture,
    /// framelock's receiver, which searches a broken frame for the start of the next frame
    Framelock,
    /// Both receivers
    Both,
}

impl Machines {
    /// Returns the policies of the receivers. The lecture's machine receives only BIN, so for all other
    /// frames `Both` means framelock alone.
    fn policies(self, protocol: &Protocol) -> &'static [Policy] {
        match self {
            Self::Lecture => &[Policy::Lecture],
            Self::Both if is_bin(protocol) => &[Policy::Lecture, Policy::Framelock],
            Self::Both | Self::Framelock => &[Policy::Framelock],
        }
    }

    /// Writes the rows as the bytes arrive. Flushes all rows before it waits for more bytes. The memory in use does
    /// not grow with the number of bytes.
    fn print(self, protocol: &Protocol, input: Input, out: &mut impl Write) -> Result<()> {
        let mut machines = Vec::new();
        for &policy in self.policies(protocol) {
            machines.push(Traced::new(protocol, policy)?);
        }
        writeln!(out, "offset  byte{}  what happened", machines[0].columns())?;
        out.flush()?;
        for_each_arrival(input, |arrival| {
            for &byte in arrival.bytes() {
                let steps: Vec<Step> = machines
                    .iter_mut()
                    .map(|machine| machine.push(byte))
                    .collect();
                write_rows(out, &machines, |number, name| {
                    machines[number].row(&steps[number], name)
                })?;
            }
            Ok(out.flush()?)
        })?;
        writeln!(out)?;
        write_rows(out, &machines, |number, name| {
            machines[number].balance(name)
        })?;
        Ok(out.flush()?)
    }
}

/// Writes a row for each receiver, or one row for both if the rows are equal. `row` makes the row of a receiver, which
/// begins with a name.
fn write_rows(
    out: &mut impl Write,
    machines: &[Traced],
    row: impl Fn(usize, &str) -> String,
) -> io::Result<()> {
    if machines.len() == 2 && row(0, "both") == row(1, "both") {
        return writeln!(out, "{}", row(0, "both"));
    }
    let numbered = machines.iter().enumerate();
    let mut rows = numbered.map(|(number, machine)| row(number, &machine.policy.to_string()));
    rows.try_for_each(|row| writeln!(out, "{row}"))
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
    let (frame, machines) = (&arguments.frame, arguments.policy);
    let mut print = |heading: &str, input| {
        write!(out, "{heading}")?;
        machines.print(frame, input, &mut out)
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
                let bytes = hex::parse(&[received.replace("--", "")]).map_err(Error::msg)?;
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

impl Arguments {
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
