//! The options of `framelock demo`.

use clap::value_parser;

use crate::numbers::{number, probability};

/// The main job without hardware: a simulated motion PC sends frames over a faulty line to the
/// lecture's machine and to the receiver, each with the failsafe behind it.
///
/// In turn: motion over a line that loses and corrupts bytes; silence, in which the failsafe
/// holds, moves to park and comes back; motion; the simulator parked on payload 00 41 42 00, where
/// one lost byte makes the lecture's machine deaf; motion. It ends with a table.
#[derive(clap::Args, Clone, Copy, Debug)]
#[command(after_help = include_str!("../help/demo.txt"))]
pub(crate) struct Arguments {
    /// Seed of the motion and of the line's faults: the same seed gives the same table
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    pub(super) seed: u64,

    /// How long it lasts; the passages are parts of it
    #[arg(long, default_value_t = 26, value_name = "SECONDS", value_parser = value_parser!(u32).range(1..=86_400))]
    pub(super) seconds: u32,

    /// Probability that the line loses a byte in motion, 0 to 1
    #[arg(long, default_value_t = 0.004, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    pub(super) drop: f64,

    /// Probability that it inverts one bit of a byte in motion, 0 to 1
    #[arg(long, default_value_t = 0.0005, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    pub(super) flip: f64,

    /// Bits in a second on the line, ten for each byte
    #[arg(long, default_value_t = 115_200, value_name = "NUMBER", value_parser = value_parser!(u32).range(300..=10_000_000))]
    pub(super) baud: u32,

    /// Frames in a second
    #[arg(long, default_value_t = 50, value_name = "NUMBER", value_parser = value_parser!(u32).range(1..=100_000))]
    pub(super) rate: u32,

    /// Byte times without a byte after which the frame under way is dropped; not done unless given,
    /// since DMA and USB adapters deliver in batches
    #[arg(long, value_name = "BYTES", value_parser = value_parser!(u32).range(1..=1_000_000))]
    pub(super) idle_gap: Option<u32>,

    /// The live view's speed: 0.1 for a tenth of real time
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = speed, allow_negative_numbers = true)]
    pub(super) speed: f64,

    /// Lines of text, without waiting: as if standard output were no terminal
    #[arg(long)]
    pub(super) plain: bool,
}

fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.01, 100.0)
}
