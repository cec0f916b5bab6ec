//! Compares the engine with a naive implementation of the rule, for random formats and streams. The engine takes each
//! stream byte by byte, and in three slices that are cut at random places.

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::Mutex;
use std::{vec, vec::Vec};

use super::{BLOCK, Window};
use crate::{DiscardReason, Found, FrameBytes, Shape};

/// Draws one of three values, so that bytes often agree with the format. One of the values is 0: the bits above the
/// window's marker are also 0, and the receiver must not take them for bytes.
fn byte() -> impl Strategy<Value = u8> {
    prop::sample::select(vec![0, 1, 2])
}

/// A piece of a stream, of fewer than 60 bytes.
#[derive(Clone, Debug)]
enum Piece {
    Random(Vec<u8>),
    /// A run of equal bytes.
    Same(u8, usize),
    /// Equal frames, with these bytes at the positions that are not fixed. The frame's check may fail.
    Frames([u8; 16], usize),
}

impl Piece {
    fn bytes(&self, places: &[Option<u8>]) -> Vec<u8> {
        match self {
            Self::Random(bytes) => bytes.clone(),
            Self::Same(byte, count) => vec![*byte; *count],
            Self::Frames(free, count) => {
                let frame = places.iter().zip(free);
                let frame = frame.map(|(place, free)| place.unwrap_or(*free));
                frame.collect::<Vec<_>>().repeat(*count)
            }
        }
    }
}

fn pieces() -> impl Strategy<Value = Vec<Piece>> {
    let random = prop::collection::vec(byte(), 0..60).prop_map(Piece::Random);
    let same = (byte(), 0..60_usize).prop_map(|(byte, count)| Piece::Same(byte, count));
    let free = prop::array::uniform16(byte());
    let frames = (free, 1..4_usize).prop_map(|(free, count)| Piece::Frames(free, count));
    prop::collection::vec(prop_oneof![random, same, frames], 0..5)
}

/// The outcome of a stream: the indices of its frames' last bytes, the number of discarded bytes for each reason except
/// `LineEvent`, and the number of pending bytes.
type Outcome = (Vec<usize>, [usize; 8], usize);

/// Checks a frame. The check fails for some frames.
fn check(frame: &[u8]) -> bool {
    frame.iter().map(|&byte| u32::from(byte)).sum::<u32>() % 5 != 1
}

/// Returns `None` if the bytes begin with a frame, or are the start of one. Otherwise returns the reason why no frame
/// begins with them.
fn mismatch(places: &[Option<u8>], bytes: &[u8], checked: bool) -> Option<DiscardReason> {
    let differs = |(place, byte): (&Option<u8>, &u8)| place.is_some_and(|fixed| fixed != *byte);
    let sync = places.iter().take_while(|place| place.is_some()).count();
    match places.iter().zip(bytes).position(differs) {
        Some(0) => Some(if sync > 0 {
            DiscardReason::NoSync
        } else {
            DiscardReason::WrongTerminator
        }),
        Some(place) if place < sync => Some(DiscardReason::BrokenSync),
        Some(_) => Some(DiscardReason::WrongTerminator),
        None if bytes.len() >= places.len() && checked && !check(&bytes[..places.len()]) => {
            Some(DiscardReason::ChecksumMismatch)
        }
        None => None,
    }
}

fn naive(places: &[Option<u8>], checked: bool, bytes: &[u8]) -> Outcome {
    let (mut ends, mut discarded, mut start) = (Vec::new(), [0; 8], 0);
    while start < bytes.len() {
        let rest = &bytes[start..];
        if let Some(why) = mismatch(places, &rest[..places.len().min(rest.len())], checked) {
            discarded[why as usize] += 1;
            start += 1;
        } else if rest.len() < places.len() {
            break;
        } else {
            start += places.len();
            ends.push(start - 1);
        }
    }
    (ends, discarded, bytes.len() - start)
}

fn pushed<F: FrameBytes>(shape: &Shape<F>, checked: bool, bytes: &[u8]) -> (Vec<usize>, Window<F>) {
    let mut window = Window::EMPTY;
    let mut ends = Vec::new();
    for (index, &byte) in bytes.iter().enumerate() {
        let check = |word| !checked || check(F::from_word(word).as_ref());
        if let Some(frame) = window.push(shape, byte, check) {
            assert_eq!(
                F::from_word(frame).as_ref(),
                &bytes[index + 1 - F::LENGTH..=index]
            );
            ends.push(index);
        }
    }
    (ends, window)
}

