//! Watches a line: prints a line of text each second, with the state, the rates, the failsafe and the last frame.

use std::io::Write;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Result;
use framelock::motion::{Failsafe, FailsafeParameters, Output as Actuators};
use framelock::{Counters, Found, LineEvent};
use framelock_description::text::harmless;
use framelock_receiving::{AnyLine, Policy, Protocol, Standstill};
use framelock_simulation::LEVEL;

use crate::frame_writer::FrameWriter;
use crate::input::{Arrivals, Input, InputNotation};
use crate::options::{check_has_no_breaks, protocol};
use crate::output::{Output, exit_code, lock};
use crate::serial::PortOptions;

/// Watch a line: print its state, its rates, the failsafe and the last frame, a line each second
#[derive(clap::Args)]
#[command(after_help = include_str!("help/monitor.txt"))]
pub(crate) struct Arguments {
    /// Read a serial port such as /dev/ttyUSB0 or COM3, or - for standard input
    #[arg(value_name = "PORT|-")]
    line: PathBuf,
    /// Receive with framelock (searches a broken frame again) or lecture (the lecture's machine, which
    /// discards it; bin only)
    #[arg(long, value_enum, default_value_t = Policy::Framelock, hide_possible_values = true)]
    policy: Policy,
    /// Receive these frames: a name, or a description file [default: bin]
    #[arg(long, value_name = "NAME|FILE", default_value = "bin", hide_default_value = true, value_parser = protocol, hide_possible_values = true)]
    frame: Protocol,
    #[command(flatten)]
    port: PortOptions,
}

/// The time between two lines.
const REPORT_EVERY: Duration = Duration::from_secs(1);

/// If silence ends the frames, a pause of this length ends a frame.
const IDLE_GAP: Duration = Duration::from_millis(4);

/// The time between two polls of the failsafe, in microseconds, as in the firmware.
const TICK: u32 = 2_000;
const TICKS_PER_SECOND: u32 = 1_000_000;

/// Runs `framelock monitor`, until the input ends or reading it fails.
pub(crate) fn run(arguments: &Arguments) -> Result<()> {
    check_has_no_breaks(&arguments.frame)?;
    let line = AnyLine::new(&arguments.frame, arguments.policy)?;
    let input = Input::open(&arguments.line, &arguments.port)?;
    let mut arrivals = Arrivals::new(input, Some(InputNotation::Bytes))?;
    let watch = Watch::new(FrameWriter::new(arguments.frame.clone(), &[])?, line);
    let watch = Arc::new(Mutex::new(watch));
    let start = Instant::now();
    let reported = Arc::clone(&watch);
    let mut output = Output::standard()?;
    // This thread ends with the process.
    thread::spawn(move || {
        loop {
            thread::sleep(REPORT_EVERY);
            let report = lock(&reported).report(start.elapsed());
            if let Err(error) = writeln!(output, "{report}") {
                std::process::exit(exit_code(Err(error.into())).into());
            }
        }
    });
    let outcome = arrivals.try_for_each(|arrival| {
        let bytes = arrival?.bytes;
        lock(&watch).receive(start.elapsed(), &bytes);
        Ok(())
    });
    let report = lock(&watch).report(start.elapsed());
    writeln!(Output::standard()?, "{report}")?;
    outcome
}

/// A line as a board would receive it, with a failsafe. The caller passes the time.
struct Watch {
    frame: FrameWriter,
    line: AnyLine,
    failsafe: Failsafe<u8, 3>,
    /// The failsafe's output at the last poll.
    output: Actuators<u8, 3>,
    standstill: Standstill,
    polled_at: Duration,
    last_frame: Vec<u8>,
    /// The time of the last bytes, if silence ends the frames and the pause after these bytes has not been reported.
    heard_at: Option<Duration>,
    /// The time and the counters of the last report.
    reported_at: Duration,
    before: Counters,
}

