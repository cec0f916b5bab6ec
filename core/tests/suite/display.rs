//! Tests the texts that programs print.

use framelock::motion::{Bin, Phase};
use framelock::{DiscardReason, EncodeError, Line, LineEvent, Receiver};

#[test]
fn reasons_events_phases_and_errors_are_written_as_words() {
    for (text, written) in [
        (DiscardReason::BrokenSync.to_string(), "broken sync"),
        (LineEvent::Parity.to_string(), "parity error"),
        (Phase::Parked.to_string(), "parked"),
        (
            EncodeError::BufferTooShort.to_string(),
            "the frame is longer than the buffer",
        ),
    ] {
        assert_eq!(text, written);
    }
    // The texts can be padded, as in a table.
    assert_eq!(format!("{:>6}|", LineEvent::Break), " break|");
}

#[test]
fn counters_are_written_in_a_line() {
    let mut line = Line::new(Receiver::<Bin>::new());
    assert_eq!(
        line.counters().to_string(),
        "0 bytes, frames: 0 (0 bytes), discarded: none, resynchronisations: 0, line events: none"
    );
    for byte in *b"xyAB\0\x01\x02\x03\rAC" {
        line.push(byte);
    }
    line.line_event(LineEvent::Idle, |_| ());
    assert_eq!(
        line.counters().to_string(),
        "11 bytes, frames: 1 (7 bytes), discarded: no sync 3, broken sync 1, resynchronisations: 1, \
         line events: idle line 1"
    );
}
