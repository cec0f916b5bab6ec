//! Tests the reader on `embedded-io` sources, blocking and async.

use std::convert::Infallible;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::motion::{Bin, Setpoint};
use framelock::{BufferedReceiver, Encode, LineEvent, Reader, Receiver};

use crate::buffered::Short;

/// A UART that returns the given pieces and errors, one per call.
struct Uart(Vec<Result<Vec<u8>, ErrorKind>>);

impl ErrorType for Uart {
    type Error = ErrorKind;
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.0.is_empty() {
            return Ok(0);
        }
        let piece = self.0.remove(0)?;
        buffer[..piece.len()].copy_from_slice(&piece);
        Ok(piece.len())
    }
}

impl embedded_io_async::Read for Uart {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        embedded_io::Read::read(self, buffer)
    }
}

const SETPOINT: Setpoint = Setpoint {
    pitch: 1,
    roll: 2,
    yaw: 3,
};

fn pieces() -> Uart {
    let frame = Bin::encode(SETPOINT);
    Uart(vec![
        Ok(frame[..3].to_vec()),
        Err(ErrorKind::Interrupted),
        Ok([&frame[3..], &frame[..], &frame[..2]].concat()),
        Err(ErrorKind::Other),
        Ok(frame.to_vec()),
    ])
}

/// Polls the future once, which is enough because this UART never waits.
fn now<T>(future: impl Future<Output = T>) -> T {
    match std::pin::pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(result) => result,
        Poll::Pending => panic!("this UART never waits"),
    }
}

#[test]
fn an_error_loses_nothing_blocking_and_async() {
    for read in [
        |reader: &mut Reader<Uart, Receiver<Bin>, 32>| reader.next_message(),
        |reader: &mut Reader<Uart, Receiver<Bin>, 32>| now(reader.next_message_async()),
    ] {
        let mut reader = Reader::new(pieces(), Receiver::<Bin>::new());
        assert_eq!(read(&mut reader), Err(ErrorKind::Interrupted));
        assert_eq!(read(&mut reader), Ok(Some(SETPOINT)));
        assert_eq!(read(&mut reader), Ok(Some(SETPOINT)));
        assert_eq!(read(&mut reader), Err(ErrorKind::Other));
        // The program decides which line event the driver's error stands for.
        reader.line_mut().line_event(LineEvent::Overrun, |_| ());
        assert_eq!(read(&mut reader), Ok(Some(SETPOINT)));
        assert_eq!(read(&mut reader), Ok(None));
        let counters = reader.line().counters();
        assert_eq!((counters.bytes, counters.frames), (23, 3));
        assert_eq!(counters.discarded.line_event, 2);
        assert!(reader.into_source().0.is_empty());
    }
}

/// A buffer of one byte is enough for the reader.
#[test]
fn the_smallest_buffer() -> Result<(), Infallible> {
    let stream = [b"noise".as_slice(), &Bin::encode(SETPOINT)].concat();
    let mut reader = Reader::<_, _, 1>::new(stream.as_slice(), Receiver::<Bin>::new());
    assert_eq!(reader.next_message()?, Some(SETPOINT));
    assert_eq!(reader.next_message()?, None);
    Ok(())
}

/// The frames of a [`BufferedReceiver`] borrow from the receiver. After a false start, two frames are complete. The
/// reader returns both before it asks its source for more bytes.
#[test]
fn frames_of_any_length_are_read() {
    let uart = Uart(vec![
        Ok(b"noise#\x02ok#\x07#\x01".to_vec()),
        Ok(b"c#\x01d#".to_vec()),
        Err(ErrorKind::Other),
        Ok(b"\x01e".to_vec()),
    ]);
    let receiver = BufferedReceiver::<_, [u8; 18]>::new(Short);
    let mut reader = Reader::<_, _, 32>::new(uart, receiver);
    let mut read = || reader.next_message_with(|frame| frame.message().to_vec());
    assert_eq!(read(), Ok(Some(b"ok".to_vec())));
    assert_eq!(read(), Ok(Some(b"c".to_vec())));
    assert_eq!(read(), Ok(Some(b"d".to_vec())));
    assert_eq!(read(), Err(ErrorKind::Other));
    assert_eq!(read(), Ok(Some(b"e".to_vec())));
    assert_eq!(read(), Ok(None));
    let counters = reader.line().counters();
    assert_eq!((counters.frames, counters.discarded.total()), (4, 5 + 2));
}
