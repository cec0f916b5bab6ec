//! What the state machine does with each byte: the lecture's table, a row per byte.

mod observed;
mod stream;
mod table;

use std::ffi::OsString;
use std::io::{BufWriter, Cursor, Write};
use std::path::Path;

use anyhow::{Error, Result, anyhow, bail};
use framelock_simulation::FrameFormat;

use crate::frame::Frame;
use crate::hex;
use crate::input::Input;
use crate::names::PolicyName;
use crate::output::Output;
use table::Format;

/// Show what the state machine does with each byte: the lecture's table, a row per byte.
///
/// Each row has the byte's offset, the byte, the state before and after it (the lecture's names:
/// A, B, 1, 2, 3, 4, CR), the temporary pitch, roll and yaw as stored last, the current setpoint
/// (SP), and what happened. Below the rows: where every byte has gone.
#[derive(clap::Args)]
#[command(after_help = include_str!("help/trace.txt"))]
pub(crate) struct Arguments {
    /// Bytes in hex, separate or glued; or one file or serial port; or - for standard input.
    /// Nothing: the lecture's two worked examples
    ///
    /// What can be read as hex is hex, even if a file has that name: write ./4142 for the file.
    #[arg(value_name = "HEX|FILE|PORT|-")]
    source: Vec<OsString>,

    /// Which machine: the lecture's (discard), the receiver (rescan), or both
    ///
    /// With both there is one row where they do the same and one each where they differ: what
    /// firmware like the lecture's makes of the bytes, and what this receiver does.
    #[arg(long, value_enum, default_value_t = Machines::Both)]
    policy: Machines,

    /// The frames: a name, or a file that describes them [default: bin]. Of others than bin each row has
    /// how many bytes are pending, the frames with their fields, and why bytes are discarded
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = Frame::named, requires = "source")]
    frame: Frame,

    /// A table, or a JSON object per byte and machine
    #[arg(
        long,
        value_enum,
        default_value_t = Format::Text,
        requires_if("jsonl", "source")
    )]
    format: Format,

    /// The serial port's rate [default: 115200]; 8 data bits, no parity, 1 stop bit
    #[arg(long, value_name = "RATE", value_parser = clap::value_parser!(u32).range(1..), requires = "source")]
    baud: Option<u32>,
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

    /// The lecture's machine knows one frame only: of others, both are the receiver.
    const fn of_any_frames(self) -> PolicyName {
        match self {
            Self::Discard => PolicyName::Discard,
            Self::Rescan | Self::Both => PolicyName::Rescan,
        }
    }
}

/// The lecture's two worked examples: what the line does, what is sent and what is received.
const EXAMPLES: [[&str; 3]; 2] = [
    [
        "The lecture's first example: one frame, and the line loses nothing.",
        "41 42 00 7F C8 4A 0D",
        "41 42 00 7F C8 4A 0D",
    ],
    [
        "The lecture's second example: two frames, and the line loses 7F and C8 of the first.",
        "41 42 00 7F C8 4A 0D 41 42 00 82 C4 4A 0D",
        "41 42 00 -- -- 4A 0D 41 42 00 82 C4 4A 0D",
    ],
];

/// Runs `framelock trace`.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    let mut out = BufWriter::new(Output::standard()?);
    let mut print = |heading: &str, input| {
        write!(out, "{heading}")?;
        if arguments.frame.setpoints != Some(FrameFormat::Bin) {
            let policy = arguments.policy.of_any_frames();
            return stream::print(&arguments.frame, policy, arguments.format, input, &mut out);
        }
        table::print(
            arguments.policy.policies(),
            arguments.format,
            input,
            &mut out,
        )
    };
    match (hex::parse(&arguments.source), &*arguments.source) {
        (_, []) => {
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
                eprintln!("framelock: {name} is taken as hex; for the file write ./{name}");
            }
            print("", Input::new("", Cursor::new(bytes)))
        }
        (Err(why), [only]) => {
            let input = Input::open(Path::new(only), arguments.baud)
                .map_err(|error| anyhow!("not hex: {why}; and no file: {error:#}"))?;
            print("", input)
        }
        (Err(why), _) => bail!(why),
    }
}
