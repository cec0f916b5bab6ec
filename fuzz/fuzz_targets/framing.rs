//! See `framelock_oracles::framing`.
#![no_main]

use framelock_oracles::{AnyFormat, framing};

libfuzzer_sys::fuzz_target!(|input: AnyFormat| {
    framing(&input);
});
