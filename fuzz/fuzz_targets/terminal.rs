//! See `framelock_fuzz_oracles::terminal`.
#![no_main]

use std::sync::LazyLock;

use framelock_fuzz_oracles::{LINES, terminal};
use framelock_host::texts::Texts;

static ALL: LazyLock<Vec<Texts>> =
    LazyLock::new(|| Texts::all(LINES).expect("they are described rightly"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| terminal(bytes, |number, stream| {
    ALL[number % ALL.len()]
        .of(stream)
        .expect("memory takes all")
}));
