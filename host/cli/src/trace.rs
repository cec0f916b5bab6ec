//! What the state machine does with each byte: the lecture's table, a row per byte.

mod observed;
mod stream;
mod table;

use std::ffi::OsString;
use std::io::{self, BufRead, BufReader, BufWriter, Cursor, IsTerminal, Write};
use std::path::Path;

use anyhow::{Error, Result, anyhow, bail};
use framelock_description::hex;
use framelock_simulation::FrameFormat;

use crate::frame::{Frame, FrameParser};
use crate::input::{Input, Spelling};
use crate::names::PolicyName;
use crate::output::{Output, note};
use crate::serial::PortOptions;
use table::Format;

/// What the machine does with each byte: the lecture's table, a row per byte
#[derive(clap::Args)]
#[command(after_help = include_str!("help/trace.txt"))]
pub(crate) struct Arguments {
    /// Bytes in hex, separate or glued; or one file or serial port; or - for standard input, which is
    /// read too if bytes are piped in. Else: the lecture's two worked examples
    #[arg(value_name = "HEX|FILE|PORT|-")]
    source: Vec<OsString>,
    /// Which machine: discard (the lecture's, which discards a failed frame), rescan (the receiver,
    /// which searches it for the next), or both, with one row where they do the same
    #[arg(long, value_enum, default_value_t = Machines::Both, hide_possible_values = true)]
    policy: Machines,
    /// The frames: a name, or a file that describes them [default: bin]. Of others than bin each row has
    /// how many bytes are pending, the frames with their fields, and why bytes are discarded
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = FrameParser, hide_possible_values = true)]
    frame: Frame,
    /// How a file, port or pipe is written: bytes, or hex: text such as 41 42 00 or 0x41,0x42
    #[arg(long, value_name = "SPELLING", value_enum, default_value_t = Spelling::Bytes, hide_possible_values = true)]
    input: Spelling,
    /// What to write: text (a table to read) or jsonl (an object per byte and machine)
    #[arg(long, value_enum, default_value_t = Format::Text, hide_possible_values = true)]
    format: Format,
    #[command(flatten)]
    port: PortOptions,
}

/// Whose steps are shown.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
enum Machines {
    /// The lecture's machine, which discards a failed frame
    Discard,
    /// The receiver, which searches a failed frame for the start of the next
    Rescan,
    /// Both
    Both,
}

impl Machines {
    const fn policies(self) -> &'static [PolicyName] {
        match self {
            Self::Discard => &[PolicyName::Discard],
            Self::Rescan => &[PolicyName::Rescan],
            Self::Both => &[PolicyName::Discard, PolicyName::Rescan],
        }
    }

    fn print(
        self,
        frame: &Frame,
        format: Format,
        input: Input,
        out: &mut impl Write,
    ) -> Result<()> {
        match (frame.setpoints, self.policies()) {
            (Some(FrameFormat::Bin), policies) => table::print(policies, format, input, out),
            // The lecture's machine knows no other frame, so both are the receiver.
            (_, &[.., policy]) => stream::print(frame, policy, format, input, out),
            (_, []) => Ok(()),
        }
    }
}

/// The rows of a stream, in each format.
pub(crate) fn texts(frame: &Frame, stream: &[u8]) -> Result<Vec<Vec<u8>>> {
    let rows = [Format::Text, Format::Jsonl].into_iter().map(|format| {
        let mut out = Vec::new();
        Machines::Both.print(frame, format, Input::new("", stream), &mut out)?;
        Ok(out)
    });
    rows.collect()
}

/// The lecture's two worked examples: what the line does, what is sent and what is received.
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
    let mut output = Output::standard()?;
    if arguments.format == Format::Text {
        output = output.of_rows();
    }
    let mut out = BufWriter::new(output);
    let (frame, machines, format) = (&arguments.frame, arguments.policy, arguments.format);
    let mut print = |heading: &str, input| {
        write!(out, "{heading}")?;
        machines.print(frame, format, input, &mut out)
    };
    match (hex::parse(&arguments.source), &*arguments.source) {
        (_, []) => {
            if let Some(input) = arguments.piped()? {
                return print("", input);
            }
            if arguments.format != Format::Text || arguments.frame.name != "bin" {
                bail!(
                    "nothing to trace: the examples are a table of bin frames; for anything else \
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
        (Ok(bytes), _) if bytes.is_empty() => bail!("no bytes in the arguments"),
        (Ok(bytes), words) => {
            if let [only] = words
                && Path::new(only).exists()
            {
                let name = only.display();
                note(&format!(
                    "{name} is taken as hex; for the file write ./{name}"
                ));
            }
            print("", Input::new("", Cursor::new(bytes)))
        }
        (Err(why), [only]) => {
            let input = Input::open(Path::new(only), &arguments.port)
                .map_err(|error| anyhow!("not hex: {why}; and no file: {error:#}"))?;
            print("", input.spelled(arguments.input))
        }
        (Err(why), _) => bail!(why),
    }
}

impl Arguments {
    /// Standard input, if something is piped in.
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
