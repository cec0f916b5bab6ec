//! See `framelock_description_oracles::is_refused_or_agrees`.
#![no_main]

use framelock_description_oracles::is_refused_or_agrees;
use framelock_oracles::Occurred;

libfuzzer_sys::fuzz_target!(|text: &str| {
    is_refused_or_agrees(text, &mut Occurred::default());
});
