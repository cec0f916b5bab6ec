//! The checks of fuzz targets and property tests: one function for each target.
//!
//! Each function takes a structured input and panics if the input shows a bug. The function does not depend on the
//! source of the input: libFuzzer (`fuzz/fuzz_targets`), proptest (`tests`), or the committed corpora, which
//! `tests/inputs.rs` replays on stable Rust. So once an input has shown a bug and is in a corpus, every later run of
//! the tests checks this input.
//!
//! The naive reference, [`mod@framelock_proofs::reference`], defines the correct results. `failsafe` and `packets` have
//! definitions of their own.

#![allow(
    clippy::indexing_slicing,
    reason = "a panic is a finding of the oracle"
)]
#![allow(
    clippy::must_use_candidate,
    reason = "a fuzzer needs only the panics of a check"
)]

mod failsafe;
mod formats;
mod frame;
mod framing;
mod layout;
mod line;
mod outcome;
mod packets;
mod parser;
mod random;
mod reader;
mod stream;
#[cfg(test)]
mod wrong_reasons;

pub use failsafe::{Schedule, ScheduleStep, failsafe};
pub use formats::{FORMATS, FormatLine, ShippedFormat, formats};
pub use frame::{frame, other_terminators, random_frame};
pub use framing::{AnyFormat, framing};
pub use layout::{EVENTS, LONGEST, interpret, interpret_before, layouts};
pub use line::{ByteFaults, FaultRates, broken, cut, faulty};
pub use outcome::Occurred;
pub use packets::{AnyPackets, PacketCheck, Packets, packets};
pub use parser::parser;
pub use random::{Occurrences, Purpose, Seed, whole};
pub use reader::reader;
pub use stream::{Stream, StreamStep};

use arbitrary::{Arbitrary, Unstructured};

/// A fuzz target as a function of the fuzzer's bytes. Counts the outcomes in `Occurred`, but counts nothing if the
/// bytes are too few for an input.
pub type Target = fn(&[u8], &mut Occurred);

/// All targets by name, except `description`. The target `description` needs the code of descriptions, so the tests of
/// descriptions run it.
pub const TARGETS: [(&str, Target); 6] = [
    ("parser", |bytes, occurred| {
        structured(bytes, |input| {
            parser(&input, occurred);
        });
    }),
    ("failsafe", |bytes, occurred| {
        structured(bytes, |input| failsafe(&input, occurred));
    }),
    ("reader", |bytes, occurred| {
        structured(bytes, |input| reader(&input, occurred));
    }),
    ("framing", |bytes, occurred| {
        structured(bytes, |input| framing(&input, occurred));
    }),
    ("packets", |bytes, occurred| {
        structured(bytes, |input| {
            packets(&input, occurred);
        });
    }),
    ("formats", |bytes, occurred| {
        structured(bytes, |input| formats(&input, occurred));
    }),
];

/// Runs a check as `libfuzzer_sys::fuzz_target!` does. Does nothing if the bytes are too few for an input.
fn structured<'a, Input: Arbitrary<'a>>(bytes: &'a [u8], check: impl FnOnce(Input)) {
    if let Ok(input) = Input::arbitrary_take_rest(Unstructured::new(bytes)) {
        check(input);
    }
}

/// Returns values until the remaining bytes are too few for another value.
fn rest<'a, T: Arbitrary<'a>>(u: &mut Unstructured<'a>) -> Vec<T> {
    let mut all = Vec::new();
    while !u.is_empty()
        && let Ok(next) = u.arbitrary()
    {
        all.push(next);
    }
    all
}
