//! One trial: a sender, a line, and stations at its end that hear the same.

use std::collections::VecDeque;

use anyhow::Result;
use framelock::LineEvent;
use framelock::motion::{Output, Setpoint};
use rand::Rng;

use crate::byte_faults::{ByteFaults, FaultRates};
use crate::line::Line;
use crate::motion::LEVEL;
use crate::parameters::Parameters;
use crate::payload::{Transmission, frames};
use crate::random::{Purpose, Seed, whole};
use crate::sent_frame::{Origin, SentFrame};
use crate::station::{Fate, Kind, Outcome, Station, microseconds};
use crate::tally::{LineTally, Tally};
use crate::uart::{BITS_PER_BYTE, Heard, TICK};

/// How often the output of the failsafe is looked at: as often as the firmware's main loop runs.
const LOOKS_PER_SECOND: f64 = 500.0;

/// What there is to see of a trial.
#[derive(Clone, Debug)]
pub enum Event {
    /// The UART has heard a byte.
    Byte {
        /// Where it comes from, and what it was when it was sent; none if it is no byte of a frame.
        sent: Option<(Origin, u8)>,
        /// What is delivered of it; none if it is lost.
        received: Option<u8>,
        /// What it made of each station; empty if it is lost.
        outcomes: Vec<Outcome>,
    },
    /// The last byte of a frame has come or was lost, just after the event of that byte.
    Frame {
        /// The frame's number.
        number: u64,
        /// What became of it at each station.
        fates: Vec<Fate>,
    },
    /// The outputs of the failsafes are looked at.
    Look {
        /// Since the beginning.
        microseconds: u64,
        /// The setpoint of the frame sent last.
        demand: Setpoint,
        /// The output of each station.
        outputs: Vec<Output<u8, 3>>,
    },
}

/// Runs the trial with that number to its end. If it `is_watched`, it has all its events.
///
/// # Errors
/// The parameters are out of their ranges or contradict each other.
pub fn run(parameters: &Parameters, number: u64, is_watched: bool) -> Result<Trial> {
    let seed = Seed {
        seed: parameters.seed,
        trial: number,
    };
    let rates = FaultRates {
        drop: parameters.lose,
        duplicate: parameters.duplicate,
        ..FaultRates::default()
    };
    let mut trial = Trial::new(parameters, seed, rates, &Kind::of(parameters.frame))?;
    trial.events = is_watched.then(Vec::new);
    let bits_per_frame = f64::from(parameters.baud) / parameters.rate;
    for (number, frame) in (0..parameters.frames).zip(frames(parameters, seed)) {
        trial.advance_to(whole(f64::from(number) * bits_per_frame));
        trial.send(number.into(), frame);
    }
    trial.send_rest();
    // Whatever is under way comes to its end.
    trial.advance_to(trial.line.sent + 3 * BITS_PER_BYTE);
    Ok(trial)
}

/// A trial that can be stopped at any bit. Time is counted in the sender's bits; what comes of a
/// trial does not depend on where it was stopped.
pub struct Trial {
    /// What has happened, if it is watched. A watcher takes it out and leaves an empty list.
    pub events: Option<Vec<Event>>,
    /// Whether there are faults behind the UART.
    pub is_faulty: bool,
    /// A byte that is lost when it comes.
    pub lost: Option<Origin>,
    baud: u32,
    /// From the beginning of a byte to the next, in bits.
    byte_step: u64,
    line: Line,
    /// The frames sent last, whose fate is open, and the one that is being sent.
    frames: VecDeque<SentFrame>,
    faults: ByteFaults,
    stations: Vec<Station>,
    tally: LineTally,
    /// The setpoint of the frame sent last, and the bit from which on the stations should follow it:
    /// a byte behind the frame, since the two clocks differ.
    demand: Setpoint,
    settled: u64,
    /// When the outputs are looked at next, and how often, in bits.
    next_look: u64,
    looks_every: u64,
}

