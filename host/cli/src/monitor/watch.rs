//! Watches a line as a board would, with a receiver and a failsafe.
//!
//! The caller passes the time. Nothing in this module waits, draws or reads.

use std::collections::VecDeque;
use std::time::Duration;

use framelock::LineEvent;
use framelock::motion::{Failsafe, FailsafeError, FailsafeParameters, Output, Setpoint};
use framelock_receiving::{AnyLine, Piece, Standstill, TrackedLine};

use crate::frame_writer::FrameWriter;
use crate::line_errors::{Marking, Marks};
use crate::process::time_of_day;
use crate::serial::Device;

/// The number of discarded bytes that are kept for the view.
pub(super) const DISCARDED_LENGTH: usize = 52;

/// The time between two computations of the rates.
const RATES_EVERY: Duration = Duration::from_secs(1);

/// The time between two polls of the failsafe, in microseconds, as in the firmware.
pub(super) const TICK: u32 = 2_000;
pub(super) const TICKS_PER_SECOND: u32 = 1_000_000;

/// Whether the receiver is in step with the sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Lock {
    /// The port has disappeared.
    Gone,
    /// No byte has arrived for a second, or for the failsafe's hold time if that is longer.
    Silent,
    /// Bytes arrive, but some were discarded since the last frame, or there was no frame yet.
    Searching,
    /// No byte was discarded since the last frame.
    Locked,
}

/// The state of the input.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Connection {
    Open,
    /// The port has disappeared, and may come back.
    Gone,
    Ended,
}

/// A line, its receiver and its failsafe.
pub(super) struct Watch {
    /// The name of the line, its settings, and the receiver.
    pub(super) title: String,
    pub(super) frame: FrameWriter,
    pub(super) line: TrackedLine,
    pub(super) now: Duration,
    /// The last frame and its setpoint.
    pub(super) last: Vec<u8>,
    pub(super) setpoint: Option<Setpoint>,
    pub(super) framed_at: Option<Duration>,
    /// The frames and the bytes per second, computed every second.
    pub(super) rates: [f64; 2],
    rates_at: Duration,
    /// The counts of frames and bytes at the last computation.
    counts_before: [u32; 2],
    failsafe: Failsafe<u8, 3>,
    /// The output of the failsafe at the last poll.
    pub(super) output: Output<u8, 3>,
    polled_at: Duration,
    pub(super) standstill: Standstill,
    /// The last discarded bytes, each with a flag that says whether the previous byte was discarded too.
    pub(super) discarded: VecDeque<(u8, bool)>,
    /// Whether the last byte with an outcome was discarded.
    is_in_loss: bool,
    is_searching: bool,
    heard_at: Option<Duration>,
    silent_after: Duration,
    /// The decoder of marks among the bytes, if the port reports line errors.
    pub(super) marks: Option<Marks>,
    /// Makes the port mark line errors, and restores the port's settings when dropped.
    marking: Option<Marking>,
    /// Messages about the port.
    pub(super) notes: Vec<String>,
    pub(super) port: Connection,
}

impl Watch {
    /// Starts to watch a line on which no byte has arrived. The ticks of `parameters` are microseconds.
    pub(super) fn new(
        frame: FrameWriter,
        line: AnyLine,
        parameters: FailsafeParameters<u8, 3>,
    ) -> Result<Self, FailsafeError> {
        let silent_after = parameters.hold_after.max(TICKS_PER_SECOND);
        let mut failsafe = Failsafe::new(parameters, 0)?;
        Ok(Self {
            title: String::new(),
            frame,
            line: TrackedLine::new(line),
            now: Duration::ZERO,
            last: Vec::new(),
            setpoint: None,
            framed_at: None,
            rates: [0.0; 2],
            rates_at: Duration::ZERO,
            counts_before: [0; 2],
            output: failsafe.poll(0),
            failsafe,
            polled_at: Duration::ZERO,
            standstill: Standstill::new(TICKS_PER_SECOND, parameters.hold_after),
            discarded: VecDeque::new(),
            is_in_loss: false,
            is_searching: true,
            heard_at: None,
            silent_after: Duration::from_micros(silent_after.into()),
            marks: None,
            marking: None,
            notes: Vec::new(),
            port: Connection::Open,
        })
    }

    /// Advances to `time`. Ignores a `time` that is earlier than the time reached so far.
    pub(super) fn advance_to(&mut self, time: Duration) {
        self.now = time.max(self.now);
        let counters = *self.line.counters();
        let elapsed = self.now.saturating_sub(self.rates_at);
        if elapsed >= RATES_EVERY {
            let counts = [counters.frames, counters.bytes];
            for (rate, (count, before)) in self
                .rates
                .iter_mut()
                .zip(counts.into_iter().zip(self.counts_before))
            {
                *rate = f64::from(count.wrapping_sub(before)) / elapsed.as_secs_f64();
            }
            (self.rates_at, self.counts_before) = (self.now, counts);
        }
        // Poll as often as a board does. After a long interruption, leave out the beginning.
        let earliest = self.now.saturating_sub(Duration::from_secs(10));
        self.polled_at = self.polled_at.max(earliest);
        let tick = Duration::from_micros(TICK.into());
        while self.polled_at + tick <= self.now {
            self.polled_at += tick;
            let ticks = ticks(self.polled_at);
            self.output = self.failsafe.poll(ticks);
            let slow_frames = self.failsafe.slow_frames();
            self.standstill
                .polled(ticks, counters.frames.into(), slow_frames);
        }
    }

