//! Target `parser`: a stream, cut into slices anywhere, with line events anywhere.

use framelock::{Accounting, Bin, BinCrc8, Event, Lecture, Mismatch, Parser, Receiver, Setpoint};
use framelock_proofs::reference::{self, Format, Policy};

use crate::outcome::{Counted, Outcome};
use crate::stream::{Stream, StreamStep};

/// Every parser reports of the stream what the reference does: the frames, their places, which bytes
/// were dropped and why. Byte by byte and slice by slice is the same, wherever the stream is cut;
/// nothing reaches across a line event; every byte and event is counted, once.
///
/// # Panics
/// If the stream shows a bug.
pub fn parser(stream: &Stream) {
    check::<Receiver<Bin>, reference::Bin>(stream, Policy::Rescan);
    check::<Lecture, reference::Bin>(stream, Policy::Discard);
    check::<Receiver<BinCrc8>, reference::BinCrc8>(stream, Policy::Rescan);
}

fn check<P, F>(Stream(steps): &Stream, policy: Policy)
where
    P: Parser<Message = Setpoint> + Copy + Default + PartialEq + std::fmt::Debug,
    F: Format,
{
    let mut line = Accounting::new(P::default());
    let mut counted = Counted::default();
    // A line event makes the rest of the stream a stream of its own.
    for stretch in steps.split_inclusive(|step| matches!(step, StreamStep::Event(_))) {
        let bytes: Vec<u8> = stretch
            .iter()
            .flat_map(StreamStep::bytes)
            .copied()
            .collect();
        let expected = Outcome::expected::<F>(&bytes, policy);
        let pushed = push::<P>(&bytes, &expected);
        let (fed, outcome) = feed::<P>(stretch);
        assert_eq!(fed, pushed, "fed: {steps:02X?}");
        assert_eq!(outcome, expected, "fed: {steps:02X?}");

        let (mut frames, mut from) = (Vec::new(), 0);
        for slice in stretch.iter().map(StreamStep::bytes) {
            line.feed(slice, |index, setpoint| {
                frames.push((from + index, setpoint));
            });
            from += slice.len();
        }
        assert_eq!(frames, expected.frames(), "accounted for: {steps:02X?}");
        assert_eq!(line.parser(), &pushed, "accounted for: {steps:02X?}");

        counted.add(bytes.len(), P::FRAME_LENGTH, &expected);
        if let Some(StreamStep::Event(event)) = stretch.last() {
            line.line_event(*event);
            counted.dropped(expected.pending, Mismatch::LineEvent);
            counted.line_event(*event);
            assert_eq!(line.parser(), &P::default(), "reset: {steps:02X?}");
        }
        let counters = line.counters();
        assert_eq!(counters, &counted.counters, "{steps:02X?}");
        assert_eq!(
            counters.bytes,
            P::FRAME_LENGTH * counters.frames + counters.discarded.total() + line.pending(),
            "every byte has one place: {steps:02X?}"
        );
    }
}

/// Byte by byte: a frame in the step that takes its last byte, less than a frame pending at any time.
fn push<P>(bytes: &[u8], expected: &Outcome) -> P
where
    P: Parser<Message = Setpoint> + Default,
{
    let mut parser = P::default();
    let mut frames = Vec::new();
    for (index, &byte) in bytes.iter().enumerate() {
        let setpoint = parser.push(byte);
        frames.extend(setpoint.map(|setpoint| (index, setpoint)));
        assert!(parser.pending() < P::FRAME_LENGTH, "{bytes:02X?}");
    }
    assert_eq!(frames, expected.frames(), "pushed: {bytes:02X?}");
    assert_eq!(parser.pending(), expected.pending, "pushed: {bytes:02X?}");
    parser
}

/// Slice by slice.
fn feed<P>(slices: &[StreamStep]) -> (P, Outcome)
where
    P: Parser<Message = Setpoint> + Default,
{
    let mut parser = P::default();
    let mut outcome = Outcome::default();
    let mut from = 0;
    for slice in slices.iter().map(StreamStep::bytes) {
        parser.feed_events(slice, |event| {
            outcome.add(match event {
                Event::Frame { index, message } => Event::Frame {
                    index: from + index,
                    message,
                },
                dropped @ Event::Dropped { .. } => dropped,
            });
        });
        from += slice.len();
    }
    outcome.pending = parser.pending();
    (parser, outcome)
}
