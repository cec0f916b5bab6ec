//! Target `parser`: a stream that is cut into slices anywhere and contains line events anywhere.

use std::fmt::Debug;

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{
    BufferedReceiver, Counters, DiscardReason, FixedFormat, Line, LineEvent, Parser, Receiver,
};
use framelock_formats::AnyOf;
use framelock_formats::layout::CheckedLayout;
use framelock_formats::motion::{BIN, BIN_CRC8};
use framelock_proofs::reference::{self, NaiveFormat};

use crate::outcome::{Counted, Occurred, Outcome, as_counter};
use crate::stream::{Stream, StreamStep, bytes_of};

/// Checks that the receivers of BIN and BIN-CRC8, and the lecture's machine, report the same as the reference: the
/// frames, their positions, the discarded bytes and the reasons. Pushed bytes and fed slices must give the same result,
/// wherever the stream is cut. No frame may contain bytes from both sides of a line event. Every byte and every event
/// must be counted once. For BIN and BIN-CRC8, a [`BufferedReceiver`] must deliver the same frames and have the same
/// counters.
///
/// Counts the outcomes, and the slices that are pulled, fed or pushed while bytes are pending. Returns the counters of
/// BIN, of the lecture's machine and of BIN-CRC8.
///
/// # Panics
/// Panics if the stream shows a bug.
pub fn parser(stream: &Stream, occurred: &mut Occurred) -> [Counters; 3] {
    buffered_receiver_does_the_same::<Bin>(&[BIN], stream);
    buffered_receiver_does_the_same::<BinCrc8>(&[BIN_CRC8], stream);
    [
        check::<Receiver<Bin>, reference::Bin>(stream, occurred),
        check::<Lecture, reference::Lecture>(stream, occurred),
        check::<Receiver<BinCrc8>, reference::BinCrc8>(stream, occurred),
    ]
}

/// A parser whose messages are setpoints.
pub(crate) trait OfSetpoints:
    for<'a> Parser<Message<'a> = Setpoint> + Default + 'static
{
}

impl<P: for<'a> Parser<Message<'a> = Setpoint> + Default + 'static> OfSetpoints for P {}

fn check<P, F>(Stream(steps): &Stream, occurred: &mut Occurred) -> Counters
where
    P: OfSetpoints + Copy + PartialEq + Debug,
    F: NaiveFormat,
{
    // Slices of three bytes or more are pulled with `messages` if their first byte is odd, and otherwise fed. Shorter
    // slices are pushed byte by byte.
    let mut line = Line::new(P::default());
    // The number of slices that came while bytes were pending, for each way.
    let mut ways = [0_u32; 3];
    let mut counted = Counted::default();
    // After a line event, the rest is a new stream.
    for stretch in steps.split_inclusive(|step| matches!(step, StreamStep::Event(_))) {
        let bytes = bytes_of(stretch);
        let expected = Outcome::expected::<F>(&bytes);
        let pushed = push::<P, F>(&bytes, &expected);
        let (fed, outcome) = feed::<P>(stretch);
        assert_eq!(fed, pushed, "fed: {steps:02X?}");
        assert_eq!(outcome, expected, "fed: {steps:02X?}");

        let mut setpoints = Vec::new();
        for slice in stretch.iter().map(StreamStep::bytes) {
            let is_pending = u32::from(line.pending() > 0);
            match slice {
                [first, _, _, ..] if first % 2 == 1 => {
                    setpoints.extend(line.messages(slice));
                    ways[0] += is_pending;
                }
                [_, _, _, ..] => {
                    line.feed(slice, |found| setpoints.extend(found.message()));
                    ways[1] += is_pending;
                }
                few => {
                    setpoints.extend(few.iter().filter_map(|&byte| line.push(byte)));
                    ways[2] += is_pending;
                }
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
            "every byte is counted once: {steps:02X?}"
        );
    }
    occurred.count("pulled while bytes are pending", ways[0]);
    occurred.count("fed while bytes are pending", ways[1]);
    occurred.count("pushed while bytes are pending", ways[2]);
    occurred.count_all(&counted.counters);
    counted.counters
}

/// Checks that a [`BufferedReceiver`] of the layout delivers the same frames as the [`Receiver`] of the format, and has
/// the same counters after each line event and at the end. One `BufferedReceiver` gets the slices by `feed`, and
/// another gets every byte by `push`.
fn buffered_receiver_does_the_same<F>(
    layout: &'static [CheckedLayout<'static>; 1],
    Stream(steps): &Stream,
) where
    F: FixedFormat<Message = Setpoint>,
{
    let buffered = || {
        let receiver = BufferedReceiver::with_buffer(AnyOf(layout), [0; 16]);
        Line::new(receiver.expect("the buffer holds the longest frame"))
    };
    let (mut fixed, mut fed, mut pushed) =
        (Line::new(Receiver::<F>::new()), buffered(), buffered());
    let (mut setpoints, mut of_fed, mut of_pushed) = (Vec::new(), Vec::new(), Vec::new());
    let setpoint = |(_, frame): (usize, &[u8])| Setpoint::from([frame[3], frame[4], frame[5]]);
    for step in steps.iter().chain([&StreamStep::Event(LineEvent::Idle)]) {
        match step {
            StreamStep::Slice(bytes) => {
                fixed.feed(bytes, |found| setpoints.extend(found.message()));
                fed.feed(bytes, |found| of_fed.extend(found.decoded().map(setpoint)));
                for &byte in bytes {
                    of_pushed.extend(pushed.push(byte).map(|frame| setpoint(frame.message())));
                }
                assert_eq!(fixed.counters(), fed.counters(), "{steps:02X?}");
            }
            StreamStep::Event(event) => {
                fixed.event(*event);
                fed.line_event(*event, |found| of_fed.extend(found.decoded().map(setpoint)));
                pushed.line_event(*event, |found| {
                    of_pushed.extend(found.decoded().map(setpoint));
                });
                assert_eq!(fixed.counters(), fed.counters(), "fed: {steps:02X?}");
                assert_eq!(fixed.counters(), pushed.counters(), "pushed: {steps:02X?}");
            }
        }
    }
    assert_eq!(
        (&setpoints, &setpoints),
        (&of_fed, &of_pushed),
        "{steps:02X?}"
    );
}

