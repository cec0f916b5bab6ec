//! See `framelock_fuzz_firmware::firmware`.
#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| framelock_fuzz_firmware::firmware(data));
