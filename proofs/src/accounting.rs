//! Theorem 9: every byte is in exactly one place (L2). At any time, modulo the counters' width,
//!
//! ```text
//! bytes = frame_bytes + discarded + pending
//! ```
//!
//! Proof by induction: at reset all are 0. Each byte, and each line event, adds the same on both sides,
//! whatever the counters, which may be about to wrap. A slice does what its bytes do (theorem 6).
//!
//! For every format of one to eight bytes: the engine reports, for each byte, a frame or dropped bytes
//! such that with what is pending they make up what was pending and the byte (`one_byte` in
//! `core/src/window/verification.rs`), and [each report is counted](each_report_is_counted).
//!
//! For every format of any length: `BufferedReceiver` puts each byte into exactly one event, or it is
//! pending (theorem 13b), and [its events are counted](pushed_bytes_of_any_length_are_counted).

use framelock::{
    Accounting, Bin, BinCrc8, BufferedReceiver, Counters, Discarded, Event, Framing, Lecture,
    LineEvents, Mismatch, Parser, Receiver, Setpoint, Verdict,
};

use crate::states::{any_lecture, any_line_event, any_receiver};

/// A parser in any state, and counters that are all the same number, which may be any: each is counted
/// on its own.
fn any_account<P>(parser: P, start: usize) -> Accounting<P> {
    let counters = Counters {
        bytes: start,
        frames: start,
        frame_bytes: start,
        discarded: Discarded {
            no_sync: start,
            broken_sync: start,
            header: start,
            check: start,
            terminator: start,
            line_event: start,
        },
        resynchronisations: start,
        events: LineEvents::default(),
    };
    Accounting::resumed(parser, counters)
}

/// By how much a counter went up.
fn up(counter: usize, start: usize) -> u8 {
    let up = counter.wrapping_sub(start).to_le_bytes()[0];
    assert!(counter == start.wrapping_add(usize::from(up)));
    up
}

/// By how much the counters went up: of bytes in frames, and of discarded bytes.
fn placed(counters: &Counters, start: usize) -> u8 {
    let discarded = &counters.discarded;
    up(counters.frame_bytes, start)
        + up(discarded.no_sync, start)
        + up(discarded.broken_sync, start)
        + up(discarded.header, start)
        + up(discarded.check, start)
        + up(discarded.terminator, start)
        + up(discarded.line_event, start)
}

/// The same, of a parser whose frames have one length.
fn placed_by<P: Parser>(counters: &Counters, start: usize) -> u8 {
    let length = P::FRAME_LENGTH.to_le_bytes()[0];
    assert!(up(counters.frame_bytes, start) == up(counters.frames, start) * length);
    placed(counters, start)
}

/// What was pending and the new byte are what was placed and what is pending now.
fn byte_is_placed<P: Parser<Message = Setpoint>>(parser: P) {
    let start = kani::any();
    let mut line = any_account(parser, start);
    let before = line.pending();
    let committed = line.push(kani::any()).is_some();
    let after = line.counters();
    assert!(after.bytes == start.wrapping_add(1));
    assert!(after.frames == start.wrapping_add(usize::from(committed)));
    let placed = placed_by::<P>(after, start);
    assert!(before + 1 == usize::from(placed) + line.pending());
    kani::cover!(committed, "a commit");
    kani::cover!(!committed && placed > 1, "bytes are discarded");
}

/// What was pending is placed.
fn event_places_what_is_pending<P: Parser<Message = Setpoint>>(parser: P) {
    let start = kani::any();
    let mut line = any_account(parser, start);
    let before = line.pending();
    line.line_event(any_line_event());
    assert!(line.counters().bytes == start && line.pending() == 0);
    assert!(before == usize::from(placed_by::<P>(line.counters(), start)));
    kani::cover!(before == P::FRAME_LENGTH - 1, "bytes are discarded");
}

fn reset_is_balanced<P: Parser>(parser: P) {
    let line = Accounting::new(parser);
    assert!(*line.counters() == Counters::default() && line.pending() == 0);
}

#[kani::proof]
#[kani::unwind(9)]
fn each_starts_balanced() {
    reset_is_balanced(Lecture::new());
    reset_is_balanced(Receiver::<Bin>::new());
    reset_is_balanced(Receiver::<BinCrc8>::new());
    kani::cover!(true, "each");
}

#[kani::proof]
#[kani::unwind(9)]
fn lecture_places_bytes() {
    byte_is_placed(any_lecture());
}

#[kani::proof]
#[kani::unwind(9)]
fn lecture_is_emptied_by_events() {
    event_places_what_is_pending(any_lecture());
}

#[kani::proof]
#[kani::unwind(9)]
fn receiver_of_bin_is_emptied_by_events() {
    event_places_what_is_pending(any_receiver::<Bin, 7>());
}

#[kani::proof]
#[kani::unwind(34)]
fn receiver_of_bin_crc8_is_emptied_by_events() {
    event_places_what_is_pending(any_receiver::<BinCrc8, 8>());
}

/// A parser that reports these two events of each slice.
struct Reports([Event<()>; 2]);

impl Parser for Reports {
    type Message = ();
    const FRAME_LENGTH: usize = 7;

    fn push(&mut self, _: u8) -> Option<()> {
        None
    }

    fn push_with(&mut self, _: u8, _: impl FnMut(usize, Mismatch)) -> Option<()> {
        None
    }

    fn feed_events(&mut self, _: &[u8], mut event: impl FnMut(Event<()>)) {
        event(self.0[0]);
        event(self.0[1]);
    }

