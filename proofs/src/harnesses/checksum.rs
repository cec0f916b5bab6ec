//! What the checksum is worth.

use framelock::{BinCrc8, Parser, Receiver};

use super::is_bin_crc8;

/// One step of the checksum's register for one bit of the payload, highest first, as its
/// catalogue entry describes it.
fn shifted(register: u8, bit: u8) -> u8 {
    let register = register ^ bit << 7;
    if register & 0x80 == 0 {
        register << 1
    } else {
        register << 1 ^ 0x2F
    }
}

/// F2: a frame with one to three wrong bits in payload and checksum is not committed: no payload,
/// no positions excepted.
///
/// The register over what was sent and the one over what was received are followed bit by bit.
/// They differ by the register over the error alone, whatever was sent.
///
/// Theorem: 4b
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn one_to_three_wrong_bits_are_noticed() {
    let payload: [u8; 4] = kani::any();
    let wrong: [u8; 4] = kani::any();
    let wrong_checksum: u8 = kani::any();
    // Clearing the lowest 1 three times leaves nothing: at most three bits.
    let clear = |bits: u64| bits & bits.wrapping_sub(1);
    let error = u64::from(u32::from_be_bytes(wrong)) << 8 | u64::from(wrong_checksum);
    kani::assume(error != 0 && clear(clear(clear(error))) == 0);

    let (mut sent, mut received, mut difference) = (0xFF, 0xFF, 0);
    let mut bit = 0;
    while bit < 32 {
        let at = |bytes: [u8; 4]| bytes[bit / 8] >> (7 - bit % 8) & 1;
        sent = shifted(sent, at(payload));
        received = shifted(received, at(payload) ^ at(wrong));
        difference = shifted(difference, at(wrong));
        assert!(sent ^ received == difference);
        bit += 1;
    }
    // What is sent is a frame, so this is its checksum; and what the receiver expects is not what
    // it gets.
    let xor = |place: usize| payload[place] ^ wrong[place];
    assert!(sent ^ 0xFF == framelock::crc8(payload));
    assert!(received ^ 0xFF == framelock::crc8([xor(0), xor(1), xor(2), xor(3)]));
    assert!(difference != wrong_checksum);

    let mut receiver = Receiver::<BinCrc8>::new();
    let checksum = framelock::crc8(payload) ^ wrong_checksum;
    let frame = [b'A', b'B', xor(0), xor(1), xor(2), xor(3), checksum, b'\r'];
    assert!(!is_bin_crc8(frame));
    let mut i = 0;
    while i < 8 {
        assert!(receiver.push(frame[i]).is_none());
        i += 1;
    }
    kani::cover!(clear(clear(error)) != 0, "an error of three bits");
    kani::cover!(clear(error) == 0, "an error of one bit");
}

/// F2: the bound is exact: four wrong bits can go unnoticed.
///
/// Theorem: 4b
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn four_wrong_bits_can_go_unnoticed() {
    let sent: [u8; 8] = kani::any();
    let received: [u8; 8] = kani::any();
    let difference = u64::from_be_bytes(sent) ^ u64::from_be_bytes(received);
    let clear = |bits: u64| bits & bits.wrapping_sub(1);
    kani::assume(clear(clear(clear(clear(difference)))) == 0);
    let both = is_bin_crc8(sent) && is_bin_crc8(received);
    kani::cover!(
        both && difference != 0,
        "two frames that differ in four bits"
    );
}