fn fed<F: FrameBytes>(shape: &Shape<F>, checked: bool, slices: &[&[u8]]) -> (Outcome, Window<F>) {
    let stream = slices.concat();
    let mut window = Window::EMPTY;
    let (mut ends, mut discarded, mut known) = (Vec::new(), [0; 8], 0);
    for slice in slices {
        let check = |word| !checked || check(F::from_word(word).as_ref());
        window.feed(shape, slice, check, |found| {
            let from = known;
            known += found.bytes();
            match found {
                Found::Frame { message, .. } => {
                    assert_eq!(F::from_word(message).as_ref(), &stream[from..known]);
                    ends.push(known - 1);
                }
                Found::Discarded { count, why } => discarded[why as usize] += count,
            }
        });
    }
    ((ends, discarded, window.pending(shape)), window)
}

/// Checks that the engine has the outcome of the naive implementation. Returns this outcome.
fn check_all<const N: usize>(
    places: &[Option<u8>],
    checked: bool,
    bytes: &[u8],
    cuts: [usize; 2],
) -> Outcome
where
    [u8; N]: FrameBytes,
{
    let places: [Option<u8>; N] = *places.first_chunk().expect("sixteen");
    let shape = Shape::new(places);
    let expected = naive(&places, checked, bytes);
    let (ends, window) = pushed(&shape, checked, bytes);
    assert_eq!((&ends, window.pending(&shape)), (&expected.0, expected.2));

    let [first, second] = cuts.map(|cut| cut.min(bytes.len()));
    let (head, tail) = bytes.split_at(first.max(second));
    let (head, middle) = head.split_at(first.min(second));
    let (outcome, after) = fed(&shape, checked, &[head, middle, tail]);
    assert_eq!(outcome, expected, "cut at {cuts:?}");
    assert!(after.agrees_with(window, &shape));
    let single: Vec<&[u8]> = bytes.chunks(1).collect();
    assert_eq!(fed(&shape, checked, &single).0, expected);
    expected
}

/// For each length of a frame, the numbers of frames, of bytes discarded for four reasons, and of pending bytes.
static OCCURRED: Mutex<[[usize; 6]; 17]> = Mutex::new([[0; 6]; 17]);

/// Checks that every possible outcome occurs for every length of a frame: frames, bytes discarded for each of the
/// engine's four reasons, and pending bytes.
#[test]
fn any_format_cut_anywhere() {
    any_format();
    let occurred = OCCURRED.lock().expect("no count panics");
    for (length, occurred) in occurred.iter().enumerate().skip(1) {
        // A frame of one byte has no second byte of a sync, no terminator, and is never pending.
        let impossible = if length == 1 { &[2, 3, 5][..] } else { &[] };
        for (outcome, times) in occurred.iter().enumerate() {
            assert_eq!(
                *times > 0,
                !impossible.contains(&outcome),
                "{length}: {occurred:?}"
            );
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 4_000,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    /// Draws random shapes, including those in which a frame may begin with 0, or with any byte.
    fn any_format(
        places: [Option<bool>; 16],
        length in 1..=16_usize,
        checked: bool,
        pieces in pieces(),
        cuts in [0..300_usize, 0..300],
    ) {
        let places = places.map(|place| place.map(u8::from));
        let bytes = pieces.iter().flat_map(|piece| piece.bytes(&places[..length]));
        let bytes: Vec<u8> = bytes.collect();
        macro_rules! of_length {
            ($($length:literal)*) => {
                match length {
                    $($length => check_all::<$length>(&places, checked, &bytes, cuts),)*
                    _ => unreachable!("no frame has {length} bytes"),
                }
            };
        }
        let (ends, discarded, pending) =
            of_length!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
        let discarded_as = |why: DiscardReason| discarded[why as usize];
        let times = [
            ends.len(),
            discarded_as(DiscardReason::NoSync),
            discarded_as(DiscardReason::BrokenSync),
            discarded_as(DiscardReason::WrongTerminator),
            discarded_as(DiscardReason::ChecksumMismatch),
            pending,
        ];
        let occurred = &mut OCCURRED.lock().expect("no count panics")[length];
        occurred.iter_mut().zip(times).for_each(|(sum, times)| *sum += times);
    }
}

/// `feed` skips the bytes between two frames several at a time.
#[test]
fn noise_is_passed_over_in_runs() {
    let mut bytes = [0x55; 1_000];
    for frame in bytes.chunks_exact_mut(100) {
        frame[..3].copy_from_slice(b"A\0\r");
    }
    let shape = Shape::new([Some(b'A'), None, Some(b'\r')]);
    let (mut frames, mut events, mut dropped) = (0, 0, 0);
    let mut window = Window::EMPTY;
    window.feed(
        &shape,
        &bytes,
        |_| true,
        |event| match event {
            Found::Frame { .. } => frames += 1,
            Found::Discarded { count, .. } => {
                events += 1;
                dropped += count;
            }
        },
    );
    assert_eq!((frames, dropped), (10, 1_000 - 10 * 3));
    // After a frame, `feed` compares single positions for one block, then skips whole blocks, and compares single
    // positions again before the next frame.
    assert!(events <= 10 * (2 * BLOCK + 1), "{events} events");
}