    /// Takes bytes that arrived at the time `at`.
    pub(super) fn receive(&mut self, at: Duration, bytes: &[u8]) {
        // While the marks are decoded, the receiver changes.
        let mut marks = self.marks.take();
        let mut take = |received| match received {
            Ok(byte) => self.byte(at, byte),
            Err(event) => self.event(at, event),
        };
        match &mut marks {
            Some(marks) => marks.feed(bytes, take),
            None => bytes.iter().for_each(|&byte| take(Ok(byte))),
        }
        self.marks = marks;
    }

    fn byte(&mut self, at: Duration, byte: u8) {
        self.advance_to(at);
        self.heard_at = Some(self.now);
        let pieces = self.line.push(byte);
        self.record(pieces);
    }

    /// Takes a line event that arrived in place of a byte.
    fn event(&mut self, at: Duration, event: LineEvent) {
        self.advance_to(at);
        self.heard_at = Some(self.now);
        self.is_searching = true;
        let pieces = self.line.line_event(event);
        self.record(pieces);
    }

    fn record(&mut self, pieces: Vec<Piece>) {
        for Piece {
            bytes,
            frame,
            discarded,
            ..
        } in pieces
        {
            self.is_searching = discarded.is_some();
            if discarded.is_some() {
                for byte in bytes {
                    let follows = std::mem::replace(&mut self.is_in_loss, true);
                    self.discarded.push_back((byte, follows));
                }
                let surplus = self.discarded.len().saturating_sub(DISCARDED_LENGTH);
                self.discarded.drain(..surplus);
                continue;
            }
            self.is_in_loss = false;
            self.framed_at = Some(self.now);
            if let Some(setpoint) = self.frame.protocol.setpoint(&frame) {
                self.setpoint = Some(setpoint);
                self.failsafe.frame(setpoint);
            }
            self.last = frame;
        }
    }

    pub(super) fn lock(&self) -> Lock {
        let is_silent = |at: Duration| self.now.saturating_sub(at) >= self.silent_after;
        if self.port == Connection::Gone {
            Lock::Gone
        } else if self.heard_at.is_none_or(is_silent) {
            Lock::Silent
        } else if self.is_searching {
            Lock::Searching
        } else {
            Lock::Locked
        }
    }

    /// Makes the port mark line errors, if the operating system supports this.
    pub(super) fn mark_errors(&mut self, device: Device, has_parity: bool) {
        self.marking = Marking::begin(device);
        self.marks = self.marking.as_ref().map(|_| Marks::new(has_parity));
    }

    /// Handles the loss of the port. No frame continues after the loss.
    pub(super) fn lose_port(&mut self, at: Duration, why: &str) {
        self.event(at, LineEvent::Idle);
        self.notes.push(format!("{}: {why}", time_of_day()));
        // Close the device. As long as the device is open, the operating system may give the returning port another
        // name.
        self.marking = None;
        self.port = Connection::Gone;
    }

    /// Handles the return of the port.
    pub(super) fn regain_port(&mut self, device: Device, has_parity: bool) {
        self.mark_errors(device, has_parity);
        self.notes
            .push(format!("{}: the port is back", time_of_day()));
        self.port = Connection::Open;
    }

    /// Returns the lines to print after the view is gone.
    pub(super) fn report(&self) -> Vec<String> {
        let counters = self.line.counters();
        let events = &counters.events;
        let counts = format!(
            "{}: bytes {}, frames {}, bytes discarded {}, resynchronisations {}, line errors {}",
            self.title,
            counters.bytes,
            counters.frames,
            counters.discarded.total(),
            counters.resynchronisations,
            events.framing + events.parity + events.overrun + events.line_break,
        );
        [&[counts][..], &self.notes].concat()
    }
}

