//! Theorems 3 and 4. A receiver delivers a setpoint exactly when its last bytes are a frame that shares no byte with an
//! earlier delivered frame. It does so in the step that takes the last of these bytes, and the setpoint is the one in
//! these bytes (R1, R2, R4). The lecture's machine also commits only frames, and none that shares a byte with a frame
//! that it has committed itself (M2). But it does not commit all such frames.
//!
//! Proof by induction. The harness takes any history, a machine whose state matches the history, and any next byte. It
//! shows that the machine delivers exactly when the theorems say so, and that the new state matches the history with
//! this byte appended. The state at reset matches the empty history, so the theorems hold after every stream. The
//! module `commits` in `core/src/window/verification.rs` has the proof for every format of one to eight bytes, and of
//! sixteen.

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{FixedFormat, FrameBytes, Receiver};

use crate::states::{History, any_lecture, is_bin, is_bin_crc8, setpoint_of};

fn commits_exactly_the_frames<F, const N: usize>(is_frame: fn([u8; N]) -> bool)
where
    F: FixedFormat<Frame = [u8; N], Message = Setpoint>,
    [u8; N]: FrameBytes,
{
    let reset = History {
        last: kani::any(),
        since: 0,
    };
    assert!(Receiver::<F>::new() == reset.receiver());

    let history = History::<N>::any();
    let byte = kani::any();
    let mut receiver = history.receiver::<F>();
    let setpoint = receiver.push(byte);

    let next = history.then(byte, false);
    let frame = usize::from(next.since) == N && is_frame(next.last);
    assert!(setpoint == frame.then(|| setpoint_of(next.last)));
    assert!(receiver == history.then(byte, frame).receiver());
    kani::cover!(frame, "a frame is delivered");
    kani::cover!(
        !frame && is_frame(next.last),
        "a frame overlaps an earlier delivered frame"
    );
}

#[kani::proof]
#[kani::unwind(9)]
fn bin() {
    commits_exactly_the_frames::<Bin, 7>(is_bin);
}

#[kani::proof]
#[kani::unwind(34)]
fn bin_crc8() {
    commits_exactly_the_frames::<BinCrc8, 8>(is_bin_crc8);
}

/// Returns whether the machine's state matches the history. The pending bytes must have come after the last commit, and
/// must be the beginning of a frame. If a pending byte is a demand, the temporary setpoint for this demand must contain
/// the byte.
fn matches(machine: Lecture, history: History<7>) -> bool {
    let taken = machine.pending();
    let at = |place: usize| history.last[7 - taken + place];
    taken <= usize::from(history.since)
        && (taken < 1 || at(0) == b'A')
        && (taken < 2 || at(1) == b'B')
        && (taken < 4 || at(3) == machine.temp.pitch)
        && (taken < 5 || at(4) == machine.temp.roll)
        && (taken < 6 || at(5) == machine.temp.yaw)
}

#[kani::proof]
#[kani::unwind(8)]
fn lecture() {
    let reset = History {
        last: kani::any(),
        since: 0,
    };
    assert!(matches(Lecture::new(), reset));

    let history = History::any();
    let mut machine = any_lecture();
    kani::assume(matches(machine, history));
    let byte = kani::any();
    let committed = machine.push(byte);

    let next = history.then(byte, false);
    let is_frame = next.since == 7 && is_bin(next.last);
    assert!(committed.is_none_or(|setpoint| is_frame && setpoint == setpoint_of(next.last)));
    assert!(matches(machine, history.then(byte, committed.is_some())));
    kani::cover!(committed.is_some(), "a frame is committed");
    kani::cover!(committed.is_none() && is_frame, "a frame is missed");
}
