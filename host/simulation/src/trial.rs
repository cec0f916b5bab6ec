//! One trial: a sender, a line, and stations at its end that all receive the same bytes.

use std::collections::VecDeque;

use anyhow::{Result, ensure};
use framelock::LineEvent;
use framelock::motion::Setpoint;
use framelock_oracles::{ByteFaults, FaultRates, Purpose, Seed, whole};
use framelock_receiving::Protocol;
use rand::Rng;

use crate::frames::{Transmission, transmissions};
use crate::line::{NoisyLine, check_rate};
use crate::parameters::Parameters;
use crate::station::{ReceiverTally, Station, StationKind};
use crate::uart::{BITS_PER_BYTE, Heard, TICK};

/// How often per second the failsafes are polled: as often as the firmware's main loop runs.
const POLLS_PER_SECOND: u32 = 500;

/// A byte's position among the bytes sent.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Origin {
    /// The frame's number.
    pub frame: u64,
    /// The byte's index in the frame, from 0.
    pub place: usize,
}

/// Counts of events on the line.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct LineTally {
    /// Frames sent completely.
    pub frames_sent: u64,
    /// Frames whose bytes all arrived as they were sent, with nothing between them.
    pub frames_intact: u64,
    /// Bytes sent.
    pub bytes_sent: u64,
    /// Bytes passed to the receivers.
    pub bytes_delivered: u64,
    /// Bytes lost after the UART.
    pub bytes_lost: u64,
    /// Framing errors that the UART reported.
    pub framing_errors: u64,
}

/// Counts from any number of trials with the same parameters.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// The counts of the line.
    pub line: LineTally,
    /// The counts of each receiver.
    pub receivers: Vec<ReceiverTally>,
}

/// Adds the fields of `$more` to those of `$sum`.
macro_rules! add {
    ($sum:expr, $more:expr; $($field:ident)+) => { $($sum.$field += $more.$field;)+ };
}

impl Tally {
    /// Returns the sum of both tallies.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        if self.receivers.is_empty() {
            return other;
        }
        add!(self.line, other.line; frames_sent frames_intact bytes_sent bytes_delivered bytes_lost framing_errors);
        for (sum, more) in self.receivers.iter_mut().zip(other.receivers) {
            add!(sum, more; delivered lost_intact wrong_setpoints false_frames bytes_discarded deaf engagements);
            sum.longest_silence = sum.longest_silence.max(more.longest_silence);
        }
        self
    }
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
    let mut trial = Trial::new(protocol, parameters, number, &StationKind::all(protocol))?;
    trial.send_all();
    Ok(trial.tally())
}

/// A frame that is being sent or was sent recently.
struct SentFrame {
    number: u64,
    transmission: Transmission,
    /// The bit at which the frame begins.
    begin: u64,
    /// Whether the whole frame has arrived as it was sent.
    is_intact: bool,
}

impl SentFrame {
    /// Returns the bit at which the frame ends.
    fn end(&self) -> u64 {
        self.begin + self.transmission.bytes.len() as u64 * BITS_PER_BYTE
    }

    /// Returns the byte of this frame that is on the line at this bit, and the byte's position.
    fn byte_at(&self, bit: u64) -> Option<(Origin, u8)> {
        let (frame, bit) = (self.number, bit.checked_sub(self.begin)?);
        let place = usize::try_from(bit / BITS_PER_BYTE).ok()?;
        let &byte = self.transmission.bytes.get(place)?;
        Some((Origin { frame, place }, byte))
    }
}

/// A received byte.
struct Received {
    origin: Option<Origin>,
    /// False if the byte's value has changed, or the UART has reported a line error since.
    is_good: bool,
}

/// One trial. Time is counted in the sender's bits.
pub struct Trial {
    /// The position of a byte that will be lost on arrival.
    pub lost: Option<Origin>,
    protocol: Protocol,
    parameters: Parameters,
    seed: Seed,
    line: NoisyLine,
    faults: ByteFaults,
    stations: Vec<Station>,
    /// The recent frames whose outcome is still open, including the frame being sent.
    frames: VecDeque<SentFrame>,
    /// The latest received bytes, as many as a frame has.
    received: VecDeque<Received>,
    tally: LineTally,
    /// The bit of the next poll of the failsafes, and the number of bits between polls.
    next_poll: u64,
    poll_every: u64,
}

impl Trial {
    /// Creates trial `number`, in which nothing has been sent yet.
    ///
    /// # Errors
    /// Returns an error if the parameters contradict each other, the frames have no setpoints, or a station cannot
    /// receive the frames.
    pub fn new(
        protocol: &Protocol,
        parameters: &Parameters,
        number: u64,
        stations: &[StationKind],
    ) -> Result<Self> {
        ensure!(
            protocol.has_setpoints(),
            "frames of {protocol} have no pitch, roll and yaw: give --frame bin or --frame bin-crc8"
        );
        check_rate(parameters.rate, protocol.longest(), parameters.baud, 1e3)?;
        let seed = Seed {
            seed: parameters.seed,
            trial: number,
        };
        let rates = FaultRates {
            drop: parameters.lose,
            flip: 0.0,
        };
        let phase = seed.random(Purpose::Once).random_range(0..TICK);
        let stations = stations
            .iter()
            .map(|&kind| Station::new(protocol, parameters, kind));
        Ok(Self {
            lost: None,
            protocol: protocol.clone(),
            parameters: *parameters,
            seed,
            line: NoisyLine::new(parameters, seed, phase),
            faults: ByteFaults::new(rates, seed),
            stations: stations.collect::<Result<_>>()?,
            frames: VecDeque::new(),
            received: VecDeque::new(),
            tally: LineTally::default(),
            next_poll: 0,
            poll_every: u64::from(parameters.baud / POLLS_PER_SECOND).max(1),
        })
    }

