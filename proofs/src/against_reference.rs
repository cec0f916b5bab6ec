//! Theorem 5: for a stream of any length, the receivers deliver the same frames as the naive whole-buffer
//! [`reference`], and the same bytes are pending at the end (R2, R3).
//!
//! Proof by induction over the reference's loop. The loop tries one position after another at which a frame may begin.
//! From each of these positions on, the machine acts like a machine in which no byte is pending. The harness starts
//! with such a machine, and pushes the following bytes one by one, up to a frame's length or the end of the stream:
//!
//! * If the bytes are a frame, the machine delivers it with the frame's last byte. Afterwards no byte is pending. The
//!   reference continues after the frame.
//! * If the bytes are no frame, the machine has delivered nothing. framelock's reference drops one byte, and the
//!   receiver is in a state as if this byte had never come. The lecture's reference drops all bytes up to and including
//!   the first wrong one. After this wrong byte, no byte is pending in the lecture's machine.
//! * If the stream ends before the bytes are decided, all of them are pending.
//!
//! To check this argument, two harnesses also compare a machine with the reference on whole streams of up to 16 bytes.

use framelock::any_format::part;
use framelock::lecture::{Lecture, State};
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{FixedFormat, FrameBytes, Receiver};

use crate::reference::{self, whole_buffer};
use crate::states::{OfSetpoints, any_setpoint, setpoint_of};

fn rescan<F, R, const N: usize>()
where
    F: FixedFormat<Frame = [u8; N], Message = Setpoint>,
    R: reference::NaiveFormat,
    [u8; N]: FrameBytes,
{
    let bytes: [u8; N] = kani::any();
    let length: usize = kani::any_where(|&length| length > 0 && length <= N);
    let (mut receiver, mut behind) = (Receiver::<F>::new(), Receiver::<F>::new());
    let (mut failed, mut committed) = (None, None);
    let mut place = 0;
    while place < N {
        if place < length {
            assert!(committed.is_none());
            committed = receiver.push(bytes[place]);
            assert!(place == 0 || behind.push(bytes[place]).is_none());
            failed = R::fails_at(part(&bytes, 0, place + 1));
        }
        place += 1;
    }
    if failed.is_some() {
        assert!(committed.is_none() && receiver == behind);
    } else if length < N {
        assert!(committed.is_none() && receiver.pending() == length);
    } else {
        assert!(committed == Some(setpoint_of(bytes)));
        assert!(receiver == Receiver::new());
    }
    kani::cover!(failed == Some(N - 1), "only the last byte is wrong");
    kani::cover!(committed.is_some(), "a frame");
}

#[kani::proof]
#[kani::unwind(9)]
fn rescan_of_bin() {
    rescan::<Bin, reference::Bin, 7>();
}

#[kani::proof]
#[kani::unwind(34)]
fn rescan_of_bin_crc8() {
    rescan::<BinCrc8, reference::BinCrc8, 8>();
}

#[kani::proof]
#[kani::unwind(9)]
fn discard_by_the_lectures_machine() {
    let bytes: [u8; 7] = kani::any();
    let mut machine = Lecture {
        state: State::SyncA,
        temp: any_setpoint(),
    };
    let (mut failed, mut committed) = (None, None);
    let mut length = 1;
    while length <= 7 {
        if failed.is_none() {
            committed = machine.push(bytes[length - 1]);
            failed = <reference::Bin as reference::NaiveFormat>::fails_at(part(&bytes, 0, length));
            let is_over = failed.is_some() || length == 7;
            assert!(failed.is_none_or(|place| place == length - 1));
            assert!(machine.pending() == if is_over { 0 } else { length });
            let is_frame = failed.is_none() && is_over;
            assert!(committed == is_frame.then(|| setpoint_of(bytes)));
        }
        length += 1;
    }
    kani::cover!(failed == Some(6), "only the last byte is wrong");
    kani::cover!(committed.is_some(), "a frame");
}

/// Compares the frames of a machine with those of the reference on every stream of `N` bytes. This covers the frames of
/// each shorter stream, which is the beginning of a longer one. Compares the pending bytes only after `N` bytes.
fn whole_streams<P, F, const N: usize>(mut parser: P)
where
    P: OfSetpoints,
    F: reference::NaiveFormat,
{
    let bytes: [u8; N] = kani::any();
    let mut expected = [None; N];
    let mut known = 0;
    let pending = whole_buffer::<F>(&bytes, |found| {
        known += found.bytes();
        if let Some(setpoint) = found.message() {
            expected[known - 1] = Some(Setpoint::from(setpoint));
        }
    });
    let mut place = 0;
    while place < N {
        assert!(parser.push(bytes[place]) == expected[place]);
        place += 1;
    }
    assert!(parser.pending() == pending);
    kani::cover!(
        pending == F::LENGTH - 1,
        "the stream ends a byte before a frame"
    );
    kani::cover!(expected[N - 1].is_some(), "the stream ends with a frame");
}

#[kani::proof]
#[kani::unwind(17)]
fn whole_streams_by_the_receiver() {
    whole_streams::<_, reference::Bin, 16>(Receiver::<Bin>::new());
}

#[kani::proof]
#[kani::unwind(17)]
fn whole_streams_by_the_lectures_machine() {
    whole_streams::<_, reference::Lecture, 16>(Lecture::new());
}
