//! See `framelock_oracles::failsafe`.
#![no_main]

use framelock_oracles::{Occurred, Schedule, failsafe};

libfuzzer_sys::fuzz_target!(|input: Schedule| {
    failsafe(&input, &mut Occurred::default());
});
