//! 13d to 13f: which frames the reference delivers, and when. Some harnesses run the receiver's loops on a few bytes.
//!
//! The reference depends only on the format's final classifications. So `no_frame_is_passed_over` gives each place an
//! arbitrary [`Row`]. Together, the rows stand for any lawful format on any stream.

use super::byte;
use crate::any_format::{Row, any_before, any_up_to, part};
use crate::{BufferedReceiver, Classification, DiscardReason, Format, Found, LineEvent};

/// The event at each place: none, a frame with its length, or a drop with its reason.
struct Log<const P: usize> {
    events: [Option<Classification>; P],
    /// The place of the next event.
    next: usize,
}

impl<const P: usize> Log<P> {
    const NEW: Self = Self {
        events: [None; P],
        next: 0,
    };

    fn frame(&mut self, length: usize) {
        self.events[self.next] = Some(Classification::Frame(length));
        self.next += length;
    }

    fn drop(&mut self, why: DiscardReason) {
        self.events[self.next] = Some(Classification::Rejected(why));
        self.next += 1;
    }
}

/// The format's answers at a line event. The entry at index `p` is about the bytes from place `p` to the end, if these
/// bytes are incomplete.
type Before<const P: usize> = [Classification; P];

/// Returns the final classification of the bytes from `place` to `end`; `None` if the reference waits for more bytes.
/// `before` is `None` if no line event follows the bytes.
fn classified<const L: usize, const P: usize>(
    rows: &[Row; P],
    before: Option<&Before<P>>,
    place: usize,
    end: usize,
) -> Option<Classification> {
    let settled = rows[place].settled((end - place).min(L));
    settled.or(before.map(|before| before[place]))
}

/// Runs the reference on the places before `end`.
fn events<const L: usize, const P: usize>(
    rows: &[Row; P],
    before: Option<&Before<P>>,
    end: usize,
) -> Log<P> {
    let mut log = Log::NEW;
    let mut place = 0;
    while place < P {
        if place == log.next && place < end {
            match classified::<L, P>(rows, before, place, end) {
                Some(Classification::Frame(length)) => log.frame(length),
                Some(Classification::Rejected(why)) => log.drop(why),
                _ => {}
            }
        }
        place += 1;
    }
    log
}

/// 13d to 13f, for the reference. A frame is in the stream if the format recognises it in the bytes from its first byte
/// on. At a line event, it is enough that `classify_before` recognises it. For each frame in the stream, one of three
/// things holds:
///
/// * The frame is delivered.
/// * A delivered frame begins earlier and shares bytes with the frame.
/// * The reference has stopped before the frame, and waits for more bytes or a line event. In this case fewer than
///   `LONGEST - 2` bytes have come after the frame's first byte.
fn no_frame_is_passed_over<const L: usize, const P: usize>() {
    let rows: [Row; P] = core::array::from_fn(|_| Row::any(L));
    let (end, at) = (any_up_to(P), any_up_to(P - 1));
    kani::assume(at < end);
    let before: Before<P> =
        core::array::from_fn(|place| any_before(end.saturating_sub(place).max(1)));
    let before = kani::any::<bool>().then_some(&before);
    let frame = classified::<L, P>(&rows, before, at, end);
    let Some(Classification::Frame(length)) = frame else {
        return;
    };
    let log = events::<L, P>(&rows, before, end);
    let is_committed = log.events[at] == frame;
    let mut is_overlapped = false;
    let mut place = 0;
    while place < P {
        if let Some(Classification::Frame(other)) = log.events[place] {
            is_overlapped |= place < at && at < place + other;
        }
        place += 1;
    }
    let waits = before.is_none() && log.next < at;
    assert!(is_committed || is_overlapped || waits);
    assert!(!(is_committed && is_overlapped));
    // The number of received bytes after the frame.
    let behind = end.saturating_sub(at + length);
    assert!(!waits || behind + 1 + length < L);
    kani::cover!(waits && behind + 2 + length == L, "as late as can be");
    kani::cover!(is_overlapped, "a frame is lost under another");
    kani::cover!(
        is_committed && rows[at].settled((end - at).min(L)).is_none(),
        "a frame that the format recognises only at a line event"
    );
}

#[kani::proof]
#[kani::unwind(8)]
fn no_frame_is_passed_over_of_4() {
    no_frame_is_passed_over::<4, 5>();
}

const LONGEST: usize = 4;

/// A format with three rules. The byte 0 looks like the start of a frame until `L` bytes have come. The byte 1 is a
/// frame. Every other byte is rejected.
#[derive(Clone, Copy)]
struct FalseStart<const L: usize>;

impl<const L: usize> Format for FalseStart<L> {
    const LONGEST: usize = L;
    type Message<'a> = ();
    fn classify(&self, bytes: &[u8]) -> Classification {
        match bytes[0] {
            0 if bytes.len() < L => Classification::Incomplete { at_least: L },
            1 => Classification::Frame(1),
            _ => Classification::Rejected(DiscardReason::ChecksumMismatch),
        }
    }
    fn decode(&self, _: &[u8]) {}
}

