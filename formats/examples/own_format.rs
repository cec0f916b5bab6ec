//! Receives frames of your own formats: one of fixed length, and one with the length in its header.
//!
//! `cargo run -p framelock-formats --example own_format`

use framelock::{
    BufferedReceiver, Classification, DiscardReason, Encode, FixedFormat, Format, LineEvent,
    Receiver, Shape,
};

/// The byte `FE`, a 16-bit throttle, and the byte `0A`.
struct Throttle;

impl FixedFormat for Throttle {
    type Frame = [u8; 4];
    type Message = u16;
    const SHAPE: Shape<[u8; 4]> = Shape::new([Some(0xFE), None, None, Some(0x0A)]);

    fn decode([_, high, low, _]: [u8; 4]) -> u16 {
        u16::from_be_bytes([high, low])
    }
}

// With this line, `cargo check` reports an error if the receiver does not accept the format.
const _: Receiver<Throttle> = Receiver::new();

// This `impl` is needed only if the program also sends frames. `framelock_formats::check_encoding` tests that `encode`
// and `decode` agree.
impl Encode for Throttle {
    fn encode(throttle: u16) -> [u8; 4] {
        let [high, low] = throttle.to_be_bytes();
        [0xFE, high, low, 0x0A]
    }
}

/// The byte `AA`, the length of the text, the text, and the sum of the text's bytes.
///
/// This format is written by hand. A `Layout` of the crate `framelock-formats` describes such a frame in a
/// few lines: see docs/own-frame.md.
#[derive(Clone, Copy)]
pub(crate) struct Text;

impl Format for Text {
    const LONGEST: usize = 34;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        let &[0xAA, ref rest @ ..] = bytes else {
            return Classification::Rejected(DiscardReason::NoSync);
        };
        let Some((&length, rest)) = rest.split_first() else {
            return Classification::Incomplete { at_least: 2 };
        };
        let whole = usize::from(length) + 3;
        if whole > Self::LONGEST {
            return Classification::Rejected(DiscardReason::TooLong);
        }
        match rest.split_at_checked(length.into()) {
            Some((text, &[sum, ..]))
                if sum == text.iter().fold(0, |sum, b| b.wrapping_add(sum)) =>
            {
                Classification::Frame(whole)
            }
            Some((_, [_, ..])) => Classification::Rejected(DiscardReason::ChecksumMismatch),
            _ => Classification::Incomplete { at_least: whole },
        }
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame.get(2..frame.len() - 1).unwrap_or_default()
    }
}

/// A receiver of texts, with a buffer for two of the longest frames.
pub(crate) type TextReceiver = BufferedReceiver<Text, [u8; 2 * Text::LONGEST]>;

/// Takes a byte, a line error or a pause. Calls `on` with the text of each frame.
pub(crate) fn take(
    receiver: &mut TextReceiver,
    found: Result<u8, LineEvent>,
    mut on: impl FnMut(&[u8]),
) {
    match found {
        Ok(byte) => {
            if let Some(frame) = receiver.push(byte) {
                on(frame.message());
            }
        }
        // A whole frame may be among the pending bytes.
        Err(event) => receiver.line_event(event, |found| {
            if let Some(text) = found.decoded() {
                on(text);
            }
        }),
    }
}

pub(crate) fn main() {
    let mut receiver = Receiver::<Throttle>::new();
    for byte in Throttle::encode(1_000) {
        if let Some(throttle) = receiver.push(byte) {
            println!("throttle {throttle}");
        }
    }
    let mut receiver = TextReceiver::new(Text);
    let bytes = b"noise\xAA\x02hi\xD1\xAA\x03";
    let found = bytes.iter().map(|byte| Ok(*byte));
    for found in found.chain([Err(LineEvent::Idle)]) {
        take(&mut receiver, found, |text| {
            println!("{}", text.escape_ascii());
        });
    }
}

// It prints:
// throttle 1000
// hi
