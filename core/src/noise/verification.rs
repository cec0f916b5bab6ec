//! Theorems 6 and 13a: the search skips only bytes that start no frame.

use core::cell::Cell;

use super::{BLOCK, blocks_without_start, run_without_start};
use crate::any_format::part;

/// Returns whether the byte is odd. In two harnesses the odd bytes start a frame, and the even bytes do not. This
/// choice stands for any format, because the search uses no property of a byte except whether it starts a frame.
fn is_odd(byte: u8) -> bool {
    byte % 2 == 1
}

fn any_place(before: usize) -> usize {
    usize::from(kani::any_where(|&place: &u8| usize::from(place) < before))
}

#[kani::proof]
#[kani::unwind(36)]
fn blocks_have_no_start() {
    let bytes: [u8; 2 * BLOCK + 1] = kani::any();
    let run = blocks_without_start(&bytes, is_odd);
    let place = any_place(bytes.len());
    assert!(run <= bytes.len());
    assert!(place >= run || !is_odd(bytes[place]));
    kani::cover!(run == 2 * BLOCK, "two blocks");
    kani::cover!(run == 0, "none");
}

#[kani::proof]
#[kani::unwind(20)]
fn runs_end_at_a_start() {
    let bytes: [u8; BLOCK + 2] = kani::any();
    let run = run_without_start(&bytes, is_odd);
    let place = any_place(bytes.len());
    assert!(run <= bytes.len());
    assert!(place >= run || !is_odd(bytes[place]));
    assert!(run == bytes.len() || is_odd(bytes[run]));
    kani::cover!(run == BLOCK + 1, "a block and a byte");
    kani::cover!(run == 0, "none");
}

/// Theorem 1: the search takes slices of any length up to 4096 bytes. In this harness `starts` returns false once, and
/// then always true. Otherwise the prover would have to unroll one iteration for each block of the slice.
#[kani::proof]
#[kani::unwind(18)]
fn long_slice_is_searched() {
    static BYTES: [u8; 4096] = [0; 4096];
    let length = usize::from(kani::any::<u16>());
    kani::assume(length <= BYTES.len());
    let bytes = part(&BYTES, 0, length);
    let examined = Cell::new(0);
    let run = run_without_start(bytes, |_| {
        examined.set(examined.get() + 1);
        examined.get() > 1
    });
    assert!(run == 0);
    kani::cover!(length == BYTES.len(), "a long slice");
}
