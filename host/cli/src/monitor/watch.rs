//! Watches a line as a board would, with a receiver and a failsafe, and computes rates.
//!
//! The caller passes the time. Nothing in this module waits, draws or reads.

use std::collections::VecDeque;
use std::time::Duration;

use framelock::LineEvent;
use framelock::motion::{Failsafe, FailsafeError, FailsafeParameters, Output, Phase, Setpoint};
use framelock_receiving::{AnyLine, Piece, Standstill, TrackedLine};

use crate::frame_writer::FrameWriter;

/// The time between samples, and the number of samples that are kept. From the oldest to the newest sample, two seconds
/// pass. The rates are those of these two seconds.
const SAMPLE_EVERY: Duration = Duration::from_millis(100);
const SAMPLES: u16 = 21;

/// The number of discarded bytes that are kept. Two rows of a terminal show fewer bytes than this.
const DISCARDED_LENGTH: usize = 256;

/// Whether the receiver is in step with the sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Lock {
    /// No byte has arrived for a second, or for the failsafe's hold time if that is longer.
    Silent,
    /// Bytes arrive, but some were discarded since the last frame, or there was no frame yet.
    Searching,
    /// No byte was discarded since the last frame.
    Locked,
}

/// The state of the line at one point in time.
#[derive(Clone, Copy, Default)]
pub(super) struct Sample {
    pub(super) at: Duration,
    /// The number of frames since the start; resetting the counters does not change it.
    frames: u64,
    bytes: u64,
}

/// A line, its receiver and its failsafe.
#[derive(Clone)]
pub(super) struct Watch {
    pub(super) now: Sample,
    pub(super) frame: FrameWriter,
    /// The last frame's setpoint and bytes.
    pub(super) setpoint: Option<Setpoint>,
    pub(super) last: Option<Vec<u8>>,
    pub(super) line: TrackedLine,
    failsafe: Failsafe<u8, 3>,
    standstill: Standstill,
    silent_after: Duration,
    idle_gap: Option<Duration>,
    /// Discarded bytes, each with a flag that says whether the previous byte was discarded too.
    pub(super) discarded: VecDeque<(u8, bool)>,
    /// Whether the last byte with an outcome was discarded.
    is_in_loss: bool,
    is_searching: bool,
    is_idle: bool,
    heard_at: Option<Duration>,
    pub(super) framed_at: Option<Duration>,
    history: VecDeque<Sample>,
    next_sample: Duration,
    polled_at: Duration,
}

/// The time between two polls of the failsafe, in microseconds, as in the firmware.
pub(super) const TICK: u32 = 2_000;
pub(super) const TICKS_PER_SECOND: u32 = 1_000_000;

impl Watch {
    /// Starts to watch a line on which no byte has arrived. The ticks of `parameters` are microseconds.
    /// A pause of more than `idle_gap` between bytes is reported to the receiver.
    pub(super) fn new(
        frame: FrameWriter,
        line: AnyLine,
        parameters: FailsafeParameters<u8, 3>,
        idle_gap: Option<Duration>,
    ) -> Result<Self, FailsafeError> {
        let silent_after = parameters.hold_after.max(TICKS_PER_SECOND);
        Ok(Self {
            now: Sample::default(),
            frame,
            setpoint: None,
            last: None,
            line: TrackedLine::new(line),
            failsafe: Failsafe::new(parameters, 0)?,
            standstill: Standstill::new(TICKS_PER_SECOND, parameters.hold_after),
            silent_after: Duration::from_micros(silent_after.into()),
            idle_gap,
            discarded: VecDeque::new(),
            is_in_loss: false,
            is_searching: true,
            is_idle: true,
            heard_at: None,
            framed_at: None,
            history: VecDeque::new(),
            next_sample: Duration::ZERO,
            polled_at: Duration::ZERO,
        })
    }

