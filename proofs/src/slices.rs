//! Theorem 6: however a stream is cut into slices, the results are the same as if the bytes were pushed one by one. The
//! results are the frames, their offsets, the dropped bytes, the reasons, and the pending bytes (R5).
//!
//! For receivers of every format, the proof is in `core/src/window/verification.rs`, which states the lengths of
//! frames. [`receiver_is_its_window`] shows that the functions of `Receiver` do the same as those of its window. This
//! module has the proof for the lecture's machine.

use framelock::lecture::Lecture;
use framelock::motion::{Bin, Setpoint};
use framelock::{DiscardReason, Found, Parser, Receiver};

use crate::states::{OfSetpoints, any_lecture, any_receiver};

/// The outcome of a slice of `N` bytes: the setpoint delivered with each byte, and the number of bytes discarded for
/// each reason.
#[derive(Clone, Copy)]
struct Report<const N: usize> {
    setpoints: [Option<Setpoint>; N],
    discarded: (u8, u8, u8, u8),
}

impl<const N: usize> Report<N> {
    const NEW: Self = Self {
        setpoints: [None; N],
        discarded: (0, 0, 0, 0),
    };

    /// Feeds the bytes to a machine, and records the outcome. The entry of the first byte is `setpoints[from]`.
    fn of<P: OfSetpoints>(&mut self, parser: &mut P, from: usize, bytes: &[u8]) {
        // Bytes that were pending before the call lie before the slice.
        let (before, mut known) = (parser.pending(), from);
        parser.feed(bytes, |found| {
            known += found.bytes();
            match found {
                Found::Frame { message, .. } => self.setpoints[known - before - 1] = Some(message),
                Found::Discarded { count, why, .. } => {
                    let (no_sync, broken_sync, check, terminator) = &mut self.discarded;
                    *match why {
                        DiscardReason::NoSync => no_sync,
                        DiscardReason::BrokenSync => broken_sync,
                        DiscardReason::ChecksumMismatch => check,
                        DiscardReason::WrongTerminator => terminator,
                        _ => panic!("the machine has no other reason"),
                    } += count.to_le_bytes()[0];
                }
            }
        });
    }
}

/// Compares, from any state, four ways to take the same bytes: as one slice, as slices of one byte, pushed, and with
/// `next`.
fn slice_is_its_bytes<P: OfSetpoints, const N: usize>(parser: P) {
    let bytes: [u8; N] = kani::any();
    let (mut whole, mut fed) = (Report::<N>::NEW, parser);
    whole.of(&mut fed, 0, &bytes);
    let (mut single, mut one_by_one, mut pushed) = (Report::<N>::NEW, parser, parser);
    let mut place = 0;
    while place < N {
        single.of(&mut one_by_one, place, &[bytes[place]]);
        let setpoint = pushed.push(bytes[place]);
        assert!(setpoint == whole.setpoints[place] && setpoint == single.setpoints[place]);
        place += 1;
    }
    assert!(whole.discarded == single.discarded);
    assert!(fed == one_by_one && fed == pushed);
    let (mut pulled, mut rest, mut frames) = (parser, &bytes[..], 0);
    while let Some(setpoint) = pulled.next(&mut rest) {
        assert!(whole.setpoints[N - rest.len() - 1] == Some(setpoint));
        frames += 1;
    }
    assert!(rest.is_empty() && pulled == fed);
    assert!(frames == whole.setpoints.iter().flatten().count());
    kani::cover!(whole.discarded.3 > 0, "a wrong terminator");
    kani::cover!(whole.setpoints[N - 1].is_some(), "a frame at the end");
}

/// The machine's `feed` is a loop of `push`. The harness starts from any state, so the result extends to any number of
/// slices of any length.
#[kani::proof]
#[kani::unwind(5)]
fn lecture() {
    slice_is_its_bytes::<Lecture, 4>(any_lecture());
}

/// From any state, `push_with` and `next` with one byte have the same result as `push`. From the state at reset, `feed`
/// of one byte discards the byte or leaves it pending. A receiver with a pending byte is not equal to a receiver
/// without a pending byte.
#[kani::proof]
#[kani::unwind(9)]
fn receiver_is_its_window() {
    let receiver = any_receiver::<Bin, 7>();
    let byte = kani::any();
    let (mut pushed, mut told) = (receiver, Clone::clone(&receiver));
    let setpoint = pushed.push(byte);
    let mut accounted = 0;
    let frame = Parser::push_with(&mut told, byte, |one| accounted += one.bytes());
    assert!(frame == setpoint);
    assert!(receiver.pending() + 1 == accounted + told.pending());
    let (mut pulled, mut rest) = (Clone::clone(&receiver), &[byte][..]);
    assert!(pulled.next(&mut rest) == setpoint && rest.is_empty());
    assert!(told.pending() == pushed.pending() && pulled.pending() == pushed.pending());
    let (mut fed, mut discarded) = (Receiver::<Bin>::new(), 0);
    fed.feed(&[byte], |found| discarded += found.bytes());
    assert!(fed.pending() + discarded == 1);
    assert!((fed == Receiver::new()) == (fed.pending() == 0));
    kani::cover!(setpoint.is_some(), "a frame");
    kani::cover!(fed.pending() == 1, "a first byte");
}
