//! Target `reader`: the core's `Reader`, blocking and async, with a UART that returns slices and
//! errors.

use std::fmt::Debug;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Counters, DiscardReason, LineEvent, Reader, Receiver};
use framelock_proofs::reference::{self, NaiveFormat};

use crate::outcome::{Counted, Outcome};
use crate::parser::OfSetpoints;
use crate::stream::{Stream, StreamStep, bytes_of};

/// The driver of a UART, which returns the bytes of the slices, and an error for each line event.
struct Driver<'a> {
    steps: std::slice::Iter<'a, StreamStep>,
    /// The rest of the current slice.
    bytes: &'a [u8],
}

/// Returns the driver's error for a line event. An idle gap loses no bytes. All other events count as overruns.
fn error(event: LineEvent) -> ErrorKind {
    if event == LineEvent::Idle {
        ErrorKind::TimedOut
    } else {
        ErrorKind::Other
    }
}

impl ErrorType for Driver<'_> {
    type Error = ErrorKind;
}

impl embedded_io::Read for Driver<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        while self.bytes.is_empty() {
            match self.steps.next() {
                Some(StreamStep::Slice(bytes)) => self.bytes = bytes,
                Some(StreamStep::Event(event)) => return Err(error(*event)),
                None => return Ok(0),
            }
        }
        let Ok(count) = self.bytes.read(buffer);
        Ok(count)
    }
}

impl embedded_io_async::Read for Driver<'_> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        embedded_io::Read::read(self, buffer)
    }
}

/// Checks that the reader returns the reference's setpoints and the driver's errors. The reader must return each
/// setpoint and each error before it reads another byte. An error must lose no byte. If an error stands for an overrun,
/// the test reports a line event to the reader, and the reader discards the pending bytes. After other errors, the
/// bytes stay pending. All this must hold for buffers of different sizes, and for the blocking and the async reader.
///
/// Returns the counters of each machine.
///
/// # Panics
/// Panics if the stream shows a bug.
pub fn reader(stream: &Stream) -> [Counters; 3] {
    [
        check::<Receiver<Bin>, reference::Bin, 16>(stream),
        check::<Lecture, reference::Lecture, 1>(stream),
        check::<Receiver<BinCrc8>, reference::BinCrc8, 64>(stream),
    ]
}

/// The result of a call to the reader's `next_message`.
type Answer = Result<Option<Setpoint>, ErrorKind>;

fn check<P, F, const N: usize>(Stream(steps): &Stream) -> Counters
where
    P: OfSetpoints + Debug,
    F: NaiveFormat,
{
    let (expected, counters) = expected::<F>(steps);
    for read in [
        |reader: &mut Reader<_, P, N>| reader.next_message(),
        |reader: &mut Reader<_, P, N>| now(reader.next_message_async()),
    ] {
        let driver = Driver {
            steps: steps.iter(),
            bytes: &[],
        };
        let mut reader = Reader::<_, _, N>::new(driver, P::default());
        for &answer in &expected {
            assert_eq!(read(&mut reader), answer, "{steps:02X?}");
            if answer == Err(ErrorKind::Other) {
                reader.line_mut().line_event(LineEvent::Overrun, |_| ());
            }
        }
        assert_eq!(reader.line().counters(), &counters, "{steps:02X?}");
    }
    counters
}

/// Returns the reader's expected answers and the expected counters. The last two answers are those
/// at the end of the source.
fn expected<F: NaiveFormat>(steps: &[StreamStep]) -> (Vec<Answer>, Counters) {
    let mut answers = Vec::new();
    let mut counted = Counted::default();
    let ends = |step: &StreamStep| matches!(step, StreamStep::Event(event) if error(*event) == ErrorKind::Other);
    for stretch in steps.split_inclusive(ends) {
        let bytes = bytes_of(stretch);
        let outcome = Outcome::expected::<F>(&bytes);
        counted.add(bytes.len(), &outcome.found);

        let mut frames = outcome.frames().into_iter().peekable();
        let mut read = 0;
        for step in stretch {
            read += step.bytes().len();
            while let Some((_, setpoint)) = frames.next_if(|&(index, _)| index < read) {
                answers.push(Ok(Some(setpoint)));
            }
            if let StreamStep::Event(event) = step {
                answers.push(Err(error(*event)));
                if ends(step) {
                    counted.discarded(outcome.pending, DiscardReason::LineEvent);
                    counted.line_event(LineEvent::Overrun);
                }
            }
        }
    }
    answers.extend([Ok(None); 2]);
    (answers, counted.counters)
}

/// Returns the future's result. The driver never waits, so the future is ready immediately.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => panic!("the driver was ready"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wrong_reasons::WrongReasons;

    const NOISE_AND_A_FRAME: &[u8] = b"?AB\0xyz\r";

    #[test]
    fn a_right_receiver_passes() {
        let stream = Stream(vec![StreamStep::Slice(NOISE_AND_A_FRAME.to_vec())]);
        check::<Receiver<Bin>, reference::Bin, 16>(&stream);
    }

    #[test]
    #[should_panic(expected = "checksum_mismatch: 1")]
    fn a_byte_that_is_counted_for_a_wrong_reason_is_a_bug() {
        let stream = Stream(vec![StreamStep::Slice(NOISE_AND_A_FRAME.to_vec())]);
        check::<WrongReasons, reference::Bin, 16>(&stream);
    }
}
