//! The options of `framelock demo`.

use std::path::PathBuf;

use crate::numbers::{number, probability, whole};

/// The story of a lost byte, without hardware: a simulated PC sends a motion seat's position over a
/// faulty line to the lecture's machine and to framelock, each with the failsafe behind it.
///
/// In turn: the seat stands still, and one lost byte makes the lecture's machine deaf; a ride, over
/// a line that loses and changes bytes; silence, in which the failsafe holds the seat and moves it
/// to the middle; the ride again. It ends with a table. A terminal of 80 columns and 24 rows shows
/// all of it, one of 60 and 16 the most.
#[derive(clap::Args, Clone, Debug)]
#[command(after_help = include_str!("../help/demo.txt"))]
pub(crate) struct Arguments {
    /// Seed of the motion and of the line's faults: the same seed gives the same table
    #[arg(long, default_value_t = 1, value_name = "NUMBER")]
    pub(super) seed: u64,

    /// How long it lasts; the passages are parts of it
    #[arg(long, default_value_t = 20, value_name = "SECONDS", value_parser = |text: &str| whole::<u32>(text, 1, 86_400))]
    pub(super) seconds: u32,

    /// Probability that the line loses a byte of the ride, 0 to 1
    #[arg(long, default_value_t = 0.02, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    pub(super) drop: f64,

    /// Probability that it inverts one bit of a byte of the ride, 0 to 1
    #[arg(long, default_value_t = 0.002, value_name = "PROBABILITY", value_parser = probability, allow_negative_numbers = true)]
    pub(super) flip: f64,

    /// Bits in a second on the line, ten for each byte
    #[arg(long, default_value_t = 115_200, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 300, 10_000_000))]
    pub(super) baud: u32,

    /// Frames in a second: few enough to watch each; motion software sends 50 and more
    #[arg(long, default_value_t = 10, value_name = "NUMBER", value_parser = |text: &str| whole::<u32>(text, 1, 100_000))]
    pub(super) rate: u32,

    /// Byte times without a byte after which the frame under way is dropped; not done unless given,
    /// since DMA and USB adapters deliver in batches
    #[arg(long, value_name = "BYTES", value_parser = |text: &str| whole::<u32>(text, 1, 1_000_000))]
    pub(super) idle_gap: Option<u32>,

    /// The live view's speed: 0.1 for a tenth of real time
    #[arg(long, default_value_t = 1.0, value_name = "FACTOR", value_parser = speed, allow_negative_numbers = true)]
    pub(super) speed: f64,

    /// Lines of text, without waiting: as if standard output were no terminal
    #[arg(long)]
    pub(super) plain: bool,

    /// Write the first ten seconds to a file, as a moving picture (SVG), and show nothing
    #[arg(long, value_name = "FILE", conflicts_with = "plain")]
    pub(super) record: Option<PathBuf>,
}

fn speed(text: &str) -> Result<f64, String> {
    number(text, 0.01, 100.0)
}
