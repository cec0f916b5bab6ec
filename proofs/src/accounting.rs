//! Theorem 9: every byte is counted exactly once (L2). This equation always holds, modulo the counters' width:
//!
//! ```text
//! bytes = frame_bytes + discarded + pending
//! ```
//!
//! Proof by induction. At reset all numbers are 0. Each byte and each line event adds the same number to both sides,
//! for any values of the counters, even if they are about to wrap. A fed slice has the same effect as pushing its bytes
//! (theorem 6).
//!
//! For every format (of the lengths in theorem 6), the receiver's engine neither loses nor invents a byte. When the
//! engine has taken a byte, each of the pending bytes and the new one is in a delivered frame, discarded, or still
//! pending (`one_byte` in `core/src/window/verification.rs`). The line [counts each report](each_report_is_counted),
//! whether a byte is pushed, a slice is fed, or a line event comes. The line also [counts each line
//! event](each_line_event_is_counted), and [counts one resynchronisation after each loss](each_loss_ends_once).
//!
//! For every format of any length, `BufferedReceiver` puts each byte into exactly one event or leaves it pending
//! (theorem 13b), and the line [counts these events](pushed_bytes_of_any_length_are_counted).

use framelock::any_format::any_line_event;
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{
    BufferedReceiver, Classification, Counters, DiscardReason, Format, Found, Line, LineEvent,
    Parser, Receiver,
};

use crate::states::{OfSetpoints, any_lecture, any_receiver};

/// Returns a line with this parser. All counters except those of line events have the value `start`. One value
/// suffices, because no counter depends on another counter.
fn any_line<P>(parser: P, start: u32) -> Line<P> {
    let mut counters = Counters::default();
    counters.bytes = start;
    counters.frames = start;
    counters.frame_bytes = start;
    counters.discarded.no_sync = start;
    counters.discarded.broken_sync = start;
    counters.discarded.bad_header = start;
    counters.discarded.too_long = start;
    counters.discarded.unknown_message = start;
    counters.discarded.checksum_mismatch = start;
    counters.discarded.wrong_terminator = start;
    counters.discarded.broken_stuffing = start;
    counters.discarded.line_event = start;
    counters.resynchronisations = start;
    Line::resumed(parser, counters)
}

/// Returns the increase of a counter, which must be less than 256.
fn up(counter: u32, start: u32) -> u8 {
    let up = counter.wrapping_sub(start).to_le_bytes()[0];
    assert!(counter == start.wrapping_add(u32::from(up)));
    up
}

/// Returns how many bytes the line has counted, in frames or as discarded, since each counter was `start`.
fn placed(counters: &Counters, start: u32) -> u8 {
    let discarded = &counters.discarded;
    up(counters.frame_bytes, start)
        + up(discarded.no_sync, start)
        + up(discarded.broken_sync, start)
        + up(discarded.bad_header, start)
        + up(discarded.too_long, start)
        + up(discarded.unknown_message, start)
        + up(discarded.checksum_mismatch, start)
        + up(discarded.wrong_terminator, start)
        + up(discarded.broken_stuffing, start)
        + up(discarded.line_event, start)
}

/// Does the same as [`placed`], and checks the counter of frames. All frames of the parser must have the same length.
fn placed_by<P: OfSetpoints>(counters: &Counters, start: u32) -> u8 {
    let length = P::LENGTH.to_le_bytes()[0];
    assert!(up(counters.frame_bytes, start) == up(counters.frames, start) * length);
    placed(counters, start)
}

/// Pushes a byte. Checks that this byte, and each byte that was pending, is now either counted or pending.
fn byte_is_placed<P: OfSetpoints>(parser: P) {
    let start = kani::any();
    let mut line = any_line(parser, start);
    let before = line.pending();
    let committed = line.push(kani::any()).is_some();
    let after = line.counters();
    assert!(after.bytes == start.wrapping_add(1));
    assert!(after.frames == start.wrapping_add(u32::from(committed)));
    let placed = placed_by::<P>(after, start);
    assert!(before + 1 == usize::from(placed) + line.pending());
    kani::cover!(committed, "a commit");
    kani::cover!(!committed && placed > 1, "bytes are discarded");
}

