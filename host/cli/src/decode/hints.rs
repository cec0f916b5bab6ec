//! Suggests what to check if a stream yields few frames. Tests each guess on the stream's first bytes before suggesting
//! it.

use std::collections::HashMap;

use framelock::LineEvent;
use framelock_description::{Class, Field, Kind, SHIPPED, Type, hex};
use framelock_formats::layout::Length;
use framelock_receiving::{AnyLine, Policy, Protocol};

/// The number of bytes on which guesses are tested.
pub(super) const TRIED: usize = 64 * 1024;

/// Returns the likely reason why a stream yields few frames of `protocol`. `stream` contains the stream's first bytes.
pub(super) fn likely_cause(protocol: &Protocol, policy: Policy, stream: &[u8]) -> Option<String> {
    let own = in_frames(protocol, policy, stream);
    // A guess fits if, with this guess, more than half of all bytes are in frames, and more than twice as many bytes as
    // with the user's options.
    let fits = |protocol: &Protocol, stream: &[u8]| {
        let count = in_frames(protocol, Policy::Framelock, stream);
        2 * count > stream.len() && count > 2 * own
    };
    if is_utf_16(stream) {
        return Some(
            "the input is UTF-16 text, which > writes in Windows PowerShell: have the program that made \
             the bytes write a file itself, or use cmd /c"
                .to_owned(),
        );
    }
    let hex = bytes_of_hex(stream);
    if let Some(bytes) = hex
        .as_ref()
        .filter(|bytes| in_frames(protocol, policy, bytes) > 0)
    {
        let count = bytes.len();
        return Some(format!(
            "the input is hex text for {count} bytes, which contain frames: give --input hex"
        ));
    }
    let fitting = |stream: &[u8]| {
        let fitting = shipped().filter(|other| fits(other, stream));
        // If several shipped frames fit equally well, suggest the first one.
        let all: Vec<Protocol> = fitting.collect();
        let count = |other: &&Protocol| in_frames(other, Policy::Framelock, stream);
        all.iter().rev().max_by_key(count).cloned()
    };
    if policy == Policy::Lecture && fits(protocol, stream) {
        return Some("--policy framelock finds frames".to_owned());
    }
    // A user's description with the same sync as a shipped description is probably a variant of the shipped one. The
    // user has then chosen the right `--frame`, but a key in the user's description is wrong.
    let is_shipped = SHIPPED.iter().any(|(name, _)| *name == protocol.name);
    if let Some(other) = fitting(stream).filter(|it| is_shipped || sync(it) != sync(protocol)) {
        return Some(format!("they are frames of {other}: give --frame {other}"));
    }
    for (end, name) in [("\n", "LF"), ("\r", "CR"), ("\r\n", "CR LF")] {
        if fits(protocol, &with_line_ends(stream, end.as_bytes())) {
            return Some(format!(
                "frames of {protocol} end in {name}, but other line ends arrive"
            ));
        }
    }
    let inverted: Vec<u8> = stream.iter().map(|byte| !byte).collect();
    if fits(protocol, &inverted) || fitting(&inverted).is_some() {
        return Some("every bit is inverted: invert the line, or the bytes".to_owned());
    }
    let delimited = |kind: &Kind| kind.layout().length == Length::Delimiter;
    let is_text = |byte: &&u8| matches!(byte, b' '..=b'~' | b'\t' | b'\r' | b'\n');
    if stream.len() >= 8
        && share(stream, is_text) > 0.95
        && !protocol.description.kinds.iter().any(delimited)
    {
        let digits = share(stream, |byte| byte.is_ascii_digit());
        return Some(match hex {
            Some(_) if share(stream, |byte| byte.is_ascii_hexdigit()) > digits => {
                "the input looks like text in hex: give --input hex".to_owned()
            }
            None if is_hex_dump(stream) => {
                "the input looks like a hex dump: convert it to bytes, for example by xxd -r"
                    .to_owned()
            }
            _ if digits > 0.3 => {
                "the input looks like decimal text, such as AB128127128: have the sender write \
                                  each value as a byte"
                    .to_owned()
            }
            _ => "the input looks like text".to_owned(),
        });
    }
    if let Some(cause) = wrong_period(protocol, stream) {
        return Some(cause);
    }
    // If the sender's baud rate is at most half of the receiver's, the sender's start bit lasts for two or more of the
    // receiver's bits. The lowest bit of each received byte is then 0.
    let is_even = |byte: &&u8| **byte & 1 == 0;
    let is_steady = stream.iter().all(|byte| Some(byte) == stream.first());
    if stream.len() >= 64 && !is_steady && share(stream, is_even) > 0.98 {
        return Some(
            "the lowest bit of nearly every byte is 0: try half the baud rate, or less".to_owned(),
        );
    }
    None
}

