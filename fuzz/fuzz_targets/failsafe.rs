//! See `framelock_oracles::failsafe`.
#![no_main]

use framelock_oracles::{Schedule, failsafe};

libfuzzer_sys::fuzz_target!(|input: Schedule| {
    let _ = failsafe(&input);
});