/// Pushes the bytes one at a time, with and without reports of discarded bytes. Checks that each frame comes with its
/// last byte, and that the pending bytes are always fewer than the bytes of a frame.
fn push<P, F>(bytes: &[u8], expected: &Outcome) -> P
where
    P: OfSetpoints + PartialEq + Debug,
    F: NaiveFormat,
{
    let (mut parser, mut reporting) = (P::default(), P::default());
    let mut frames = Vec::new();
    let mut reported = Outcome::default();
    for (index, &byte) in bytes.iter().enumerate() {
        let setpoint = parser.push(byte);
        frames.extend(setpoint.map(|setpoint| (index, setpoint)));
        assert!(parser.pending() < F::LENGTH, "{bytes:02X?}");

        let mut length = None;
        let setpoint = reporting.push_with(byte, |one| match one {
            framelock::Found::Discarded { count, why, .. } => {
                reported.add(framelock::Found::discarded(count, why));
            }
            framelock::Found::Frame { length: bytes, .. } => length = Some(bytes),
        });
        assert_eq!(length.is_some(), setpoint.is_some(), "{bytes:02X?}");
        if let (Some(length), Some(setpoint)) = (length, setpoint) {
            reported.add(framelock::Found::frame(length, setpoint));
        }
        assert_eq!(reporting, parser, "{bytes:02X?}");
    }
    reported.pending = reporting.pending();
    assert_eq!(frames, expected.frames(), "pushed: {bytes:02X?}");
    assert_eq!(&reported, expected, "pushed: {bytes:02X?}");
    parser
}

/// Feeds the slices one after another.
fn feed<P: OfSetpoints>(slices: &[StreamStep]) -> (P, Outcome) {
    let mut parser = P::default();
    let mut outcome = Outcome::default();
    for slice in slices.iter().map(StreamStep::bytes) {
        parser.feed(slice, |found| outcome.add(found));
    }
    outcome.pending = parser.pending();
    (parser, outcome)
}

#[cfg(test)]
mod tests {
    use super::{Occurred, check, reference};
    use crate::stream::{Stream, StreamStep};
    use crate::wrong_reasons::WrongReasons;

    #[test]
    #[should_panic(expected = "checksum_mismatch: 1")]
    fn a_byte_that_is_counted_for_a_wrong_reason_is_a_bug() {
        let stream = Stream(vec![StreamStep::Slice(b"?AB\0xyz\r".to_vec())]);
        check::<WrongReasons, reference::Bin>(&stream, &mut Occurred::default());
    }
}
