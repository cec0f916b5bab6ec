//! Equality with the naive whole-buffer reference: for every stream of up to so many bytes at once,
//! where the checker sees the reference itself run; and for streams of any length, by induction over
//! the reference's own loop.

use framelock::{Bin, BinCrc8, Discard, Format, Lecture, Parser, Receiver, Setpoint};

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

/// R2, for any length, by induction over the starts of the stream, the places at which a frame may
/// begin. An empty receiver is at a start, and what follows is a frame's length of bytes, or fewer if
/// the stream ends there.
///
/// * If they are a frame, it commits them with the last and is empty again: at the next start, as the
///   reference is.
/// * If they are not, it has committed nothing, and is where an empty one at the next start, a byte
///   behind, is: the reference drops a byte.
/// * If they end before that shows, all of them are pending, as the reference says.
fn rescan_judges_starts<F, R, const LENGTH: usize>()
where
    F: Format<Word = u64, Message = Setpoint>,
    R: reference::Format,
{
    let bytes: [u8; LENGTH] = kani::any();
    let length: usize = kani::any_where(|&length| length > 0 && length <= LENGTH);
    let mut receiver = Receiver::<F>::new();
    let mut at_next_start = Receiver::<F>::new();
    let mut committed = None;
    let mut i = 0;
    while i < LENGTH {
        if i < length {
            assert!(committed.is_none());
            committed = receiver.push(bytes[i]);
            assert!(i == 0 || at_next_start.push(bytes[i]).is_none());
        }
        i += 1;
    }
    let [pitch, roll, yaw] = [bytes[3], bytes[4], bytes[5]];
    let fails_at = R::fails_at(&bytes[..length]);
    if fails_at.is_none() && length == LENGTH {
        assert!(committed == Some(Setpoint { pitch, roll, yaw }));
        assert!(receiver == Receiver::new());
    } else {
        assert!(committed.is_none());
        if fails_at.is_none() {
            assert!(receiver.pending() == length);
        } else {
            assert!(receiver.pending() == at_next_start.pending());
            assert!(length < LENGTH || receiver == at_next_start);
        }
    }
    kani::cover!(committed.is_some(), "a frame");
    kani::cover!(
        fails_at == Some(LENGTH - 1),
        "a start that fails at its end"
    );
    kani::cover!(
        fails_at.is_none() && length == LENGTH - 1,
        "a frame but for a byte"
    );
}

/// R3, likewise: what fails is thrown away with all that is held.
fn discard_judges_starts<F, R, const LENGTH: usize>()
where
    F: Format<Word = u64, Message = Setpoint>,
    R: reference::Format,
{
    let bytes: [u8; LENGTH] = kani::any();
    let mut receiver = Receiver::<F, Discard>::new();
    let mut fails_at = None;
    let mut committed = None;
    let mut i = 0;
    while i < LENGTH {
        if fails_at.is_none() {
            committed = receiver.push(bytes[i]);
            fails_at = R::fails_at(&bytes[..=i]);
            if fails_at.is_some() {
                assert!(fails_at == Some(i) && committed.is_none());
                assert!(receiver == Receiver::new());
            } else if i < LENGTH - 1 {
                assert!(committed.is_none() && receiver.pending() == i + 1);
            }
        }
        i += 1;
    }
    if fails_at.is_none() {
        let [pitch, roll, yaw] = [bytes[3], bytes[4], bytes[5]];
        assert!(committed == Some(Setpoint { pitch, roll, yaw }));
        assert!(receiver == Receiver::new());
    }
    kani::cover!(fails_at.is_none(), "a frame");
    kani::cover!(
        fails_at == Some(LENGTH - 1),
        "a start that fails at its end"
    );
}

/// R2: Rescan of BIN.
///
/// Theorem: 5
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn rescan_bin() {
    rescan_judges_starts::<Bin, reference::Bin, 7>();
}

/// R2, F2: Rescan of BIN-CRC8.
///
/// Theorem: 5
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn rescan_bin_crc8() {
    rescan_judges_starts::<BinCrc8, reference::BinCrc8, 8>();
}

/// R3: Discard of BIN.
///
/// Theorem: 5
/// Length: any
#[kani::proof]
#[kani::unwind(9)]
fn discard_bin() {
    discard_judges_starts::<Bin, reference::Bin, 7>();
}

/// R3, F2: Discard of BIN-CRC8.
///
/// Theorem: 5
/// Length: any
#[kani::proof]
#[kani::unwind(34)]
fn discard_bin_crc8() {
    discard_judges_starts::<BinCrc8, reference::BinCrc8, 8>();
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
