//! One trial: a sender, a line, and stations at its end that all receive the same bytes.

use std::collections::VecDeque;

use anyhow::{Result, ensure};
use framelock::LineEvent;
use framelock::motion::Output;
use framelock_receiving::Protocol;
use rand::Rng;

use crate::byte_faults::{ByteFaults, FaultRates};
use crate::frames::{Transmission, transmissions};
use crate::line::{NoisyLine, check_rate};
use crate::parameters::Parameters;
use crate::random::{Purpose, Seed, whole};
use crate::sent_frame::{Origin, SentFrame};
use crate::station::{Fate, Outcome, Station, StationKind};
use crate::tally::{LineTally, Tally};
use crate::uart::{BITS_PER_BYTE, Heard, TICK};

/// How often per second the failsafes are polled: as often as the firmware's main loop runs.
const POLLS_PER_SECOND: u32 = 500;

/// An event of a trial.
#[derive(Clone, Debug)]
pub enum Event {
    /// The UART received a byte.
    Byte {
        /// The byte's position and its value when it was sent; `None` if it is not a byte of a
        /// frame.
        sent: Option<(Origin, u8)>,
        /// The byte that the stations received; `None` if the byte was lost.
        received: Option<u8>,
        /// The byte's effect on each station; empty if the byte was lost.
        outcomes: Vec<Outcome>,
    },
    /// The last byte of a frame arrived or was lost. This event follows the event of that byte.
    Frame {
        /// The frame's number.
        number: u64,
        /// The frame's outcome at each station.
        fates: Vec<Fate>,
    },
}

/// Runs all trials of a sender of these frames.
///
/// # Errors
/// Returns an error if the parameters contradict each other, or the frames have no setpoints.
pub fn run_all(protocol: &Protocol, parameters: &Parameters) -> Result<Tally> {
    (0..parameters.trials).try_fold(Tally::default(), |sum, number| {
        Ok(sum.and(run(protocol, parameters, number.into())?))
    })
}

/// Runs trial `number` to its end.
///
/// # Errors
/// Returns an error if the parameters contradict each other, or the frames have no setpoints.
pub fn run(protocol: &Protocol, parameters: &Parameters, number: u64) -> Result<Tally> {
    let seed = Seed {
        seed: parameters.seed,
        trial: number,
    };
    let rates = FaultRates {
        drop: parameters.lose,
        flip: 0.0,
    };
    let mut trial = Trial::new(
        protocol,
        parameters,
        seed,
        rates,
        &StationKind::all(protocol),
    )?;
    trial.send_all(protocol, parameters, seed);
    Ok(trial.tally())
}

/// A trial that can be stopped at any bit. Time is counted in the sender's bits. The results do not
/// depend on where the trial was stopped.
pub struct Trial {
    /// The events so far, if the trial is watched. The watcher takes them and leaves an empty list.
    pub events: Option<Vec<Event>>,
    /// True if bytes suffer faults after the UART.
    pub is_faulty: bool,
    /// The position of a byte that will be lost on arrival.
    pub lost: Option<Origin>,
    line: NoisyLine,
    /// The recent frames whose outcome is still open, including the frame being sent.
    frames: VecDeque<SentFrame>,
    faults: ByteFaults,
    stations: Vec<Station>,
    tally: LineTally,
    /// The bit at which the last frame ended.
    ended: u64,
    /// The bit of the next poll of the failsafes, and the number of bits between polls.
    next_poll: u64,
    poll_every: u64,
}

impl Trial {
    /// Creates a trial in which nothing has been sent yet. `rates` are the rates of the faults
    /// after the UART.
    ///
    /// # Errors
    /// Returns an error if the parameters contradict each other, the frames have no setpoints, or a station cannot
    /// receive the frames.
    pub fn new(
        protocol: &Protocol,
        parameters: &Parameters,
        seed: Seed,
        rates: FaultRates,
        stations: &[StationKind],
    ) -> Result<Self> {
        ensure!(
            protocol.has_setpoints(),
            "frames of {protocol} have no pitch, roll and yaw: give --frame bin or --frame bin-crc8"
        );
        check_rate(parameters.rate, protocol.longest(), parameters.baud, 1e3)?;
        let phase = seed.random(Purpose::Once).random_range(0..TICK);
        let stations = stations
            .iter()
            .map(|&kind| Station::new(protocol, parameters, kind));
        Ok(Self {
            events: None,
            is_faulty: true,
            lost: None,
            line: NoisyLine::new(parameters, seed, phase),
            frames: VecDeque::new(),
            faults: ByteFaults::new(rates, seed),
            stations: stations.collect::<Result<_>>()?,
            tally: LineTally::default(),
            ended: 0,
            next_poll: 0,
            poll_every: u64::from(parameters.baud / POLLS_PER_SECOND).max(1),
        })
    }

