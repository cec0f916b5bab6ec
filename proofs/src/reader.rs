//! Theorem 1 for the reader. The harnesses also show that each byte of a read is parsed once (theorem 6).
//!
//! The harnesses call `next_message_with` and `next_message_async_with` of [`Reader`] from any state, with any parser
//! and a source that does anything: a read returns any number, even one larger than the buffer, or it returns an error,
//! or it is pending. The future of a pending read is dropped. The source returns an error to a second read in the same
//! call. By then, the parser must have taken all bytes of the first read. The harnesses need no later reads: an
//! execution that reads a second time is at the start of the loop again, in another state, and the harnesses start from
//! any state.

use core::cell::Cell;
use core::future::{Future as _, pending};
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::{Line, Reader};

use crate::any_parser::AnyParser;

/// A source whose first read may have any result. Each later read returns an error.
struct AnySource<'a> {
    reads: &'a Cell<u8>,
    /// The number of bytes that the source has put into the reader's buffer.
    given: &'a Cell<usize>,
    is_waiting: bool,
}

impl AnySource<'_> {
    fn result(&mut self, buffer: &[u8]) -> Result<usize, ErrorKind> {
        let is_first = self.reads.replace(1) == 0;
        if !is_first || kani::any() {
            return Err(ErrorKind::Other);
        }
        let count = kani::any();
        self.given.set(buffer.len().min(count));
        Ok(count)
    }
}

impl ErrorType for AnySource<'_> {
    type Error = ErrorKind;
}

impl embedded_io::Read for AnySource<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.result(buffer)
    }
}

impl embedded_io_async::Read for AnySource<'_> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.is_waiting {
            pending::<()>().await;
        }
        self.result(buffer)
    }
}

const SIZE: usize = 4096;

type AnyReader<'a> = Reader<AnySource<'a>, AnyParser, SIZE>;

/// The result of a call. `None` means that the source was pending.
type Answer = Option<Result<Option<u8>, ErrorKind>>;

/// Calls the reader in any state. Whatever the source does, each byte in the buffer is either parsed once or still in
/// the buffer.
fn each_byte_is_parsed_once(call: impl FnOnce(&mut AnyReader<'_>) -> Answer) {
    let (given, reads) = (Cell::new(0), Cell::new(0));
    let source = AnySource {
        reads: &reads,
        given: &given,
        is_waiting: kani::any(),
    };
    let [taken, filled] = [kani::any::<u16>(), kani::any()].map(usize::from);
    kani::assume(taken <= filled && filled <= SIZE);
    let line = Line::new(AnyParser::default());
    let mut reader = Reader::in_state(source, line, [0; SIZE], [taken, filled]);
    let answer = call(&mut reader);
    let [new_taken, new_filled] = reader.state();
    assert!(new_taken <= new_filled && new_filled <= SIZE);
    let left = new_filled - new_taken;
    assert!(filled - taken + given.get() == reader.line().parser().taken + left);
    match answer {
        Some(Ok(Some(_))) => {}
        Some(Err(_)) => assert!(left == 0),
        // The end of the source, or a source that is pending.
        Some(Ok(None)) | None => assert!(left == 0 && given.get() == 0),
    }
    kani::cover!(
        answer == Some(Ok(None)) && taken < filled,
        "the end of the source"
    );
    kani::cover!(
        matches!(answer, Some(Err(_))) && given.get() == SIZE,
        "an error after a full buffer"
    );
    kani::cover!(
        matches!(answer, Some(Ok(Some(_)))) && given.get() == SIZE,
        "a full buffer"
    );
    kani::cover!(
        matches!(answer, Some(Ok(Some(_)))) && left > SIZE / 2,
        "half a buffer is left"
    );
}

#[kani::proof]
#[kani::unwind(3)]
fn blocking_read() {
    each_byte_is_parsed_once(|reader| Some(reader.next_message_with(|message| message)));
}

/// The future is polled once and then dropped.
#[kani::proof]
#[kani::unwind(3)]
fn async_read() {
    each_byte_is_parsed_once(|reader| {
        let future = pin!(reader.next_message_async_with(|message| message));
        match future.poll(&mut Context::from_waker(Waker::noop())) {
            Poll::Ready(answer) => {
                kani::cover!(true, "the source is ready");
                Some(answer)
            }
            Poll::Pending => {
                kani::cover!(true, "the source is pending");
                None
            }
        }
    });
}
