//! One trial: a sender, a line, and four stations at its end that hear the same.

use std::collections::VecDeque;

use framelock::{FailsafeError, LineEvent, Output, Parser, Setpoint};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::line::Line;
use super::noise::Noise;
use super::occurrences::{Occurrences, whole};
use super::parameters::Parameters;
use super::payload::{Frame, Payload, Sender};
use super::station::{Clock, Station};
use super::tally::{LineTally, RECEIVERS, Tally};
use super::truth::{Origin, SentFrame, Truth};
use super::uart::{BITS_PER_BYTE, Heard, TICK};
use crate::setpoints::LEVEL;

/// How often the output of the failsafe is looked at: as often as the firmware's main loop runs.
const ACTUATOR_PERIOD: f64 = 0.002;

/// A look at the outputs.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) microseconds: u64,
    /// The setpoint of the frame sent last.
    pub(super) demand: Setpoint,
    pub(super) outputs: [Output; RECEIVERS],
}

/// Which of its generators a trial takes for what, besides the noise's own, 0 to 3.
mod stream {
    pub(super) const SENDER: u64 = 4;
    pub(super) const LOSSES: u64 = 5;
    pub(super) const DUPLICATES: u64 = 6;
    pub(super) const ONCE: u64 = 7;
    pub(super) const COUNT: u64 = 8;
}

/// Runs the trial with that number; `D` is the receiver that discards, `R` the one that rescans.
/// `watch` is shown what the actuators do.
///
/// # Errors
/// If the failsafe's parameters contradict each other.
pub(super) fn run<D, R>(
    parameters: &Parameters,
    number: u64,
    watch: &mut impl FnMut(Sample),
) -> Result<Tally, FailsafeError>
where
    D: Parser<Message = Setpoint> + Default,
    R: Parser<Message = Setpoint> + Default,
{
    let random = |purpose| {
        let mut random = ChaCha8Rng::seed_from_u64(parameters.seed);
        random.set_stream(number * stream::COUNT + purpose);
        random
    };
    let mut once = random(stream::ONCE);
    let noise = Noise::new(parameters, random);
    let mut trial = Trial {
        line: Line::new(noise, parameters.baud_error, once.random_range(0..TICK)),
        end: FarEnd::<D, R> {
            characters: [None; 2],
            frames: VecDeque::new(),
            truth: Truth::new(R::FRAME_LENGTH),
            losses: Occurrences::new(random(stream::LOSSES), parameters.lose, 1),
            duplicates: Occurrences::new(random(stream::DUPLICATES), parameters.duplicate, 1),
            heard: 0,
            lost: parameters.lose_one_in.map(|frame| Origin {
                frame: frame.into(),
                place: once.random_range(0..R::FRAME_LENGTH),
            }),
            discard: [
                Station::new(parameters, false)?,
                Station::new(parameters, true)?,
            ],
            rescan: [
                Station::new(parameters, false)?,
                Station::new(parameters, true)?,
            ],
            tally: LineTally::default(),
        },
        clock: Clock::new(parameters.baud),
        byte_gap: parameters.byte_gap.into(),
        demand: LEVEL,
        settled: 0,
        next_look: 0,
        looks_every: whole(ACTUATOR_PERIOD * f64::from(parameters.baud)).max(1),
        watch,
    };
    let mut sender = Sender::new(parameters, random(stream::SENDER));
    let bits_per_frame = f64::from(parameters.baud) / parameters.rate;
    let is_noise = parameters.payload == Payload::Noise;
    for number in 0..u64::from(parameters.frames) {
        #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
        let begin = whole(number as f64 * bits_per_frame);
        trial.idle_until(begin);
        trial.send(number, sender.next(), is_noise);
    }
    // Whatever is under way comes to its end.
    trial.idle_until(trial.line.bits_sent() + 3 * BITS_PER_BYTE);
    Ok(trial.end.finish(trial.line.now()))
}

struct Trial<'a, D, R, W> {
    line: Line,
    end: FarEnd<D, R>,
    clock: Clock,
    byte_gap: u64,
    /// The setpoint of the frame sent last, and the bit from which on it should be in force: a byte
    /// behind the frame, since the two clocks differ.
    demand: Setpoint,
    settled: u64,
    /// When the outputs are looked at next, and how often, in bits.
    next_look: u64,
    looks_every: u64,
    watch: &'a mut W,
}

impl<D, R, W> Trial<'_, D, R, W>
where
    D: Parser<Message = Setpoint> + Default,
    R: Parser<Message = Setpoint> + Default,
    W: FnMut(Sample),
{
    fn idle_until(&mut self, bit: u64) {
        loop {
            let look = self.look_due();
            if look > bit {
                break;
            }
            let end = &mut self.end;
            self.line.idle_until(look, &mut |heard| end.hear(heard));
            self.look();
        }
        let end = &mut self.end;
        self.line.idle_until(bit, &mut |heard| end.hear(heard));
    }

    fn send(&mut self, number: u64, frame: Frame, is_noise: bool) {
        if !is_noise {
            self.end.begin_frame(SentFrame {
                number,
                setpoint: frame.setpoint(),
                begin: self.line.now(),
                is_intact: false,
            });
        }
        for (place, &byte) in frame.bytes().iter().enumerate() {
            if place > 0 && self.byte_gap > 0 {
                self.idle_until(self.line.bits_sent() + self.byte_gap);
            }
            let origin = Origin {
                frame: number,
                place,
            };
            self.end.expect(SentCharacter {
                begin: self.line.now(),
                end: self.line.byte_end(),
                origin: (!is_noise).then_some(origin),
                byte,
            });
            let end = &mut self.end;
            self.line.send(byte, &mut |heard| end.hear(heard));
            if self.line.bits_sent() >= self.look_due() && place + 1 < frame.bytes().len() {
                self.look();
            }
        }
        self.demand = frame.setpoint();
        self.settled = self.line.bits_sent() + BITS_PER_BYTE;
    }

    /// The bit before which the outputs are looked at.
    fn look_due(&self) -> u64 {
        self.next_look.max(self.settled)
    }

    fn look(&mut self) {
        let now = self.line.now();
        let sample = Sample {
            microseconds: self.clock.microseconds(now),
            demand: self.demand,
            outputs: self.end.compare(now, self.demand),
        };
        (self.watch)(sample);
        while self.next_look <= self.line.bits_sent() {
            self.next_look += self.looks_every;
        }
    }
}

