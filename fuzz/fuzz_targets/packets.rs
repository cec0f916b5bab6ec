//! See `framelock_oracles::packets`.
#![no_main]

use framelock_oracles::{AnyPackets, Occurred, packets};

libfuzzer_sys::fuzz_target!(|input: AnyPackets| {
    packets(&input, &mut Occurred::default());
});
