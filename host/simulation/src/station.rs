//! A station at the end of the line: a receiver followed by a failsafe. The station also records
//! the outcome of each frame.

use anyhow::{Error, Result};
use framelock::LineEvent;
use framelock::motion::{Failsafe, FailsafeParameters, Phase, Setpoint};
use framelock_receiving::{AnyLine, Policy, Protocol};

use crate::parameters::Parameters;
use crate::uart::{BIT, BITS_PER_BYTE};

/// The usual parameters of a failsafe, whose clock counts microseconds. The station polls the failsafe every 2 ms and at
/// each commit.
const FAILSAFE: FailsafeParameters<u8, 3> =
    FailsafeParameters::for_clock(1_000_000, 2_000, [0x80; 3]);

/// A kind of station: the policy of its receiver, and whether it has an idle-gap rule.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct StationKind {
    /// The receiver's policy.
    pub policy: Policy,
    /// True if a pause longer than the idle gap drops the current frame.
    pub has_idle_gap: bool,
}

impl StationKind {
    /// Returns all stations that receive the frames. For BIN these are the lecture's machine and then framelock's
    /// receiver. Each receiver comes twice: first without an idle-gap rule, then with such a rule.
    #[must_use]
    pub fn all(protocol: &Protocol) -> Vec<Self> {
        let mut kinds = Vec::new();
        for policy in [Policy::Lecture, Policy::Framelock] {
            if AnyLine::new(protocol, policy).is_ok() {
                kinds.extend([false, true].map(|has_idle_gap| Self {
                    policy,
                    has_idle_gap,
                }));
            }
        }
        kinds
    }
}

/// Converts time steps to microseconds on a line of `baud`.
pub(crate) fn microseconds(time: u64, baud: u32) -> u64 {
    let steps_per_second = u128::from(baud) * u128::from(BIT);
    let microseconds = u128::from(time) * 1_000_000 / steps_per_second;
    u64::try_from(microseconds).unwrap_or(u64::MAX)
}

/// Counts of what happened at one receiver and at the failsafe that follows it.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ReceiverTally {
    /// The kind of the station.
    pub kind: StationKind,
    /// Frames whose setpoint the receiver delivered with the frame's own last byte.
    pub delivered: u64,
    /// Frames that arrived intact and that the receiver did not deliver.
    pub lost_intact: u64,
    /// Deliveries that end with a frame's last byte and consist of that frame's bytes, but have
    /// another setpoint.
    pub wrong_setpoints: u64,
    /// All other deliveries of something that is not a sent frame.
    pub false_frames: u64,
    /// Bytes that belong to no delivered frame.
    pub bytes_discarded: u64,
    /// Trials at whose end the receiver was deaf: it had lost an intact frame since its last delivery of a frame.
    pub deaf: u64,
    /// The longest time without a delivery, in microseconds.
    pub longest_silence: u64,
    /// How often the failsafe took over, because frames stopped coming.
    pub engagements: u64,
}

/// A receiver and its failsafe.
pub(crate) struct Station {
    protocol: Protocol,
    receiver: AnyLine,
    failsafe: Failsafe<u8, 3>,
    /// Whether the output followed the setpoints at the last poll.
    is_following: bool,
    baud: u32,
    /// The longest time between the ends of two consecutive bytes that does not count as a gap.
    /// `idle_from` is the time after which the next byte ends a gap.
    idle_limit: u64,
    idle_from: u64,
    /// The time of the last commit.
    committed: u64,
    /// The number of the frame delivered last.
    delivered: Option<u64>,
    /// Whether the receiver has lost an intact frame since its last delivery.
    is_deaf: bool,
    tally: ReceiverTally,
}

impl Station {
    pub(crate) fn new(
        protocol: &Protocol,
        parameters: &Parameters,
        kind: StationKind,
    ) -> Result<Self> {
        // Receiving the byte that ends the gap takes one byte time.
        let limit = (u64::from(parameters.idle_gap) + 1) * BITS_PER_BYTE * BIT;
        let receiver = AnyLine::new(protocol, kind.policy);
        Ok(Self {
            protocol: protocol.clone(),
            receiver: receiver.map_err(Error::msg)?,
            failsafe: Failsafe::new(FAILSAFE, 0)?,
            is_following: false,
            baud: parameters.baud,
            idle_limit: if kind.has_idle_gap { limit } else { u64::MAX },
            idle_from: u64::MAX,
            committed: 0,
            delivered: None,
            is_deaf: false,
            tally: ReceiverTally {
                kind,
                ..ReceiverTally::default()
            },
        })
    }

    /// Processes a byte. If the byte completes a frame, and every byte of that frame arrived, `ended` is the frame's
    /// number and setpoint.
    pub(crate) fn push(&mut self, at: u64, byte: u8, ended: Option<(u64, Option<Setpoint>)>) {
        // The receiver learns of a gap only when the next byte arrives.
        if at > self.idle_from {
            self.line_event(LineEvent::Idle);
        }
        self.idle_from = at.saturating_add(self.idle_limit);
        let mut committed = None;
        self.receiver.feed(&[byte], |found| {
            committed = found
                .message()
                .and_then(|frame| self.protocol.setpoint(frame));
        });
        let Some(setpoint) = committed else {
            return;
        };
        self.poll(at);
        self.tally.longest_silence = self.longest_silence(at);
        self.committed = at;
        self.failsafe.frame(setpoint);
        self.poll(at);
        // The receiver delivers a frame with its last byte, because all frames have the same length.
        match ended {
            Some((number, sent)) if sent == Some(setpoint) => self.delivered = Some(number),
            Some(_) => self.tally.wrong_setpoints += 1,
            None => self.tally.false_frames += 1,
        }
    }

    /// Reports a line event to the receiver.
    pub(crate) fn line_event(&mut self, event: LineEvent) {
        self.receiver.line_event(event, |_| ());
    }

    /// Returns the failsafe's time, a counter that wraps.
    fn ticks(&self, at: u64) -> u32 {
        let [a, b, c, d, ..] = microseconds(at, self.baud).to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }

    /// Polls the failsafe, and counts an engagement if the output has stopped following the setpoints.
    pub(crate) fn poll(&mut self, at: u64) {
        let phase = self.failsafe.poll(self.ticks(at)).phase;
        let is_following = matches!(phase, Phase::Live | Phase::Approach);
        self.tally.engagements += u64::from(self.is_following && !is_following);
        self.is_following = is_following;
    }

    fn longest_silence(&self, at: u64) -> u64 {
        let silence = microseconds(at - self.committed, self.baud);
        self.tally.longest_silence.max(silence)
    }

    /// Records the outcome of a frame. Call this when no more bytes of the frame can come. Call it for
    /// frames in the order in which they were sent, and for each frame before the next frame ends.
    pub(crate) fn settle(&mut self, number: u64, is_intact: bool) {
        let is_delivered = self.delivered == Some(number);
        let is_missed = is_intact && !is_delivered;
        self.tally.delivered += u64::from(is_delivered);
        self.tally.lost_intact += u64::from(is_missed);
        self.is_deaf = is_missed || self.is_deaf && !is_delivered;
    }

    /// Returns the counts up to the time `at`.
    pub(crate) fn tally(&self, at: u64) -> ReceiverTally {
        ReceiverTally {
            bytes_discarded: self.receiver.counters().discarded.total().into(),
            deaf: self.is_deaf.into(),
            longest_silence: self.longest_silence(at),
            ..self.tally
        }
    }
}
