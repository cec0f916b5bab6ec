//! Theorem 7: from any state, a receiver of BIN or BIN-CRC8 delivers each frame that it receives in full, with the
//! frame's last byte. The only exception is a frame in which another delivered frame ended, between the sync and the
//! terminator (R1). So the receiver delivers a frame during any whole frame, but perhaps a false one. A frame that
//! begins directly after a reset or a line event is delivered (L1). The lecture's machine can stay deaf for ever (M1).
//!
//! No receiver of BIN can promise more. The reason is that the bytes before a frame, together with the frame's first
//! bytes, may themselves be a frame (N2).

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Encode, FixedFormat, FrameBytes};

use crate::states::{
    any_lecture, any_receiver, any_setpoint, is_bin, is_bin_crc8, receive, setpoint_of,
};

fn delivers_or_has_just_committed<F, const N: usize>(is_frame: fn([u8; N]) -> bool)
where
    F: FixedFormat<Frame = [u8; N], Message = Setpoint>,
    [u8; N]: FrameBytes,
{
    let mut receiver = any_receiver::<F, N>();
    let frame: [u8; N] = kani::any();
    kani::assume(is_frame(frame));
    let (before, delivered) = receive(&mut receiver, frame);
    assert!(before <= 1);
    assert!(delivered == (before == 0).then(|| setpoint_of(frame)));
    let mut return_in_payload = false;
    let mut place = 2;
    while place < N - 1 {
        return_in_payload = return_in_payload || frame[place] == b'\r';
        place += 1;
    }
    assert!(before == 0 || return_in_payload);
    kani::cover!(before == 1, "the frame can be lost");
    kani::cover!(
        before == 0 && return_in_payload,
        "the frame can be delivered"
    );
}

#[kani::proof]
#[kani::unwind(9)]
fn bin_delivers_or_has_just_committed() {
    delivers_or_has_just_committed::<Bin, 7>(is_bin);
}

#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8_delivers_or_has_just_committed() {
    delivers_or_has_just_committed::<BinCrc8, 8>(is_bin_crc8);
}

#[kani::proof]
#[kani::unwind(9)]
fn the_frame_after_a_reset_is_delivered() {
    let (mut receiver, mut machine) = (any_receiver::<Bin, 7>(), any_lecture());
    let pending = (receiver.pending(), machine.pending());
    receiver.reset();
    machine.reset();
    let setpoint = any_setpoint();
    assert!(receive(&mut receiver, Bin::encode(setpoint)) == (0, Some(setpoint)));
    assert!(receive(&mut machine, Bin::encode(setpoint)) == (0, Some(setpoint)));
    kani::cover!(pending == (6, 6), "one byte is missing from a frame");
}

/// A sender repeats one frame, and the line loses the first byte. The lecture's machine commits nothing, and after each
/// whole frame it is in the same state again. The receiver delivers the first whole frame.
#[kani::proof]
#[kani::unwind(8)]
fn the_lectures_machine_stays_deaf() {
    let frame = [b'A', b'B', 0, b'A', b'B', 0, b'\r'];
    let (mut machine, mut receiver) = (Lecture::new(), any_receiver::<Bin, 7>());
    let mut place = 1;
    while place < 7 {
        assert!(machine.push(frame[place]).is_none());
        receiver.push(frame[place]);
        place += 1;
    }
    let nothing = (0, None);
    assert!(receive(&mut machine, frame) == nothing);
    let deaf = machine;
    assert!(receive(&mut machine, frame) == nothing && machine == deaf);
    assert!(receive(&mut receiver, frame) == (0, Some(setpoint_of(frame))));
    kani::cover!(true, "the receiver is not deaf");
}