impl Trial {
    /// Nothing has been sent yet. `rates`: the faults behind the UART.
    ///
    /// # Errors
    /// The parameters are out of their ranges or contradict each other, or a station cannot receive
    /// the frame format.
    pub fn new(
        parameters: &Parameters,
        seed: Seed,
        rates: FaultRates,
        stations: &[Kind],
    ) -> Result<Self> {
        parameters.check()?;
        let mut once = seed.random(Purpose::Once);
        let phase = once.random_range(0..TICK);
        let stations = stations.iter().map(|&kind| Station::new(parameters, kind));
        Ok(Self {
            events: None,
            is_faulty: true,
            lost: parameters.lose_one_in.map(|frame| Origin {
                frame: frame.into(),
                place: once.random_range(0..parameters.frame.length()),
            }),
            baud: parameters.baud,
            byte_step: BITS_PER_BYTE + u64::from(parameters.byte_gap),
            line: Line::new(parameters, seed, phase),
            frames: VecDeque::new(),
            faults: ByteFaults::new(rates, seed),
            stations: stations.collect::<Result<_>>()?,
            tally: LineTally::default(),
            demand: LEVEL,
            settled: 0,
            next_look: 0,
            looks_every: whole(f64::from(parameters.baud) / LOOKS_PER_SECOND).max(1),
        })
    }

    /// The stations at the end of the line, and the output of each now.
    pub fn stations(&self) -> impl Iterator<Item = (&Station, Output<u8, 3>)> {
        let now = self.line.now();
        self.stations
            .iter()
            .map(move |each| (each, each.output(now)))
    }

    /// Begins to send a frame, as soon as the one before has been sent. Numbers rise.
    pub fn send(&mut self, number: u64, transmission: Transmission) {
        self.send_rest();
        self.frames.push_back(SentFrame {
            number,
            transmission,
            begin: self.line.sent,
            ..SentFrame::default()
        });
    }

    /// When the next byte of the current frame begins, if there is one.
    fn next_byte(&self) -> Option<u64> {
        let frame = self.frames.back().filter(|frame| !frame.is_sent())?;
        Some(frame.begin + frame.sent as u64 * self.byte_step)
    }

    /// Sends the current frame to its end.
    fn send_rest(&mut self) {
        while let Some(begin) = self.next_byte() {
            self.advance_to(begin + BITS_PER_BYTE);
        }
    }

    /// Goes on up to that bit: sends the bytes of the current frame that end by then, and is idle
    /// where there is nothing to send.
    pub fn advance_to(&mut self, bit: u64) {
        loop {
            let (now, look) = (self.line.sent, self.next_look.max(self.settled));
            let byte = self.next_byte().unwrap_or(u64::MAX);
            if look <= now {
                self.look();
            } else if byte <= now && byte + BITS_PER_BYTE <= bit {
                self.send_byte();
            } else if now < bit.min(byte) {
                self.line.idle_until(bit.min(byte).min(look));
                self.hear();
            } else {
                return;
            }
        }
    }

    fn send_byte(&mut self) {
        let Some(current) = self.frames.back_mut() else {
            return;
        };
        let byte = current.transmission.bytes.get(current.sent);
        self.line.send(byte.copied().unwrap_or_default());
        self.tally.bytes_sent += 1;
        current.sent += 1;
        if current.is_sent() {
            self.demand = current.transmission.setpoint.unwrap_or(self.demand);
            self.settled = self.line.sent + BITS_PER_BYTE;
        }
        self.hear();
    }

    fn look(&mut self) {
        let (now, demand) = (self.line.now(), self.demand);
        let outputs = self.stations.iter_mut().map(|each| each.look(now, demand));
        let look = Event::Look {
            microseconds: microseconds(now, self.baud),
            demand,
            outputs: outputs.collect(),
        };
        self.see(look);
        while self.next_look <= self.line.sent {
            self.next_look += self.looks_every;
        }
    }

