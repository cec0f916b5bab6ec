//! Compares the checksum with a catalogue of CRCs, and tests it with every small error.

use framelock::motion::{BinCrc8, Setpoint, crc8};
use framelock::{Encode, Receiver};
use framelock_proofs::reference;
use proptest::prelude::*;

const CATALOGUE: crc::Crc<u8> = crc::Crc::<u8>::new(&crc::CRC_8_AUTOSAR);

#[test]
fn the_reference_gives_the_catalogues_check_value() {
    assert_eq!(crc::CRC_8_AUTOSAR.check, 0xDF);
    assert_eq!(reference::crc8(b"123456789"), 0xDF);
}

proptest! {
    #[test]
    fn crc8_is_the_catalogues(payload: [u8; 4]) {
        prop_assert_eq!(crc8(payload), CATALOGUE.checksum(&payload));
        prop_assert_eq!(reference::crc8(&payload), CATALOGUE.checksum(&payload));
    }
}

/// A frame with one to three wrong bits in payload and checksum is never delivered. The test tries every choice of
/// positions for three payloads. (One payload would be enough, because the code is linear.)
#[test]
fn one_to_three_wrong_bits_are_never_committed() {
    let bits = 2 * 8..7 * 8;
    for setpoint in [[0, 0, 0], [0x41, 0x42, 0x0D], [0xFF, 0x80, 0x01]].map(Setpoint::from) {
        let frame = BinCrc8::encode(setpoint);
        let mut tried = 0;
        for a in bits.clone() {
            for b in a..bits.end {
                for c in b..bits.end {
                    let mut wrong = frame;
                    // If two of the three positions are equal, the error has fewer than three bits.
                    for bit in [Some(a), (b != a).then_some(b), (c != b).then_some(c)]
                        .into_iter()
                        .flatten()
                    {
                        wrong[bit / 8] ^= 0x80 >> (bit % 8);
                    }
                    let mut receiver = Receiver::<BinCrc8>::new();
                    let committed = wrong.iter().any(|&byte| receiver.push(byte).is_some());
                    assert!(!committed, "{wrong:02X?}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 40 * 41 * 42 / 6);
        let mut receiver = Receiver::<BinCrc8>::new();
        let setpoints: Vec<_> = frame
            .iter()
            .filter_map(|&byte| receiver.push(byte))
            .collect();
        assert_eq!(setpoints, [setpoint]);
    }
}

/// Some errors of four bits go unnoticed, so the bound of three bits is exact.
#[test]
fn some_four_wrong_bits_are_committed() {
    let found = (0..40_u32).any(|a| {
        (0..a).any(|b| {
            (0..b).any(|c| {
                (0..c).any(|d| {
                    let error = (1_u64 << a | 1 << b | 1 << c | 1 << d).to_be_bytes();
                    // The code is linear, so the difference of two checksums depends only on the error. This difference
                    // is the error's own checksum, without the effect of the initial value and the final exclusive or.
                    let [_, _, _, e0, e1, e2, e3, crc] = error;
                    crc8([e0, e1, e2, e3]) ^ crc8([0; 4]) == crc
                })
            })
        })
    });
    assert!(found);
}