    fn pending(&self) -> usize {
        0
    }

    fn reset(&mut self) {}
}

fn any_event() -> Event<()> {
    let count = kani::any_where(|&count| count < 64);
    let dropped = |why| Event::Dropped { count, why };
    match kani::any::<u8>() {
        0 => dropped(Mismatch::NoSync),
        1 => dropped(Mismatch::BrokenSync),
        2 => dropped(Mismatch::Check),
        3 => dropped(Mismatch::Terminator),
        _ => Event::Frame {
            index: 0,
            message: (),
        },
    }
}

/// Two, so that the second may be the first frame after a loss.
#[kani::proof]
#[kani::unwind(9)]
fn each_report_is_counted() {
    let events = [any_event(), any_event()];
    let start = kani::any();
    let mut line = any_account(Reports(events), start);
    let mut frames = 0;
    line.feed(&[0], |_, ()| frames += 1);
    let counters = line.counters();
    assert!(counters.bytes == start.wrapping_add(1));
    assert!(counters.frames == start.wrapping_add(frames));
    let is_frame = |event| matches!(event, Event::Frame { .. });
    let is_resynchronised = !is_frame(events[0]) && is_frame(events[1]);
    let resynchronisations = start.wrapping_add(usize::from(is_resynchronised));
    assert!(counters.resynchronisations == resynchronisations);
    // Each for its own reason.
    let dropped_as = |event, reason| match event {
        Event::Dropped { count, why } if why == reason => count,
        _ => 0,
    };
    let of_reason = |reason| dropped_as(events[0], reason) + dropped_as(events[1], reason);
    let discarded = &counters.discarded;
    assert!(discarded.no_sync == start.wrapping_add(of_reason(Mismatch::NoSync)));
    assert!(discarded.broken_sync == start.wrapping_add(of_reason(Mismatch::BrokenSync)));
    assert!(discarded.check == start.wrapping_add(of_reason(Mismatch::Check)));
    assert!(discarded.terminator == start.wrapping_add(of_reason(Mismatch::Terminator)));
    kani::cover!(frames == 2, "frames");
    kani::cover!(is_resynchronised, "a frame after a loss");
}

/// Says anything of two bytes, and of the second alone; of the first alone, that it takes both. With one
/// byte for the longest frame, anything of either. It need not keep the laws.
struct Anything<const LONGEST: usize>([u8; 2]);

impl<const LONGEST: usize> Framing for Anything<LONGEST> {
    const LONGEST: usize = LONGEST;
    type Message<'a> = u8;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        let code = match bytes {
            [0] if LONGEST == 2 => return Verdict::Incomplete { at_least: 2 },
            [0, ..] => self.0[0],
            _ => self.0[1],
        };
        match code {
            0 => Verdict::Frame(1),
            1 => Verdict::Frame(2),
            2 => Verdict::Incomplete { at_least: 2 },
            3 => Verdict::Reject(Mismatch::NoSync),
            4 => Verdict::Reject(Mismatch::BrokenSync),
            5 => Verdict::Reject(Mismatch::Header),
            6 => Verdict::Reject(Mismatch::Check),
            _ => Verdict::Reject(Mismatch::Terminator),
        }
    }

    fn starts(&self, _: u8) -> bool {
        true
    }

    fn decode(&self, frame: &[u8]) -> u8 {
        frame.len().to_le_bytes()[0]
    }
}

/// Bytes pushed: each is placed, or pending. After a line event none is pending. That counters wrap is in
/// [`each_report_is_counted`]: it is the same ledger.
#[kani::proof]
#[kani::unwind(3)]
fn pushed_bytes_of_any_length_are_counted() {
    let start = 0;
    let receiver = BufferedReceiver::<_, 2>::new(Anything::<2>(kani::any()));
    let mut line = any_account(receiver, start);
    assert!(line.push(0).is_none() && line.pending() == 1);
    let pushed = line.push(1).unwrap_or(0);
    let pending = line.pending();
    assert!(line.counters().bytes == start.wrapping_add(2));
    assert!(2 == usize::from(placed(line.counters(), start)) + pending);
    assert!(up(line.counters().frame_bytes, start) == pushed);
    let mut frames = u8::from(pushed > 0);
    line.line_event(any_line_event(), |found| {
        frames += u8::from(found.message().is_some());
    });
    let counters = line.counters();
    assert!(counters.bytes == start.wrapping_add(2) && line.pending() == 0);
    assert!(2 == placed(counters, start));
    assert!(up(counters.frames, start) == frames);
    kani::cover!(pushed == 2, "a frame of two bytes");
    kani::cover!(
        pending == 1 && frames == 1,
        "a frame found by the line event"
    );
}

/// Bytes of a slice.
#[kani::proof]
#[kani::unwind(3)]
fn fed_bytes_of_any_length_are_counted() {
    let start = 0;
    let receiver = BufferedReceiver::<_, 1>::new(Anything::<1>(kani::any()));
    let mut line = any_account(receiver, start);
    let mut frames = 0;
    line.feed(&[0, 1], |found| {
        frames += u8::from(found.message().is_some());
    });
    let counters = line.counters();
    assert!(counters.bytes == start.wrapping_add(2) && line.pending() == 0);
    assert!(2 == placed(counters, start));
    assert!(up(counters.frames, start) == frames && up(counters.frame_bytes, start) == frames);
    kani::cover!(frames == 1, "a frame and a drop");
}
