//! See `framelock_oracles::reader`.
#![no_main]

use framelock_oracles::{Stream, reader};

libfuzzer_sys::fuzz_target!(|input: Stream| {
    reader(&input);
});
