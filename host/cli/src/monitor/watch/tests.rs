#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

use framelock::Counters;
use framelock::motion::Phase;
use framelock_receiving::{Policy, Protocol};

use super::*;

pub(in super::super) const FRAME: &[u8; 7] = b"AB\0\x10\x20\x30\r";

pub(in super::super) const fn ms(milliseconds: u64) -> Duration {
    Duration::from_millis(milliseconds)
}

pub(in super::super) fn watch(idle_gap: Option<Duration>) -> Watch {
    watch_frames("bin", idle_gap)
}

pub(in super::super) fn watch_frames(name: &str, idle_gap: Option<Duration>) -> Watch {
    let park = framelock_simulation::LEVEL.into();
    let parameters = FailsafeParameters::for_clock(1_000_000, TICK, park);
    let frame = Protocol::named(name).unwrap();
    let line = AnyLine::new(&frame, Policy::Framelock).unwrap();
    Watch::new(FrameWriter::new(frame), line, parameters, idle_gap).unwrap()
}

fn feed(watch: &mut Watch, at: Duration, bytes: &[u8]) {
    for &byte in bytes {
        watch.byte(at, byte);
    }
}

fn discarded(watch: &Watch) -> String {
    let shown = |(byte, follows): &(u8, bool)| {
        let separator = if *follows { "" } else { "|" };
        format!("{separator}{}", byte.escape_ascii())
    };
    watch.discarded.iter().map(shown).collect()
}

#[test]
fn the_view_shows_exactly_the_discarded_bytes() {
    let mut watch = watch(None);
    feed(&mut watch, ms(1), b"??");
    feed(&mut watch, ms(1), FRAME);
    feed(&mut watch, ms(1), b"A!");
    watch.event(ms(1), LineEvent::Break);
    feed(&mut watch, ms(1), b"AB");
    watch.event(ms(1), LineEvent::Framing);
    feed(&mut watch, ms(1), FRAME);
    feed(&mut watch, ms(1), b"AB");
    assert_eq!(discarded(&watch), "|??|A!AB");
    feed(&mut watch, ms(1), &[b'.'; 300]);
    assert_eq!(watch.discarded.len(), 256);
}

#[test]
fn the_lock_is_found_lost_and_silent() {
    let mut watch = watch(None);
    assert_eq!(watch.lock(), Lock::Silent);
    for (at, bytes, lock) in [
        (10, &b"AB\0"[..], Lock::Searching),
        (11, b"\x01\x02\x03\r", Lock::Locked),
        // A pending byte is not a loss. A byte that can no longer become part of a frame is a loss.
        (30, b"AB\0\x01", Lock::Locked),
        (31, b"\x02\x03?", Lock::Searching),
        (50, FRAME, Lock::Locked),
    ] {
        feed(&mut watch, ms(at), bytes);
        assert_eq!(watch.lock(), lock, "{at}");
    }
    watch.event(ms(60), LineEvent::Framing);
    for (at, lock) in [
        (60, Lock::Searching),
        (1_059, Lock::Searching),
        (1_060, Lock::Silent),
    ] {
        watch.advance_to(ms(at));
        assert_eq!(watch.lock(), lock, "{at}");
    }
    assert_eq!(watch.framed_at, Some(ms(50)));
}

#[test]
fn the_failsafe_follows_holds_and_parks() {
    let mut watch = watch(None);
    assert_eq!(watch.output().phase, Phase::Parked);
    for frame in 1..=100 {
        feed(&mut watch, ms(20 * frame), FRAME);
    }
    // A time that is earlier than the previous time does not count as silence.
    watch.advance_to(ms(2_030));
    feed(&mut watch, ms(2_020), FRAME);
    let output = watch.output();
    let setpoint = Setpoint::from([0x10, 0x20, 0x30]);
    assert_eq!(output.phase, Phase::Live);
    assert_eq!(
        (Setpoint::from(output.axes), watch.now.at),
        (setpoint, ms(2_030))
    );
    for (time, phase) in [
        (2_131, Phase::Live),
        // The poll at 2032 ms has taken the last frame.
        (2_132, Phase::Hold),
        (2_540, Phase::Ramp),
        (4_030, Phase::Parked),
    ] {
        watch.advance_to(ms(time));
        assert_eq!(watch.output().phase, phase, "{time}");
    }
    // The setpoint of the last frame remains.
    assert_eq!(watch.setpoint, Some(setpoint));
}