/// Returns the time as the failsafe expects it: a counter of microseconds that wraps.
fn ticks(time: Duration) -> u32 {
    let [a, b, c, d, ..] = time.as_micros().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use framelock::motion::Phase;
    use framelock_receiving::{Policy, Protocol};

    use super::*;

    pub(in super::super) const FRAME: &[u8; 7] = b"AB\0\x10\x20\x30\r";

    pub(in super::super) const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    pub(in super::super) fn watch(name: &str) -> Watch {
        let park = framelock_simulation::LEVEL.into();
        let parameters = FailsafeParameters::for_clock(TICKS_PER_SECOND, TICK, park);
        let frame = Protocol::named(name).unwrap();
        let line = AnyLine::new(&frame, Policy::Framelock).unwrap();
        let mut watch = Watch::new(FrameWriter::new(frame), line, parameters).unwrap();
        watch.title = format!("/dev/ttyACM0, 115200 baud, {name}, framelock");
        watch
    }

    fn discarded(watch: &Watch) -> String {
        let text = |(byte, follows): &(u8, bool)| {
            let separator = if *follows { "" } else { "|" };
            format!("{separator}{}", byte.escape_ascii())
        };
        watch.discarded.iter().map(text).collect()
    }

    #[test]
    fn the_discarded_bytes_are_kept_and_the_report_counts_them() {
        let mut watch = watch("bin");
        watch.receive(ms(1), b"??");
        watch.receive(ms(1), FRAME);
        watch.receive(ms(1), b"A!");
        watch.event(ms(1), LineEvent::Break);
        watch.receive(ms(1), b"AB");
        watch.event(ms(1), LineEvent::Framing);
        watch.receive(ms(1), FRAME);
        watch.receive(ms(1), b"AB");
        assert_eq!(discarded(&watch), "|??|A!AB");
        assert_eq!(
            watch.report(),
            [
                "/dev/ttyACM0, 115200 baud, bin, framelock: bytes 22, frames 2, bytes discarded 6, \
                 resynchronisations 2, line errors 2"
            ]
        );
        watch.receive(ms(1), &[b'.'; 300]);
        assert_eq!(watch.discarded.len(), DISCARDED_LENGTH);
    }

    #[test]
    fn marks_are_line_errors_and_not_data() {
        let mut watch = watch("bin");
        watch.marks = Some(Marks::new(false));
        // The bytes are a frame in which FF is doubled, then a byte with an error, then a break. The bytes arrive in two
        // pieces, which are cut within the doubled FF.
        watch.receive(ms(1), b"AB\0\xFF\xFF\xFF");
        watch.receive(ms(2), b"\xFF\0\rAB\0\xFF\0?\x10\xFF\0\0");
        watch.receive(ms(3), FRAME);
        let counters = watch.line.counters();
        assert_eq!((counters.frames, counters.bytes), (2, 18));
        let events = &counters.events;
        assert_eq!((events.framing, events.line_break), (1, 1));
    }

    #[test]
    fn the_lock_is_found_lost_and_silent() {
        let mut watch = watch("bin");
        assert_eq!(watch.lock(), Lock::Silent);
        for (at, bytes, lock) in [
            (10, &b"AB\0"[..], Lock::Searching),
            (11, b"\x01\x02\x03\r", Lock::Locked),
            // A pending byte is not a loss. A byte that can no longer become part of a frame is a loss.
            (30, b"AB\0\x01", Lock::Locked),
            (31, b"\x02\x03?", Lock::Searching),
            (50, FRAME, Lock::Locked),
        ] {
            watch.receive(ms(at), bytes);
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

    /// The failsafe's clock of microseconds wraps after 71.6 minutes.
    #[test]
    fn the_failsafe_follows_holds_and_parks_at_once_and_after_hours() {
        let mut watch = watch("bin");
        assert_eq!(watch.output.phase, Phase::Parked);
        for start in [0, 3 * 3_600_000] {
            for frame in 1..=100 {
                watch.receive(ms(start + 20 * frame), FRAME);
            }
            // A time that is earlier than the previous time does not count as silence.
            watch.advance_to(ms(start + 2_030));
            watch.receive(ms(start + 2_020), FRAME);
            assert_eq!(watch.now, ms(start + 2_030));
            assert_eq!(watch.output.axes, [0x10, 0x20, 0x30]);
            for (time, phase) in [
                (2_030, Phase::Live),
                (2_131, Phase::Live),
                // The poll at 2032 ms has taken the last frame.
                (2_132, Phase::Hold),
                (2_540, Phase::Ramp),
                (4_030, Phase::Parked),
            ] {
                watch.advance_to(ms(start + time));
                assert_eq!(watch.output.phase, phase, "{start} {time}");
            }
            // The setpoint of the last frame remains.
            assert_eq!(watch.setpoint, Some([0x10, 0x20, 0x30].into()));
        }
    }

    #[test]
    fn rates_cover_a_second() {
        let mut watch = watch("bin");
        for frame in 0..150 {
            watch.receive(ms(10 + 20 * frame), FRAME);
        }
        let year = ms(365 * 86_400_000);
        for (time, rates) in [
            (ms(3_010), ["50", "350"]),
            (ms(4_300), ["0", "0"]),
            // The computer was suspended for a year.
            (year, ["0", "0"]),
        ] {
            watch.advance_to(time);
            let rounded = watch.rates.map(|rate| format!("{rate:.0}"));
            assert_eq!(rounded, rates, "{time:?}");
        }
    }
}
