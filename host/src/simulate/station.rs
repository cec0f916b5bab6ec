//! A receiver at the end of the line, the failsafe behind it, and what becomes of each frame.
//!
//! The demonstration has stations too. Theirs only need the place at which a frame ends; these tell
//! a corrupted frame from one that nobody sent, and intact frames from broken ones.

use std::num::NonZeroU32;

use framelock::{
    Accounting, Failsafe, FailsafeError, FailsafeParameters, LineEvent, Output, Parser, Phase,
    Setpoint,
};

use super::parameters::Parameters;
use super::tally::ReceiverTally;
use super::truth::SentFrame;
use super::uart::{BIT, BITS_PER_BYTE};
use crate::setpoints::LEVEL;

/// From time steps to microseconds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    steps_per_second: u128,
}

impl Clock {
    pub(super) fn new(baud: u32) -> Self {
        Self {
            steps_per_second: u128::from(baud) * u128::from(BIT),
        }
    }

    pub(super) fn microseconds(self, time: u64) -> u64 {
        let microseconds = u128::from(time) * 1_000_000 / self.steps_per_second;
        u64::try_from(microseconds).unwrap_or(u64::MAX)
    }

    /// As the failsafe is told it: a counter that wraps.
    fn ticks(self, time: u64) -> u32 {
        let [a, b, c, d, ..] = self.microseconds(time).to_le_bytes();
        u32::from_le_bytes([a, b, c, d])
    }
}

/// The failsafe's parameters, in ticks of a microsecond.
fn failsafe_parameters(parameters: &Parameters) -> FailsafeParameters {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 1 to 10^9"
    )]
    let ticks = |milliseconds: f64| (milliseconds * 1000.0).round() as u32;
    let per_unit = ticks(parameters.full_travel / f64::from(u8::MAX));
    FailsafeParameters {
        hold_after: ticks(parameters.hold_after),
        ramp_after: ticks(parameters.ramp_after),
        park: LEVEL,
        ticks_per_unit: [NonZeroU32::new(per_unit).unwrap_or(NonZeroU32::MIN); 3],
    }
}

/// Frames whose fate may still be open: the last ones. A power of two.
const OPEN_FRAMES: usize = 4;

/// A receiver and its failsafe.
#[derive(Debug)]
pub(super) struct Station<P> {
    line: Accounting<P>,
    failsafe: Failsafe,
    clock: Clock,
    /// How long after a byte the next one may end at the latest.
    idle_limit: Option<u64>,
    hears_errors: bool,
    last_byte: Option<u64>,
    committed: u64,
    /// When a frame was delivered, with its number, in the place of its number.
    delivered: [Option<(u64, u64)>; OPEN_FRAMES],
    outage: Option<Outage>,
    is_following: bool,
    tally: ReceiverTally,
}

/// A frame was not delivered, and none has been since.
#[derive(Debug, Default)]
struct Outage {
    /// Intact frames lost in it, and when the first of them began.
    frames: u64,
    since: Option<u64>,
}

impl<P: Parser<Message = Setpoint> + Default> Station<P> {
    pub(super) fn new(parameters: &Parameters, has_idle_gap: bool) -> Result<Self, FailsafeError> {
        // The byte that ends the gap takes one byte time to come in.
        let limit = (u64::from(parameters.idle_gap) + 1) * BITS_PER_BYTE * BIT;
        Ok(Self {
            line: Accounting::new(P::default()),
            failsafe: Failsafe::new(failsafe_parameters(parameters), 0)?,
            clock: Clock::new(parameters.baud),
            idle_limit: has_idle_gap.then_some(limit),
            hears_errors: !parameters.unreported,
            last_byte: None,
            committed: 0,
            delivered: [None; OPEN_FRAMES],
            outage: None,
            is_following: false,
            tally: ReceiverTally::default(),
        })
    }

