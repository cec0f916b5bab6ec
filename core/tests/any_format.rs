//! Formats that are not this crate's: any length, any bytes fixed or free, against the naive rule.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use framelock::{
    Accounting, Discard, Format, Parser, Policy, Receiver, Rescan, Shape, Window, Word,
};
use proptest::prelude::*;

/// Few values, so that they meet; 0 is what a window holds where nothing has been received.
fn byte() -> impl Strategy<Value = u8> {
    prop::sample::select(vec![0, 1, 2])
}

/// Ends of the leftmost frames that do not overlap.
fn naive(places: &[Option<u8>], bytes: &[u8]) -> Vec<usize> {
    let mut ends = Vec::new();
    let mut start = 0;
    while let Some(window) = bytes.get(start..start + places.len()) {
        let frame = places
            .iter()
            .zip(window)
            .all(|(place, byte)| place.is_none_or(|p| p == *byte));
        if frame {
            start += places.len();
            ends.push(start - 1);
        } else {
            start += 1;
        }
    }
    ends
}

fn ends<W: Word>(shape: &Shape<W>, bytes: &[u8]) -> Vec<usize> {
    let mut window = Window::EMPTY;
    let mut ends = Vec::new();
    for (index, &byte) in bytes.iter().enumerate() {
        let (after, complete) = window.push(shape, byte, |_| true);
        window = after;
        ends.extend(complete.then_some(index));
    }
    ends
}

/// Checks the first so many places as a format of that length.
macro_rules! check {
    ($word:ty, $places:ident, $bytes:ident, $length:ident in $($known:literal)*) => {
        match $length {
            $($known => {
                let places: [Option<u8>; $known] = *$places.first_chunk().expect("sixteen");
                prop_assert_eq!(ends(&Shape::<$word>::new(places), &$bytes), naive(&places, &$bytes));
            })*
            _ => unreachable!("no format of {} bytes", $length),
        }
    };
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    /// Whatever is fixed, to whatever values: also where 0, or anything, may begin a frame.
    #[test]
    fn formats_of_up_to_eight_bytes(
        places: [Option<bool>; 16],
        length in 1..=8_usize,
        bytes in prop::collection::vec(byte(), 0..40),
    ) {
        let places = places.map(|place| place.map(u8::from));
        check!(u64, places, bytes, length in 1 2 3 4 5 6 7 8);
    }

    #[test]
    fn formats_of_up_to_sixteen_bytes(
        places: [Option<bool>; 16],
        length in 1..=16_usize,
        bytes in prop::collection::vec(byte(), 0..60),
    ) {
        let places = places.map(|place| place.map(u8::from));
        check!(u128, places, bytes, length in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
    }

    /// Receivers of such formats: slices cut anywhere against byte by byte.
    #[test]
    fn slices_of_other_formats(
        bytes in prop::collection::vec(byte(), 0..500),
        cut in 0..500_usize,
    ) {
        slices::<FreeStart, Rescan>(&bytes, cut);
        slices::<FreeStart, Discard>(&bytes, cut);
        slices::<ZeroStart, Rescan>(&bytes, cut);
        slices::<ZeroStart, Discard>(&bytes, cut);
        slices::<Sixteen, Rescan>(&bytes, cut);
        slices::<Sixteen, Discard>(&bytes, cut);
    }
}

/// A format that any byte may begin.
struct FreeStart;

impl Format for FreeStart {
    type Word = u64;
    type Frame = [u8; 3];
    type Message = [u8; 3];
    const SHAPE: Shape<u64> = Shape::<u64>::new([None, Some(0), None]);

    fn decode(frame: [u8; 3]) -> [u8; 3] {
        frame
    }

    fn encode(message: [u8; 3]) -> [u8; 3] {
        message
    }
}

/// A format that 0 begins, with a check that is known early: the second byte is not 2.
struct ZeroStart;

impl Format for ZeroStart {
    type Word = u64;
    type Frame = [u8; 8];
    type Message = [u8; 8];
    const SHAPE: Shape<u64> =
        Shape::<u64>::new([Some(0), None, None, Some(0), None, None, None, Some(1)]);
    const CHECK_KNOWN_AT: u8 = 2;

    fn check(frame: [u8; 8]) -> bool {
        frame[1] != 2
    }

    fn decode(frame: [u8; 8]) -> [u8; 8] {
        frame
    }

    fn encode(message: [u8; 8]) -> [u8; 8] {
        message
    }
}

/// The longest frame there can be.
struct Sixteen;

impl Format for Sixteen {
    type Word = u128;
    type Frame = [u8; 16];
    type Message = [u8; 16];
    const SHAPE: Shape<u128> = {
        let mut places = [None; 16];
        places[0] = Some(1);
        places[15] = Some(2);
        Shape::<u128>::new(places)
    };

    fn decode(frame: [u8; 16]) -> [u8; 16] {
        frame
    }

    fn encode(message: [u8; 16]) -> [u8; 16] {
        message
    }
}

fn slices<F: Format, P: Policy>(bytes: &[u8], cut: usize)
where
    F::Message: PartialEq + std::fmt::Debug,
{
    let (mut pushed, mut fed) = (Receiver::<F, P>::new(), Receiver::<F, P>::new());
    let mut expected = Vec::new();
    for (index, &byte) in bytes.iter().enumerate() {
        expected.extend(pushed.push(byte).map(|message| (index, message)));
    }
    let cut = cut.min(bytes.len());
    let mut found = Vec::new();
    fed.feed(&bytes[..cut], &mut |index, message| {
        found.push((index, message));
    });
    fed.feed(&bytes[cut..], &mut |index, message| {
        found.push((cut + index, message));
    });
    assert_eq!(found, expected, "{bytes:?} cut at {cut}");
    assert_eq!(fed, pushed, "{bytes:?} cut at {cut}");

    // Every byte in one place: also those that the slice path drops.
    let mut line = Accounting::new(Receiver::<F, P>::new());
    line.feed(bytes, |_, _| ());
    let placed = u64::from(F::SHAPE.length()) * line.counters().frames
        + line.counters().discarded.total()
        + line.pending() as u64;
    assert_eq!(placed, bytes.len() as u64, "{bytes:?}");
}
