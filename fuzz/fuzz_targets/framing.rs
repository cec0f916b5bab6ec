//! See `framelock_oracles::framing`.
#![no_main]

use framelock_oracles::{AnyFormat, Occurred, framing};

libfuzzer_sys::fuzz_target!(|input: AnyFormat| {
    framing(&input, &mut Occurred::default());
});
