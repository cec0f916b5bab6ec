#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use std::num::NonZeroU32;

use framelock::{Bin, BinCrc8, Discard, Format, Lecture, Phase, Receiver};
use framelock_proofs::reference::{self, Event, Policy};
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

pub(in super::super) const PARAMETERS: FailsafeParameters = FailsafeParameters {
    hold_after: 100_000,
    ramp_after: 500_000,
    park: crate::setpoints::LEVEL,
    ticks_per_unit: [NonZeroU32::new(3_922).unwrap(); 3],
};

const FRAME: &[u8; 7] = b"AB\0\x10\x20\x30\r";

const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

fn watch<P: Parser<Message = Setpoint> + Default + Copy>() -> Watch<P> {
    Watch::new(PARAMETERS, None).unwrap()
}

fn feed<P>(watch: &mut Watch<P>, at: Duration, bytes: &[u8])
where
    P: Parser<Message = Setpoint> + Default + Copy,
{
    for &byte in bytes {
        watch.byte(at, byte);
    }
}

fn discarded(report: &Report) -> Vec<u8> {
    report.discarded.iter().map(|byte| byte.byte).collect()
}

/// Noise full of beginnings of frames, and frames.
fn noise<F: Format<Message = Setpoint, Frame: AsRef<[u8]>>>(random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = Vec::new();
    while stream.len() < 150 {
        if random.random_ratio(1, 4) {
            stream.extend_from_slice(F::encode([1, b'A', b'B'].into()).as_ref());
        } else {
            stream.push(*b"AB\r?".choose(random).unwrap());
        }
    }
    stream
}

/// Against the reference: which bytes were discarded, and where a frame was between.
fn discards_what_the_reference_does<P, F, R>(policy: Policy)
where
    P: Parser<Message = Setpoint> + Default + Copy,
    F: Format<Message = Setpoint, Frame: AsRef<[u8]>>,
    R: reference::Format,
{
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..300 {
        let stream = noise::<F>(&mut random);
        let mut watch = watch::<P>();
        feed(&mut watch, ms(1), &stream);
        let mut rest = stream.iter().copied();
        let (mut expected, mut follows) = (Vec::new(), false);
        let pending = reference::whole_buffer::<R>(&stream, policy, |event| match event {
            Event::Dropped { count, .. } => {
                for byte in rest.by_ref().take(count) {
                    expected.push(DiscardedByte { byte, follows });
                    follows = true;
                }
            }
            Event::Frame { .. } => {
                rest.by_ref().take(R::LENGTH).for_each(drop);
                follows = false;
            }
        });
        let report = watch.report();
        assert_eq!(report.discarded, expected, "{stream:?}");
        assert_eq!(report.pending, pending);
        assert_eq!(report.counters.discarded.total(), expected.len() as u64);
    }
}

#[test]
fn the_bytes_shown_as_discarded_are_those_that_were() {
    discards_what_the_reference_does::<Receiver<Bin>, Bin, reference::Bin>(Policy::Rescan);
    discards_what_the_reference_does::<Lecture, Bin, reference::Bin>(Policy::Discard);
    discards_what_the_reference_does::<Receiver<BinCrc8>, BinCrc8, reference::BinCrc8>(
        Policy::Rescan,
    );
    discards_what_the_reference_does::<Receiver<BinCrc8, Discard>, BinCrc8, reference::BinCrc8>(
        Policy::Discard,
    );
}

#[test]
fn the_lock_is_found_lost_and_silent() {
    let mut watch = watch::<Receiver<Bin>>();
    assert_eq!(watch.report().lock, Lock::Silent);
    feed(&mut watch, ms(10), b"AB\0");
    assert_eq!(watch.report().lock, Lock::Searching);
    feed(&mut watch, ms(11), b"\x01\x02\x03\r");
    assert_eq!(watch.report().lock, Lock::Locked);
    // Part of a frame is no loss; a byte that cannot be is one.
    feed(&mut watch, ms(30), b"AB\0\x01");
    assert_eq!(watch.report().lock, Lock::Locked);
    feed(&mut watch, ms(31), b"\x02\x03?");
    assert_eq!(watch.report().lock, Lock::Searching);
    feed(&mut watch, ms(50), FRAME);
    assert_eq!(watch.report().lock, Lock::Locked);
    watch.event(ms(60), LineEvent::Framing);
    assert_eq!(watch.report().lock, Lock::Searching);
    watch.advance_to(ms(159));
    assert_eq!(watch.report().lock, Lock::Searching);
    watch.advance_to(ms(160));
    assert_eq!(watch.report().lock, Lock::Silent);
    assert_eq!(watch.report().age, Some(ms(110)));
}

