//! What the fuzz targets check: one function each, from the fuzzer's bytes to assertions.
//!
//! A function panics if what it is given shows a bug, and returns otherwise. It knows nothing of the
//! fuzzer: `fuzz/fuzz_targets` hands it libFuzzer's inputs, and the tests here hand it the committed
//! corpora, on stable Rust. So an input that has once shown a bug goes on being tried.
//!
//! Frames and drops are compared with the naive reference, [`mod@framelock_proofs::reference`].

mod chunks;
mod decode;
mod expected;
mod failsafe;
mod faults;
mod parser;
mod reader;

pub use chunks::chunks;
pub use decode::decode;
pub use failsafe::failsafe;
pub use faults::faults;
pub use parser::parser;

/// What a target does with an input.
pub type Target = fn(&[u8]);

/// Every target here by name.
pub const TARGETS: [(&str, Target); 5] = [
    ("parser", parser),
    ("chunks", chunks),
    ("faults", faults),
    ("failsafe", failsafe),
    ("decode", decode),
];
