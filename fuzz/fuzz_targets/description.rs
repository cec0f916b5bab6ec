//! Parses texts as descriptions. The property is defined in the descriptions' own tests.
#![no_main]

#[path = "../../host/description/tests/suite/agreement.rs"]
mod agreement;
#[allow(dead_code, reason = "only the tests use random descriptions")]
#[path = "../../host/description/tests/suite/drawn.rs"]
mod drawn;

libfuzzer_sys::fuzz_target!(|text: &str| {
    agreement::is_refused_or_agrees(text);
});
