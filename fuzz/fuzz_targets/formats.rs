//! See `framelock_fuzz_oracles::formats`.
#![no_main]

use framelock_fuzz_oracles::{FormatLine, formats};

libfuzzer_sys::fuzz_target!(|input: FormatLine| {
    formats(&input);
});
