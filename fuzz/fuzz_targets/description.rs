//! Texts as descriptions: the property is that of the descriptions' own tests.
#![no_main]

#[path = "../../host/description/tests/suite/agreement.rs"]
mod agreement;
#[allow(dead_code, reason = "random descriptions are for the tests")]
#[path = "../../host/description/tests/suite/drawn.rs"]
mod drawn;

libfuzzer_sys::fuzz_target!(|text: &str| {
    agreement::is_refused_or_agrees(text);
});
