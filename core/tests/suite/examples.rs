//! Tests that each example prints the lines at its end. Also tests that three examples deliver the right setpoints
//! after one pause.

use std::cell::RefCell;

use framelock::motion::{Bin, Setpoint};
use framelock::{Line, LineEvent, Receiver};

thread_local! {
    static PRINTED: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Replaces the `println!` of the examples.
macro_rules! println {
    ($($text:tt)*) => { super::print(&format!($($text)*)) };
}

fn print(line: &str) {
    PRINTED.with_borrow_mut(|printed| *printed += &(line.to_owned() + "\n"));
}

macro_rules! examples {
    ($($(#[$attribute:meta])* $name:ident $file:literal;)*) => { $(
        $(#[$attribute])*
        #[path = $file]
        mod $name;

        $(#[$attribute])*
        #[test]
        fn $name() {
            let _ = $name::main();
            let (_, says) = include_str!($file).split_once("\n// It prints:\n").unwrap();
            let says: String = says.lines().map(|line| line.replacen("// ", "", 1) + "\n").collect();
            assert_eq!(PRINTED.take(), says);
        }
    )* };
}

examples! {
    push_in_a_loop "../../examples/push_in_a_loop.rs";
    line_events_and_counters "../../examples/line_events_and_counters.rs";
    failsafe "../../examples/failsafe.rs";
    mailbox "../../examples/mailbox.rs";
    dma "../../examples/dma.rs";
    #[cfg(feature = "embedded-io-v0.7")]
    embedded_io "../../examples/embedded_io.rs";
}

/// A frame that contains a CR, followed by `AB`. If a sender repeats this frame and the first byte is lost, a receiver
/// finds frames at the wrong place until a pause.
const AMBIGUOUS: &[u8] = b"AB\0\rAB\r";
const RIGHT: [u8; 3] = *b"\rAB";
const WRONG: [u8; 3] = *b"AB\0";

/// The number of repeated frames in a stream.
const REPEATED: usize = 1_000;

/// Tests that a new handler returns wrong setpoints until the first pause, and then the right ones. `receive` gives
/// bytes and line events to the handler, and returns the setpoints.
fn is_right_after_one_pause(mut receive: impl FnMut(Result<&[u8], LineEvent>) -> Vec<Setpoint>) {
    let stream = AMBIGUOUS.repeat(REPEATED);
    // Without a pause, the receiver cannot tell these wrong frames from the right ones.
    let before = receive(Ok(&stream[1..]));
    assert_eq!(before, [Setpoint::from(WRONG); REPEATED - 1]);
    for lost in 0..AMBIGUOUS.len() {
        assert!(receive(Err(LineEvent::Idle)).is_empty());
        let after = receive(Ok(&stream));
        assert_eq!(after, [Setpoint::from(RIGHT); REPEATED]);
        let mut faulty = AMBIGUOUS.repeat(10);
        faulty.remove(lost);
        receive(Ok(&faulty));
    }
    assert!(receive(Err(LineEvent::Idle)).is_empty());
    // An error ends a frame, too. Up to nine other bytes may come between the error and the rest of the frame.
    for dropped in 0..10 {
        assert!(receive(Ok(b"AB\0\rA")).is_empty());
        receive(Err(LineEvent::Framing));
        let rest = [&b".........."[..dropped], b"B\r"].concat();
        assert!(receive(Ok(&rest)).is_empty());
        receive(Err(LineEvent::Idle));
    }
    assert_eq!(receive(Ok(AMBIGUOUS)), [Setpoint::from(RIGHT)]);
}

#[test]
fn the_interrupt_handler_is_right_after_one_pause() {
    let (mut line, mut heard, mut now) = (Line::new(Receiver::<Bin>::new()), 0, 0_u32);
    is_right_after_one_pause(|found| {
        let mut interrupt = |found| {
            now = now.wrapping_add(87);
            line_events_and_counters::interrupt(&mut line, &mut heard, now, found)
        };
        match found {
            Ok(bytes) => bytes
                .iter()
                .filter_map(|&byte| interrupt(Ok(byte)))
                .collect(),
            Err(LineEvent::Idle) => {
                now = now.wrapping_add(5_000);
                vec![]
            }
            Err(error) => interrupt(Err(error)).into_iter().collect(),
        }
    });
}

#[test]
fn the_loop_is_right_after_one_pause() {
    let (mut reception, mut now) = (push_in_a_loop::Reception::new(), 0_u32);
    is_right_after_one_pause(|found| {
        if let Ok(bytes) = found {
            // Each byte takes a fraction of a millisecond.
            let setpoints = bytes
                .iter()
                .filter_map(|&byte| reception.iterate(now, Some(byte)));
            return setpoints.collect();
        }
        // The port reports no errors, so each line event is a pause here.
        let silence = (0..=5).filter_map(|_| {
            now = now.wrapping_add(1);
            reception.iterate(now, None)
        });
        silence.collect()
    });
}

#[test]
#[cfg(feature = "embedded-io-v0.7")]
fn the_reader_is_right_after_one_pause() {
    use ::embedded_io::ErrorKind;
    use framelock::Reader;

    use self::embedded_io::{Serial, next};

    let stream: &[u8] = AMBIGUOUS.repeat(REPEATED).leak();
    // The reads are in reverse order. A driver returns at most as many bytes as the reader's buffer holds.
    let mut reads: Vec<_> = stream.chunks(16).rev().map(Ok).collect();
    reads.push(Err(ErrorKind::TimedOut));
    reads.extend(stream[1..].chunks(16).rev().map(Ok));
    let mut reader = Reader::new(Serial(reads), Receiver::new());
    let mut events = vec![];
    let mut setpoints = vec![];
    while let Some(setpoint) = next(&mut reader, |event| events.push(event)) {
        setpoints.push(setpoint);
    }
    let (wrong, right) = setpoints.split_at(REPEATED - 1);
    assert_eq!(wrong, [Setpoint::from(WRONG); REPEATED - 1]);
    assert_eq!(right, [Setpoint::from(RIGHT); REPEATED]);
    assert_eq!(events, [LineEvent::Idle]);
}