/// A character on the line.
#[derive(Clone, Copy, Debug)]
struct SentCharacter {
    begin: u64,
    end: u64,
    origin: Option<Origin>,
    byte: u8,
}

/// Behind the UART: what is lost there, who listens, and what really arrived.
struct FarEnd<D, R> {
    /// The two characters sent last.
    characters: [Option<SentCharacter>; 2],
    /// The frames sent last, whose fate is open.
    frames: VecDeque<SentFrame>,
    truth: Truth,
    losses: Occurrences,
    duplicates: Occurrences,
    /// Bytes that the UART has heard.
    heard: u64,
    /// The byte to be lost.
    lost: Option<Origin>,
    discard: [Station<D>; 2],
    rescan: [Station<R>; 2],
    tally: LineTally,
}

impl<D, R> FarEnd<D, R>
where
    D: Parser<Message = Setpoint> + Default,
    R: Parser<Message = Setpoint> + Default,
{
    fn begin_frame(&mut self, frame: SentFrame) {
        self.tally.frames_sent += 1;
        self.frames.push_back(frame);
        // What is heard of a frame is heard before the next but one begins.
        if self.frames.len() > 2 {
            self.settle_first();
        }
    }

    fn settle_first(&mut self) {
        if let Some(frame) = self.frames.pop_front() {
            self.tally.frames_intact += u64::from(frame.is_intact);
            self.discard
                .iter_mut()
                .for_each(|station| station.settle(&frame));
            self.rescan
                .iter_mut()
                .for_each(|station| station.settle(&frame));
        }
    }

    fn expect(&mut self, character: SentCharacter) {
        self.tally.bytes_sent += 1;
        let [_, last] = self.characters;
        self.characters = [last, Some(character)];
    }

    /// The character on the line when a start bit was seen; none if the line was idle.
    fn character_at(&self, start: u64) -> Option<SentCharacter> {
        let is_under_way = |sent: &&SentCharacter| (sent.begin..sent.end).contains(&start);
        self.characters.iter().flatten().find(is_under_way).copied()
    }

    fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Byte { byte, start, at } => self.hear_byte(byte, start, at),
            Heard::FramingError { .. } => {
                self.tally.framing_errors += 1;
                self.line_error(LineEvent::Framing);
            }
            Heard::Break { .. } => {
                self.tally.breaks += 1;
                self.line_error(LineEvent::Break);
            }
        }
    }

    fn line_error(&mut self, event: LineEvent) {
        self.truth.line_error();
        self.discard
            .iter_mut()
            .for_each(|station| station.line_error(event));
        self.rescan
            .iter_mut()
            .for_each(|station| station.line_error(event));
    }

    fn hear_byte(&mut self, byte: u8, start: u64, at: u64) {
        let sent = self.character_at(start);
        let origin = sent.and_then(|sent| sent.origin);
        let is_as_sent = sent.is_some_and(|sent| sent.byte == byte);
        let number = self.heard;
        self.heard += 1;
        let is_the_one = origin.is_some() && self.lost == origin;
        if self.losses.next(number) == number || is_the_one {
            self.tally.bytes_lost += 1;
            return;
        }
        self.deliver(byte, at, origin, is_as_sent);
        if self.duplicates.next(number) == number {
            self.deliver(byte, at, origin, is_as_sent);
        }
    }

    fn deliver(&mut self, byte: u8, at: u64, origin: Option<Origin>, is_as_sent: bool) {
        self.tally.bytes_delivered += 1;
        let ends = self.truth.deliver(origin, is_as_sent);
        let mut aligned = None;
        for frame in &mut self.frames {
            frame.is_intact |= ends.intact == Some(frame.number);
            if ends.aligned == Some(frame.number) {
                aligned = Some(&*frame);
            }
        }
        self.discard
            .iter_mut()
            .for_each(|station| station.push(at, byte, aligned));
        self.rescan
            .iter_mut()
            .for_each(|station| station.push(at, byte, aligned));
    }

    fn compare(&mut self, at: u64, demand: Setpoint) -> [Output; RECEIVERS] {
        let [a, b] = &mut self.discard;
        let [c, d] = &mut self.rescan;
        [
            a.compare(at, demand),
            b.compare(at, demand),
            c.compare(at, demand),
            d.compare(at, demand),
        ]
    }

    fn finish(mut self, at: u64) -> Tally {
        while !self.frames.is_empty() {
            self.settle_first();
        }
        let bytes_lost = self.tally.bytes_lost;
        self.tally.bytes_lost_squares = bytes_lost.pow(2);
        let [a, b] = self.discard.map(|station| station.finish(at, bytes_lost));
        let [c, d] = self.rescan.map(|station| station.finish(at, bytes_lost));
        Tally {
            trials: 1,
            line: self.tally,
            receivers: [a, b, c, d],
        }
    }
}
