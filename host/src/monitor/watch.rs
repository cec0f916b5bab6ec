//! A line under watch: the receiver, the failsafe as a board would have it, and what they have seen.
//!
//! Time is passed in, and nothing in here waits, draws or reads.

use std::collections::VecDeque;
use std::time::Duration;

use framelock::{
    Accounting, Counters, Failsafe, FailsafeError, FailsafeParameters, LineEvent, Output, Parser,
    Setpoint,
};

/// How far apart samples are, and how many are kept: the last ten seconds.
pub(super) const SAMPLE_EVERY: Duration = Duration::from_millis(100);
const SAMPLES: u16 = 100;

/// Over how many of them rates are taken: two seconds.
const RATE_SAMPLES: usize = 20;

/// How many discarded bytes are kept: more than any terminal has room for in two rows.
const DISCARDED_LENGTH: usize = 256;

/// Whether the receiver is in step with the sender.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Lock {
    /// No byte has come for as long as the failsafe waits before it holds.
    Silent,
    /// Bytes come, but some were discarded since the last frame; or there was no frame yet.
    Searching,
    /// Since the last frame nothing was discarded.
    Locked,
}

/// A point of the recent past.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Sample {
    pub(super) at: Duration,
    /// The setpoint in force.
    pub(super) setpoint: Option<Setpoint>,
    /// Frames and bytes until then.
    frames: u64,
    bytes: u64,
}

/// A byte that is part of no frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct DiscardedByte {
    pub(super) byte: u8,
    /// Whether the byte in front of it on the line was discarded too.
    pub(super) follows: bool,
}

/// What there is to see.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Report {
    pub(super) now: Duration,
    pub(super) lock: Lock,
    /// Bytes held of the frame under way: the machine's state.
    pub(super) pending: usize,
    pub(super) frame_length: usize,
    pub(super) setpoint: Option<Setpoint>,
    /// How old it is.
    pub(super) age: Option<Duration>,
    /// What a board's failsafe would put out.
    pub(super) output: Output,
    pub(super) frames_per_second: f64,
    pub(super) bytes_per_second: f64,
    pub(super) counters: Counters,
    pub(super) discarded: Vec<DiscardedByte>,
    pub(super) history: Vec<Sample>,
}

/// A line under watch.
pub(super) struct Watch<P> {
    line: Accounting<P>,
    failsafe: Failsafe,
    parameters: FailsafeParameters,
    idle_gap: Option<Duration>,
    now: Duration,

    /// The bytes that the parser holds, oldest first.
    held: VecDeque<u8>,
    discarded: VecDeque<DiscardedByte>,
    /// Whether the byte judged last was discarded.
    is_in_loss: bool,

    setpoint: Option<Setpoint>,
    framed_at: Option<Duration>,
    heard_at: Option<Duration>,
    is_searching: bool,
    is_idle: bool,

    frames: u64,
    bytes: u64,
    history: VecDeque<Sample>,
    next_sample: Duration,
}

impl<P: Parser<Message = Setpoint> + Default + Copy> Watch<P> {
    /// Nothing has come yet. Ticks of `parameters` are microseconds; a pause in the bytes of more
    /// than `idle_gap` is reported to the receiver.
    pub(super) fn new(
        parameters: FailsafeParameters,
        idle_gap: Option<Duration>,
    ) -> Result<Self, FailsafeError> {
        Ok(Self {
            line: Accounting::new(P::default()),
            failsafe: Failsafe::new(parameters, 0)?,
            parameters,
            idle_gap,
            now: Duration::ZERO,
            held: VecDeque::new(),
            discarded: VecDeque::new(),
            is_in_loss: false,
            setpoint: None,
            framed_at: None,
            heard_at: None,
            is_searching: true,
            is_idle: true,
            frames: 0,
            bytes: 0,
            history: VecDeque::new(),
            next_sample: Duration::ZERO,
        })
    }

    /// Time passes. Time that goes back is taken for no time.
    pub(super) fn advance_to(&mut self, time: Duration) {
        let time = time.max(self.now);
        // Whoever stopped the process for long finds no more than the history holds.
        let earliest = time.saturating_sub(SAMPLE_EVERY * u32::from(SAMPLES));
        self.next_sample = self.next_sample.max(earliest);
        while self.next_sample <= time {
            if self.history.len() == usize::from(SAMPLES) {
                self.history.pop_front();
            }
            self.history.push_back(Sample {
                at: self.next_sample,
                setpoint: self.setpoint,
                frames: self.frames,
                bytes: self.bytes,
            });
            self.next_sample += SAMPLE_EVERY;
        }
        self.now = time;
        let last = self.heard_at.unwrap_or_default();
        if !self.is_idle && self.idle_gap.is_some_and(|gap| time > last + gap) {
            self.is_idle = true;
            self.event(time, LineEvent::Idle);
        }
        self.failsafe.poll(ticks(self.now));
    }

