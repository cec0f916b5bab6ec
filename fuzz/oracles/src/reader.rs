//! The core's reader, blocking and async, on what comes in pieces, pauses and fails: part of the
//! target `decode`.

use std::fmt::Debug;
use std::io::Read as _;
use std::pin::pin;
use std::task::{Context, Poll, Waker};

use embedded_io::{ErrorKind, ErrorType};
use framelock::{LineEvent, Parser, Reader, Setpoint};
use framelock_proofs::reference::{Format, Policy};

use crate::decode::{Piece, Pieces};
use crate::expected::Expected;

/// A UART driver that gives the pieces.
struct Driver<'a>(Pieces<'a>);

impl ErrorType for Driver<'_> {
    type Error = ErrorKind;
}

impl embedded_io::Read for Driver<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        self.0.read(buffer).map_err(|_| ErrorKind::Other)
    }
}

impl embedded_io_async::Read for Driver<'_> {
    async fn read(&mut self, buffer: &mut [u8]) -> Result<usize, ErrorKind> {
        embedded_io::Read::read(self, buffer)
    }
}

/// The messages are the reference's, and every error is handed on, after which nothing is lost.
pub(crate) fn check<P, F>(pieces: &[Piece], policy: Policy)
where
    P: Parser<Message = Setpoint> + Default + Debug,
    F: Format,
{
    let bytes: Vec<u8> = pieces.iter().flat_map(Piece::bytes).copied().collect();
    let expected = Expected::of::<F>(&bytes, policy);
    let setpoints: Vec<_> = expected
        .frames
        .iter()
        .map(|&(_, setpoint)| setpoint)
        .collect();
    let errors = pieces.iter().filter(|piece| piece.is_error()).count();

    for is_async in [false, true] {
        let driver = Driver(Pieces::new(pieces));
        let mut reader = Reader::<_, _, 16>::new(driver, P::default());
        let mut read = Vec::new();
        let mut failed = 0;
        loop {
            let answer = if is_async {
                now(reader.read_async())
            } else {
                reader.read()
            };
            match answer {
                Ok(Some(setpoint)) => read.push(setpoint),
                Ok(None) => break,
                Err(ErrorKind::Other) => failed += 1,
                Err(error) => panic!("{error} is not what the driver said: {pieces:02X?}"),
            }
        }
        assert_eq!(read, setpoints, "{pieces:02X?}");
        assert_eq!(failed, errors, "{pieces:02X?}");
        let line = reader.line();
        assert_eq!(line.counters().discarded, expected.dropped, "{pieces:02X?}");
        assert_eq!(line.pending(), expected.pending, "{pieces:02X?}");
        reader.line_mut().line_event(LineEvent::Idle);
        assert_eq!(reader.line().pending(), 0, "{pieces:02X?}");
        let rest = embedded_io::Read::read(&mut reader.into_source(), &mut [0]);
        assert_eq!(rest, Ok(0), "{pieces:02X?}");
    }
}

/// What comes of it; the driver never lets anyone wait.
fn now<T>(future: impl Future<Output = T>) -> T {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => panic!("the driver was ready"),
    }
}
