//! Target `parser`: a stream, cut into slices anywhere, with line events anywhere.

use std::fmt::Debug;

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{DiscardReason, Line, Parser, Receiver};
use framelock_proofs::reference::{self, Format};

use crate::outcome::{Counted, Outcome, as_counter};
use crate::stream::{Stream, StreamStep, bytes_of};

/// Every machine reports of the stream what the reference does: the frames, their places, which bytes
/// were discarded and why. Byte by byte and slice by slice is the same, wherever the stream is cut;
/// nothing reaches across a line event; every byte and event is counted, once.
///
/// # Panics
/// If the stream shows a bug.
pub fn parser(stream: &Stream) {
    check::<Receiver<Bin>, reference::Bin>(stream);
    check::<Lecture, reference::Lecture>(stream);
    check::<Receiver<BinCrc8>, reference::BinCrc8>(stream);
}

/// A machine whose messages are setpoints.
pub(crate) trait OfSetpoints:
    for<'a> Parser<Message<'a> = Setpoint> + Default + 'static
{
}

impl<P: for<'a> Parser<Message<'a> = Setpoint> + Default + 'static> OfSetpoints for P {}

fn check<P, F>(Stream(steps): &Stream)
where
    P: OfSetpoints + Copy + PartialEq + Debug,
    F: Format,
{
    // By slices, some of them pulled, and of these the shortest by bytes.
    let mut line = Line::new(P::default());
    let mut counted = Counted::default();
    // A line event makes the rest of the stream a stream of its own.
    for stretch in steps.split_inclusive(|step| matches!(step, StreamStep::Event(_))) {
        let bytes = bytes_of(stretch);
        let expected = Outcome::expected::<F>(&bytes);
        let pushed = push::<P, F>(&bytes, &expected);
        let (fed, outcome) = feed::<P>(stretch);
        assert_eq!(fed, pushed, "fed: {steps:02X?}");
        assert_eq!(outcome, expected, "fed: {steps:02X?}");

        let mut setpoints = Vec::new();
        for slice in stretch.iter().map(StreamStep::bytes) {
            match slice {
                [first, _, _, ..] if first % 2 == 1 => setpoints.extend(line.messages(slice)),
                [_, _, _, ..] => line.feed(slice, |found| setpoints.extend(found.message())),
                few => setpoints.extend(few.iter().filter_map(|&byte| line.push(byte))),
            }
        }
        let expected_setpoints = expected.frames().into_iter().map(|(_, setpoint)| setpoint);
        assert!(
            setpoints.into_iter().eq(expected_setpoints),
            "on the line: {steps:02X?}"
        );
        assert_eq!(line.parser(), &pushed, "on the line: {steps:02X?}");

        counted.add(bytes.len(), &expected.found);
        if let Some(StreamStep::Event(event)) = stretch.last() {
            let mut discarded = 0;
            line.line_event(*event, |found| {
                assert_eq!(found.message(), None, "{steps:02X?}");
                discarded += found.bytes();
            });
            assert_eq!(discarded, expected.pending, "{steps:02X?}");
            counted.discarded(expected.pending, DiscardReason::LineEvent);
            counted.line_event(*event);
            assert_eq!(line.parser(), &P::default(), "reset: {steps:02X?}");
        }
        let counters = line.counters();
        assert_eq!(counters, &counted.counters, "{steps:02X?}");
        assert_eq!(
            counters.bytes,
            counters.frame_bytes + counters.discarded.total() + as_counter(line.pending()),
            "every byte has one place: {steps:02X?}"
        );
    }
}

/// Byte by byte, with what is discarded and without: a frame in the step that takes its last byte, less
/// than a frame pending at any time.
fn push<P, F>(bytes: &[u8], expected: &Outcome) -> P
where
    P: OfSetpoints + PartialEq + Debug,
    F: Format,
{
    let (mut parser, mut telling) = (P::default(), P::default());
    let mut frames = Vec::new();
    let mut told = Outcome::default();
    for (index, &byte) in bytes.iter().enumerate() {
        let setpoint = parser.push(byte);
        frames.extend(setpoint.map(|setpoint| (index, setpoint)));
        assert!(parser.pending() < F::LENGTH, "{bytes:02X?}");

        let mut length = None;
        let setpoint = telling.push_with(byte, |one| match one {
            framelock::Found::Discarded { count, why, .. } => {
                told.add(framelock::Found::discarded(count, why));
            }
            framelock::Found::Frame { length: bytes, .. } => length = Some(bytes),
        });
        assert_eq!(length.is_some(), setpoint.is_some(), "{bytes:02X?}");
        if let (Some(length), Some(setpoint)) = (length, setpoint) {
            told.add(framelock::Found::frame(length, setpoint));
        }
        assert_eq!(telling, parser, "{bytes:02X?}");
    }
    told.pending = telling.pending();
    assert_eq!(frames, expected.frames(), "pushed: {bytes:02X?}");
    assert_eq!(&told, expected, "pushed: {bytes:02X?}");
    parser
}

/// Slice by slice.
fn feed<P: OfSetpoints>(slices: &[StreamStep]) -> (P, Outcome) {
    let mut parser = P::default();
    let mut outcome = Outcome::default();
    for slice in slices.iter().map(StreamStep::bytes) {
        parser.feed(slice, |found| outcome.add(found));
    }
    outcome.pending = parser.pending();
    (parser, outcome)
}
