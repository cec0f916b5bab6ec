//! Checks that `Display` writes counters in one line, for logs.

use framelock::motion::Bin;
use framelock::{Line, LineEvent, Receiver};

#[test]
fn counters_are_one_line() {
    let mut line = Line::new(Receiver::<Bin>::new());
    let nothing =
        "0 bytes, frames: 0 (0 bytes), discarded: none, resynchronisations: 0, line events: none";
    assert_eq!(line.counters().to_string(), nothing);
    for byte in *b"noise AB\0xyz\rAB\0x" {
        line.push(byte);
    }
    line.line_event(LineEvent::Parity, |_| ());
    assert_eq!(
        line.counters().to_string(),
        "17 bytes, frames: 1 (7 bytes), discarded: no sync 6, line event 4, resynchronisations: 1, \
         line events: parity error 1"
    );
}