    /// A byte has come.
    pub(super) fn byte(&mut self, at: Duration, byte: u8) {
        self.advance_to(at);
        self.heard_at = Some(self.now);
        self.is_idle = false;
        self.bytes += 1;
        self.held.push_back(byte);
        if let Some(setpoint) = self.line.push(byte) {
            self.frames += 1;
            self.failsafe.frame(ticks(self.now), setpoint);
            self.setpoint = Some(setpoint);
            self.framed_at = Some(self.now);
            self.is_searching = false;
            self.is_in_loss = false;
            // What was held besides is part of it.
            self.held.clear();
        }
        self.discard_what_is_not_held();
    }

    /// Something has come in place of a byte.
    pub(super) fn event(&mut self, at: Duration, event: LineEvent) {
        // An idle gap is noticed while time passes.
        if event != LineEvent::Idle {
            self.advance_to(at);
            self.heard_at = Some(self.now);
            self.is_searching = true;
        }
        self.line.line_event(event);
        self.discard_what_is_not_held();
    }

    fn discard_what_is_not_held(&mut self) {
        while self.held.len() > self.line.pending() {
            let Some(byte) = self.held.pop_front() else {
                return;
            };
            if self.discarded.len() == DISCARDED_LENGTH {
                self.discarded.pop_front();
            }
            self.discarded.push_back(DiscardedByte {
                byte,
                follows: self.is_in_loss,
            });
            self.is_in_loss = true;
            self.is_searching = true;
        }
    }

    /// Counts from now on. What is held has been received already, and counts.
    pub(super) fn reset_counters(&mut self) {
        self.line = Accounting::new(*self.line.parser());
        self.discarded.clear();
        self.is_in_loss = false;
    }

    /// What has been counted.
    pub(super) fn counters(&self) -> &Counters {
        self.line.counters()
    }

    /// What there is to see now.
    pub(super) fn report(&self) -> Report {
        let [frames_per_second, bytes_per_second] = self.rates();
        Report {
            now: self.now,
            lock: self.lock(),
            pending: self.line.pending(),
            frame_length: P::FRAME_LENGTH,
            setpoint: self.setpoint,
            age: self.framed_at.map(|at| self.now.saturating_sub(at)),
            // Of a copy: at a given time it is the same however often it is asked for.
            output: { self.failsafe }.poll(ticks(self.now)),
            frames_per_second,
            bytes_per_second,
            counters: *self.line.counters(),
            discarded: self.discarded.iter().copied().collect(),
            history: self.history.iter().copied().collect(),
        }
    }

    fn lock(&self) -> Lock {
        let hold_after = Duration::from_micros(self.parameters.hold_after.into());
        let is_silent = self
            .heard_at
            .is_none_or(|at| self.now.saturating_sub(at) >= hold_after);
        if is_silent {
            Lock::Silent
        } else if self.is_searching {
            Lock::Searching
        } else {
            Lock::Locked
        }
    }

    /// Frames and bytes in a second, lately.
    fn rates(&self) -> [f64; 2] {
        let before = self.history.len().saturating_sub(RATE_SAMPLES + 1);
        let (Some(first), Some(last)) = (self.history.get(before), self.history.back()) else {
            return [0.0; 2];
        };
        let time = last.at.saturating_sub(first.at).as_secs_f64();
        if time == 0.0 {
            return [0.0; 2];
        }
        #[expect(
            clippy::cast_precision_loss,
            reason = "it is rounded for people to read"
        )]
        let rate = |count: u64| count as f64 / time;
        [
            rate(last.frames - first.frames),
            rate(last.bytes - first.bytes),
        ]
    }
}

/// The time as the failsafe is told it: a counter of microseconds that wraps.
fn ticks(time: Duration) -> u32 {
    let [a, b, c, d, ..] = time.as_micros().to_le_bytes();
    u32::from_le_bytes([a, b, c, d])
}

#[cfg(test)]
pub(super) mod tests;
