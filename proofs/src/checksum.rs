//! Theorem 4b: a frame of BIN-CRC8 with one to three wrong bits in payload and checksum is not delivered.
//! With four wrong bits it can be delivered (F2).
//!
//! The checksum of four bytes takes one step per byte, and each step is linear ([`steps_are_linear`]). So, by induction
//! over the bytes, an error changes the same bits of the checksum in every frame. Whether the error goes unnoticed does
//! not depend on the frame, so it suffices to try every error in one frame. Theorem 3 states that only frames are
//! delivered.

use framelock::motion::{BinCrc8, Setpoint, crc8};
use framelock::{Encode, Receiver};

use crate::reference;
use crate::states::{is_bin_crc8, receive};

/// The step for one byte is linear: the same difference in the register always leads to the same difference in the
/// result. The checksum consists of four such steps.
#[kani::proof]
#[kani::unwind(34)]
fn steps_are_linear() {
    let step = |register: u8| reference::crc8(&[register]);
    let (register, difference): (u8, u8) = kani::any();
    assert!(step(register ^ difference) ^ step(register) == step(difference) ^ step(0));

    let payload: [u8; 4] = kani::any();
    let mut register = 0;
    let mut place = 0;
    while place < 4 {
        register = step(register ^ payload[place]);
        place += 1;
    }
    assert!(register == crc8(payload));
    kani::cover!(register == 0, "a checksum of 0");
}

/// Returns the number without its lowest 1 bit.
fn clear(bits: u64) -> u64 {
    bits & bits.wrapping_sub(1)
}

#[kani::proof]
#[kani::unwind(34)]
fn one_to_three_wrong_bits() {
    let (wrong, wrong_checksum): ([u8; 4], u8) = kani::any();
    let error = u64::from(u32::from_be_bytes(wrong)) << 8 | u64::from(wrong_checksum);
    kani::assume(error != 0 && clear(clear(clear(error))) == 0);
    assert!(crc8(wrong) ^ crc8([0; 4]) != wrong_checksum);

    let checksum = crc8([0; 4]) ^ wrong_checksum;
    let [reserved, pitch, roll, yaw] = wrong;
    let frame = [b'A', b'B', reserved, pitch, roll, yaw, checksum, b'\r'];
    assert!(!is_bin_crc8(frame));
    assert!(receive(&mut Receiver::<BinCrc8>::new(), frame) == (0, None));
    kani::cover!(clear(error) == 0, "one");
    kani::cover!(clear(clear(error)) != 0, "three");
}

/// Some error of four bits goes unnoticed, so the bound of three bits is exact.
#[kani::proof]
#[kani::unwind(34)]
fn four_wrong_bits() {
    let error = 0x0000_0080_0007_0000;
    assert!(clear(clear(clear(clear(error)))) == 0);
    let sent = u64::from_be_bytes(BinCrc8::encode(Setpoint::default()));
    let received = (sent ^ error).to_be_bytes();
    let committed = receive(&mut Receiver::<BinCrc8>::new(), received);
    assert!(committed == (0, Some(Setpoint::from([0x80, 0, 7]))));
    kani::cover!(true, "a wrong setpoint");
}
