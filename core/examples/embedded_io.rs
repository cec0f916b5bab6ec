//! Receives setpoints from a source that implements `Read` of `embedded-io`. Many serial drivers implement `Read`.
//!
//! `cargo run -p framelock --features embedded-io-v0.7 --example embedded_io`

use embedded_io::{ErrorKind, Read};
use framelock::motion::{Bin, Setpoint};
use framelock::{LineEvent, Reader, Receiver};

/// A driver that returns a few bytes at a time, and reports a pause and a lost byte. Set your driver's timeout to 5 ms,
/// which is longer than the pauses that a USB serial adapter inserts into a frame.
pub(crate) struct Serial(pub(crate) Vec<Result<&'static [u8], ErrorKind>>);

impl embedded_io::ErrorType for Serial {
    type Error = ErrorKind;
}

impl Read for Serial {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        let mut bytes = self.0.pop().unwrap_or(Ok(&[]))?;
        let Ok(count) = bytes.read(buffer);
        Ok(count)
    }
}

/// Returns the next setpoint, or `None` at the end of the source. `on` gets each line event.
pub(crate) fn next<R: Read>(
    reader: &mut Reader<R, Receiver<Bin>, 16>,
    mut on: impl FnMut(LineEvent),
) -> Option<Setpoint>
where
    R::Error: embedded_io::Error,
{
    loop {
        let event = match reader.next_message() {
            Ok(setpoint) => return setpoint,
            Err(error) => match embedded_io::Error::kind(&error) {
                ErrorKind::TimedOut => LineEvent::Idle,
                // Most drivers do not say which error has occurred.
                _ => LineEvent::Overrun,
            },
        };
        // After a lost byte or a pause, the pending bytes are worthless, so discard them. The next call continues.
        reader.line_mut().event(event);
        on(event);
    }
}

pub(crate) fn main() {
    // The pieces are in reverse order, because `pop` takes the last one first.
    let received = vec![
        Ok(&b"AB\0\x12\x22\x32\r"[..]),
        Err(ErrorKind::TimedOut),
        Ok(b"AB\0\x11\x21\x31\rAB\0"),
        Err(ErrorKind::Other),
        Ok(b"\x20\x30\rAB\0"),
        Ok(b"AB\0\x10"),
    ];
    let mut reader = Reader::new(Serial(received), Receiver::new());
    while let Some(setpoint) = next(&mut reader, |event| println!("{event}")) {
        println!("{setpoint}");
    }
    let discarded = reader.line().counters().discarded.total();
    println!("{discarded} bytes discarded");
}

// It prints:
// pitch 16, roll 32, yaw 48
// overrun
// pitch 17, roll 33, yaw 49
// idle line
// pitch 18, roll 34, yaw 50
// 6 bytes discarded