#[test]
fn the_failsafe_follows_holds_and_parks() {
    let mut watch = watch::<Receiver<Bin>>();
    assert_eq!(watch.report().output.phase, Phase::Parked);
    for frame in 1..=100 {
        feed(&mut watch, ms(20 * frame), FRAME);
    }
    let output = watch.report().output;
    assert_eq!(output.phase, Phase::Live);
    assert_eq!(output.setpoint, Setpoint::from([0x10, 0x20, 0x30]));
    for (time, phase) in [
        (2_099, Phase::Live),
        (2_100, Phase::Hold),
        (2_510, Phase::Ramp),
        (4_000, Phase::Parked),
    ] {
        watch.advance_to(ms(time));
        assert_eq!(watch.report().output.phase, phase, "{time}");
    }
    // The setpoint in force stays.
    assert_eq!(watch.report().setpoint, Some([0x10, 0x20, 0x30].into()));
}

#[test]
fn bytes_that_are_stamped_late_are_no_silence() {
    let mut watch = watch::<Receiver<Bin>>();
    for frame in 1..=100 {
        feed(&mut watch, ms(20 * frame), FRAME);
    }
    watch.advance_to(ms(2_030));
    feed(&mut watch, ms(2_020), FRAME);
    assert_eq!(watch.report().output.phase, Phase::Live);
    assert_eq!(watch.report().now, ms(2_030));
}

#[test]
fn an_idle_gap_drops_the_frame_under_way_if_asked_for() {
    for (gap, frames) in [(None, 1), (Some(ms(5)), 0)] {
        let mut watch = Watch::<Receiver<Bin>>::new(PARAMETERS, gap).unwrap();
        feed(&mut watch, ms(10), b"AB\0\x01");
        feed(&mut watch, ms(15), b"\x02");
        watch.advance_to(ms(20));
        feed(&mut watch, ms(21), b"\x03\r");
        let report = watch.report();
        assert_eq!(report.counters.frames, frames);
        assert_eq!(report.counters.events.idle, 1 - frames);
        assert_eq!(report.counters.discarded.line_event, 5 * (1 - frames));
        let dropped: &[u8] = if frames == 0 {
            b"AB\0\x01\x02\x03\r"
        } else {
            b""
        };
        assert_eq!(discarded(&report), dropped);
        // A gap is one however long it lasts.
        watch.advance_to(ms(500));
        watch.advance_to(ms(900));
        assert_eq!(watch.report().counters.events.idle, 2 * (1 - frames));
    }
}

#[test]
fn a_reset_counts_from_zero_and_keeps_the_frame_under_way() {
    let mut watch = watch::<Receiver<Bin>>();
    feed(&mut watch, ms(1), b"??");
    feed(&mut watch, ms(2), FRAME);
    feed(&mut watch, ms(3), b"AB\0\x10");
    watch.reset_counters();
    let report = watch.report();
    let expected = Counters {
        bytes: 4,
        ..Counters::ZERO
    };
    assert_eq!(report.counters, expected);
    assert_eq!(discarded(&report), b"");
    feed(&mut watch, ms(4), b"\x20\x30\r");
    assert_eq!((watch.counters().bytes, watch.counters().frames), (7, 1));
}

#[test]
fn rates_are_those_of_the_last_two_seconds() {
    let mut watch = watch::<Receiver<Bin>>();
    for frame in 0..150 {
        feed(&mut watch, ms(10 + 20 * frame), FRAME);
    }
    watch.advance_to(ms(3_000));
    let rates = |watch: &Watch<_>| {
        let report = watch.report();
        [report.frames_per_second, report.bytes_per_second].map(|rate| format!("{rate:.1}"))
    };
    assert_eq!(rates(&watch), ["50.0", "350.0"]);
    watch.advance_to(ms(4_000));
    assert_eq!(rates(&watch), ["25.0", "175.0"]);
    watch.advance_to(ms(5_000));
    assert_eq!(rates(&watch), ["0.0", "0.0"]);
}

#[test]
fn the_history_is_of_the_last_ten_seconds_whatever_happens() {
    let mut watch = watch::<Receiver<Bin>>();
    feed(&mut watch, ms(150), FRAME);
    watch.advance_to(ms(300));
    let known = |watch: &Watch<_>| -> Vec<bool> {
        let report = watch.report();
        let history = report.history.iter();
        history.map(|sample| sample.setpoint.is_some()).collect()
    };
    assert_eq!(known(&watch), [false, false, true, true]);
    // The computer slept for a year.
    watch.advance_to(Duration::from_secs(31_536_000));
    assert_eq!(known(&watch), [true; 100]);
}
