//! Target `parser`: any bytes, one at a time and as one slice, both formats, both policies.

use framelock::{Accounting, Bin, Lecture, Parser, Receiver, Setpoint};
use framelock_proofs::reference::{self, Policy};

use crate::expected::Expected;

/// The input is the stream, of BIN. For the receiver (Rescan) and the lecture's machine (Discard):
/// the frames, their setpoints and the indices of their last bytes are the reference's, and so is why
/// each byte was dropped; less than a frame is ever held; every byte is accounted for; and the state
/// that the receiver shows is the lecture's.
///
/// Little more than that is done with an input, so that many can be tried: the other parsers, and
/// streams in pieces, are the target [`chunks`](crate::chunks)'s.
///
/// # Panics
/// If one of these does not hold.
pub fn parser(bytes: &[u8]) {
    let rescan = Expected::of::<reference::Bin>(bytes, Policy::Rescan);
    // What it holds are bytes of a shift register; looking how many of them count takes longer.
    let receiver = check(Receiver::<Bin>::new(), bytes, &rescan, |receiver| {
        receiver.window().count().into()
    });
    let pending = bytes.len() - rescan.pending;
    check_what_is_shown(receiver, bytes.get(pending..).unwrap_or_default());
    let discard = Expected::of::<reference::Bin>(bytes, Policy::Discard);
    check(Lecture::new(), bytes, &discard, Parser::pending);
}

/// The state that the receiver shows is that of the lecture's machine that has just taken the bytes
/// held, `pending`.
fn check_what_is_shown(receiver: Receiver<Bin>, pending: &[u8]) {
    let mut lecture = Lecture::new();
    for &byte in pending {
        lecture.push(byte);
    }
    assert_eq!(receiver.state(), lecture.state, "{pending:02X?}");
    let taken = [3, 4, 5].map(|place| pending.get(place).copied());
    assert_eq!(receiver.temp(), taken, "{pending:02X?}");
    let stored = taken.map(Option::unwrap_or_default);
    assert_eq!(<[u8; 3]>::from(lecture.temp), stored, "{pending:02X?}");
}

/// Returns the parser that has taken the bytes.
fn check<P>(at_reset: P, bytes: &[u8], expected: &Expected, held: impl Fn(&P) -> usize) -> P
where
    P: Parser<Message = Setpoint> + Copy + PartialEq + std::fmt::Debug,
{
    let mut parser = at_reset;
    let mut frames = expected.frames.iter();
    for (index, &byte) in bytes.iter().enumerate() {
        if let Some(setpoint) = parser.push(byte) {
            let committed = Some(&(index, setpoint));
            assert_eq!(frames.next(), committed, "pushed: {bytes:02X?}");
        }
        assert!(
            held(&parser) < P::FRAME_LENGTH,
            "pushed {index} of {bytes:02X?}"
        );
    }
    assert_eq!(frames.next(), None, "pushed: {bytes:02X?}");
    assert_eq!(parser.pending(), expected.pending, "pushed {bytes:02X?}");

    let mut line = Accounting::new(at_reset);
    let mut frames = expected.frames.iter();
    line.feed(bytes, |index, setpoint| {
        assert_eq!(frames.next(), Some(&(index, setpoint)), "fed {bytes:02X?}");
    });
    assert_eq!(frames.next(), None, "fed {bytes:02X?}");
    assert_eq!(line.parser(), &parser, "fed {bytes:02X?}");
    let counters = line.counters();
    assert_eq!(counters.discarded, expected.dropped, "fed {bytes:02X?}");
    assert_eq!(
        counters.resynchronisations, expected.resynchronisations,
        "fed {bytes:02X?}"
    );
    assert_eq!(counters.bytes, bytes.len() as u64);
    assert_eq!(
        counters.bytes,
        P::FRAME_LENGTH as u64 * counters.frames
            + counters.discarded.total()
            + line.pending() as u64,
        "every byte is in one place: {bytes:02X?}"
    );
    parser
}
