//! What fuzz targets and property tests check: one function for each property.
//!
//! A function takes a structured input and panics if the input shows a bug. It knows nothing of who
//! made the input: libFuzzer (`fuzz/fuzz_targets`), proptest (`core/tests`), or the committed corpora,
//! which the tests here replay on stable Rust. So an input that has once shown a bug is tried ever
//! after.
//!
//! The naive reference, [`mod@framelock_proofs::reference`], says what is right.

#![allow(
    clippy::indexing_slicing,
    reason = "what goes wrong is what an oracle would find"
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
pub use parser::parser;
pub use protocol::Protocol;
pub use reader::reader;
pub use stream::{Stream, StreamStep};
pub use terminal::{LINES, is_harmless, terminal};

use arbitrary::{Arbitrary, Unstructured};

/// A fuzz target: what it does with the fuzzer's bytes.
pub type Target = fn(&[u8]);

/// Every target by name, but for `terminal`: the command line, which it is about, is compiled for its own tests only.
pub const TARGETS: [(&str, Target); 6] = [
    ("parser", |bytes| structured(bytes, parser)),
    ("faults", |bytes| structured(bytes, faults)),
    ("failsafe", |bytes| structured(bytes, failsafe)),
    ("reader", |bytes| structured(bytes, reader)),
    ("framing", |bytes| structured(bytes, framing)),
    ("formats", |bytes| structured(bytes, formats)),
];

/// As `libfuzzer_sys::fuzz_target!` does it. Bytes that are too few are no input.
fn structured<'a, Input: Arbitrary<'a>>(bytes: &'a [u8], check: fn(&Input)) {
    if let Ok(input) = Input::arbitrary_take_rest(Unstructured::new(bytes)) {
        check(&input);
    }
}

/// All that the bytes left over make. What they leave at the end, too few for one more, is ignored.
fn rest<'a, T: Arbitrary<'a>>(u: &mut Unstructured<'a>) -> Vec<T> {
    let mut all = Vec::new();
    while !u.is_empty()
        && let Ok(next) = u.arbitrary()
    {
        all.push(next);
    }
    all
}
