//! Tests that after one pause, the handler of each example delivers the right frames. `core/tests/suite/examples.rs`
//! tests the core's examples in the same way.
#![allow(clippy::indexing_slicing, reason = "a panic is a failed test")]

use framelock::motion::Setpoint;
use framelock::{Line, LineEvent, Receiver};
use framelock_example_handlers::{embassy, rp2040, rtic};

/// A frame that contains the end of a frame and the beginning of another one. If a stream repeats this frame, and its
/// first byte is lost, a receiver finds wrong frames until a pause: the end of one frame and the beginning of the next.
const AMBIGUOUS: &[u8] = b"AB\0\rAB\r";
const RIGHT: [u8; 3] = *b"\rAB";
const WRONG: [u8; 3] = *b"AB\0";

/// The number of repeated frames in a stream.
const REPEATED: usize = 1_000;

/// Tests that a new handler delivers wrong setpoints until the first pause, and right ones after it. `receive` gives
/// bytes and line events to the handler, and returns the setpoints.
fn is_right_after_one_pause(mut receive: impl FnMut(Result<&[u8], LineEvent>) -> Vec<Setpoint>) {
    let stream = AMBIGUOUS.repeat(REPEATED);
    // Without a pause, no receiver can notice that these frames are wrong.
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
    // An error ends a frame, too. The handler may drop some bytes after it.
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
fn embassys_handler_is_right_after_one_pause() {
    let (mut reception, mut errors) = (embassy::Reception::new(7), 7_u32);
    is_right_after_one_pause(|found| {
        let mut setpoints = vec![];
        match found {
            Ok(bytes) => bytes.chunks(64).for_each(|bytes| {
                reception.take(Some(bytes), errors, |setpoint| setpoints.push(setpoint));
            }),
            // If bytes are pending, the first call reports the pause. A call while none is pending clears `in_doubt`.
            Err(LineEvent::Idle) => (0..2).for_each(|_| {
                reception.take(None, errors, |setpoint| setpoints.push(setpoint));
            }),
            Err(_) => errors += 1,
        }
        setpoints
    });
}

/// The driver loses bytes, and the example restarts the driver.
#[test]
fn embassys_handler_is_right_after_an_overrun() {
    let mut reception = embassy::Reception::new(0);
    let none = |_| panic!("a frame from before and after an overrun");
    assert_eq!(reception.take(Some(b"AB\0\rA"), 0, none), None);
    reception.restart(1);
    assert_eq!(reception.take(Some(b"B\r"), 1, none), None);
    let mut setpoints = vec![];
    reception.take(Some(AMBIGUOUS), 1, |setpoint| setpoints.push(setpoint));
    assert_eq!(setpoints, [Setpoint::from(RIGHT)]);
}

#[test]
fn rtics_handler_is_right_after_one_pause() {
    let (mut reception, mut now) = (rtic::Reception::new(), 0_u32);
    is_right_after_one_pause(|found| match found {
        // There are no pauses between these bytes, so `now` stays the same.
        Ok(bytes) => {
            let setpoints = bytes
                .iter()
                .filter_map(|&byte| reception.interrupt(now, None, Some(byte)));
            setpoints.collect()
        }
        Err(LineEvent::Idle) => {
            now = now.wrapping_add(5);
            vec![]
        }
        Err(error) => reception
            .interrupt(now, Some(error), None)
            .into_iter()
            .collect(),
    });
}

#[test]
fn the_rp2040s_handler_is_right_after_one_pause() {
    let mut line = Line::new(Receiver::new());
    is_right_after_one_pause(|found| {
        let mut setpoints = vec![];
        rp2040::take(&mut line, found, |setpoint| setpoints.push(setpoint));
        setpoints
    });
}
