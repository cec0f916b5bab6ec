//! Tests the reader on `embedded-io` sources, blocking and async.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::future::poll_fn;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::motion::{Bin, Setpoint};
use framelock::{BufferedReceiver, Encode, LineEvent, PacketReceiver, Reader, Receiver, Stuffing};

use crate::buffered::Short;
use crate::packets::Any;

/// The answer of a UART to a call.
#[derive(Clone)]
enum Answer {
    Bytes(Vec<u8>),
    Error(ErrorKind),
    /// The line is silent for ever. The blocking UART does not give this answer.
    Silence,
}

/// A UART that gives these answers, and then nothing more. If it `is_slow`, it is pending once before each answer.
struct Uart {
    answers: VecDeque<Answer>,
    is_slow: bool,
}

fn uart<const N: usize>(answers: [Answer; N]) -> Uart {
    let answers = answers.into();
    let is_slow = false;
    Uart { answers, is_slow }
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
        let mut is_pending = self.is_slow;
        poll_fn(|_| {
            if std::mem::take(&mut is_pending) {
                Poll::Pending
            } else {
                Poll::Ready(())
            }
        })
        .await;
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

/// Polls the future once, which is enough unless the UART is slow.
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

/// Reads to the end of the source. Drops the future at the pending reads whose numbers `is_dropped` selects, and calls
/// the reader again. Returns the setpoints.
fn read_with_dropped_futures(
    reader: &mut Reader<Uart, Receiver<Bin>, 16>,
    is_dropped: impl Fn(usize) -> bool,
) -> Vec<Setpoint> {
    let (mut setpoints, mut number) = (Vec::new(), 0);
    loop {
        let mut future = std::pin::pin!(reader.next_message_async());
        let answer = loop {
            match future
                .as_mut()
                .poll(&mut Context::from_waker(Waker::noop()))
            {
                Poll::Ready(answer) => break answer,
                Poll::Pending => {
                    number += 1;
                    if is_dropped(number) {
                        break Err(ErrorKind::Interrupted);
                    }
                }
            }
        };
        match answer {
            Ok(Some(setpoint)) => setpoints.push(setpoint),
            Ok(None) => return setpoints,
            Err(_) => {}
        }
    }
}

/// Whenever a future is dropped while the source is pending, no byte is lost, and no byte is parsed twice. The slices
/// contain several frames, whole and cut.
#[test]
fn a_dropped_future_loses_and_doubles_nothing() {
    let sent: Vec<Setpoint> = (0..9).map(|pitch| Setpoint { pitch, ..SETPOINT }).collect();
    let frames: Vec<u8> = sent.iter().flat_map(|&one| Bin::encode(one)).collect();
    let stream = [b"noise", frames.as_slice(), b"A"].concat();
    for size in 1..=16 {
        let pieces = stream.chunks(size);
        let answers = pieces.map(|piece| Answer::Bytes(piece.to_vec()));
        let answers: VecDeque<Answer> = answers.collect();
        // The last read returns 0.
        let reads = answers.len() + 1;
        let check = |is_dropped: &dyn Fn(usize) -> bool| {
            let uart = Uart {
                answers: answers.clone(),
                is_slow: true,
            };
            let mut reader = Reader::new(uart, Receiver::<Bin>::new());
            let setpoints = read_with_dropped_futures(&mut reader, is_dropped);
            assert_eq!(setpoints, sent, "slices of {size} bytes");
            let counters = reader.line().counters();
            assert_eq!(
                counters.bytes as usize,
                stream.len(),
                "slices of {size} bytes"
            );
            assert_eq!(counters.discarded.total(), 5);
            assert_eq!(reader.line().pending(), 1);
        };
        check(&|_| false);
        for dropped in 1..=reads {
            check(&|number| number == dropped);
        }
        // The first future of each read is dropped.
        check(&|number| number % 2 == 1);
    }
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