    /// Sends the frames of the parameters, and runs until they have arrived completely.
    pub fn send_all(&mut self, protocol: &Protocol, parameters: &Parameters, seed: Seed) {
        let bits_per_frame = f64::from(parameters.baud) / parameters.rate;
        // The motion takes two seconds from one point to the next.
        let slots_per_leg = whole(2.0 * parameters.rate).max(1);
        let frames = transmissions(protocol, parameters.payload, seed, slots_per_leg);
        for (number, frame) in (0..parameters.frames).zip(frames) {
            self.advance_to(whole(f64::from(number) * bits_per_frame));
            self.send(number.into(), frame);
        }
        self.send_rest();
        self.advance_to(self.line.sent + 3 * BITS_PER_BYTE);
    }

    /// Returns the stations at the end of the line, each with its current output.
    pub fn stations(&self) -> impl Iterator<Item = (&Station, Output<u8, 3>)> {
        let now = self.line.now();
        self.stations
            .iter()
            .map(move |each| (each, each.output(now)))
    }

    /// Begins to send a frame as soon as the previous one has been sent. Frame numbers must ascend.
    pub fn send(&mut self, number: u64, transmission: Transmission) {
        self.send_rest();
        self.frames.push_back(SentFrame {
            number,
            transmission,
            begin: self.line.sent,
            ..SentFrame::default()
        });
    }

    /// Returns the bit at which the next byte of the current frame begins, if there is one.
    fn next_byte(&self) -> Option<u64> {
        let frame = self.frames.back().filter(|frame| !frame.is_sent())?;
        Some(frame.begin + frame.sent as u64 * BITS_PER_BYTE)
    }

    /// Sends the rest of the current frame.
    fn send_rest(&mut self) {
        while let Some(begin) = self.next_byte() {
            self.advance_to(begin + BITS_PER_BYTE);
        }
    }

    /// Advances to this bit. Sends the bytes of the current frame that end at or before this bit, and keeps the line
    /// idle when there is nothing to send.
    pub fn advance_to(&mut self, bit: u64) {
        loop {
            let now = self.line.sent;
            let byte = self.next_byte().unwrap_or(u64::MAX);
            if self.next_poll <= now {
                self.poll();
            } else if byte <= now && byte + BITS_PER_BYTE <= bit {
                self.send_byte();
            } else if now < bit.min(byte) {
                self.line.idle_until(bit.min(byte).min(self.next_poll));
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
        self.line.send(current.transmission.bytes[current.sent]);
        self.tally.bytes_sent += 1;
        current.sent += 1;
        if current.is_sent() {
            self.ended = self.line.sent;
        }
        self.hear();
    }

    fn poll(&mut self) {
        let now = self.line.now();
        self.stations.iter_mut().for_each(|each| each.poll(now));
        while self.next_poll <= self.line.sent {
            self.next_poll += self.poll_every;
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
                Heard::FramingError => {
                    self.tally.framing_errors += 1;
                    self.frames.iter_mut().for_each(SentFrame::line_error);
                    let stations = self.stations.iter_mut();
                    stations.for_each(|station| station.line_event(LineEvent::Framing));
                }
            }
        }
        self.settle();
    }

    fn hear_byte(&mut self, byte: u8, start: u64, at: u64) {
        let bit = self.line.bit_at(start);
        let mut frames = self.frames.iter();
        let sent = frames.find_map(|frame| frame.byte_at(bit));
        let is_lost = sent.is_some_and(|(origin, _)| self.lost == Some(origin));
        let received = match self.is_faulty {
            _ if is_lost => None,
            true => self.faults.carry(byte),
            false => Some(byte),
        };
        self.deliver(at, received, sent);
        if let Some((Origin { frame, place }, _)) = sent {
            self.end(frame, place);
        }
    }

    /// Handles the arrival or the loss of byte `place` of frame `number`. If the byte is the frame's last one,
    /// reports the frame's outcome at each station.
    fn end(&mut self, number: u64, place: usize) {
        let frame = self.frames.iter().find(|sent| sent.number == number);
        if let Some(frame) = frame.filter(|frame| place + 1 == frame.transmission.bytes.len()) {
            let stations = self.stations.iter_mut();
            let fates = stations.map(|station| station.fate(frame)).collect();
            self.see(Event::Frame { number, fates });
        }
    }

    /// Passes a received byte to the stations, or records that it was lost if `received` is `None`.
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

    /// Records the outcome of each frame of which no more bytes can come. This is certain two byte
    /// times after the frame's end.
    fn settle(&mut self) {
        let is_open = self.line.sent < self.ended + 2 * BITS_PER_BYTE;
        while !is_open
            && self.frames.front().is_some_and(SentFrame::is_sent)
            && let Some(frame) = self.frames.pop_front()
        {
            if frame.transmission.setpoint.is_some() {
                self.tally.frames_sent += 1;
                self.tally.frames_intact += u64::from(frame.is_intact);
                let stations = self.stations.iter_mut();
                stations.for_each(|station| station.settle(&frame));
            }
        }
    }

    /// Returns the counts. They include only frames of which no more bytes can come. This is certain
    /// two byte times after a frame's end.
    #[must_use]
    pub fn tally(&self) -> Tally {
        let stations = self.stations.iter();
        let receivers = stations.map(|each| each.tally(self.line.now()));
        Tally {
            trials: 1,
            line: self.tally,
            receivers: receivers.collect(),
        }
    }
}
