//! A station at the end of the line: a receiver, the failsafe behind it, and what becomes of each
//! frame.

use std::num::NonZeroU32;

use anyhow::{Error, Result};
use framelock::LineEvent;
use framelock::motion::{Failsafe, FailsafeParameters, Output, Phase, Setpoint};
use framelock_receiving::{AnyLine, DeliveryCheck, FrameFormat, Policy};

use crate::motion::LEVEL;
use crate::parameters::Parameters;
use crate::random::whole;
use crate::sent_frame::SentFrame;
use crate::statistics::Ratio;
use crate::tally::ReceiverTally;
use crate::uart::{BIT, BITS_PER_BYTE};

/// What is at the end of the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Kind {
    /// The machine.
    pub policy: Policy,
    /// Whether a pause longer than the idle gap drops the current frame.
    pub has_idle_gap: bool,
}

impl Kind {
    /// All stations that receive the format: of BIN the lecture's machine, then framelock; each without an
    /// idle-gap rule and then with one.
    #[must_use]
    pub fn of(format: FrameFormat) -> Vec<Self> {
        let both = |policy| {
            [false, true].map(|has_idle_gap| Self {
                policy,
                has_idle_gap,
            })
        };
        match format {
            FrameFormat::Bin => [both(Policy::Lecture), both(Policy::Framelock)].concat(),
            FrameFormat::BinCrc8 => both(Policy::Framelock).to_vec(),
        }
    }
}

/// Time steps to microseconds, on a line of `baud`.
pub(crate) fn microseconds(time: u64, baud: u32) -> u64 {
    let steps_per_second = u128::from(baud) * u128::from(BIT);
    let microseconds = u128::from(time) * 1_000_000 / steps_per_second;
    u64::try_from(microseconds).unwrap_or(u64::MAX)
}

/// The failsafe's parameters; it counts microseconds.
fn failsafe(parameters: &Parameters) -> FailsafeParameters<u8, 3> {
    let microseconds = |milliseconds: f64| {
        let rounded = (milliseconds * 1000.0).round();
        u32::try_from(whole(rounded)).unwrap_or(u32::MAX)
    };
    let per_unit = microseconds(parameters.full_travel / f64::from(u8::MAX));
    FailsafeParameters {
        hold_after: microseconds(parameters.hold_after),
        ramp_after: microseconds(parameters.ramp_after),
        park: LEVEL.into(),
        ticks_per_unit: [NonZeroU32::new(per_unit).unwrap_or(NonZeroU32::MIN); 3],
    }
}

/// What a byte made of a station.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Outcome {
    /// It committed nothing, and has this many bytes of a frame.
    Pending(usize),
    /// It committed the setpoint of the frame that the byte ends.
    Delivered,
    /// It committed something else.
    Wrong,
}

/// What became of a sent frame at a station.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fate {
    /// Its setpoint was committed with its last byte.
    Delivered,
    /// The line lost or changed some of it, and the receiver committed nothing.
    Broken,
    /// It arrived whole, and the receiver committed nothing.
    Missed,
    /// While it came, the receiver committed something else.
    Wrong,
}

/// A receiver and its failsafe.
pub struct Station {
    format: FrameFormat,
    receiver: AnyLine,
    /// Bytes received.
    received: usize,
    /// The sent frames of which every byte came, by their numbers and setpoints.
    check: DeliveryCheck<(u64, Option<Setpoint>)>,
    /// Something wrong was committed since the last frame.
    is_wrong: bool,
    failsafe: Failsafe<u8, 3>,
    baud: u32,
    hears_errors: bool,
    /// How long after a byte the next one may end at the latest, and until when it may now.
    idle_limit: u64,
    idle_from: u64,
    committed: u64,
    /// Microseconds of silence after which the failsafe holds.
    hold_after: u64,
    /// The frame that was delivered last, and when.
    delivered: Option<(u64, u64)>,
    is_following: bool,
    /// A frame was not delivered, and none has been since: intact frames lost, and when the first of
    /// them began.
    outage: Option<(u64, Option<u64>)>,
    tally: ReceiverTally,
}

impl Station {
    pub(crate) fn new(parameters: &Parameters, kind: Kind) -> Result<Self> {
        // The byte that ends the gap takes one byte time to come in.
        let limit = (u64::from(parameters.idle_gap) + 1) * BITS_PER_BYTE * BIT;
        let receiver = AnyLine::of_setpoints(parameters.frame, kind.policy);
        let failsafe = failsafe(parameters);
        Ok(Self {
            format: parameters.frame,
            receiver: receiver.map_err(Error::msg)?,
            received: 0,
            check: DeliveryCheck::default(),
            is_wrong: false,
            failsafe: Failsafe::new(failsafe, 0)?,
            hold_after: failsafe.hold_after.into(),
            baud: parameters.baud,
            hears_errors: !parameters.unreported,
            idle_limit: if kind.has_idle_gap { limit } else { u64::MAX },
            idle_from: u64::MAX,
            committed: 0,
            delivered: None,
            is_following: true,
            outage: None,
            tally: ReceiverTally {
                kind,
                ..ReceiverTally::default()
            },
        })
    }

