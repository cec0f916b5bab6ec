//! Target `reader`: the core's `Reader`, blocking and async, with a UART that returns slices and errors. The program
//! cancels reads, and the line pauses.

use std::fmt::Debug;
use std::future::{pending, poll_fn, ready};
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Counters, DiscardReason, LineEvent, Reader, Receiver};
use framelock_proofs::reference::{self, NaiveFormat};

use crate::outcome::{Counted, Occurred, Outcome};
use crate::parser::OfSetpoints;
use crate::stream::{Stream, StreamStep, bytes_of};

/// The driver of a UART, which returns the bytes of the slices, and an error for each line event.
struct Driver<'a> {
    steps: std::slice::Iter<'a, StreamStep>,
    /// The rest of the current slice.
    bytes: &'a [u8],
    /// Whether an async read has waited for the next slice or error.
    has_waited: bool,
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
    /// Waits once whenever no byte of the current slice is left. If the program cancels the read then, nothing is lost.
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        poll_fn(|_| {
            self.has_waited = self.bytes.is_empty() && !self.has_waited;
            if self.has_waited {
                Poll::Pending
            } else {
                Poll::Ready(())
            }
        })
        .await;
        embedded_io::Read::read(self, buffer)
    }
}

/// Checks that the reader returns the reference's setpoints and the driver's errors, in the order in which frames and
/// errors come in the stream. An error must lose no byte. If an error stands for an overrun, the test reports a line
/// event to the reader, and the reader discards the pending bytes. After other errors, the bytes stay pending. All this
/// must hold for buffers of different sizes, for the blocking and the async reader, and for an async reader whose reads
/// are cancelled whenever they wait. A reader that reports pauses must discard the pending bytes whenever a read waits.
///
/// Counts the outcomes, and the cancelled reads and the errors that come while bytes are pending.
///
/// # Panics
/// Panics if the stream shows a bug.
pub fn reader(stream: &Stream, occurred: &mut Occurred) {
    check::<Receiver<Bin>, reference::Bin, 16>(stream, occurred);
    check::<Lecture, reference::Lecture, 1>(stream, occurred);
    check::<Receiver<BinCrc8>, reference::BinCrc8, 64>(stream, occurred);
}

/// The result of a call to one of the reader's functions.
type Answer = Result<Option<Setpoint>, ErrorKind>;

/// One of the reader's functions, called in one of several ways.
type Read<'a, 'b, P, const N: usize> = &'a mut dyn FnMut(&mut Reader<Driver<'b>, P, N>) -> Answer;

fn check<P, F, const N: usize>(Stream(steps): &Stream, occurred: &mut Occurred)
where
    P: OfSetpoints + Debug,
    F: NaiveFormat,
{
    let [mut cancelled, mut errors, mut joined] = [0_u32; 3];
    let [in_one_piece, with_pauses] = [false, true].map(|pauses| expected::<F>(steps, pauses));
    let blocking: Read<P, N> = &mut Reader::next_message;
    let cancelling: Read<P, N> = &mut |reader| {
        loop {
            if let Poll::Ready(answer) = poll(pin!(reader.next_message_async())) {
                return answer;
            }
            cancelled += u32::from(reader.line().pending() > 0);
        }
    };
    let without_a_pause: Read<P, N> =
        &mut |reader| patient(reader.next_message_or_pause(pending::<()>, |setpoint| setpoint));
    let pausing: Read<P, N> =
        &mut |reader| patient(reader.next_message_or_pause(|| ready(()), |setpoint| setpoint));
    for (read, (answers, counters)) in [
        (blocking, &in_one_piece),
        (cancelling, &in_one_piece),
        (without_a_pause, &in_one_piece),
        (pausing, &with_pauses),
    ] {
        let driver = Driver {
            steps: steps.iter(),
            bytes: &[],
            has_waited: false,
        };
        let mut reader = Reader::<_, _, N>::new(driver, P::default());
        let mut pending = 0;
        for &answer in answers {
            let before = std::mem::replace(&mut pending, 0);
            assert_eq!(read(&mut reader), answer, "{steps:02X?}");
            match answer {
                Err(ErrorKind::Other) => reader.line_mut().line_event(LineEvent::Overrun, |_| ()),
                Err(_) => pending = reader.line().pending(),
                Ok(setpoint) => joined += u32::from(before > 0 && setpoint.is_some()),
            }
            errors += u32::from(pending > 0);
        }
        assert_eq!(reader.line().counters(), counters, "{steps:02X?}");
    }
    occurred.count("a read is cancelled while bytes are pending", cancelled);
    occurred.count("an error leaves bytes pending", errors);
    occurred.count(
        "a frame comes after an error that left bytes pending",
        joined,
    );
    occurred.count_all(&in_one_piece.1);
    occurred.count_all(&with_pauses.1);
}

/// Returns the reader's expected answers and the expected counters. The last two answers are `Ok(None)`, because a read
/// at the end of the stream returns this each time. If there are pauses, the line pauses after each slice.
fn expected<F: NaiveFormat>(steps: &[StreamStep], pauses: bool) -> (Vec<Answer>, Counters) {
    let mut answers = Vec::new();
    let mut counted = Counted::default();
    let end = |step: &StreamStep| match step {
        StreamStep::Event(event) => {
            (error(*event) == ErrorKind::Other).then_some(LineEvent::Overrun)
        }
        StreamStep::Slice(_) => pauses.then_some(LineEvent::Idle),
    };
    for stretch in steps.split_inclusive(|step| end(step).is_some()) {
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
            }
            // A pause counts only if bytes are pending.
            if let Some(event) = end(step)
                && (event == LineEvent::Overrun || outcome.pending > 0)
            {
                counted.discarded(outcome.pending, DiscardReason::LineEvent);
                counted.line_event(event);
            }
        }
    }
    answers.extend([Ok(None); 2]);
    (answers, counted.counters)
}

fn poll<T>(future: std::pin::Pin<&mut impl Future<Output = T>>) -> Poll<T> {
    future.poll(&mut Context::from_waker(Waker::noop()))
}

/// Polls the future until it is ready, as an executor does.
fn patient<T>(future: impl Future<Output = T>) -> T {
    let mut future = pin!(future);
    loop {
        if let Poll::Ready(value) = poll(future.as_mut()) {
            return value;
        }
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
        check::<Receiver<Bin>, reference::Bin, 16>(&stream, &mut Occurred::default());
    }

    #[test]
    #[should_panic(expected = "checksum_mismatch: 1")]
    fn a_byte_that_is_counted_for_a_wrong_reason_is_a_bug() {
        let stream = Stream(vec![StreamStep::Slice(NOISE_AND_A_FRAME.to_vec())]);
        check::<WrongReasons, reference::Bin, 16>(&stream, &mut Occurred::default());
    }
}
