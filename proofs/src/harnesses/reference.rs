//! Equality with the naive whole-buffer reference, for every stream of up to so many bytes.
//!
//! Here the length is bounded. What ties it to streams of any length is in `any_length`: the
//! inductive step is about the same clauses.

use framelock::{Bin, BinCrc8, Discard, Lecture, Parser, Receiver, Setpoint};

use super::{DiscardBin, RescanBin};
use crate::reference::{self, Event, Policy, whole_buffer};

/// Every stream of `N` bytes, and with it every shorter one: commits at the same bytes, with the
/// same setpoints, and as many bytes pending at the end.
fn equals_reference<P, F, const N: usize>(mut parser: P, policy: Policy)
where
    P: Parser<Message = Setpoint>,
    F: reference::Format,
{
    let bytes: [u8; N] = kani::any();
    let mut expected = [None; N];
    let pending = whole_buffer::<F>(&bytes, policy, |event| {
        if let Event::Frame { index, setpoint } = event {
            expected[index] = Some(Setpoint::from(setpoint));
        }
    });
    let mut i = 0;
    while i < N {
        assert!(parser.push(bytes[i]) == expected[i]);
        i += 1;
    }
    assert!(parser.pending() == pending);
    kani::cover!(expected[N - 1].is_some(), "the last byte completes a frame");
    kani::cover!(
        pending == F::LENGTH - 1,
        "the stream ends one byte before a frame does"
    );
}

/// R2: Rescan of BIN.
///
/// Theorem: 5
/// Length: up to 64 bytes
#[kani::proof]
#[kani::unwind(65)]
fn rescan_bin_64() {
    equals_reference::<_, reference::Bin, 64>(RescanBin::new(), Policy::Rescan);
}

/// R2: Rescan of BIN.
///
/// Theorem: 5
/// Length: up to 128 bytes
/// Run: long
#[kani::proof]
#[kani::unwind(129)]
fn rescan_bin_128() {
    equals_reference::<_, reference::Bin, 128>(RescanBin::new(), Policy::Rescan);
}

/// R3, M1: the lecture's machine.
///
/// Theorem: 5
/// Length: up to 64 bytes
#[kani::proof]
#[kani::unwind(65)]
fn lecture_64() {
    equals_reference::<_, reference::Bin, 64>(Lecture::new(), Policy::Discard);
}

/// R3, M1: the lecture's machine.
///
/// Theorem: 5
/// Length: up to 128 bytes
/// Run: long
#[kani::proof]
#[kani::unwind(129)]
fn lecture_128() {
    equals_reference::<_, reference::Bin, 128>(Lecture::new(), Policy::Discard);
}

/// R3: Discard of BIN, by the receiver.
///
/// Theorem: 5
/// Length: up to 24 bytes
#[kani::proof]
#[kani::unwind(25)]
fn discard_bin_24() {
    equals_reference::<_, reference::Bin, 24>(DiscardBin::new(), Policy::Discard);
}

/// R2, F2: Rescan of BIN-CRC8.
///
/// Theorem: 5
/// Length: up to 9 bytes
#[kani::proof]
#[kani::unwind(34)]
fn rescan_bin_crc8_9() {
    equals_reference::<_, reference::BinCrc8, 9>(Receiver::<BinCrc8>::new(), Policy::Rescan);
}

/// R3, F2: Discard of BIN-CRC8.
///
/// Theorem: 5
/// Length: up to 9 bytes
#[kani::proof]
#[kani::unwind(34)]
fn discard_bin_crc8_9() {
    equals_reference::<_, reference::BinCrc8, 9>(
        Receiver::<BinCrc8, Discard>::new(),
        Policy::Discard,
    );
}

/// R3: the lecture's machine is the receiver's policy Discard of BIN: one step from any state
/// that both can be in leads both to the same state, with the same commit.
///
/// Theorem: 5
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn lecture_is_discard_of_bin() {
    let mut receiver = super::any_receiver::<Bin, Discard>();
    let mut machine = super::any_lecture();
    kani::assume(same(&machine, &receiver));
    let byte = kani::any();
    let committed = machine.push(byte);
    assert!(receiver.push(byte) == committed);
    assert!(same(&machine, &receiver));
    kani::cover!(committed.is_some(), "a commit");
}

/// The receiver holds as many bytes as the machine counts, and the temporary setpoints are theirs.
fn same(machine: &Lecture, receiver: &DiscardBin) -> bool {
    let held = receiver.window().history().to_be_bytes();
    let taken = machine.state.bytes_taken();
    let at = |place: usize| held[8 - taken + place];
    receiver.pending() == taken
        && (taken < 4 || at(3) == machine.temp.pitch)
        && (taken < 5 || at(4) == machine.temp.roll)
        && (taken < 6 || at(5) == machine.temp.yaw)
}