    /// Takes a byte. `ended`: the frame that it ends, if every byte of that frame came.
    pub(crate) fn push(&mut self, at: u64, byte: u8, ended: Option<&SentFrame>) -> Outcome {
        // Nothing notices the gap before the byte that ends it.
        if at > self.idle_from {
            self.line_event(LineEvent::Idle);
        }
        self.idle_from = at.saturating_add(self.idle_limit);
        self.received += 1;
        let arrived = self.received.saturating_sub(self.format.length())..self.received;
        if let Some(sent) = ended {
            let frame = (sent.number, sent.transmission.setpoint);
            self.check.arrived(arrived.clone(), frame);
        }
        // A receiver of frames of one length has decided about all bytes before these.
        while self.check.missed(arrived.start).is_some() {}
        let mut committed = None;
        self.receiver.feed(&[byte], |found| {
            let frame = found.message();
            committed = frame.and_then(|frame| self.format.setpoint(frame));
        });
        let Some(setpoint) = committed else {
            return Outcome::Pending(self.pending());
        };
        self.poll(at);
        self.tally.longest_silence = self.longest_silence(at);
        self.committed = at;
        self.failsafe.frame(self.ticks(at), setpoint);
        self.poll(at);
        match self.check.delivered(&arrived) {
            Some((number, sent)) if sent == Some(setpoint) => {
                self.delivered = Some((number, at));
                return Outcome::Delivered;
            }
            Some(_) => self.tally.wrong_setpoints += 1,
            None => self.tally.false_frames += 1,
        }
        self.is_wrong = true;
        Outcome::Wrong
    }

    /// Returns what became of a frame whose last byte has come or was lost.
    pub(crate) fn fate(&mut self, frame: &SentFrame) -> Fate {
        if std::mem::take(&mut self.is_wrong) {
            Fate::Wrong
        } else if self.delivery(frame).is_some() {
            Fate::Delivered
        } else if frame.is_intact {
            Fate::Missed
        } else {
            Fate::Broken
        }
    }

    /// Returns when the frame was delivered, if it was.
    fn delivery(&self, frame: &SentFrame) -> Option<u64> {
        let (number, at) = self.delivered?;
        (number == frame.number).then_some(at)
    }

    /// The UART reports an error.
    pub(crate) fn line_error(&mut self, event: LineEvent) {
        if self.hears_errors {
            self.line_event(event);
        }
    }

    fn line_event(&mut self, event: LineEvent) {
        self.receiver.line_event(event, |_| ());
    }

    /// How many bytes of a frame the receiver has.
    #[must_use]
    pub fn pending(&self) -> usize {
        self.receiver.pending()
    }

    /// The failsafe's time: a counter that wraps.
    fn ticks(&self, at: u64) -> u32 {
        let [a, b, c, d, ..] = microseconds(at, self.baud).to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }

    fn poll(&mut self, at: u64) -> Output<u8, 3> {
        let output = self.failsafe.poll(self.ticks(at));
        self.tally.engagements += self.engagement(at, output);
        self.is_following = self.is_following(at, output);
        output
    }

    /// 1 if the failsafe has taken over.
    fn engagement(&self, at: u64, output: Output<u8, 3>) -> u64 {
        u64::from(self.is_following && !self.is_following(at, output))
    }

    /// Whether the output is the setpoint's, or on its way there, or the first frame is not late yet.
    fn is_following(&self, at: u64, output: Output<u8, 3>) -> bool {
        microseconds(at, self.baud) < self.hold_after
            || matches!(output.phase, Phase::Live | Phase::Approach)
    }

    /// The output at that time.
    pub(crate) fn output(&self, at: u64) -> Output<u8, 3> {
        // Of a copy: at a given time it is the same however often it is asked for.
        { self.failsafe }.poll(self.ticks(at))
    }

    /// The output now, compared with `demand`.
    pub(crate) fn look(&mut self, at: u64, demand: Setpoint) -> Output<u8, 3> {
        let output = self.poll(at);
        for (actual, demanded) in output.axes.into_iter().zip(<[u8; 3]>::from(demand)) {
            let difference = actual.abs_diff(demanded);
            self.tally.largest_error = self.tally.largest_error.max(difference);
            self.tally.error_squares += u64::from(difference).pow(2);
        }
        self.tally.looks += 1;
        output
    }

    fn longest_silence(&self, at: u64) -> u64 {
        let silence = microseconds(at - self.committed, self.baud);
        self.tally.longest_silence.max(silence)
    }

    /// Nothing more of the frame, which began at that time, can come. Frames come in their order,
    /// each before the next ends.
    pub(crate) fn settle(&mut self, frame: &SentFrame, began: u64) {
        let began = frame.is_intact.then_some(began);
        let Some(at) = self.delivery(frame) else {
            let (lost, since) = self.outage.unwrap_or_default();
            let more = u64::from(frame.is_intact);
            self.tally.lost_intact += more;
            self.outage = Some((lost + more, since.or(began)));
            return;
        };
        self.tally.delivered += 1;
        // A frame that is delivered though it is not intact proves nothing.
        if let Some((lost, since)) = self.outage.take()
            && let Some(since) = since.or(began)
        {
            let time = microseconds(at - since, self.baud);
            *self.tally.back_by_frames.entry(lost).or_default() += 1;
            *self.tally.back_by_microseconds.entry(time).or_default() += 1;
        }
    }

    /// What has been counted until then. `bytes_lost`: how many the line has lost in the trial.
    pub(crate) fn tally(&self, at: u64, bytes_lost: u64) -> ReceiverTally {
        let mut tally = self.tally.clone();
        let counters = self.receiver.counters();
        tally.bytes_discarded = counters.discarded.total().into();
        tally.never_back = u64::from(matches!(self.outage, Some((_, Some(_)))));
        tally.engagements += self.engagement(at, self.output(at));
        tally.longest_silence = self.longest_silence(at);
        tally.lost_per_byte = Ratio::of(tally.lost_intact, bytes_lost);
        tally
    }
}
