#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use std::io::ErrorKind;
use std::num::NonZeroU32;

use framelock::{Bin, BinCrc8, Parser, Receiver};

use super::super::faults::FaultRates;
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

/// So many frames: pitch counts them; some are silent.
struct Counting {
    frames: u64,
    silent: fn(u64) -> bool,
}

const TEN: Counting = Counting {
    frames: 10,
    silent: |_| false,
};

impl Source for Counting {
    fn due(&mut self, number: u64) -> Option<Duration> {
        (number < self.frames).then(|| RATE.due(number))
    }

    fn setpoint(&mut self, number: u64, _due: Duration) -> Option<Setpoint> {
        let pitch = number.to_le_bytes()[0];
        (!(self.silent)(number)).then(|| Setpoint::from([pitch, 128, 128]))
    }
}

fn without_faults() -> Faults {
    Faults::new(FaultRates::default(), 1)
}

/// The pitch of every frame that the receiver finds; it must find nothing else.
fn pitches<P: Parser<Message = Setpoint> + Default>(bytes: &[u8]) -> Vec<u8> {
    let mut pitches = Vec::new();
    P::default().feed(bytes, &mut |_, setpoint: Setpoint| {
        assert_eq!((setpoint.roll, setpoint.yaw), (128, 128));
        pitches.push(setpoint.pitch);
    });
    assert_eq!(bytes.len(), P::FRAME_LENGTH * pitches.len());
    pitches
}

fn run(
    clock: &mut TestClock,
    mut source: Counting,
    length: Option<Duration>,
    parking: Option<Parking>,
) -> (Vec<u8>, Report) {
    let mut line = Vec::new();
    let mut session = Session::new::<Bin>(clock, &mut line, without_faults());
    session.run(&mut source, length, parking).unwrap();
    let report = session.report();
    (pitches::<Receiver<Bin>>(&line), report)
}

#[test]
fn each_frame_is_sent_when_it_is_due() {
    let mut clock = TestClock::default();
    let (pitches, report) = run(&mut clock, TEN, None, None);
    assert_eq!(pitches, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9]);
    let due: Vec<Duration> = (0..10).map(|number| RATE.due(number)).collect();
    assert_eq!(clock.waits, due);
    assert_eq!((report.frames, report.park_frames), (10, 0));
    assert_eq!(report.time, RATE.due(9));
}

#[test]
fn the_end_is_in_a_straight_line_to_park_and_stays_there() {
    let mut clock = TestClock::default();
    let (pitches, report) = run(&mut clock, TEN, None, Some(PARKING));
    assert_eq!(pitches.get(9), Some(&9));
    let end = [27, 45, 64, 82, 100, 100, 100, 100, 100, 100];
    assert_eq!(pitches.get(10..), Some(&end[..]));
    assert_eq!((report.frames, report.park_frames), (10, 10));
    // At the same pace as before.
    assert_eq!(clock.waits.last(), Some(&RATE.due(19)));
}

#[test]
fn a_reason_to_stop_ends_the_motion_and_parks() {
    let mut clock = TestClock {
        stop_after: Some(4),
        ..TestClock::default()
    };
    let (pitches, report) = run(&mut clock, TEN, None, Some(PARKING));
    assert_eq!(pitches.get(..4), Some(&[0, 1, 2, 3][..]));
    assert_eq!(pitches.get(9..), Some(&[100; 5][..]));
    assert_eq!((report.frames, report.park_frames), (4, 10));
}

#[test]
fn there_is_nothing_to_approach_before_the_first_frame_or_at_once() {
    let mut clock = TestClock {
        stop_after: Some(0),
        ..TestClock::default()
    };
    assert_eq!(run(&mut clock, TEN, None, Some(PARKING)).0, [100; 5]);
    let at_once = Parking {
        seconds: 0.0,
        ..PARKING
    };
    let (pitches, _) = run(&mut TestClock::default(), TEN, None, Some(at_once));
    assert_eq!(pitches.get(10..), Some(&[100; 5][..]));
}

#[test]
fn a_length_ends_it_before_the_source_does() {
    let length = Some(Duration::from_millis(60));
    let (pitches, _) = run(&mut TestClock::default(), TEN, length, None);
    assert_eq!(pitches, [0, 1, 2]);
}

#[test]
fn nothing_is_sent_while_there_is_nothing_to_send() {
    let source = Counting {
        silent: |number| (3..6).contains(&number),
        ..TEN
    };
    let mut clock = TestClock::default();
    let (pitches, report) = run(&mut clock, source, None, None);
    assert_eq!(pitches, [0, 1, 2, 6, 7, 8, 9]);
    assert_eq!((report.frames, report.silent), (7, 3));
    assert_eq!(clock.waits.len(), 10);
}

#[test]
fn faults_are_in_the_motion_but_not_in_the_parking() {
    let rates = FaultRates {
        drop: 1.0,
        ..FaultRates::default()
    };
    let (mut clock, mut line) = (TestClock::default(), Vec::new());
    let faults = Faults::new(rates, 1);
    let mut session = Session::new::<BinCrc8>(&mut clock, &mut line, faults);
    session.run(&mut { TEN }, None, Some(PARKING)).unwrap();
    assert_eq!(session.report().faults.unwrap().dropped, 80);
    assert_eq!(
        pitches::<Receiver<BinCrc8>>(&line),
        [27, 45, 64, 82, 100, 100, 100, 100, 100, 100]
    );
}

/// Takes so many frames, then no more.
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
fn a_line_that_is_cut_ends_it_with_what_was_sent() {
    let (mut clock, mut line) = (TestClock::default(), Cut(3));
    let mut session = Session::new::<Bin>(&mut clock, &mut line, without_faults());
    session.run(&mut { TEN }, None, Some(PARKING)).unwrap_err();
    assert_eq!(session.report().frames, 3);
}
