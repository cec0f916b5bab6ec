//! See `framelock_oracles::parser`.
#![no_main]

use framelock_oracles::{Occurred, Stream, parser};

libfuzzer_sys::fuzz_target!(|input: Stream| {
    parser(&input, &mut Occurred::default());
});
