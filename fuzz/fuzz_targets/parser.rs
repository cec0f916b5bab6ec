//! See `framelock_fuzz_oracles::parser`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| framelock_fuzz_oracles::parser(data));
