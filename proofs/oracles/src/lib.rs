//! The properties that fuzz targets and property tests check: one function for each property.
//!
//! Each function takes a structured input and panics if the input shows a bug. The function does not depend on the
//! source of the input: libFuzzer (`fuzz/fuzz_targets`), proptest (`tests`), or the committed corpora, which the
//! tests here replay on stable Rust. So once an input has shown a bug and is in a corpus, every later run of the tests
//! checks this input.
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

pub use failsafe::{CASES, FailsafeRun, Schedule, ScheduleStep, failsafe};
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
use framelock::Counters;
use framelock::motion::FailsafeError;

/// A fuzz target as a function of the fuzzer's bytes. Counts the outcomes in `Occurred`, but counts nothing if the
/// bytes are too few for an input.
pub type Target = fn(&[u8], &mut Occurred);

/// All targets by name, except `description`. This target needs the code of descriptions, so only the tests of
/// descriptions run it.
pub const TARGETS: [(&str, Target); 6] = [
    ("parser", |bytes, occurred| {
        count_lines(bytes, parser, occurred);
    }),
    ("failsafe", |bytes, occurred| {
        let result = structured(bytes, failsafe).unwrap_or_else(|| Ok(FailsafeRun::default()));
        let error = result.as_ref().err().copied();
        occurred.count_failsafe(&result.unwrap_or_default());
        for (name, contradiction) in [
            ("hold within step", FailsafeError::HoldWithinStep),
            ("ramp before hold", FailsafeError::RampBeforeHold),
            ("single frame", FailsafeError::SingleFrame),
            ("live too fast", FailsafeError::LiveTooFast),
        ] {
            occurred.count(name, error == Some(contradiction));
        }
    }),
    ("reader", |bytes, occurred| {
        count_lines(bytes, reader, occurred);
    }),
    ("framing", |bytes, occurred| {
        count_lines(bytes, framing, occurred);
    }),
    ("packets", |bytes, occurred| {
        count_lines(bytes, packets, occurred);
    }),
    ("formats", |bytes, occurred| {
        let counters = structured(bytes, |line: &FormatLine| (line.format.name, formats(line)));
        if let Some((name, counters)) = counters {
            occurred.count(name, counters.frames);
            occurred.count_all(&counters);
        }
    }),
];

/// Runs a check that returns the counters of lines, and counts their outcomes.
fn count_lines<'a, Input: Arbitrary<'a>, const LINES: usize>(
    bytes: &'a [u8],
    check: fn(&Input) -> [Counters; LINES],
    occurred: &mut Occurred,
) {
    let all = structured(bytes, check).into_iter().flatten();
    all.for_each(|counters| occurred.count_all(&counters));
}

/// Runs a check in the same way as `libfuzzer_sys::fuzz_target!`. Returns `None` if the bytes are too few.
fn structured<'a, Input: Arbitrary<'a>, T>(bytes: &'a [u8], check: fn(&Input) -> T) -> Option<T> {
    let input = Input::arbitrary_take_rest(Unstructured::new(bytes));
    input.ok().map(|input| check(&input))
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
