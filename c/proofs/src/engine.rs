//! Proves that the engine of receivers with a buffer does the same in C and in Rust. From any state that satisfies the
//! invariant, a byte, a poll and a line event each have the same results in both languages: the delivered frames (at a
//! line event, only their lengths and first bytes), the counters, the questions to the classifier, and the next state.
//! The proof holds for all layouts, because both engines ask the same classifier, and this classifier may give any
//! answer that a layout can give.
//!
//! Frames have up to three bytes, and the buffer has five bytes. The engine has no case that depends on these sizes.

use framelock::{BufferedReceiver, Classification, DiscardReason, Format, Found, Line, LineEvent};

use crate::windows::{LINE_EVENTS, counters};

const LONGEST: usize = 3;
const ROOM: usize = 5;

unsafe extern "C" {
    safe fn c_start_engine();
    safe fn c_engine_state(which: u8) -> u8;
    safe fn c_byte(place: u8) -> u8;
    safe fn c_starts(byte: u8) -> u8;
    safe fn c_answer(first: u8, count: u8, seen: u8) -> u16;
    safe fn c_asked_the_same() -> u8;
    safe fn c_push(byte: u8) -> u8;
    safe fn c_poll_frame() -> u8;
    safe fn c_frames_of_event(event: u8) -> u8;
    safe fn c_length(place: u8) -> u8;
    safe fn c_first(place: u8) -> u8;
    safe fn c_counter(place: u8) -> u32;
}

/// A format that asks the classifier in C.
#[derive(Clone, Copy)]
struct Any;

impl Format for Any {
    const LONGEST: usize = LONGEST;
    type Message<'a> = &'a [u8];

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        answer(bytes, low(seen))
    }

    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        let number = match event {
            LineEvent::Framing => 0,
            LineEvent::Parity => 1,
            LineEvent::Overrun => 2,
            LineEvent::Break => 3,
            _ => 4,
        };
        answer(bytes, BEFORE + number)
    }

    fn starts(&self, byte: u8) -> bool {
        c_starts(byte) != 0
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

/// For the question `classify_before`, the argument `seen` of `c_answer` is this number plus the event.
const BEFORE: u8 = 250;

/// Returns the answer of the classifier in C.
fn answer(bytes: &[u8], seen: u8) -> Classification {
    let [outcome, number] = c_answer(bytes[0], low(bytes.len()), seen).to_le_bytes();
    let number = usize::from(number);
    Classification::Rejected(match outcome {
        0 => DiscardReason::NoSync,
        1 => DiscardReason::BrokenSync,
        2 => DiscardReason::BadHeader,
        3 => DiscardReason::TooLong,
        4 => DiscardReason::UnknownMessage,
        5 => DiscardReason::ChecksumMismatch,
        6 => DiscardReason::WrongTerminator,
        7 => DiscardReason::LineEvent,
        8 => return Classification::Frame(number),
        _ => return Classification::Incomplete { at_least: number },
    })
}

/// Converts a number below 256 to a byte.
fn low(number: usize) -> u8 {
    number.to_le_bytes()[0]
}

type Receiver = BufferedReceiver<Any, [u8; ROOM]>;

/// Returns the bytes and the indexes of the C receiver.
fn state() -> ([u8; ROOM], [usize; 3]) {
    let bytes = [c_byte(0), c_byte(1), c_byte(2), c_byte(3), c_byte(4)];
    let [from, to, ask_at] = [c_engine_state(0), c_engine_state(1), c_engine_state(2)];
    (bytes, [from, to, ask_at].map(usize::from))
}

/// Puts the C receiver into an arbitrary state. Returns a Rust line in the state of the C receiver.
fn related() -> Line<Receiver> {
    c_start_engine();
    let (bytes, indexes) = state();
    let line = Line::new(BufferedReceiver::in_state(Any, bytes, indexes));
    if c_engine_state(3) == 0 {
        line
    } else {
        line.after_loss()
    }
}

/// Checks that both receivers are in the same state, have the same counters, and have asked the same questions.
fn are_related(line: &Line<Receiver>) {
    assert!(c_asked_the_same() != 0);
    let ((bytes, indexes), (bytes_in_c, indexes_in_c)) = (line.parser().state(), state());
    assert!(indexes == indexes_in_c);
    let [from, to, _] = indexes;
    let place = usize::from(kani::any::<u8>());
    assert!(place < from || place >= to || bytes[place] == bytes_in_c[place]);
    assert!(line.is_after_loss() == (c_engine_state(3) != 0));
    let counters = counters(line.counters());
    let which = usize::from(kani::any::<u8>());
    assert!(which >= counters.len() || counters[which] == c_counter(low(which)));
}

/// Checks that both receivers have delivered the same frame. In C the frame's bytes precede index `from` in the buffer.
fn frame_is_same(frame: Option<&[u8]>, length_in_c: u8) {
    let frame = frame.unwrap_or_default();
    assert!(frame.len() == usize::from(length_in_c));
    let place = usize::from(kani::any::<u8>());
    if place < frame.len() {
        assert!(frame[place] == c_byte(c_engine_state(0) - length_in_c + low(place)));
    }
}

#[kani::proof]
#[kani::unwind(4)]
fn byte_is_same() {
    let mut line = related();
    let byte = kani::any();
    let length = c_push(byte);
    let frame = line.push(byte).map(|frame| frame.message());
    frame_is_same(frame, length);
    are_related(&line);
    kani::cover!(
        length > 0 && line.pending() > 0,
        "a frame with bytes after it"
    );
    kani::cover!(
        length == 0 && c_counter(9) == 2,
        "bytes that start no frame"
    );
}

#[kani::proof]
#[kani::unwind(4)]
fn poll_is_same() {
    let mut line = related();
    let length = c_poll_frame();
    let frame = line.poll().map(|frame| frame.message());
    frame_is_same(frame, length);
    are_related(&line);
    kani::cover!(
        length > 0 && line.counters().discarded.bad_header == 1,
        "a frame after a discarded byte"
    );
    kani::cover!(length == 0 && line.pending() > 0, "bytes stay pending");
}

#[kani::proof]
#[kani::unwind(4)]
fn event_is_same() {
    let mut line = related();
    let number: u8 = kani::any_where(|number| *number < 5);
    let event = LINE_EVENTS[usize::from(number)];
    let frames = c_frames_of_event(number);
    let mut count = 0;
    line.line_event(event, |found| {
        if let Found::Frame {
            length, message, ..
        } = found
        {
            assert!(
                count < frames
                    && low(length) == c_length(count)
                    && message.message()[0] == c_first(count)
            );
            count += 1;
        }
    });
    assert!(count == frames);
    are_related(&line);
    kani::cover!(frames == 2, "two frames");
    kani::cover!(
        frames == 1 && line.counters().discarded.line_event == 1,
        "a frame and a discarded byte"
    );
    let discarded = &line.counters().discarded;
    kani::cover!(
        discarded.line_event == 1 && discarded.no_sync == 1,
        "an undecided byte that starts no frame, and a byte that waited"
    );
}
