#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::io::ErrorKind;
use std::num::NonZeroU32;

use framelock::motion::Bin;
use framelock::{Line, Receiver};

use super::super::pacer::tests::TestClock;
use super::*;

const RATE: Rate = Rate(NonZeroU32::new(50).unwrap());

const PARKING: Parking = Parking {
    at: Setpoint {
        pitch: 100,
        roll: 128,
        yaw: 128,
    },
    seconds: 0.1,
    rate: RATE,
};

/// The pitches while parking from pitch 9: first the pitches on the way, then the pitch of the park position.
const PARKED: [u8; 10] = [27, 45, 64, 82, 100, 100, 100, 100, 100, 100];

fn bin() -> Protocol {
    Protocol::named("bin").unwrap()
}

/// Returns a source of ten frames with the pitches 0 to 9. If `silent` returns true for a pitch, the frame with this
/// pitch is not sent.
fn ten(silent: impl Fn(u8) -> bool + 'static) -> Source {
    let frame = bin();
    let mut numbers = 0..10;
    Source {
        dues: Box::new(RATE.dues().take(10)),
        frame: Box::new(move |_| {
            let number = numbers.next()?;
            (!silent(number)).then(|| frame.encode_setpoint([number, 128, 128].into()))
        }),
    }
}

/// Returns the pitch of every frame that the receiver delivers, and checks that the receiver discards nothing.
fn pitches(bytes: &[u8]) -> Vec<u8> {
    let mut pitches = Vec::new();
    let mut line = Line::new(Receiver::<Bin>::new());
    line.feed(bytes, |found| {
        let setpoint = found.message().unwrap();
        assert_eq!((setpoint.roll, setpoint.yaw), (128, 128));
        pitches.push(setpoint.pitch);
    });
    assert_eq!((line.counters().discarded.total(), line.pending()), (0, 0));
    pitches
}

/// Returns the pitches that were sent, and the numbers of moving, silent and parking frames.
fn run(
    clock: &mut TestClock,
    source: Source,
    length: Option<Duration>,
    parking: Option<Parking>,
) -> (Vec<u8>, [u64; 3]) {
    let (mut line, frame) = (Vec::new(), bin());
    let mut transmission = Transmission::new(clock, &mut line, &frame);
    transmission.run(source, length, parking).unwrap();
    let counts = [
        transmission.frames,
        transmission.silent,
        transmission.park_frames,
    ];
    (pitches(&line), counts)
}

#[test]
fn each_frame_is_sent_when_it_is_due_or_not_at_all() {
    let mut clock = TestClock::default();
    let source = ten(|number| (3..6).contains(&number));
    let (pitches, counts) = run(&mut clock, source, None, None);
    assert_eq!(pitches, [0, 1, 2, 6, 7, 8, 9]);
    let due: Vec<Duration> = RATE.dues().take(10).collect();
    assert_eq!(clock.waits, due);
    assert_eq!(counts, [7, 3, 0]);
    // The transmission ends after its length, although the source has more frames.
    let length = Some(Duration::from_millis(60));
    assert_eq!(
        run(&mut TestClock::default(), ten(|_| false), length, None).0,
        [0, 1, 2]
    );
}

#[test]
fn the_axes_park_in_a_straight_line_and_stay_there() {
    let mut clock = TestClock::default();
    let (pitches, counts) = run(&mut clock, ten(|_| false), None, Some(PARKING));
    assert_eq!((pitches[9], &pitches[10..]), (9, &PARKED[..]));
    assert_eq!(counts, [10, 0, 10]);
    // Parking keeps the rate of the motion.
    assert_eq!(clock.waits.last(), Some(&RATE.due(19)));
    let at_once = Parking {
        seconds: 0.0,
        ..PARKING
    };
    let (pitches, _) = run(
        &mut TestClock::default(),
        ten(|_| false),
        None,
        Some(at_once),
    );
    assert_eq!(pitches[10..], [100; 5]);
}

#[test]
fn a_reason_to_stop_ends_the_motion_and_parks() {
    // Before the first frame, the position is unknown, so only the park position is sent.
    for (stop_after, park_frames) in [(4, 10), (0, 5)] {
        let mut clock = TestClock {
            stop_after: Some(stop_after),
            ..TestClock::default()
        };
        let (pitches, counts) = run(&mut clock, ten(|_| false), None, Some(PARKING));
        assert_eq!(pitches[..stop_after], [0, 1, 2, 3][..stop_after]);
        assert!(pitches.ends_with(&[100; 5]));
        assert_eq!(counts, [stop_after as u64, 0, park_frames]);
    }
}

#[test]
fn frames_in_returns_at_least_one_frame_and_saturates() {
    for (seconds, frames) in [(1.0, 50), (0.0, 1), (1e300, u32::MAX)] {
        assert_eq!(RATE.frames_in(seconds), frames);
    }
}

/// A line that accepts a number of frames and then fails.
struct Cut(usize);

impl Write for Cut {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 = self.0.checked_sub(1).ok_or(ErrorKind::Other)?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn an_error_of_the_line_ends_the_transmission_and_keeps_the_count() {
    let (mut clock, mut line) = (TestClock::default(), Cut(3));
    let frame = bin();
    let mut transmission = Transmission::new(&mut clock, &mut line, &frame);
    transmission
        .run(ten(|_| false), None, Some(PARKING))
        .unwrap_err();
    assert_eq!(transmission.frames, 3);
}