/// Some streams reach the bounds of 13e. After a false start, `feed` delivers a frame of one byte when `LONGEST - 2`
/// bytes have come after the frame. `push` delivers the same frame one byte later than `feed`.
#[kani::proof]
#[kani::unwind(8)]
fn latest_delivery() {
    let mut fed = BufferedReceiver::<_, [u8; LONGEST]>::new(FalseStart::<LONGEST>);
    let mut pushed = BufferedReceiver::<_, [u8; LONGEST]>::new(FalseStart::<LONGEST>);
    let mut place = 0;
    while place < LONGEST + 1 {
        let mut frames = 0;
        fed.feed(&[byte(place)], |found| {
            frames += usize::from(matches!(found, Found::Frame { .. }));
        });
        assert!(frames == usize::from(place == 1 + LONGEST - 2));
        let is_pushed = pushed.push(byte(place)).is_some();
        assert!(is_pushed == (place == 1 + LONGEST - 1));
        place += 1;
    }
    kani::cover!(fed.pending() == 0, "all is decided");
}

/// 13a, by running the loop of `feed`. After a false start the bytes of a slice are decided one after another. Only a 0
/// at the end stays undecided.
#[kani::proof]
#[kani::unwind(4)]
fn feed_goes_on() {
    let bytes = [0, 1, kani::any()];
    let mut receiver = BufferedReceiver::<_, [u8; 2]>::new(FalseStart::<2>);
    assert!(receiver.push(bytes[0]).is_none());
    let mut decided = 0;
    receiver.feed(part(&bytes, 1, 3), |found| {
        assert!(found.bytes() == 1);
        assert!(found.message().is_some() == (bytes[decided] == 1));
        decided += 1;
    });
    assert!(receiver.pending() == usize::from(bytes[2] == 0));
    assert!(decided == 3 - receiver.pending());
    kani::cover!(bytes[2] == 1, "frames after a false start");
    kani::cover!(receiver.pending() == 1, "another false start");
}

/// 13a, by running the loop of `next`. After a false start `next` discards bytes up to the next frame, or up to bytes
/// that may still become a frame. It takes only as many bytes from the slice as its decisions need, and leaves the
/// rest.
#[kani::proof]
#[kani::unwind(4)]
fn next_goes_on() {
    let last = kani::any();
    let bytes = [0, 1, last];
    let mut rest = bytes.as_slice();
    let mut receiver = BufferedReceiver::<_, [u8; 2]>::new(FalseStart::<2>);
    let mut discarded = 0;
    let mut account = |one: Found<()>| {
        discarded += usize::from(matches!(one, Found::Discarded { .. }));
    };
    assert!(receiver.next_with(&mut rest, &mut account).is_some());
    assert!(rest.len() == 1 && receiver.pending() == 0);
    let found = receiver.next_with(&mut rest, &mut account).is_some();
    assert!(rest.is_empty() && found == (last == 1));
    assert!(receiver.pending() == usize::from(last == 0));
    assert!(discarded == 1 + usize::from(last > 1));
    kani::cover!(found, "two frames after a false start");
    kani::cover!(receiver.pending() == 1, "another false start");
}

/// 13f: a line event goes through all pending bytes, and finds every frame in them. `push` has left these bytes
/// undecided. The bytes before the first false start are dropped with the reasons that `feed` would give. All other
/// bytes that are part of no frame are dropped as `LineEvent`.
#[kani::proof]
#[kani::unwind(8)]
fn line_event_goes_on() {
    let mut receiver = BufferedReceiver::<_, [u8; LONGEST]>::new(FalseStart::<LONGEST>);
    let bytes: [u8; LONGEST - 1] = kani::any();
    assert!(receiver.push(0).is_none());
    let mut place = 0;
    while place < bytes.len() {
        assert!(receiver.push(bytes[place]).is_none());
        place += 1;
    }
    assert!(receiver.pending() == bytes.len());
    let (mut place, mut frames, mut has_waited) = (0, 0, false);
    receiver.line_event(LineEvent::Idle, |found| {
        let is_frame = found.message().is_some();
        assert!(is_frame == (bytes[place] == 1));
        assert!(found.bytes() == 1);
        has_waited |= bytes[place] == 0;
        if let Found::Discarded { why, .. } = found {
            assert!((why == DiscardReason::LineEvent) == has_waited);
        }
        frames += usize::from(is_frame);
        place += 1;
    });
    assert!(place == bytes.len() && receiver.pending() == 0);
    kani::cover!(frames == 2 && has_waited, "two frames and a false start");
    kani::cover!(
        bytes[0] > 1 && bytes[1] == 0 && bytes[2] > 1,
        "the same byte is dropped for two reasons"
    );
}