/// Checks that a line event counts all pending bytes, and that each report has at least one byte.
fn event_places_what_is_pending<P: OfSetpoints>(parser: P) {
    let start = kani::any();
    let mut line = any_line(parser, start);
    let before = line.pending();
    line.line_event(any_line_event(), |found| assert!(found.bytes() > 0));
    assert!(line.counters().bytes == start && line.pending() == 0);
    assert!(before == usize::from(placed_by::<P>(line.counters(), start)));
    kani::cover!(before == P::LENGTH - 1, "bytes are discarded");
}

fn reset_is_balanced<P: Parser>(parser: P) {
    let line = Line::new(parser);
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

/// A machine that reports these outcomes whenever it takes a byte, a slice, a line event or a poll.
struct Reports<const COUNT: usize>([Found<()>; COUNT]);

impl<const COUNT: usize> Parser for Reports<COUNT> {
    type Message<'a> = ();

    fn push_with(&mut self, _: u8, mut account: impl FnMut(Found<()>)) -> Option<()> {
        let mut frame = None;
        self.feed(&[], |found| {
            frame = frame.or(found.message());
            account(found);
        });
        frame
    }

    fn next_with(&mut self, bytes: &mut &[u8], account: impl FnMut(Found<()>)) -> Option<()> {
        *bytes = &[];
        self.push_with(0, account)
    }

    fn feed(&mut self, _: &[u8], mut found: impl FnMut(Found<()>)) {
        let mut next = 0;
        while next < COUNT {
            found(self.0[next]);
            next += 1;
        }
    }

    fn line_event(&mut self, _: LineEvent, found: impl FnMut(Found<()>)) {
        self.feed(&[], found);
    }

    fn pending(&self) -> usize {
        0
    }

    fn reset(&mut self) {}
}

fn any_found() -> Found<()> {
    let count = kani::any_where(|&count| count < 64);
    let discarded = |why| Found::discarded(count, why);
    match kani::any::<u8>() {
        0 => discarded(DiscardReason::NoSync),
        1 => discarded(DiscardReason::BrokenSync),
        2 => discarded(DiscardReason::BadHeader),
        3 => discarded(DiscardReason::ChecksumMismatch),
        4 => discarded(DiscardReason::WrongTerminator),
        5 => discarded(DiscardReason::LineEvent),
        6 => discarded(DiscardReason::TooLong),
        7 => discarded(DiscardReason::UnknownMessage),
        _ => Found::frame(count, ()),
    }
}

/// Chooses an arbitrary counter of bytes, and returns its value. The counter counts bytes in frames (`None`), or bytes
/// discarded for the returned reason.
fn any_place(counters: &Counters) -> (Option<DiscardReason>, u32) {
    let discarded = &counters.discarded;
    match kani::any::<u8>() {
        0 => (Some(DiscardReason::NoSync), discarded.no_sync),
        1 => (Some(DiscardReason::BrokenSync), discarded.broken_sync),
        2 => (Some(DiscardReason::BadHeader), discarded.bad_header),
        3 => (Some(DiscardReason::TooLong), discarded.too_long),
        4 => (
            Some(DiscardReason::UnknownMessage),
            discarded.unknown_message,
        ),
        5 => (
            Some(DiscardReason::ChecksumMismatch),
            discarded.checksum_mismatch,
        ),
        6 => (
            Some(DiscardReason::WrongTerminator),
            discarded.wrong_terminator,
        ),
        7 => (
            Some(DiscardReason::BrokenStuffing),
            discarded.broken_stuffing,
        ),
        8 => (Some(DiscardReason::LineEvent), discarded.line_event),
        _ => (None, counters.frame_bytes),
    }
}

/// Checks the counters of a line after `report`. The machine first reports an outcome of zero bytes: a frame, or
/// discarded bytes. Then it reports an arbitrary outcome. Returns whether the second outcome is the first frame after a
/// loss.
fn two_are_counted(
    reports: [Found<()>; 2],
    bytes: u32,
    report: impl FnOnce(&mut Line<Reports<2>>) -> u32,
) -> bool {
    let start = kani::any();
    let mut line = any_line(Reports(reports), start);
    let frames = report(&mut line);
    let counters = line.counters();
    assert!(counters.bytes == start.wrapping_add(bytes));
    assert!(counters.frames == start.wrapping_add(frames));
    let [first, second] = reports.map(is_frame);
    assert!(frames == u32::from(first) + u32::from(second));
    let is_loss_ended = !first && second;
    let resynchronisations = start.wrapping_add(u32::from(is_loss_ended));
    assert!(counters.resynchronisations == resynchronisations);
    // Each outcome changes at most one of these counters, its own. The harness watches an arbitrary one.
    let (watched, counter) = any_place(counters);
    let more = match reports[1] {
        Found::Discarded { count, why, .. } if Some(why) == watched => count,
        Found::Frame { length, .. } if watched.is_none() => length,
        _ => 0,
    };
    // `more` is less than 64, so the conversion succeeds. If it did not, the assertion would fail.
    let more = u32::try_from(more).unwrap_or(u32::MAX);
    assert!(counter == start.wrapping_add(more));
    is_loss_ended
}

fn is_frame(found: Found<()>) -> bool {
    matches!(found, Found::Frame { .. })
}

/// Checks each function of the line that reports outcomes.
#[kani::proof]
#[kani::unwind(9)]
fn each_report_is_counted() {
    let nothing = if kani::any() {
        Found::frame(0, ())
    } else {
        Found::discarded(0, DiscardReason::NoSync)
    };
    let (first, reports) = (is_frame(nothing), [nothing, any_found()]);
    let function: u8 = kani::any();
    // A byte completes at most one frame, and the frame is reported last.
    kani::assume(function > 1 || !first);
    let is_loss_ended = match function {
        0 => two_are_counted(reports, 1, |line| u32::from(line.push(0).is_some())),
        1 => two_are_counted(reports, 1, |line| {
            u32::from(line.messages(&[0]).next().is_some())
        }),
        2 => two_are_counted(reports, 0, |line| {
            let mut frames = 0;
            line.line_event(any_line_event(), |found| {
                frames += u32::from(is_frame(found));
            });
            frames
        }),
        3 => two_are_counted(reports, 0, |line| {
            let mut frames = 0;
            line.line_event_step(any_line_event(), |found| {
                frames += u32::from(is_frame(found));
            });
            frames
        }),
        4 => two_are_counted(reports, 0, |line| {
            let mut frames = 0;
            line.poll_step(|found| frames += u32::from(is_frame(found)));
            frames
        }),
        _ => two_are_counted(reports, 1, |line| {
            let mut frames = 0;
            line.feed(&[0], |found| {
                frames += u32::from(is_frame(found));
            });
            frames
        }),
    };
    kani::cover!(
        is_loss_ended && function == 0,
        "a frame after a loss, pushed"
    );
    kani::cover!(is_loss_ended && function == 2, "with a line event");
    kani::cover!(first && function == 5, "a frame is fed");
}

/// Each line event increases the counter of its kind, and nothing else increases these counters.
#[kani::proof]
#[kani::unwind(9)]
fn each_line_event_is_counted() {
    let start = kani::any();
    let mut counters = Counters::default();
    counters.events.framing = start;
    counters.events.parity = start;
    counters.events.overrun = start;
    counters.events.line_break = start;
    counters.events.idle = start;
    let mut line = Line::resumed(Reports([any_found()]), counters);
    let event = any_line_event();
    if kani::any() {
        line.line_event(event, |_| ());
    } else {
        line.line_event_step(event, |_| ());
    }
    line.push(0);
    line.poll();
    line.poll_step(|_| ());
    line.feed(&[0], |_| ());
    let events = &line.counters().events;
    let told = |which| start.wrapping_add(u32::from(event == which));
    assert!(events.framing == told(LineEvent::Framing));
    assert!(events.parity == told(LineEvent::Parity));
    assert!(events.overrun == told(LineEvent::Overrun));
    assert!(events.line_break == told(LineEvent::Break));
    assert!(events.idle == told(LineEvent::Idle));
    kani::cover!(event == LineEvent::Break, "a break");
    kani::cover!(start == u32::MAX, "about to wrap");
}

/// A loss ends once, with the first frame after it, which counts as one resynchronisation.
#[kani::proof]
#[kani::unwind(9)]
fn each_loss_ends_once() {
    let frames: [bool; 4] = kani::any();
    let reports = frames.map(|is_frame| {
        if is_frame {
            Found::frame(1, ())
        } else {
            Found::discarded(1, DiscardReason::NoSync)
        }
    });
    let mut line = any_line(Reports(reports), 0);
    line.feed(&[], |_| ());
    let [first, second, third, last] = frames;
    let ended = [!first && second, !second && third, !third && last];
    let ended = ended.map(u32::from);
    assert!(line.counters().resynchronisations == ended[0] + ended[1] + ended[2]);
    kani::cover!(!first && second && third, "two frames after a loss");
    kani::cover!(ended[0] == 1 && ended[2] == 1, "two losses");
}

/// A format that gives arbitrary answers about two bytes and about the second byte alone. If only the first byte has
/// come, the format needs the second byte, too. If the longest frame has one byte, the format gives arbitrary
/// answers about either byte. The answers need not keep the laws.
#[derive(Clone, Copy)]
struct Anything<const LONGEST: usize>([u8; 2]);

impl<const LONGEST: usize> Format for Anything<LONGEST> {
    const LONGEST: usize = LONGEST;
    type Message<'a> = u8;

    fn classify(&self, bytes: &[u8]) -> Classification {
        let code = match bytes {
            [0] if LONGEST == 2 => return Classification::Incomplete { at_least: 2 },
            [0, ..] => self.0[0],
            _ => self.0[1],
        };
        match code {
            0 => Classification::Frame(1),
            1 => Classification::Frame(2),
            2 => Classification::Incomplete { at_least: 2 },
            3 => Classification::Rejected(DiscardReason::NoSync),
            4 => Classification::Rejected(DiscardReason::BrokenSync),
            5 => Classification::Rejected(DiscardReason::BadHeader),
            6 => Classification::Rejected(DiscardReason::ChecksumMismatch),
            7 => Classification::Rejected(DiscardReason::TooLong),
            8 => Classification::Rejected(DiscardReason::UnknownMessage),
            _ => Classification::Rejected(DiscardReason::WrongTerminator),
        }
    }

    fn starts(&self, _: u8) -> bool {
        true
    }

    fn decode(&self, frame: &[u8]) -> u8 {
        frame.len().to_le_bytes()[0]
    }
}

/// Each pushed byte is counted or pending. After a line event no byte is pending. In this harness all counters start at
/// zero. [`each_report_is_counted`] checks the same counting code with counters that start anywhere, so that they can
/// wrap.
#[kani::proof]
#[kani::unwind(3)]
fn pushed_bytes_of_any_length_are_counted() {
    let start = 0;
    let receiver = BufferedReceiver::<_, [u8; 2]>::new(Anything::<2>(kani::any()));
    let mut line = any_line(receiver, start);
    assert!(line.push(0).is_none() && line.pending() == 1);
    let pushed = line.push(1).map_or(0, |frame| frame.message());
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

/// Each byte of a slice is counted.
#[kani::proof]
#[kani::unwind(3)]
fn fed_bytes_of_any_length_are_counted() {
    let start = 0;
    let receiver = BufferedReceiver::<_, [u8; 1]>::new(Anything::<1>(kani::any()));
    let mut line = any_line(receiver, start);
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
