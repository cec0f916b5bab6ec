//! A station at the end of the line: a receiver, and the outcome of each frame at this receiver.

use anyhow::{Error, Result};
use framelock::LineEvent;
use framelock_receiving::{AnyLine, Policy, Protocol};

use crate::frames::Transmission;
use crate::parameters::Parameters;
use crate::uart::{BIT, BITS_PER_BYTE};

/// The counts of one receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ReceiverTally {
    /// The receiver's policy.
    pub policy: Policy,
    /// True if a pause longer than the idle gap drops the current frame.
    pub has_idle_gap: bool,
    /// Frames whose setpoint the receiver delivered with the frame's own last byte.
    pub delivered: u64,
    /// Frames that arrived intact and that the receiver did not deliver.
    pub lost_intact: u64,
    /// Deliveries that end with a frame's last byte and consist of that frame's bytes, but have
    /// another setpoint.
    pub wrong_setpoints: u64,
    /// All other deliveries: they do not end with a frame's last byte, or do not consist of that frame's bytes.
    pub false_frames: u64,
    /// Trials at whose end the receiver was deaf: it had lost an intact frame since its last delivery of a sent frame.
    pub deaf: u64,
}

impl ReceiverTally {
    /// Returns a tally with all counts at 0 for each receiver of these frames. The receivers of BIN are the lecture's
    /// machine and framelock's receiver. Each receiver comes twice: first without an idle-gap rule, then with such a
    /// rule.
    pub(crate) fn none(protocol: &Protocol) -> Vec<Self> {
        let policies = [Policy::Lecture, Policy::Framelock].into_iter();
        let policies = policies.filter(|&policy| AnyLine::new(protocol, policy).is_ok());
        let tallies = policies.flat_map(|policy| {
            [false, true].map(|has_idle_gap| Self {
                policy,
                has_idle_gap,
                ..Self::default()
            })
        });
        tallies.collect()
    }
}

/// A receiver.
pub(crate) struct Station {
    protocol: Protocol,
    receiver: AnyLine,
    /// The longest time between the ends of two consecutive bytes that does not count as a gap.
    idle_limit: u64,
    /// If the next byte ends after this time, a gap precedes it.
    idle_from: u64,
    /// The bit at which the last delivered frame began.
    delivered: Option<u64>,
    /// Whether the receiver has lost an intact frame since its last delivery of a sent frame.
    is_deaf: bool,
    tally: ReceiverTally,
}

impl Station {
    /// Creates a station that has received nothing yet. `tally` has the counts of earlier trials.
    pub(crate) fn new(
        protocol: &Protocol,
        parameters: &Parameters,
        tally: ReceiverTally,
    ) -> Result<Self> {
        // Receiving the byte that ends the gap takes one byte time.
        let limit = (u64::from(parameters.idle_gap) + 1) * BITS_PER_BYTE * BIT;
        Ok(Self {
            protocol: protocol.clone(),
            receiver: AnyLine::new(protocol, tally.policy).map_err(Error::msg)?,
            idle_limit: if tally.has_idle_gap { limit } else { u64::MAX },
            idle_from: u64::MAX,
            delivered: None,
            is_deaf: false,
            tally,
        })
    }

    /// Processes a byte. If the byte completes a frame, and no byte of that frame was lost, added or reordered, `ended`
    /// is the bit at which the frame began, and the frame's transmission.
    pub(crate) fn push(&mut self, at: u64, byte: u8, ended: Option<&(u64, Transmission)>) {
        // The receiver learns of a gap only when the next byte arrives.
        if at > self.idle_from {
            self.line_event(LineEvent::Idle);
        }
        self.idle_from = at.saturating_add(self.idle_limit);
        let mut delivered = None;
        self.receiver.feed(&[byte], |found| {
            let setpoint = |frame| self.protocol.setpoint(frame);
            delivered = found.message().and_then(setpoint);
        });
        // All frames have the same length, so the receiver delivers each frame as soon as the last byte arrives.
        match (delivered, ended) {
            (None, _) => {}
            (Some(setpoint), Some((begin, sent))) if sent.setpoint == setpoint => {
                self.delivered = Some(*begin);
            }
            (Some(_), Some(_)) => self.tally.wrong_setpoints += 1,
            (Some(_), None) => self.tally.false_frames += 1,
        }
    }

    /// Reports a line event to the receiver.
    pub(crate) fn line_event(&mut self, event: LineEvent) {
        self.receiver.line_event(event, |_| ());
    }

    /// Records the outcome of the frame that began at this bit. Call this when no more bytes of the frame can come.
    /// Call it for frames in the order in which they were sent, and for each frame before the next frame ends.
    pub(crate) fn settle(&mut self, begin: u64, is_intact: bool) {
        let is_delivered = self.delivered == Some(begin);
        let is_missed = is_intact && !is_delivered;
        self.tally.delivered += u64::from(is_delivered);
        self.tally.lost_intact += u64::from(is_missed);
        self.is_deaf = is_missed || self.is_deaf && !is_delivered;
    }

    /// Returns the counts at the end of a trial.
    pub(crate) fn tally(&self) -> ReceiverTally {
        let deaf = self.tally.deaf + u64::from(self.is_deaf);
        ReceiverTally { deaf, ..self.tally }
    }
}