impl Watch {
    fn new(frame: FrameWriter, line: AnyLine) -> Self {
        let parameters = FailsafeParameters::for_clock(TICKS_PER_SECOND, TICK, LEVEL.into());
        let mut failsafe = Failsafe::new(parameters, 0).expect("the parameters are the usual ones");
        Self {
            frame,
            line,
            output: failsafe.poll(0),
            failsafe,
            standstill: Standstill::new(TICKS_PER_SECOND, parameters.hold_after),
            polled_at: Duration::ZERO,
            last_frame: Vec::new(),
            heard_at: None,
            reported_at: Duration::ZERO,
            before: Counters::ZERO,
        }
    }

    /// Takes bytes that arrived at this time.
    fn receive(&mut self, now: Duration, bytes: &[u8]) {
        self.advance_to(now);
        self.step(|line, found| line.feed(bytes, found));
        let ending_event = self.frame.protocol.description.ending_event();
        self.heard_at = ending_event.map(|_| now);
    }

    /// Passes bytes or a line event to the line, and keeps the last frame.
    fn step(&mut self, step: impl FnOnce(&mut AnyLine, &mut dyn FnMut(Found<&[u8]>))) {
        step(&mut self.line, &mut |found| {
            if let Some(frame) = found.message() {
                frame.clone_into(&mut self.last_frame);
                if let Some(setpoint) = self.frame.protocol.setpoint(frame) {
                    self.failsafe.frame(setpoint);
                }
            }
        });
    }

    /// If silence ends the frames, reports a pause of [`IDLE_GAP`] or more to the receiver. Polls the failsafe as often
    /// as a board does. If the last poll is more than 10 s ago, skips the polls before the last 10 s.
    fn advance_to(&mut self, now: Duration) {
        let is_over = |heard: &mut Duration| now.saturating_sub(*heard) >= IDLE_GAP;
        if self.heard_at.take_if(is_over).is_some() {
            self.step(|line, found| line.line_event(LineEvent::Idle, found));
        }
        let earliest = now.saturating_sub(Duration::from_secs(10));
        self.polled_at = self.polled_at.max(earliest);
        let tick = Duration::from_micros(TICK.into());
        while self.polled_at + tick <= now {
            self.polled_at += tick;
            // The failsafe's clock is a counter of microseconds that wraps.
            let [a, b, c, d, ..] = self.polled_at.as_micros().to_le_bytes();
            let ticks = u32::from_le_bytes([a, b, c, d]);
            self.output = self.failsafe.poll(ticks);
            let frames = self.line.counters().frames.into();
            let slow_frames = self.failsafe.slow_frames();
            self.standstill.polled(ticks, frames, slow_frames);
        }
    }

