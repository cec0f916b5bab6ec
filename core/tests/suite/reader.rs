//! Tests the reader on `embedded-io` sources, blocking and async.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::motion::{Bin, Setpoint};
use framelock::{BufferedReceiver, Encode, LineEvent, PacketReceiver, Reader, Receiver, Stuffing};

use crate::buffered::Short;
use crate::packets::Any;

/// The answer of a UART to a call of `read`.
enum Answer {
    Bytes(Vec<u8>),
    Error(ErrorKind),
    /// The line is silent, so the async read never ends. The blocking read ends the source instead.
    Silence,
}

/// A UART that gives these answers, and then ends.
struct Uart {
    answers: VecDeque<Answer>,
}

fn uart<const N: usize>(answers: [Answer; N]) -> Uart {
    let answers = answers.into();
    Uart { answers }
}

impl ErrorType for Uart {
    type Error = ErrorKind;
}

impl embedded_io::Read for Uart {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        match self.answers.pop_front() {
            Some(Answer::Bytes(bytes)) => {
                buffer[..bytes.len()].copy_from_slice(&bytes);
                Ok(bytes.len())
            }
            Some(Answer::Error(error)) => Err(error),
            _ => Ok(0),
        }
    }
}

impl embedded_io_async::Read for Uart {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        if matches!(self.answers.front(), Some(Answer::Silence)) {
            self.answers.pop_front();
            std::future::pending::<()>().await;
        }
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
    uart([
        Answer::Bytes(frame[..3].to_vec()),
        Answer::Error(ErrorKind::Interrupted),
        Answer::Bytes([&frame[3..], &frame[..], &frame[..2]].concat()),
        Answer::Error(ErrorKind::Other),
        Answer::Bytes(frame.to_vec()),
    ])
}

/// Polls the future once, which is enough for this UART.
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
        assert!(reader.into_source().answers.is_empty());
    }
}

/// The frames of a [`BufferedReceiver`] borrow from the receiver. After a false start, two frames are complete. The
/// reader returns both before it asks its source for more bytes.
#[test]
fn frames_of_any_length_are_read() {
    let uart = uart([
        Answer::Bytes(b"noise#\x02ok#\x07#\x01".to_vec()),
        Answer::Bytes(b"c#\x01d#".to_vec()),
        Answer::Error(ErrorKind::Other),
        Answer::Bytes(b"\x01e".to_vec()),
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

/// A faulty driver returns a number that is greater than the buffer's size. The reader parses the whole buffer, and
/// continues.
#[test]
fn a_driver_that_returns_too_great_a_number_does_no_harm() {
    struct Faulty(usize);
    impl ErrorType for Faulty {
        type Error = Infallible;
    }
    impl embedded_io::Read for Faulty {
        fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Infallible> {
            buffer[..7].copy_from_slice(&Bin::encode(SETPOINT));
            Ok(std::mem::take(&mut self.0))
        }
    }
    for count in [8, 100, usize::MAX] {
        let mut reader = Reader::<_, _, 7>::new(Faulty(count), Receiver::<Bin>::new());
        assert_eq!(reader.next_message(), Ok(Some(SETPOINT)));
        assert_eq!(reader.next_message(), Ok(None));
        assert_eq!(reader.line().counters().bytes, 7);
    }
}

/// After a false start, two whole frames are pending. Only the pause shows that they are frames.
#[test]
fn a_pause_delivers_the_whole_frames_one_in_each_call() {
    let uart = uart([
        Answer::Bytes(b"#\x07#\x01k#\x01c".to_vec()),
        Answer::Silence,
        Answer::Bytes(b"#\x01d".to_vec()),
    ]);
    let receiver = BufferedReceiver::<_, [u8; 18]>::new(Short);
    let mut reader = Reader::<_, _, 32>::new(uart, receiver);
    let mut silences = 0;
    let mut read = || {
        let silence = || {
            silences += 1;
            std::future::ready(())
        };
        now(reader.next_message_or_pause(silence, |frame| frame.message().to_vec()))
    };
    assert_eq!(read(), Ok(Some(b"k".to_vec())));
    assert_eq!(read(), Ok(Some(b"c".to_vec())));
    assert_eq!(read(), Ok(Some(b"d".to_vec())));
    assert_eq!(read(), Ok(None));
    assert_eq!(silences, 1, "a silence counts only while bytes are pending");
    let counters = reader.line().counters();
    assert_eq!((counters.events.idle, counters.frames), (1, 3));
    assert_eq!(
        counters.bytes,
        counters.frame_bytes + counters.discarded.total()
    );
}

/// A delimiter before a pause stays pending, but the pause is reported only once.
#[test]
fn a_pause_after_a_delimiter_is_reported_once() {
    let uart = uart([
        Answer::Bytes(b"\xC0".to_vec()),
        Answer::Silence,
        Answer::Bytes(b"ab\xC0".to_vec()),
    ]);
    let receiver = PacketReceiver::with_buffer(Any(Stuffing::SLIP, 3), [0; 3]);
    let receiver = receiver.expect("long enough");
    let mut reader = Reader::<_, _, 32>::new(uart, receiver);
    let mut silences = 0;
    let silence = || {
        silences += 1;
        std::future::ready(())
    };
    let packet = now(reader.next_message_or_pause(silence, |frame| frame.bytes().to_vec()));
    assert_eq!((packet, silences), (Ok(Some(b"ab".to_vec())), 1));
    let counters = reader.line().counters();
    assert_eq!((counters.events.idle, counters.discarded.total()), (1, 0));
}
