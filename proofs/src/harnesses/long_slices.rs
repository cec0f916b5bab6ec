//! Slices of 96 bytes and more: the parts of the path that searches them by blocks.
//!
//! What that path does is said most simply of *starts*, the places at which a frame may begin, judged
//! one after the other: where a frame begins it is committed, and the next start is behind it; any
//! other start is dropped, for the first place at which its frame fails, and the next start is the
//! next byte.
//!
//! 1. Byte by byte a receiver does just that ([`bytes_judge_starts`]).
//! 2. What it holds in front of the start that is next has no say in it
//!    ([`only_what_may_become_a_frame_matters`]). So the path may begin at the oldest byte that the
//!    receiver's state says may become a frame, and at its end take up an empty receiver there; once
//!    that holds as many bytes as it can, it is the same as the other
//!    ([`receivers_agree_once_full`]).
//! 3. Rows of frames ([`rows_are_frames`]) and blocks ([`blocks_judge_starts`],
//!    [`starts_are_dropped_for_their_reason`]) judge starts as in 1.
//!
//! By induction over rows and blocks the path is as byte by byte, for slices of any length.

use framelock::{Bin, Mismatch, Parser, Receiver, Rescan, Setpoint};

use super::slices::Report;
use super::{any_receiver, is_bin};

/// R1, R5: an empty receiver that is given seven bytes commits them if they are a frame. If not, it
/// drops the first of them, for the place at which it fails, and else does what an empty receiver does
/// that is given the other six; and so it ends.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn bytes_judge_starts() {
    let bytes: [u8; 7] = kani::any();
    let mut all = Report::<7>::new();
    let mut from_first = Receiver::<Bin>::new();
    let mut others = Report::<7>::new();
    let mut from_second = Receiver::<Bin>::new();
    let mut i = 0;
    while i < 7 {
        all.from = i;
        from_first.feed(&[bytes[i]], &mut all);
        if i > 0 {
            others.from = i;
            from_second.feed(&[bytes[i]], &mut others);
        }
        i += 1;
    }
    let [a, b, reserved, pitch, roll, yaw, end] = bytes;
    let word = u64::from_be_bytes([0, a, b, reserved, pitch, roll, yaw, end]);
    match Receiver::<Bin>::mismatch(word, 7) {
        None => {
            assert!(is_bin(bytes));
            assert!(all.setpoints[6] == Some(Setpoint { pitch, roll, yaw }));
            assert!(all.setpoints[..6] == [None; 6]);
            assert!(all.dropped == [0; 4]);
            assert!(from_first == Receiver::new());
        }
        Some((_, why)) => {
            assert!(!is_bin(bytes));
            others.drop_more(1, why);
            assert!(all.setpoints == [None; 7] && others.setpoints == [None; 7]);
            assert!(all.dropped == others.dropped);
            assert!(from_first == from_second);
        }
    }
    kani::cover!(is_bin(bytes), "a frame");
    kani::cover!(all.dropped[3] == 1, "a start that fails at the terminator");
}

/// Whether both hold the same bytes that may become a frame.
fn agree(one: &Receiver<Bin>, other: &Receiver<Bin>) -> bool {
    let pending = one.pending();
    let unused = 64 - 8 * pending;
    let kept = |receiver: &Receiver<Bin>| {
        if pending == 0 {
            0
        } else {
            receiver.window().history() << unused
        }
    };
    other.pending() == pending && kept(one) == kept(other)
}

/// R5: receivers that hold the same bytes that may become a frame, whatever else they hold, do the
/// same with the next byte, and again hold the same.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn only_what_may_become_a_frame_matters() {
    let mut one = any_receiver::<Bin, Rescan>();
    let mut other = any_receiver::<Bin, Rescan>();
    kani::assume(agree(&one, &other));
    let byte = [kani::any()];
    let mut of_one = Report::<1>::new();
    let mut of_other = Report::<1>::new();
    one.feed(&byte, &mut of_one);
    other.feed(&byte, &mut of_other);
    assert!(of_one == of_other);
    assert!(agree(&one, &other));
    kani::cover!(of_one.setpoints[0].is_some(), "a frame");
    kani::cover!(of_one.dropped[1] > 0 && one != other, "not the same state");
}

