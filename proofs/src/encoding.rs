//! Theorem 11: if a parser at reset receives an encoded setpoint, the parser delivers this setpoint. Conversely, if a
//! parser at reset delivers a setpoint with the last byte of a frame whose reserved byte is 0, the frame is the
//! encoding of this setpoint (F1, F2).

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{Encode, Receiver};

use crate::states::{any_setpoint, receive};

#[kani::proof]
#[kani::unwind(9)]
fn bin() {
    let setpoint = any_setpoint();
    let once = (0, Some(setpoint));
    assert!(receive(&mut Receiver::<Bin>::new(), Bin::encode(setpoint)) == once);
    assert!(receive(&mut Lecture::new(), Bin::encode(setpoint)) == once);

    let bytes: [u8; 7] = kani::any();
    let given = receive(&mut Receiver::<Bin>::new(), bytes);
    assert!(given == receive(&mut Lecture::new(), bytes));
    if let (_, Some(setpoint)) = given {
        let encoded = Bin::encode(setpoint);
        let mut place = 0;
        while place < 7 {
            assert!(place == 2 || encoded[place] == bytes[place]);
            place += 1;
        }
    }
    kani::cover!(given.1.is_some(), "a frame");
}

#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8() {
    let setpoint = any_setpoint();
    let once = (0, Some(setpoint));
    assert!(receive(&mut Receiver::<BinCrc8>::new(), BinCrc8::encode(setpoint)) == once);

    let mut bytes: [u8; 8] = kani::any();
    // The encoder sends 0 as the reserved byte, and another reserved byte would change the checksum.
    bytes[2] = 0;
    let given = receive(&mut Receiver::<BinCrc8>::new(), bytes);
    if let (_, Some(setpoint)) = given {
        let encoded = BinCrc8::encode(setpoint);
        assert!(u64::from_be_bytes(encoded) == u64::from_be_bytes(bytes));
    }
    kani::cover!(given.1.is_some(), "a frame");
}
