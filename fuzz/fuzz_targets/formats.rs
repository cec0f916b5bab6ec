//! See `framelock_oracles::formats`.
#![no_main]

use framelock_oracles::{FormatLine, Occurred, formats};

libfuzzer_sys::fuzz_target!(|input: FormatLine| {
    formats(&input, &mut Occurred::default());
});
