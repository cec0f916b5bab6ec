//! The lecture's two worked examples.

use std::io::Write;

use super::{Format, Policy, print as print_rows};
use crate::stream::Failure;

struct Example {
    heading: &'static str,
    received: &'static [u8],
}

const EXAMPLES: [Example; 2] = [
    Example {
        heading: "\
The lecture's first example: one frame, and the line loses nothing.

  sent      41 42 00 7F C8 4A 0D
  received  41 42 00 7F C8 4A 0D",
        received: &[0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D],
    },
    Example {
        heading: "\
The lecture's second example: two frames, and the line loses 7F and C8 of the first.

  sent      41 42 00 7F C8 4A 0D 41 42 00 82 C4 4A 0D
  received  41 42 00 -- -- 4A 0D 41 42 00 82 C4 4A 0D",
        received: &[
            0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D,
        ],
    },
];

/// Prints them: for each what was sent and what came, and the table.
pub(super) fn print(policy: Policy, out: &mut impl Write) -> Result<(), Failure> {
    let mut separator = "";
    for Example { heading, received } in EXAMPLES {
        writeln!(out, "{separator}{heading}\n")?;
        let mut received = received;
        print_rows(&mut received, policy, Format::Text, out)?;
        separator = "\n\n";
    }
    Ok(())
}
