//! The properties that fuzz targets and property tests check: one function for each property.
//!
//! Each function takes a structured input and panics if the input shows a bug. The function does not depend on the
//! source of the input: libFuzzer (`fuzz/fuzz_targets`), proptest (`core/tests`), or the committed corpora, which the
//! tests here replay on stable Rust. So an input that has shown a bug is checked in every later run of the tests.
//!
//! The naive reference, [`mod@framelock_proofs::reference`], defines the correct results.

#![allow(
    clippy::indexing_slicing,
    reason = "a panic is a finding of the oracle"
)]
#![allow(
    clippy::must_use_candidate,
    reason = "a fuzzer needs only the panics of a check"
)]

mod failsafe;
mod faults;
mod formats;
mod framing;
mod outcome;
mod parser;
mod protocol;
mod reader;
mod stream;
mod terminal;

pub use failsafe::{Schedule, ScheduleStep, failsafe};
pub use faults::{FaultyLine, faults};
pub use formats::{Fault, FormatLine, FormatStep, formats};
pub use framing::{AnyFormat, framing};
pub use outcome::Occurred;
pub use parser::parser;
pub use protocol::Protocol;
pub use reader::reader;
pub use stream::{Stream, StreamStep};
pub use terminal::{LINES, is_harmless, terminal};

use arbitrary::{Arbitrary, Unstructured};

/// A fuzz target as a function of the fuzzer's bytes. Returns false if the bytes are too few for an
/// input.
pub type Target = fn(&[u8]) -> bool;

/// All targets by name, except `terminal` and `description`. These two depend on the command line and on descriptions,
/// which are compiled only for their own tests.
pub const TARGETS: [(&str, Target); 6] = [
    ("parser", |bytes| structured(bytes, parser)),
    ("faults", |bytes| structured(bytes, faults)),
    ("failsafe", |bytes| structured(bytes, failsafe)),
    ("reader", |bytes| structured(bytes, reader)),
    ("framing", |bytes| structured(bytes, framing)),
    ("formats", |bytes| structured(bytes, formats)),
];

/// Runs a check like `libfuzzer_sys::fuzz_target!`. Returns false if the bytes are too few.
fn structured<'a, Input: Arbitrary<'a>, T>(bytes: &'a [u8], check: fn(&Input) -> T) -> bool {
    let input = Input::arbitrary_take_rest(Unstructured::new(bytes));
    input.map(|input| check(&input)).is_ok()
}

/// Returns values until the bytes are too few for another one.
fn rest<'a, T: Arbitrary<'a>>(u: &mut Unstructured<'a>) -> Vec<T> {
    let mut all = Vec::new();
    while !u.is_empty()
        && let Ok(next) = u.arbitrary()
    {
        all.push(next);
    }
    all
}
