//! See `framelock_oracles::faults`.
#![no_main]

use framelock_oracles::{FaultyLine, faults};

libfuzzer_sys::fuzz_target!(|input: FaultyLine| {
    faults(&input);
});
