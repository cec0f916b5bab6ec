//! See `framelock_fuzz_oracles::framing`.
#![no_main]

use framelock_fuzz_oracles::{AnyFraming, framing};

libfuzzer_sys::fuzz_target!(|input: AnyFraming| framing(&input));