    /// Returns the line of text about the time since the last report.
    fn report(&mut self, now: Duration) -> String {
        self.advance_to(now);
        let counters = *self.line.counters();
        let before = std::mem::replace(&mut self.before, counters);
        let elapsed = now.saturating_sub(self.reported_at).as_secs_f64();
        self.reported_at = now;
        let increase = |count: fn(&Counters) -> u32| count(&counters).wrapping_sub(count(&before));
        let bytes = increase(|counters| counters.bytes);
        let frames = increase(|counters| counters.frames);
        let discarded = increase(|counters| counters.discarded.total());
        let state = match (bytes, frames, discarded) {
            (0, ..) => "SILENT",
            (_, 1.., 0) => "LOCKED",
            _ => "SEARCHING",
        };
        let rate = |count: u32| f64::from(count) / elapsed.max(1e-3);
        let mut report = format!(
            "{state:<9} {:>7.1} frames/s {:>8.0} bytes/s   discarded {}",
            rate(frames),
            rate(bytes),
            counters.discarded.total()
        );
        if self.frame.protocol.has_setpoints() {
            let Actuators { axes, phase } = self.output;
            let [pitch, roll, yaw] = axes;
            let name = phase.to_string().to_uppercase();
            let reason = self.standstill.reason(phase);
            let reason = reason.map_or(String::new(), |why| format!(": {why}"));
            let failsafe = format!("   failsafe {name} {pitch},{roll},{yaw}{reason}");
            report += &failsafe;
        }
        if !self.last_frame.is_empty() {
            let mut text = Vec::new();
            self.frame.append_text(&mut text, &self.last_frame);
            report += &String::from_utf8_lossy(&text);
        }
        harmless(&report)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    fn watch(name: &str) -> Watch {
        let frame = Protocol::named(name).unwrap();
        let line = AnyLine::new(&frame, Policy::Framelock).unwrap();
        Watch::new(FrameWriter::new(frame, &[]).unwrap(), line)
    }

    /// Receives this number of frames, one every `every` milliseconds. Returns the report at the end.
    fn after(watch: &mut Watch, frames: u64, every: u64, bytes: &[u8]) -> String {
        let start = watch.reported_at;
        for frame in 0..frames {
            watch.receive(start + Duration::from_millis(frame * every), bytes);
        }
        watch.report(start + Duration::from_millis(frames * every))
    }

    const FRAME: &[u8] = b"AB\0\x10\x20\x30\r";
    const NONE: &[u8] = b"";

    /// The failsafe's clock wraps after 71.6 minutes.
    #[test]
    fn each_second_has_a_report_at_once_and_after_hours() {
        for hours in [0, 3] {
            let mut watch = watch("bin");
            watch.report(Duration::from_secs(hours * 3_600));
            let fields = "   pitch  16   roll  32   yaw  48";
            for (frames, every, bytes, expected) in [
                (
                    150,
                    20,
                    FRAME,
                    "LOCKED       50.0 frames/s      350 bytes/s   discarded 0   failsafe LIVE 16,32,48",
                ),
                (
                    50,
                    20,
                    b"?AB\0\x10\x20\x30\r",
                    "SEARCHING    50.0 frames/s      400 bytes/s   discarded 50   failsafe LIVE 16,32,48",
                ),
                (
                    1,
                    600,
                    &FRAME[..3],
                    "SEARCHING     0.0 frames/s        5 bytes/s   discarded 50   failsafe RAMP",
                ),
                (
                    2,
                    1_000,
                    NONE,
                    "SILENT        0.0 frames/s        0 bytes/s   discarded 50   failsafe PARKED 128,128,128: no frames",
                ),
            ] {
                let report = after(&mut watch, frames, every, bytes);
                assert!(
                    report.starts_with(expected) && report.ends_with(fields),
                    "{report}"
                );
            }
        }
    }

    #[test]
    fn the_report_says_why_the_platform_does_not_follow() {
        let mut watch = watch("bin");
        let report = after(&mut watch, 20, 200, FRAME);
        let apart = "PARKED 128,128,128: frames arrive too far apart (100 ms or more)";
        assert!(
            report.contains("  5.0 frames/s") && report.contains(apart),
            "{report}"
        );
        let report = after(&mut watch, 30, 20, FRAME);
        assert!(
            report.contains(": moves slowly to the setpoint"),
            "{report}"
        );
    }

    #[test]
    fn a_pause_ends_frames_that_silence_ends() {
        let report = after(
            &mut watch("modbus-rtu"),
            10,
            100,
            b"\x01\x03\x02\0\0\xB8\x44",
        );
        let fields = "discarded 0   length   7   address   1   function   3   data x020000";
        assert!(
            report.starts_with("LOCKED       10.0 frames/s") && report.ends_with(fields),
            "{report}"
        );
    }

    #[test]
    fn described_frames_have_their_fields_and_no_failsafe() {
        let report = after(
            &mut watch("ubx"),
            10,
            100,
            b"\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38",
        );
        let expected = "discarded 0   length  10   kind ACK-ACK   class   5   id   1   clsID   6";
        assert!(
            report.starts_with("LOCKED       10.0 frames/s      100 bytes/s")
                && report.contains(expected),
            "{report}"
        );
    }
}
