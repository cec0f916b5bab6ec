//! Encoding, and decoding what was encoded.

use framelock::{Bin, BinCrc8, Format, Lecture, Parser, Receiver};

use super::{any_lecture, any_setpoint, receive};

/// F1: a parser at reset gives back what was encoded; and seven bytes that give a setpoint are
/// its encoding, but for the reserved byte.
///
/// Theorem: 11
/// Length: up to 7 bytes
#[kani::proof]
#[kani::unwind(9)]
fn bin() {
    let setpoint = any_setpoint();
    let once = (0, Some(setpoint));
    assert!(receive(&mut Receiver::<Bin>::new(), Bin::encode(setpoint)) == once);
    assert!(receive(&mut Lecture::new(), Bin::encode(setpoint)) == once);
    let mut reset = any_lecture();
    reset.reset();
    assert!(receive(&mut reset, Bin::encode(setpoint)) == once);

    let bytes: [u8; 7] = kani::any();
    let given = receive(&mut Receiver::<Bin>::new(), bytes);
    assert!(given == receive(&mut Lecture::new(), bytes));
    if let (_, Some(setpoint)) = given {
        let mut encoded = Bin::encode(setpoint);
        encoded[2] = bytes[2];
        assert!(encoded == bytes);
    }
    kani::cover!(given.1.is_some(), "a frame");
}

/// F2: likewise; where the reserved byte is the encoder's 0, all the bytes are.
///
/// Theorem: 11
/// Length: up to 8 bytes
#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8() {
    let setpoint = any_setpoint();
    let once = (0, Some(setpoint));
    assert!(receive(&mut Receiver::<BinCrc8>::new(), BinCrc8::encode(setpoint)) == once);

    let bytes: [u8; 8] = kani::any();
    if let (_, Some(setpoint)) = receive(&mut Receiver::<BinCrc8>::new(), bytes) {
        let encoded = BinCrc8::encode(setpoint);
        assert!(bytes[2] != 0 || encoded == bytes);
        kani::cover!(bytes[2] == 0, "a frame");
    }
}
