//! Formats that are not this crate's: any length, any bytes fixed or free, against the naive rule.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use framelock::{
    Accounting, Bin, Discard, Format, Frame, Mismatch, Parser, Policy, Receiver, Rescan, Setpoint,
    Shape, Sink, Window, Word,
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

    /// Receivers of such formats and of this crate's: slices cut anywhere against byte by byte.
    #[test]
    fn slices_of_any_format(
        bytes in noise(),
        frames in (0..500_usize, 0..40_usize),
        cut in 0..500_usize,
    ) {
        both_policies::<Bin>(&bytes, frames, cut);
        both_policies::<FreeStart>(&bytes, frames, cut);
        both_policies::<Free>(&bytes, frames, cut);
        both_policies::<ZeroStart>(&bytes, frames, cut);
        both_policies::<Eight>(&bytes, frames, cut);
        both_policies::<Sixteen>(&bytes, frames, cut);
    }
}

/// What lies between frames is searched a block at a time, not byte by byte: it is told of in sums.
#[test]
fn long_noise_is_told_of_in_few_sums() {
    #[derive(Default)]
    struct Told {
        frames: usize,
        times: usize,
        dropped: usize,
    }
    impl Sink<Setpoint> for Told {
        fn frame(&mut self, _index: usize, _message: Setpoint) {
            self.frames += 1;
        }

        fn dropped(&mut self, count: usize, _why: Mismatch) {
            self.times += 1;
            self.dropped += count;
        }
    }

    let mut bytes = [0x55; 1_000];
    for frame in bytes.chunks_exact_mut(100) {
        frame[..7].copy_from_slice(b"AB\0xyz\r");
    }
    let mut told = Told::default();
    Receiver::<Bin>::new().feed(&bytes, &mut told);
    assert_eq!((told.frames, told.dropped), (10, 1_000 - 10 * 7));
    assert!(told.times <= 100, "{} times", told.times);
}

/// Up to 500 bytes: random ones, and stretches of one and the same.
fn noise() -> impl Strategy<Value = Vec<u8>> {
    let random = prop::collection::vec(byte(), 0..100);
    let same = (byte(), 0..100_usize).prop_map(|(byte, count)| vec![byte; count]);
    prop::collection::vec(prop_oneof![random, same], 0..6).prop_map(|pieces| pieces.concat())
}

/// A format whose messages are its frames.
macro_rules! raw_format {
    ($(#[$doc:meta])* $name:ident, $word:ty, $length:literal, $places:expr $(, $check:item)*) => {
        $(#[$doc])*
        struct $name;

        impl Format for $name {
            type Word = $word;
            type Frame = [u8; $length];
            type Message = [u8; $length];
            const SHAPE: Shape<$word> = Shape::<$word>::new($places);
            $($check)*

            fn decode(frame: [u8; $length]) -> [u8; $length] {
                frame
            }

            fn encode(message: [u8; $length]) -> [u8; $length] {
                message
            }
        }
    };
}

raw_format!(
    /// A format that any byte may begin.
    FreeStart, u64, 3, [None, Some(0), None]
);

raw_format!(
    /// A format that 0 begins, with a check that is known early: the second byte is not 2.
    ZeroStart, u64, 8, [Some(0), None, None, Some(0), None, None, None, Some(1)],
    const CHECK_KNOWN_AT: u8 = 2;,
    fn check(frame: [u8; 8]) -> bool {
        frame[1] != 2
    }
);

raw_format!(
    /// A format without fixed bytes: only its check tells a frame.
    Free, u64, 3, [None, None, None],
    fn check(frame: [u8; 3]) -> bool {
        frame[0] != 2
    }
);

raw_format!(
    /// A frame that fills the word, and begins with what no other byte of the test is.
    Eight, u64, 8, [Some(0xFF), None, None, None, None, None, None, None]
);

raw_format!(
    /// The longest frame there can be.
    Sixteen, u128, 16, {
        let mut places = [None; 16];
        places[0] = Some(1);
        places[15] = Some(2);
        places
    }
);

/// Makes some of the bytes frames that follow each other: so many, from there on.
fn put_frames<F: Format>(bytes: &mut [u8], (from, count): (usize, usize)) {
    let [mask, pattern] = [F::SHAPE.mask(), F::SHAPE.pattern()].map(F::Frame::from_word);
    let fixed = mask.as_ref().iter().zip(pattern.as_ref()).cycle();
    let bytes = bytes.iter_mut().skip(from).take(count * F::Frame::LENGTH);
    for (byte, (mask, fixed)) in bytes.zip(fixed) {
        *byte = *byte & !mask | fixed;
    }
}

fn both_policies<F: Format>(noise: &[u8], frames: (usize, usize), cut: usize)
where
    F::Message: PartialEq + std::fmt::Debug,
{
    let mut bytes = noise.to_vec();
    put_frames::<F>(&mut bytes, frames);
    slices::<F, Rescan>(&bytes, cut);
    slices::<F, Discard>(&bytes, cut);
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

    // Every byte in one place, and in the same: also those that the slice path drops.
    let mut line = Accounting::new(Receiver::<F, P>::new());
    line.feed(bytes, |_, _| ());
    let placed = u64::from(F::SHAPE.length()) * line.counters().frames
        + line.counters().discarded.total()
        + line.pending() as u64;
    assert_eq!(placed, bytes.len() as u64, "{bytes:?}");
    let mut by_bytes = Accounting::new(Receiver::<F, P>::new());
    for &byte in bytes {
        by_bytes.push(byte);
    }
    assert_eq!(line, by_bytes, "{bytes:?}");
}
