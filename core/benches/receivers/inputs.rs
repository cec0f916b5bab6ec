//! The input streams of the contenders. The streams are the same in every run.

use framelock::Encode;
use framelock::motion::{Bin, BinCrc8, Setpoint};

/// Returns the approximate number of bytes in each stream. The streams are long for timing, when cargo passes
/// `--bench`, and short if only the answers are checked.
fn size() -> usize {
    let is_timed = std::env::args().any(|argument| argument == "--bench");
    1 << if is_timed { 20 } else { 16 }
}

/// A stream, and the name of the benchmarks that use the stream.
pub(crate) struct Input {
    pub(crate) name: &'static str,
    pub(crate) bytes: Vec<u8>,
}

/// Returns the stream of a perfect line: frames back to back, with random setpoints.
pub(crate) fn clean_frames() -> Input {
    Input {
        name: "clean frames",
        bytes: frames::<Bin>(),
    }
}

/// Returns the stream of a line that loses each byte with probability 1/100.
pub(crate) fn frames_with_losses() -> Input {
    let mut random = Random(0x1055);
    let mut bytes = frames::<Bin>();
    bytes.retain(|_| random.next() % 100 != 0);
    Input {
        name: "one byte in a hundred lost",
        bytes,
    }
}

/// Returns random bytes, as on a line that carries only noise.
pub(crate) fn noise() -> Input {
    let mut random = Random(0x0153);
    let eight_bytes = |_| random.next().to_le_bytes();
    Input {
        name: "noise",
        bytes: (0..size() / 8).flat_map(eight_bytes).collect(),
    }
}

/// Returns the stream of a perfect line in the format with a checksum.
pub(crate) fn clean_frames_with_checksum() -> Input {
    Input {
        name: "clean frames with checksum",
        bytes: frames::<BinCrc8>(),
    }
}

/// Returns streams that are slow to receive. Some have many positions at which a frame may begin, and in others a
/// processor can hardly predict where the next frame begins.
pub(crate) fn worst_cases() -> Vec<Input> {
    let eight_frames_and_one_byte = [b"AB0123\r".repeat(8).as_slice(), b"x"].concat();
    vec![
        repeated("worst case, only A", b"A"),
        repeated("worst case, only AB", b"AB"),
        repeated("worst case, wrong terminators", b"AB01234"),
        repeated("worst case, frames that overlap", b"AB\rx"),
        repeated("worst case, a frame and one byte", b"AB0123\rx"),
        repeated(
            "worst case, eight frames and one byte",
            &eight_frames_and_one_byte,
        ),
        drawn_from("worst case, random A and B", &[b"A", b"B"]),
        drawn_from("worst case, random A, B and CR", &[b"A", b"B", b"\r"]),
        drawn_from(
            "worst case, random parts of frames",
            &[b"A", b"AB", b"AB0123\r", b"x"],
        ),
    ]
}

/// Returns frames back to back, with random setpoints.
fn frames<F: Encode<Message = Setpoint>>() -> Vec<u8> {
    let mut random = Random(0xF4A3);
    let mut bytes = Vec::with_capacity(size() + 8);
    while bytes.len() < size() {
        let [pitch, roll, yaw, ..] = random.next().to_le_bytes();
        let frame = F::encode(Setpoint { pitch, roll, yaw });
        bytes.extend_from_slice(frame.as_ref());
    }
    bytes
}

/// Returns one pattern, repeated.
fn repeated(name: &'static str, pattern: &[u8]) -> Input {
    Input {
        name,
        bytes: pattern.repeat(size() / pattern.len()),
    }
}

/// Returns parts in random order. All parts are equally likely.
fn drawn_from(name: &'static str, parts: &[&[u8]]) -> Input {
    let mut random = Random(0xBADC);
    let mut bytes = Vec::with_capacity(size() + 8);
    while bytes.len() < size() {
        let drawn = random.next() % parts.len() as u64;
        let part = usize::try_from(drawn)
            .ok()
            .and_then(|drawn| parts.get(drawn));
        bytes.extend_from_slice(part.expect("the remainder is an index"));
    }
    Input { name, bytes }
}

/// The random number generator `SplitMix64`, by Steele, Lea and Flood.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ mixed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }
}
