//! See `framelock_fuzz_oracles::reader`.
#![no_main]

use framelock_fuzz_oracles::{Stream, reader};

libfuzzer_sys::fuzz_target!(|input: Stream| {
    reader(&input);
});