    /// Sends the frames of the parameters, and runs until they have arrived completely.
    pub fn send_all(&mut self) {
        let (protocol, parameters) = (self.protocol.clone(), self.parameters);
        let bits_per_frame = f64::from(parameters.baud) / parameters.rate;
        // The motion takes two seconds from one point to the next.
        let slots_per_leg = whole(2.0 * parameters.rate).max(1);
        let frames = transmissions(&protocol, parameters.payload, self.seed, slots_per_leg);
        for (number, frame) in (0..parameters.frames).zip(frames) {
            self.advance_to(whole(f64::from(number) * bits_per_frame));
            self.send(number.into(), frame);
        }
        self.send_rest();
        self.advance_to(self.line.sent + 3 * BITS_PER_BYTE);
    }

    /// Begins to send a frame as soon as the previous one has been sent. Frame numbers must ascend.
    fn send(&mut self, number: u64, transmission: Transmission) {
        self.send_rest();
        self.frames.push_back(SentFrame {
            number,
            transmission,
            begin: self.line.sent,
            is_intact: false,
        });
    }

    /// Returns the next byte of the current frame, if the frame has not been sent completely.
    fn next_byte(&self) -> Option<u8> {
        let (_, byte) = self.frames.back()?.byte_at(self.line.sent)?;
        Some(byte)
    }

    /// Sends the rest of the current frame.
    fn send_rest(&mut self) {
        while self.next_byte().is_some() {
            self.advance_to(self.line.sent + BITS_PER_BYTE);
        }
    }

    /// Advances to this bit. Sends the bytes of the current frame that end at or before this bit, and keeps the line
    /// idle when there is nothing to send.
    fn advance_to(&mut self, bit: u64) {
        loop {
            let now = self.line.sent;
            if self.next_poll <= now {
                let time = self.line.now();
                self.stations.iter_mut().for_each(|each| each.poll(time));
                self.next_poll = (now / self.poll_every + 1) * self.poll_every;
                continue;
            }
            match self.next_byte() {
                Some(byte) if now + BITS_PER_BYTE <= bit => {
                    self.line.send(byte);
                    self.tally.bytes_sent += 1;
                }
                None if now < bit => self.line.idle_until(bit.min(self.next_poll)),
                _ => return,
            }
            self.hear();
        }
    }

    fn hear(&mut self) {
        while let Some(heard) = self.line.uart.hear() {
            match heard {
                Heard::Byte { byte, start, at } => self.hear_byte(byte, start, at),
                Heard::FramingError => {
                    self.tally.framing_errors += 1;
                    self.received.iter_mut().for_each(|it| it.is_good = false);
                    let stations = self.stations.iter_mut();
                    stations.for_each(|station| station.line_event(LineEvent::Framing));
                }
            }
        }
        self.settle();
    }

    /// Passes a byte to the stations, unless a fault after the UART loses the byte.
    fn hear_byte(&mut self, byte: u8, start: u64, at: u64) {
        let bit = self.line.bit_at(start);
        // Bytes of noise have no positions.
        let is_frame = |frame: &&SentFrame| frame.transmission.setpoint.is_some();
        let mut frames = self.frames.iter().filter(is_frame);
        let sent = frames.find_map(|frame| frame.byte_at(bit));
        let received = match sent {
            Some((origin, _)) if self.lost == Some(origin) => None,
            _ => self.faults.carry(byte),
        };
        if let Some(byte) = received {
            self.tally.bytes_delivered += 1;
            let ended = self.arrive(byte, sent);
            let stations = self.stations.iter_mut();
            stations.for_each(|station| station.push(at, byte, ended));
        } else {
            self.tally.bytes_lost += 1;
        }
    }

    /// Records a received byte. If the byte completes a frame and no byte of the frame was lost, added or reordered,
    /// returns the frame's number and setpoint. Values may differ.
    fn arrive(&mut self, byte: u8, sent: Option<(Origin, u8)>) -> Option<(u64, Option<Setpoint>)> {
        let (origin, original) = sent.unzip();
        self.received.push_back(Received {
            origin,
            is_good: original == Some(byte),
        });
        let length = self.protocol.longest();
        if self.received.len() > length {
            self.received.pop_front();
        }
        let frame = origin?.frame;
        let whole = (0..length).map(|place| Some(Origin { frame, place }));
        if !self.received.iter().map(|it| it.origin).eq(whole) {
            return None;
        }
        let frame = self.frames.iter_mut().find(|sent| sent.number == frame)?;
        frame.is_intact = self.received.iter().all(|it| it.is_good);
        Some((frame.number, frame.transmission.setpoint))
    }

    /// Records the outcome of each frame of which no more bytes can come. This is certain two byte
    /// times after the frame's end.
    fn settle(&mut self) {
        let settled = self.line.sent.saturating_sub(2 * BITS_PER_BYTE);
        let is_settled = |frame: &SentFrame| frame.end() <= settled;
        while self.frames.front().is_some_and(is_settled)
            && let Some(frame) = self.frames.pop_front()
        {
            let (number, is_intact) = (frame.number, frame.is_intact);
            if frame.transmission.setpoint.is_some() {
                self.tally.frames_sent += 1;
                self.tally.frames_intact += u64::from(is_intact);
                let stations = self.stations.iter_mut();
                stations.for_each(|station| station.settle(number, is_intact));
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
            line: self.tally,
            receivers: receivers.collect(),
        }
    }
}
