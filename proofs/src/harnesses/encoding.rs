//! Encoding, and decoding what was encoded.

use framelock::{Bin, BinCrc8, Format, Lecture, Parser, Receiver, Setpoint};

use super::{any_lecture, any_setpoint};

/// From reset, the bytes give this setpoint with the last of them, and none before.
fn gives<P: Parser<Message = Setpoint>, const N: usize>(
    mut parser: P,
    bytes: [u8; N],
) -> Option<Setpoint> {
    let mut i = 0;
    while i < N - 1 {
        if parser.push(bytes[i]).is_some() {
            return None;
        }
        i += 1;
    }
    parser.push(bytes[N - 1])
}

/// F1: a parser at reset gives back what was encoded; and seven bytes that give a setpoint are
/// its encoding, but for the reserved byte.
///
/// Theorem: 11
/// Length: up to 7 bytes
#[kani::proof]
#[kani::unwind(9)]
fn bin() {
    let setpoint = any_setpoint();
    assert!(gives(Receiver::<Bin>::new(), Bin::encode(setpoint)) == Some(setpoint));
    assert!(gives(Lecture::new(), Bin::encode(setpoint)) == Some(setpoint));
    let mut reset = any_lecture();
    reset.reset();
    assert!(gives(reset, Bin::encode(setpoint)) == Some(setpoint));

    let bytes: [u8; 7] = kani::any();
    let given = gives(Receiver::<Bin>::new(), bytes);
    assert!(given == gives(Lecture::new(), bytes));
    if let Some(setpoint) = given {
        let mut encoded = Bin::encode(setpoint);
        encoded[2] = bytes[2];
        assert!(encoded == bytes);
    }
    kani::cover!(given.is_some(), "a frame");
}

/// F2: likewise; where the reserved byte is the encoder's 0, all the bytes are.
///
/// Theorem: 11
/// Length: up to 8 bytes
#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8() {
    let setpoint = any_setpoint();
    assert!(gives(Receiver::<BinCrc8>::new(), BinCrc8::encode(setpoint)) == Some(setpoint));

    let bytes: [u8; 8] = kani::any();
    if let Some(setpoint) = gives(Receiver::<BinCrc8>::new(), bytes) {
        let encoded = BinCrc8::encode(setpoint);
        assert!(bytes[2] != 0 || encoded == bytes);
        kani::cover!(bytes[2] == 0, "a frame");
    }
}