/// Returns the number of bytes that are in frames.
fn in_frames(protocol: &Protocol, policy: Policy, stream: &[u8]) -> usize {
    let Ok(mut line) = AnyLine::new(protocol, policy) else {
        return 0;
    };
    line.feed(stream, |_| ());
    line.line_event(LineEvent::Idle, |_| ());
    usize::try_from(line.counters().frame_bytes).unwrap_or(usize::MAX)
}

fn shipped() -> impl Iterator<Item = Protocol> {
    SHIPPED
        .iter()
        .filter_map(|(name, _)| Protocol::named(name).ok())
}

/// Parses a text as hex. Returns its bytes.
fn bytes_of_hex(stream: &[u8]) -> Option<Vec<u8>> {
    let text = std::str::from_utf8(stream).ok()?;
    // The last line may be incomplete.
    let whole = text.rsplit_once('\n').map_or(text, |(lines, _)| lines);
    hex::parse(&[whole]).ok().filter(|bytes| !bytes.is_empty())
}

/// Returns whether most words are two or four hex digits, some of them letters, as in the output of hexdump and xxd.
fn is_hex_dump(stream: &[u8]) -> bool {
    let is_hex =
        |word: &&[u8]| matches!(word.len(), 2 | 4) && word.iter().all(u8::is_ascii_hexdigit);
    let words = stream
        .split(u8::is_ascii_whitespace)
        .filter(|word| !word.is_empty());
    let (hex, others): (Vec<&[u8]>, Vec<_>) = words.partition(is_hex);
    hex.len() > 2 * others.len() && hex.concat().iter().any(u8::is_ascii_alphabetic)
}

/// Returns whether the bytes begin with a byte order mark, and every second byte is 0.
fn is_utf_16(stream: &[u8]) -> bool {
    let (pairs, _) = stream.as_chunks::<2>();
    match pairs {
        [[0xFF, 0xFE], rest @ ..] => rest.iter().all(|[_, high]| *high == 0),
        [[0xFE, 0xFF], rest @ ..] => rest.iter().all(|[high, _]| *high == 0),
        _ => false,
    }
}

/// Returns the stream with `end` in place of each line end (CR LF, LF or CR).
fn with_line_ends(stream: &[u8], end: &[u8]) -> Vec<u8> {
    let mut replaced = Vec::new();
    let mut before = 0;
    for &byte in stream {
        match (before, byte) {
            (b'\r', b'\n') => {}
            (_, b'\r' | b'\n') => replaced.extend(end),
            _ => replaced.push(byte),
        }
        before = byte;
    }
    replaced
}

/// Returns the share of bytes for which the condition holds.
fn share(stream: &[u8], holds: impl Fn(&&u8) -> bool) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "the counts are small")]
    let share = stream.iter().filter(holds).count() as f64 / stream.len().max(1) as f64;
    share
}

fn sync(protocol: &Protocol) -> Option<&[u8]> {
    let kind = protocol.description.kinds.first()?;
    kind.layout().sync.each().next()
}

/// Returns a hint if frames have a fixed length, but the sync repeats at a distance other than this length.
fn wrong_period(protocol: &Protocol, stream: &[u8]) -> Option<String> {
    let kind = protocol.description.kinds.first()?;
    let sync =
        sync(protocol).filter(|sync| sync.len() > 1 && kind.layout().length == Length::Fixed)?;
    let places = stream.windows(sync.len()).enumerate();
    let places = places.filter_map(|(at, bytes)| (bytes == sync).then_some(at));
    let places: Vec<usize> = places.collect();
    let mut distances = HashMap::<usize, usize>::new();
    for pair in places.windows(2) {
        if let [one, next] = pair {
            *distances.entry(next - one).or_default() += 1;
        }
    }
    let (&distance, &count) = distances.iter().max_by_key(|(_, count)| **count)?;
    let length = kind.layout().longest;
    if distance == length || count < 5 || 2 * count * distance < stream.len() {
        return None;
    }
    let bytes_of = |bytes| {
        let is_it = |field: &&Field| matches!(field.kind, Type::Number(number) if number.bytes == bytes && number.class != Class::Float);
        kind.varying_fields()
            .filter(is_it)
            .map(|field| bytes * field.values())
            .sum::<usize>()
    };
    let guess = match (bytes_of(1), bytes_of(2)) {
        (small @ 1.., _) if distance == length + small => ": are its values 16 bits wide?",
        (small @ 1.., _) if distance + 1 == length + small => {
            ": are its values 16 bits wide, and is a byte missing?"
        }
        _ if distance + 1 == length => ": is a byte missing?",
        (_, large @ 1..) if distance + large / 2 == length => ": are its values 8 bits wide?",
        _ => "",
    };
    Some(format!(
        "{} repeats every {distance} bytes, and a frame of {protocol} has {length}{guess}",
        hex::glued(sync)
    ))
}

#[cfg(test)]
mod tests;
