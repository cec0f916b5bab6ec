//! Tests that a receiver finds the same frames as the reference. The streams have faults, and are split into slices at
//! any positions. Also tests that each frame begins with the bytes that its protocol states.

use framelock_fuzz_oracles::{Fault, FormatLine, FormatStep, Protocol, formats};
use proptest::prelude::*;

fn step() -> impl Strategy<Value = FormatStep> {
    let bytes = || prop::collection::vec(any::<u8>(), 0..40);
    let fault = any::<(u8, u8)>().prop_map(|(place, inverted)| Fault { place, inverted });
    prop_oneof![
        1 => bytes().prop_map(FormatStep::Slice),
        6 => (bytes(), prop::option::weighted(0.3, fault), any::<u8>())
            .prop_map(|(bytes, fault, size)| FormatStep::Frame(bytes, fault, size)),
        1 => Just(FormatStep::Silence),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn every_format(steps in prop::collection::vec(step(), 0..12)) {
        use Protocol::{Crsf, Ibus, Mavlink1, Mavlink2, Nmea, Rtcm, Sbus, SixAxes, Ubx};
        for protocol in [Sbus, Ibus, Crsf, Ubx, Mavlink1, Mavlink2, Nmea, Rtcm, SixAxes] {
            formats(&FormatLine { protocol, steps: steps.clone() });
        }
    }
}
