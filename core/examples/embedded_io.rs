//! Receives setpoints from a source that implements `Read` of `embedded-io`. Most serial drivers implement it.
//!
//! `cargo run -p framelock-examples --bin embedded_io`

use framelock::motion::Bin;
use framelock::{LineEvent, Reader, Receiver};

/// A driver that returns a few bytes at a time, and reports a lost byte once.
struct Serial(Vec<Result<&'static [u8], embedded_io::ErrorKind>>);

impl embedded_io::ErrorType for Serial {
    type Error = embedded_io::ErrorKind;
}

impl embedded_io::Read for Serial {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize, Self::Error> {
        let mut bytes = self.0.pop().unwrap_or(Ok(&[]))?;
        let Ok(count) = bytes.read(buffer);
        Ok(count)
    }
}

pub(crate) fn main() {
    // In reverse order, because `pop` takes the last piece first.
    let received = vec![
        Ok(&b"AB\0\x11\x21\x31\r"[..]),
        Err(embedded_io::ErrorKind::Other),
        Ok(b"\x20\x30\rAB\0"),
        Ok(b"AB\0\x10"),
    ];
    let mut reader = Reader::<_, _, 16>::new(Serial(received), Receiver::<Bin>::new());
    loop {
        match reader.next_message() {
            Ok(Some(setpoint)) => println!("{setpoint}"),
            Ok(None) => break,
            // After a lost byte the pending bytes are worthless, so discard them. The next call continues.
            Err(error) => {
                println!("error: {error}");
                reader.line_mut().line_event(LineEvent::Overrun, |_| ());
            }
        }
    }
    let discarded = reader.line().counters().discarded.total();
    println!("{discarded} bytes discarded");
}

// It prints:
// pitch 16, roll 32, yaw 48
// error: Other
// pitch 17, roll 33, yaw 49
// 3 bytes discarded