    fn see(&mut self, event: Event) {
        if let Some(events) = &mut self.events {
            events.push(event);
        }
    }

    fn hear(&mut self) {
        while let Some(heard) = self.line.uart.hear() {
            match heard {
                Heard::Byte { byte, start, at } => self.hear_byte(byte, start, at),
                Heard::Error { event, .. } => {
                    self.tally.framing_errors += u64::from(event == LineEvent::Framing);
                    self.tally.breaks += u64::from(event == LineEvent::Break);
                    self.frames.iter_mut().for_each(SentFrame::line_error);
                    let stations = self.stations.iter_mut();
                    stations.for_each(|station| station.line_error(event));
                }
            }
        }
        self.settle();
    }

    fn hear_byte(&mut self, byte: u8, start: u64, at: u64) {
        let bit = self.line.bit_at(start);
        let mut frames = self.frames.iter();
        let sent = frames.find_map(|frame| frame.byte_at(bit, self.byte_step));
        let is_lost = sent.is_some_and(|(origin, _)| self.lost == Some(origin));
        let [inserted, received, again] = match self.is_faulty {
            _ if is_lost => [None; 3],
            true => self.faults.carry(byte),
            false => [None, Some(byte), None],
        };
        if inserted.is_some() {
            self.deliver(at, inserted, None);
        }
        self.deliver(at, received, sent);
        if again.is_some() {
            self.deliver(at, again, sent);
        }
        if let Some((Origin { frame, place }, _)) = sent {
            self.end(frame, place);
        }
    }

    /// That byte of that frame has come or was lost.
    fn end(&mut self, number: u64, place: usize) {
        let is_it = |sent: &&SentFrame| sent.number == number;
        let frame = self.frames.iter().find(is_it);
        if let Some(frame) = frame.filter(|frame| place + 1 == frame.transmission.bytes.len()) {
            let stations = self.stations.iter_mut();
            let fates = stations.map(|station| station.fate(frame)).collect();
            self.see(Event::Frame { number, fates });
        }
    }

    /// Gives the stations what was received of a byte sent; nothing if it was lost.
    fn deliver(&mut self, at: u64, received: Option<u8>, sent: Option<(Origin, u8)>) {
        let mut outcomes = Vec::new();
        if let Some(byte) = received {
            self.tally.bytes_delivered += 1;
            let (origin, original) = sent.unzip();
            let mut ended = None;
            for frame in &mut self.frames {
                if frame.deliver(origin, original == Some(byte)) {
                    ended = Some(&*frame);
                }
            }
            let stations = self.stations.iter_mut();
            outcomes.extend(stations.map(|station| station.push(at, byte, ended)));
        } else {
            self.tally.bytes_lost += 1;
        }
        self.see(Event::Byte {
            sent,
            received,
            outcomes,
        });
    }

    /// Two byte times behind a frame nothing more of it can come.
    fn settle(&mut self) {
        let is_open = self.line.sent < self.settled + BITS_PER_BYTE;
        while !is_open
            && self.frames.front().is_some_and(SentFrame::is_sent)
            && let Some(frame) = self.frames.pop_front()
        {
            if frame.transmission.setpoint.is_some() {
                self.tally.frames_sent += 1;
                self.tally.frames_intact += u64::from(frame.is_intact);
                let began = self.line.instant(frame.begin);
                let stations = self.stations.iter_mut();
                stations.for_each(|station| station.settle(&frame, began));
            }
        }
    }

    /// What has been counted of the frames that have been sent for long enough that nothing more of
    /// them can come: two byte times.
    #[must_use]
    pub fn tally(&self) -> Tally {
        let stations = self.stations.iter();
        let receivers = stations.map(|each| each.tally(self.line.now(), self.tally.bytes_lost));
        Tally {
            trials: 1,
            line: self.tally,
            receivers: receivers.collect(),
        }
    }
}
