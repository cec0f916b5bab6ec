//! Suggests what to check if a stream yields few frames. Tests each guess on the stream's first bytes before suggesting
//! it.

use std::cmp::Reverse;

use framelock::LineEvent;
use framelock_description::{SHIPPED, hex};
use framelock_receiving::{AnyLine, Policy, Protocol};

/// The number of bytes on which guesses are tested.
pub(super) const TRIED: usize = 64 * 1024;

/// Returns the likely reason why a stream yields few frames of `protocol`. `stream` contains the stream's first bytes.
pub(super) fn likely_cause(protocol: &Protocol, policy: Policy, stream: &[u8]) -> String {
    let own = in_frames(protocol, policy, stream);
    // A guess fits if, with this guess, more than half of all bytes are in frames, and more than twice as many bytes as
    // with the user's options.
    let fits = |protocol: &Protocol, stream: &[u8]| {
        let count = in_frames(protocol, Policy::Framelock, stream);
        2 * count > stream.len() && count > 2 * own
    };
    // If several shipped frames fit equally well, this is the first one.
    let best_of_shipped = |stream: &[u8]| {
        let fitting = shipped().filter(|other| fits(other, stream));
        fitting.min_by_key(|other| Reverse(in_frames(other, Policy::Framelock, stream)))
    };
    let inverted = || stream.iter().map(|byte| !byte).collect::<Vec<u8>>();
    if let Some(bytes) = bytes_of_hex(stream)
        && in_frames(protocol, policy, &bytes) > 0
    {
        let count = bytes.len();
        format!("the input is hex text for {count} bytes, which contain frames: give --input hex")
    } else if policy == Policy::Lecture && fits(protocol, stream) {
        "--policy framelock finds frames".to_owned()
    } else if let Some(other) = best_of_shipped(stream) {
        format!("they are frames of {other}: give --frame {other}")
    } else if fits(protocol, &inverted()) || best_of_shipped(&inverted()).is_some() {
        "every bit is inverted: invert the line, or the bytes".to_owned()
    } else if is_decimal_text(stream) {
        "the input looks like decimal text, such as AB128127128: have the sender write each value as a byte".to_owned()
    } else {
        "check --frame, the baud rate and parity, and whether the line is inverted".to_owned()
    }
}

/// Returns the number of bytes that are in frames.
fn in_frames(protocol: &Protocol, policy: Policy, stream: &[u8]) -> usize {
    let mut line = AnyLine::new(protocol, policy).expect("the decoder has such a line too");
    line.feed(stream, |_| ());
    line.line_event(LineEvent::Idle, |_| ());
    line.counters().frame_bytes as usize
}

fn shipped() -> impl Iterator<Item = Protocol> {
    let named =
        |(name, _): &(&str, &str)| Protocol::named(name).expect("shipped descriptions are valid");
    // Most bytes fit packets without a checksum.
    let has_checksum = |protocol: &Protocol| {
        let description = &protocol.description;
        let mut kinds = description.kinds.iter();
        description.format().packets().is_none()
            || kinds.all(|kind| kind.layout().checksum.is_some())
    };
    SHIPPED.iter().map(named).filter(has_checksum)
}

/// Parses a text as hex. Returns its bytes.
fn bytes_of_hex(stream: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(stream).ok()?;
    // The last line may be incomplete.
    let whole = text.rsplit_once('\n').map_or(text, |(lines, _)| lines);
    hex::parse(&[whole]).ok().filter(|bytes| !bytes.is_empty())
}

fn is_decimal_text(stream: &[u8]) -> bool {
    let is_text_byte = |byte: &u8| matches!(byte, b' '..=b'~' | b'\t' | b'\r' | b'\n');
    let digits = stream.iter().filter(|byte| byte.is_ascii_digit()).count();
    stream.iter().all(is_text_byte) && 10 * digits > 3 * stream.len()
}
