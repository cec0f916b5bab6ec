//! See `framelock_oracles::reader`.
#![no_main]

use framelock_oracles::{Occurred, Stream, reader};

libfuzzer_sys::fuzz_target!(|input: Stream| {
    reader(&input, &mut Occurred::default());
});