    /// Takes a byte. If it ends a frame of which every byte came: that frame.
    pub(super) fn push(&mut self, at: u64, byte: u8, aligned: Option<&SentFrame>) {
        // Nobody sees the gap before the byte that ends it.
        if let (Some(limit), Some(last)) = (self.idle_limit, self.last_byte)
            && at > last + limit
        {
            self.line.line_event(LineEvent::Idle);
        }
        self.last_byte = Some(at);
        let Some(setpoint) = self.line.push(byte) else {
            return;
        };
        match aligned {
            None => self.tally.false_frames += 1,
            Some(frame) if frame.setpoint != setpoint => self.tally.wrong_setpoints += 1,
            Some(frame) => {
                if let Some(place) = self.place(frame.number) {
                    *place = Some((frame.number, at));
                }
            }
        }
        self.poll(at);
        self.end_silence(at);
        self.failsafe.frame(self.clock.ticks(at), setpoint);
        self.poll(at);
    }

    fn place(&mut self, number: u64) -> Option<&mut Option<(u64, u64)>> {
        let [lowest, ..] = number.to_le_bytes();
        self.delivered.get_mut(usize::from(lowest) % OPEN_FRAMES)
    }

    /// The UART reports an error.
    pub(super) fn line_error(&mut self, event: LineEvent) {
        if self.hears_errors {
            self.line.line_event(event);
        }
    }

    /// What the actuators are to do now.
    pub(super) fn poll(&mut self, at: u64) -> Output {
        let output = self.failsafe.poll(self.clock.ticks(at));
        let is_following = matches!(output.phase, Phase::Live | Phase::Approach);
        self.tally.engagements += u64::from(self.is_following && !is_following);
        self.is_following = is_following;
        output
    }

    /// The output now against `demand`.
    pub(super) fn compare(&mut self, at: u64, demand: Setpoint) -> Output {
        let output = self.poll(at);
        let error = &mut self.tally.error;
        let axes = <[u8; 3]>::from(output.setpoint)
            .into_iter()
            .zip(<[u8; 3]>::from(demand));
        for (put_out, demanded) in axes {
            let difference = put_out.abs_diff(demanded);
            error.largest = error.largest.max(difference);
            error.squares += u64::from(difference).pow(2);
        }
        error.samples += 1;
        output
    }

    fn end_silence(&mut self, at: u64) {
        let silence = self.clock.microseconds(at - self.committed);
        self.tally.longest_silence = self.tally.longest_silence.max(silence);
        self.committed = at;
    }

    /// The fate of the frame is settled. Frames come in their order.
    pub(super) fn settle(&mut self, frame: &SentFrame) {
        let delivered = self.place(frame.number).and_then(Option::take);
        let delivered = delivered.filter(|(number, _)| *number == frame.number);
        if let Some((_, at)) = delivered {
            self.tally.delivered += 1;
            if let Some(outage) = self.outage.take() {
                // A frame that is delivered though it is not intact proves nothing.
                let first_intact = frame.is_intact.then_some(frame.begin);
                if let Some(since) = outage.since.or(first_intact) {
                    let time = self.clock.microseconds(at - since);
                    self.tally.resynchronisation.record(outage.frames, time);
                }
            }
            return;
        }
        let outage = self.outage.get_or_insert_default();
        if frame.is_intact {
            self.tally.lost_intact += 1;
            outage.frames += 1;
            outage.since.get_or_insert(frame.begin);
        }
    }

    /// The trial is over. `bytes_lost`: how many the line has lost in it.
    pub(super) fn finish(mut self, at: u64, bytes_lost: u64) -> ReceiverTally {
        self.poll(at);
        self.end_silence(at);
        let is_out = self.outage.is_some_and(|outage| outage.since.is_some());
        self.tally.resynchronisation.never += u64::from(is_out);
        self.tally.bytes_discarded = self.line.counters().discarded.total();
        self.tally.lost_intact_squares = self.tally.lost_intact.pow(2);
        self.tally.lost_products = self.tally.lost_intact * bytes_lost;
        self.tally
    }
}
