//! When a frame that is sent in full is delivered, whatever came before.
//!
//! No receiver of BIN can promise it for every frame: what came before, together with the frame's
//! first bytes, may itself be a frame (N2). The strongest that is true of Rescan is here; under
//! Discard nothing of the kind is.

use framelock::{Bin, BinCrc8, Format, Lecture, Parser, Rescan, Setpoint};

use super::{any_lecture, any_receiver, any_setpoint, is_bin, is_bin_crc8, receive};

/// R1: from any state, a frame sent in full is delivered with its last byte; or else one commit
/// came within it, of a frame that ends in its payload, at a payload byte CR. So in any seven
/// bytes that are a frame something is committed: the receiver is never deaf. And a frame without
/// a CR in its payload is always delivered.
///
/// Theorem: 7
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn bin_delivers_or_has_just_committed() {
    let mut receiver = any_receiver::<Bin, Rescan>();
    let frame: [u8; 7] = kani::any();
    kani::assume(is_bin(frame));
    let (before, delivered) = receive(&mut receiver, frame);
    let [_, _, reserved, pitch, roll, yaw, _] = frame;
    assert!(before <= 1);
    assert!(delivered == (before == 0).then_some(Setpoint { pitch, roll, yaw }));
    let carriage_return = [reserved, pitch, roll, yaw].contains(&b'\r');
    assert!(before == 0 || carriage_return);
    kani::cover!(before == 1, "the bound is exact: such a frame can be lost");
    kani::cover!(
        delivered.is_some() && carriage_return,
        "and can be delivered"
    );
}

/// R1, F2: likewise for BIN-CRC8.
///
/// Theorem: 7
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8_delivers_or_has_just_committed() {
    let mut receiver = any_receiver::<BinCrc8, Rescan>();
    let frame: [u8; 8] = kani::any();
    kani::assume(is_bin_crc8(frame));
    let (before, delivered) = receive(&mut receiver, frame);
    let [_, _, reserved, pitch, roll, yaw, crc, _] = frame;
    assert!(before <= 1);
    assert!(delivered == (before == 0).then_some(Setpoint { pitch, roll, yaw }));
    assert!(before == 0 || [reserved, pitch, roll, yaw, crc].contains(&b'\r'));
    kani::cover!(delivered.is_some(), "delivered");
}

/// L1: at reset, and so after every line event (theorem 8), the very next frame is delivered.
///
/// Theorem: 7
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn the_frame_after_a_reset_is_delivered() {
    let mut receiver = any_receiver::<Bin, Rescan>();
    kani::cover!(receiver.pending() == 6, "one byte before a frame's end");
    receiver.reset();
    let mut machine = any_lecture();
    kani::cover!(machine.pending() == 6, "likewise");
    machine.reset();
    let setpoint = any_setpoint();
    assert!(receive(&mut receiver, Bin::encode(setpoint)) == (0, Some(setpoint)));
    assert!(receive(&mut machine, Bin::encode(setpoint)) == (0, Some(setpoint)));
}

/// M1: the lecture's machine goes deaf. There are a state that a single lost byte leads to and a
/// frame that, sent from there, commits nothing and leads back to that state: repeated for ever,
/// it is never delivered. No bound exists.
///
/// Theorem: 7
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn lecture_has_no_bound() {
    // A parked simulator's frame, received without its first byte, and once more.
    let frame: [u8; 7] = kani::any();
    kani::assume(is_bin(frame));
    let mut machine = Lecture::new();
    let mut i = 1;
    while i < 7 {
        kani::assume(machine.push(frame[i]).is_none());
        i += 1;
    }
    kani::assume(receive(&mut machine, frame) == (0, None));
    let deaf = machine;
    let heard = receive(&mut machine, frame);
    kani::cover!(heard == (0, None) && machine == deaf, "deaf for ever");
    kani::cover!(
        frame[2..6] == [0x00, 0x41, 0x42, 0x00] && machine == deaf,
        "finding 1"
    );
}
