//! See `framelock_oracles::formats`.
#![no_main]

use framelock_oracles::{FormatLine, formats};

libfuzzer_sys::fuzz_target!(|input: FormatLine| {
    formats(&input);
});
