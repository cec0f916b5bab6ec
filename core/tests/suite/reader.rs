//! Tests the reader on `embedded-io` sources, blocking and async.

use std::convert::Infallible;
use std::future::poll_fn;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::motion::{Bin, Setpoint};
use framelock::{BufferedReceiver, Encode, LineEvent, PacketReceiver, Reader, Receiver, Stuffing};

use crate::buffered::Short;
use crate::packets::Any;

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

/// A UART that is pending once before each read.
struct Slow {
    uart: Uart,
    is_pending: bool,
}

impl ErrorType for Slow {
    type Error = ErrorKind;
}

impl embedded_io_async::Read for Slow {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.is_pending = true;
        poll_fn(|_| {
            if std::mem::take(&mut self.is_pending) {
                Poll::Pending
            } else {
                Poll::Ready(())
            }
        })
        .await;
        embedded_io::Read::read(&mut self.uart, buffer)
    }
}

/// Reads to the end of the source. Drops the future at the pending reads whose numbers `is_dropped` selects, and calls
/// the reader again. Returns the setpoints.
fn read_with_dropped_futures(
    reader: &mut Reader<Slow, Receiver<Bin>, 16>,
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
        let pieces: Vec<_> = stream
            .chunks(size)
            .map(|piece| Ok(piece.to_vec()))
            .collect();
        // The last read returns 0.
        let reads = pieces.len() + 1;
        let check = |is_dropped: &dyn Fn(usize) -> bool| {
            let uart = Slow {
                uart: Uart(pieces.clone()),
                is_pending: false,
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

/// A UART that waits for ever at each `None`.
struct Pausing(Vec<Option<Vec<u8>>>);

impl ErrorType for Pausing {
    type Error = ErrorKind;
}

impl embedded_io_async::Read for Pausing {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        if self.0.is_empty() {
            return Ok(0);
        }
        match self.0.remove(0) {
            Some(piece) => {
                buffer[..piece.len()].copy_from_slice(&piece);
                Ok(piece.len())
            }
            None => std::future::pending().await,
        }
    }
}

/// Behind a false start, two whole frames are pending. Only the pause shows that they are frames.
#[test]
fn a_pause_delivers_the_whole_frames_one_in_each_call() {
    let pieces = [
        Some(b"#\x07#\x01k#\x01c".to_vec()),
        None,
        Some(b"#\x01d".to_vec()),
    ];
    let receiver = BufferedReceiver::<_, [u8; 18]>::new(Short);
    let mut reader = Reader::<_, _, 32>::new(Pausing(pieces.to_vec()), receiver);
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
    let pieces = [Some(b"\xC0".to_vec()), None, Some(b"ab\xC0".to_vec())];
    let receiver = PacketReceiver::with_buffer(Any(Stuffing::SLIP, 3), [0; 3]);
    let receiver = receiver.expect("long enough");
    let mut reader = Reader::<_, _, 32>::new(Pausing(pieces.to_vec()), receiver);
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
