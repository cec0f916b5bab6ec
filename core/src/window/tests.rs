//! Compares the engine with a naive implementation of the rule, for any format and any stream. The engine takes each
//! stream byte by byte, and in slices that are cut anywhere.

use proptest::prelude::*;
use std::{vec, vec::Vec};

use super::{BLOCK, Window};
use crate::{DiscardReason, Found, FrameBytes, Shape};

/// Draws one of three values, so that bytes often agree with the format. 0 is one of them, because the word is 0 above
/// the window's marker.
fn byte() -> impl Strategy<Value = u8> {
    prop::sample::select(vec![0, 1, 2])
}

/// Draws fewer than 240 bytes: up to four pieces, each of random bytes or of equal bytes.
fn stream() -> impl Strategy<Value = Vec<u8>> {
    let random = prop::collection::vec(byte(), 0..60);
    let same = (byte(), 0..60_usize).prop_map(|(byte, count)| vec![byte; count]);
    prop::collection::vec(prop_oneof![random, same], 0..5).prop_map(|pieces| pieces.concat())
}

/// The outcome of a stream: the indices of its frames' last bytes, the number of discarded bytes for each reason, and
/// the number of pending bytes.
type Outcome = (Vec<usize>, [usize; 8], usize);

/// Checks a frame. The check fails for some frames.
fn check(frame: &[u8]) -> bool {
    frame.iter().map(|&byte| u32::from(byte)).sum::<u32>() % 5 != 1
}

/// Returns the reason why the bytes are neither a frame nor the start of one, or `None` if they are one or the other.
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

fn check_all<const N: usize>(places: &[Option<u8>], checked: bool, bytes: &[u8], cuts: [usize; 2])
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
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4_000))]

    /// Draws random shapes, including those in which a frame may begin with 0, or with any byte.
    #[test]
    fn any_format_cut_anywhere(
        places: [Option<bool>; 16],
        length in 1..=16_usize,
        checked: bool,
        bytes in stream(),
        cuts in [0..300_usize, 0..300],
    ) {
        let places = places.map(|place| place.map(u8::from));
        macro_rules! of_length {
            ($($length:literal)*) => {
                match length {
                    $($length => check_all::<$length>(&places, checked, &bytes, cuts),)*
                    _ => unreachable!("no frame has {length} bytes"),
                }
            };
        }
        of_length!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16);
    }
}

/// Bytes between frames are skipped several at a time.
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