    /// Advances to `time`. Ignores a `time` that is earlier than the time reached so far.
    pub(super) fn advance_to(&mut self, time: Duration) {
        let now = time.max(self.now.at);
        // After a long interruption, add no more samples than are kept.
        let earliest = now.saturating_sub(SAMPLE_EVERY * u32::from(SAMPLES));
        self.next_sample = self.next_sample.max(earliest);
        while self.next_sample <= now {
            self.now.at = self.next_sample;
            push_within(&mut self.history, SAMPLES.into(), self.now);
            self.next_sample += SAMPLE_EVERY;
        }
        self.now.at = now;
        let ends_gap = |gap| self.heard_at.is_some_and(|last| now > last + gap);
        if !self.is_idle && self.idle_gap.is_some_and(ends_gap) {
            self.is_idle = true;
            let pieces = self.line.line_event(LineEvent::Idle);
            self.settle(pieces);
        }
        // Poll as often as a board does. After a long interruption, leave out the beginning.
        let tick = Duration::from_micros(TICK.into());
        self.polled_at = self
            .polled_at
            .max(now.saturating_sub(Duration::from_secs(10)));
        while self.polled_at + tick <= now {
            self.polled_at += tick;
            let ticks = ticks(self.polled_at);
            self.failsafe.poll(ticks);
            let slow_frames = self.failsafe.slow_frames();
            self.standstill.polled(ticks, self.now.frames, slow_frames);
        }
    }

    /// Takes a byte that arrived.
    pub(super) fn byte(&mut self, at: Duration, byte: u8) {
        self.advance_to(at);
        self.heard_at = Some(self.now.at);
        self.is_idle = false;
        self.now.bytes += 1;
        let pieces = self.line.push(byte);
        self.settle(pieces);
    }

    /// Takes a line event that arrived in place of a byte.
    pub(super) fn event(&mut self, at: Duration, event: LineEvent) {
        self.advance_to(at);
        self.heard_at = Some(self.now.at);
        self.is_searching = true;
        let pieces = self.line.line_event(event);
        self.settle(pieces);
    }

    fn settle(&mut self, pieces: Vec<Piece>) {
        for Piece {
            bytes, discarded, ..
        } in pieces
        {
            if discarded.is_some() {
                for byte in bytes {
                    let follows = std::mem::replace(&mut self.is_in_loss, true);
                    push_within(&mut self.discarded, DISCARDED_LENGTH, (byte, follows));
                    self.is_searching = true;
                }
                continue;
            }
            self.now.frames += 1;
            if let Some(setpoint) = self.frame.protocol.setpoint(&bytes) {
                self.setpoint = Some(setpoint);
                self.failsafe.frame(setpoint);
            }
            self.last = Some(bytes);
            self.framed_at = Some(self.now.at);
            self.is_searching = false;
            self.is_in_loss = false;
        }
    }

    /// Sets the counters to zero, and forgets the discarded bytes.
    pub(super) fn reset_counters(&mut self) {
        self.line.reset_counters();
        self.discarded.clear();
        self.is_in_loss = false;
    }

    pub(super) fn lock(&self) -> Lock {
        let is_silent = |at: Duration| self.now.at.saturating_sub(at) >= self.silent_after;
        if self.heard_at.is_none_or(is_silent) {
            Lock::Silent
        } else if self.is_searching {
            Lock::Searching
        } else {
            Lock::Locked
        }
    }

    /// Returns the current output of a board's failsafe.
    pub(super) fn output(&self) -> Output<u8, 3> {
        // `poll` changes a copy, so that this method can be called any number of times.
        { self.failsafe }.poll(ticks(self.now.at))
    }

    /// Returns the reason why the output does not follow the setpoints in this phase.
    pub(super) fn reason(&self, phase: Phase) -> Option<String> {
        self.standstill.reason(phase)
    }

    /// Returns the frames and the bytes per second, over the last two seconds.
    pub(super) fn rates(&self) -> [f64; 2] {
        let (Some(first), Some(last)) = (self.history.front(), self.history.back()) else {
            return [0.0; 2];
        };
        let time = last.at.saturating_sub(first.at).as_secs_f64();
        #[expect(
            clippy::cast_precision_loss,
            reason = "it is rounded for people to read"
        )]
        [last.frames - first.frames, last.bytes - first.bytes]
            .map(|count| if time > 0.0 { count as f64 / time } else { 0.0 })
    }
}

/// Appends an item, and drops the oldest item if the queue is full.
fn push_within<T>(queue: &mut VecDeque<T>, room: usize, item: T) {
    if queue.len() == room {
        queue.pop_front();
    }
    queue.push_back(item);
}

/// Returns the time as the failsafe expects it: a counter of microseconds that wraps.
fn ticks(time: Duration) -> u32 {
    let [a, b, c, d, ..] = time.as_micros().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
pub(super) mod tests;