/// R5: such receivers are the same after six more bytes, or once they have committed.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn receivers_agree_once_full() {
    let mut one = any_receiver::<Bin, Rescan>();
    let mut other = any_receiver::<Bin, Rescan>();
    kani::assume(agree(&one, &other));
    let bytes: [u8; 6] = kani::any();
    let mut committed = false;
    let mut i = 0;
    while i < 6 {
        let setpoint = one.push(bytes[i]);
        assert!(other.push(bytes[i]) == setpoint);
        committed = committed || setpoint.is_some();
        assert!(!committed || one == other);
        i += 1;
    }
    assert!(one == other);
    kani::cover!(committed, "a frame");
    kani::cover!(!committed, "none");
}

/// R5: what is taken in a row are frames that follow each other from the head of the slice.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(66)]
fn rows_are_frames() {
    let bytes: [u8; 64] = kani::any();
    let mut setpoints = [None; 64];
    let end = Receiver::<Bin>::rows_of_slice(&bytes, &mut |index, setpoint| {
        setpoints[index] = Some(setpoint);
    });
    assert!(end == 0 || end == 56);
    let mut frame = 0;
    while frame < 8 {
        let [a, b, reserved, pitch, roll, yaw, last] =
            [0, 1, 2, 3, 4, 5, 6].map(|place| bytes[7 * frame + place]);
        let setpoint = Setpoint { pitch, roll, yaw };
        assert!(end == 0 || is_bin([a, b, reserved, pitch, roll, yaw, last]));
        assert!(setpoints[7 * frame + 6] == (end != 0).then_some(setpoint));
        frame += 1;
    }
    kani::cover!(end != 0, "a row");
}

/// R5: in a block, the next start from any on at which a frame begins is found and committed, and
/// the starts up to the frame's end are judged with it; or there is none.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(82)]
fn blocks_judge_starts() {
    let bytes: [u8; 80] = kani::any();
    let judged: u32 = kani::any_where(|&judged| judged <= 70);
    let mut committed = None;
    let behind = Receiver::<Bin>::next_in_block(&bytes, judged, &mut |index, setpoint| {
        assert!(committed.is_none());
        committed = Some((index, setpoint));
    });

    let mut expected = None;
    let mut start = 0;
    while start < 64 {
        let [a, b, reserved, pitch, roll, yaw, last] =
            [0, 1, 2, 3, 4, 5, 6].map(|place| bytes[start as usize + place]);
        if expected.is_none() && start >= judged && is_bin([a, b, reserved, pitch, roll, yaw, last])
        {
            expected = Some((start, Setpoint { pitch, roll, yaw }));
        }
        start += 1;
    }
    match expected {
        Some((start, setpoint)) => {
            assert!(behind == Some(start + 7));
            assert!(committed == Some((start as usize + 6, setpoint)));
        }
        None => assert!(behind.is_none() && committed.is_none()),
    }
    kani::cover!(behind == Some(70), "the last start");
    kani::cover!(behind.is_none() && judged == 0, "none");
}

/// R5: a start of a block at which no frame begins is dropped for the place at which its frame fails.
/// Of several, those with the same reason are counted together.
///
/// Theorem: 6
/// Length: any
#[kani::proof]
#[kani::unwind(82)]
fn starts_are_dropped_for_their_reason() {
    let bytes: [u8; 80] = kani::any();
    let start: usize = kani::any_where(|&start| start < 64);
    let mut word = 0;
    let mut place = 0;
    while place < 7 {
        word = word << 8 | u64::from(bytes[start + place]);
        place += 1;
    }
    let expected = Receiver::<Bin>::mismatch(word, 7);
    let mut report = Report::<1>::new();
    Receiver::<Bin>::drop_in_block(&bytes, 1 << start, &mut report);
    if let Some((_, why)) = expected {
        let mut once = Report::<1>::new();
        once.drop_more(1, why);
        assert!(report.dropped == once.dropped);
    }
    kani::cover!(report.dropped[3] == 1, "a terminator");
    kani::cover!(report.dropped[1] == 1, "a broken sync");
}
