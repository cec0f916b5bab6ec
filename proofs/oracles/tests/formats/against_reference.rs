//! Tests that a receiver finds the same frames as the reference. The streams have faults, and are split into slices at
//! any positions. Also tests that each frame begins with the bytes that its protocol states.

use std::sync::Mutex;

use framelock_oracles::{Fault, FormatLine, FormatStep, Occurred, Protocol, formats};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Beginnings of frames: two `MAVLink` headers, which state a payload that is too long for the message, and the first
/// bytes of an NMEA sentence.
const HEADS: [&[u8]; 3] = [
    b"\xFE\x64\0\x01\x01\0",
    b"\xFD\x64\0\0\0\x01\x01\0\0\0",
    b"$GP",
];

fn step() -> impl Strategy<Value = FormatStep> {
    let bytes = || prop::collection::vec(any::<u8>(), 0..40);
    // 0 loses the byte.
    let inverted = prop_oneof![Just(0), any::<u8>()];
    let fault = (any::<u8>(), inverted).prop_map(|(place, inverted)| Fault { place, inverted });
    let head = prop::sample::select(HEADS.to_vec());
    prop_oneof![
        1 => head.prop_map(|head| FormatStep::Slice(head.to_vec())),
        1 => bytes().prop_map(FormatStep::Slice),
        6 => (bytes(), prop::option::weighted(0.3, fault), any::<u8>())
            .prop_map(|(bytes, fault, size)| FormatStep::Frame(bytes, fault, size)),
        1 => Just(FormatStep::Silence),
    ]
}

const PROTOCOLS: [Protocol; 9] = [
    Protocol::Sbus,
    Protocol::Ibus,
    Protocol::Crsf,
    Protocol::Ubx,
    Protocol::Mavlink1,
    Protocol::Mavlink2,
    Protocol::Nmea,
    Protocol::Rtcm,
    Protocol::SixAxes,
];

/// The outcomes of each protocol.
static OCCURRED: [Mutex<Occurred>; PROTOCOLS.len()] =
    [const { Mutex::new(Occurred::NOTHING) }; PROTOCOLS.len()];

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 200,
        rng_seed: RngSeed::Fixed(1),
        ..ProptestConfig::default()
    })]

    fn any_line(steps in prop::collection::vec(step(), 0..12)) {
        for (protocol, occurred) in PROTOCOLS.into_iter().zip(&OCCURRED) {
            let counters = formats(&FormatLine { protocol, steps: steps.clone() });
            occurred.lock().expect("no count panics").count_all(&counters);
        }
    }
}

/// Each outcome that is possible in a protocol occurs.
#[test]
fn every_format() {
    any_line();
    for (protocol, occurred) in PROTOCOLS.into_iter().zip(&OCCURRED) {
        let mut impossible = match protocol {
            Protocol::Sbus => vec![
                "bad header",
                "broken sync",
                "checksum mismatch",
                "too long",
                "unknown message",
            ],
            Protocol::Ibus => vec![
                "bad header",
                "too long",
                "unknown message",
                "wrong terminator",
            ],
            Protocol::Crsf => vec!["broken sync", "unknown message", "wrong terminator"],
            Protocol::Ubx => vec!["bad header", "unknown message", "wrong terminator"],
            Protocol::Mavlink1 => vec!["bad header", "broken sync", "wrong terminator"],
            Protocol::Mavlink2 => vec!["broken sync", "wrong terminator"],
            Protocol::Nmea => vec!["broken sync", "too long", "unknown message"],
            Protocol::Rtcm => vec![
                "broken sync",
                "too long",
                "unknown message",
                "wrong terminator",
            ],
            Protocol::SixAxes => vec![
                "bad header",
                "checksum mismatch",
                "too long",
                "unknown message",
            ],
        };
        // All line events are idle gaps.
        impossible.extend(["break", "framing error", "overrun", "parity error"]);
        impossible.sort_unstable();
        let missing = occurred.lock().expect("no count panics").missing();
        assert_eq!(missing, impossible, "{protocol:?}");
    }
}
