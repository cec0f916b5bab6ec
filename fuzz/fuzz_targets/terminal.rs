//! See `framelock_oracles::terminal`.
#![no_main]

use std::sync::LazyLock;

use framelock_oracles::{LINES, terminal};
use framelock_host::text_outputs::TextOutputs;

static ALL: LazyLock<Vec<TextOutputs>> =
    LazyLock::new(|| TextOutputs::all(LINES).expect("the descriptions are valid"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| terminal(bytes, |number, stream| {
    ALL[number % ALL.len()]
        .of(stream)
        .expect("writing to memory cannot fail")
}));