/// The failsafe's clock of microseconds wraps after 71.6 minutes.
#[test]
fn the_failsafe_goes_on_after_hours() {
    let mut watch = watch(None);
    let hours = 3 * 3_600_000;
    watch.advance_to(ms(hours));
    for frame in 1..=120 {
        feed(&mut watch, ms(hours + 20 * frame), FRAME);
    }
    assert_eq!(watch.output().phase, Phase::Live);
    watch.advance_to(ms(hours + 2_700));
    assert_eq!(watch.output().phase, Phase::Hold);
}

#[test]
fn an_idle_gap_drops_the_incomplete_frame_if_the_option_is_given() {
    for (gap, frames, dropped) in [
        (None, 1, ""),
        (Some(ms(5)), 0, "|AB\\x00\\x01\\x02\\x03\\r"),
    ] {
        let mut watch = watch(gap);
        feed(&mut watch, ms(10), b"AB\0\x01");
        feed(&mut watch, ms(15), b"\x02");
        watch.advance_to(ms(20));
        feed(&mut watch, ms(21), b"\x03\r");
        let counters = watch.line.counters();
        assert_eq!(counters.frames, frames);
        assert_eq!(counters.events.idle, 1 - frames);
        assert_eq!(counters.discarded.line_event, 5 * (1 - frames));
        assert_eq!(discarded(&watch), dropped);
        // A long gap is counted once.
        watch.advance_to(ms(500));
        watch.advance_to(ms(900));
        assert_eq!(watch.line.counters().events.idle, 2 * (1 - frames));
    }
}

#[test]
fn an_idle_gap_delivers_the_frame_after_a_false_start() {
    let frame = [0xC8, 0x02, 0x14, 0xAC];
    let mut watch = watch_frames("crsf", Some(ms(5)));
    feed(&mut watch, ms(10), &[0xC8, 0x3E]);
    feed(&mut watch, ms(10), &frame);
    assert_eq!((watch.last.clone(), watch.line.pending().len()), (None, 6));
    watch.advance_to(ms(16));
    assert_eq!(watch.last.as_deref(), Some(&frame[..]));
    assert_eq!(discarded(&watch), "|\\xc8>");
    assert_eq!(
        (watch.line.counters().frames, watch.line.pending().len()),
        (1, 0)
    );
}

#[test]
fn a_reset_counts_from_zero_and_keeps_the_frame_under_way() {
    let mut watch = watch(None);
    feed(&mut watch, ms(1), b"??");
    feed(&mut watch, ms(2), FRAME);
    feed(&mut watch, ms(3), b"AB\0\x10");
    watch.reset_counters();
    let mut expected = Counters::ZERO;
    expected.bytes = 4;
    assert_eq!(
        (*watch.line.counters(), discarded(&watch)),
        (expected, String::new())
    );
    feed(&mut watch, ms(4), b"\x20\x30\r");
    let counters = watch.line.counters();
    assert_eq!((counters.bytes, counters.frames), (7, 1));
}

#[test]
fn rates_cover_two_seconds() {
    let rates_of = |watch: &Watch| watch.rates().map(|rate| format!("{rate:.1}")).join(" ");
    let mut watch = watch(None);
    for frame in 0..150 {
        feed(&mut watch, ms(10 + 20 * frame), FRAME);
    }
    for (time, rates) in [
        (3_000, "50.0 350.0"),
        (4_000, "25.0 175.0"),
        (5_000, "0.0 0.0"),
    ] {
        watch.advance_to(ms(time));
        assert_eq!(rates_of(&watch), rates, "{time}");
    }
    // The computer was suspended for a year.
    let year = Duration::from_secs(31_536_000);
    watch.advance_to(year);
    assert_eq!(rates_of(&watch), "0.0 0.0");
    feed(&mut watch, year + ms(100), FRAME);
    watch.advance_to(year + ms(200));
    assert_eq!(rates_of(&watch), "0.5 3.5");
}
