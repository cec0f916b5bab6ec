//! Theorem 6: however a stream is cut into slices, the frames, their offsets, the dropped bytes and
//! their reasons, and what is pending are the same as byte by byte (R5).
//!
//! For receivers of every format of one to eight bytes: `core/src/window/verification.rs` has the
//! proof. Here is the lecture's machine.

use framelock::{Event, Lecture, Mismatch, Parser, Setpoint};

use crate::states::any_lecture;

/// What becomes of a slice of `N` bytes: which byte gave which setpoint, and how many bytes were
/// dropped for each reason.
#[derive(Clone, Copy)]
struct Report<const N: usize> {
    setpoints: [Option<Setpoint>; N],
    dropped: (u8, u8, u8, u8),
}

impl<const N: usize> Report<N> {
    const NEW: Self = Self {
        setpoints: [None; N],
        dropped: (0, 0, 0, 0),
    };

    /// Feeds the bytes to a parser; the slice begins at `from`.
    fn of<P: Parser<Message = Setpoint>>(&mut self, parser: &mut P, from: usize, bytes: &[u8]) {
        parser.feed_events(bytes, |event| match event {
            Event::Frame { index, message } => self.setpoints[from + index] = Some(message),
            Event::Dropped { count, why } => {
                let (no_sync, broken_sync, check, terminator) = &mut self.dropped;
                *match why {
                    Mismatch::NoSync => no_sync,
                    Mismatch::BrokenSync => broken_sync,
                    Mismatch::Check => check,
                    Mismatch::Terminator => terminator,
                    Mismatch::Header | Mismatch::LineEvent => panic!("it has neither"),
                } += count.to_le_bytes()[0];
            }
        });
    }
}

/// From any state: a slice as a whole, its bytes as slices of one, and its bytes pushed.
fn slice_is_its_bytes<P, const N: usize>(parser: P)
where
    P: Parser<Message = Setpoint> + Copy + PartialEq,
{
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
    assert!(whole.dropped == single.dropped);
    assert!(fed == one_by_one && fed == pushed);
    kani::cover!(whole.dropped.3 > 0, "a wrong terminator");
    kani::cover!(whole.setpoints[N - 1].is_some(), "a frame at the end");
}

/// The machine's `feed` is a loop of `push`. From any state, hence for slices of any length, one behind
/// the other.
#[kani::proof]
#[kani::unwind(9)]
fn lecture() {
    slice_is_its_bytes::<Lecture, 4>(any_lecture());
}
