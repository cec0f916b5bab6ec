//! One trial: a sender, a line, and receivers at its end that all receive the same bytes.

use std::collections::VecDeque;
use std::time::Duration;

use anyhow::{Result, ensure};
use framelock::LineEvent;
use framelock_oracles::{ByteFaults, FaultRates, Purpose, Seed, whole};
use framelock_receiving::Protocol;
use rand::Rng;

use crate::frames::{Transmission, transmissions};
use crate::line::{NoisyLine, check_rate};
use crate::parameters::Parameters;
use crate::station::{ReceiverTally, Station};
use crate::uart::{BITS_PER_BYTE, Heard, TICK};

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

/// Counts from all trials with the same parameters.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Tally {
    /// The counts of the line.
    pub line: LineTally,
    /// The counts of each receiver.
    pub receivers: Vec<ReceiverTally>,
}

/// Runs all trials. The sender sends frames of this protocol.
///
/// # Errors
/// Returns an error if the frames have no setpoints, or if the line cannot carry this number of frames per second.
pub fn run_all(protocol: &Protocol, parameters: &Parameters) -> Result<Tally> {
    ensure!(
        protocol.has_setpoints(),
        "frames of {protocol} have no pitch, roll and yaw: give --frame bin or --frame bin-crc8"
    );
    check_rate(parameters.rate, protocol.longest(), parameters.baud, 1e3)?;
    let mut tally = Tally {
        line: LineTally::default(),
        receivers: ReceiverTally::none(protocol),
    };
    for trial in 0..parameters.trials {
        tally = Trial::new(protocol, parameters, trial.into(), tally)?.run();
    }
    Ok(tally)
}

/// A frame that is being sent or was sent recently.
struct SentFrame {
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

    /// Returns the byte of this frame that is on the line at this bit, and the byte's index in the frame.
    fn byte_at(&self, bit: u64) -> Option<(usize, u8)> {
        let place = usize::try_from(bit.checked_sub(self.begin)? / BITS_PER_BYTE).ok()?;
        Some((place, *self.transmission.bytes.get(place)?))
    }
}

/// The part of a frame that has arrived without a lost or an added byte.
struct Arrived {
    /// The bit at which the frame begins.
    begin: u64,
    bytes: usize,
    /// False if a byte's value has changed, or the UART has reported a line error since the frame began.
    is_good: bool,
}

/// One trial. Time is counted in the sender's bits.
struct Trial {
    protocol: Protocol,
    parameters: Parameters,
    seed: Seed,
    line: NoisyLine,
    faults: ByteFaults,
    stations: Vec<Station>,
    /// The recent frames whose outcome is still open, including the frame being sent.
    frames: VecDeque<SentFrame>,
    /// The frame that is arriving, if its first byte has arrived.
    arrived: Option<Arrived>,
    tally: LineTally,
}

impl Trial {
    /// Creates a trial with this number, in which nothing has been sent yet. `tally` has the counts of earlier trials.
    fn new(
        protocol: &Protocol,
        parameters: &Parameters,
        number: u64,
        tally: Tally,
    ) -> Result<Self> {
        let seed = Seed {
            seed: parameters.seed,
            trial: number,
        };
        let rates = FaultRates {
            drop: parameters.lose,
            flip: 0.0,
        };
        let phase = seed.random(Purpose::Once).random_range(0..TICK);
        let stations = tally.receivers.into_iter();
        let stations = stations.map(|tally| Station::new(protocol, parameters, tally));
        Ok(Self {
            protocol: protocol.clone(),
            parameters: *parameters,
            seed,
            line: NoisyLine::new(parameters, seed, phase),
            faults: ByteFaults::new(rates, seed),
            stations: stations.collect::<Result<_>>()?,
            frames: VecDeque::new(),
            arrived: None,
            tally: tally.line,
        })
    }

    /// Sends the number of frames that the parameters give, and runs until they have arrived completely. Returns the
    /// counts of all trials so far.
    fn run(mut self) -> Tally {
        let (protocol, parameters) = (self.protocol.clone(), self.parameters);
        let bits_per_frame = f64::from(parameters.baud) / parameters.rate;
        let frame_time = Duration::from_secs_f64(1.0 / parameters.rate);
        let frames = transmissions(&protocol, parameters.payload, self.seed, frame_time);
        for (number, transmission) in (0..parameters.frames).zip(frames) {
            self.advance_to(whole(f64::from(number) * bits_per_frame));
            self.send_rest();
            self.frames.push_back(SentFrame {
                transmission,
                begin: self.line.sent,
                is_intact: false,
            });
        }
        self.send_rest();
        self.advance_to(self.line.sent + 3 * BITS_PER_BYTE);
        Tally {
            line: self.tally,
            receivers: self.stations.iter().map(Station::tally).collect(),
        }
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
            match self.next_byte() {
                Some(byte) if now + BITS_PER_BYTE <= bit => {
                    self.line.send(byte);
                    self.tally.bytes_sent += 1;
                }
                None if now < bit => self.line.idle_until(bit),
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
                    if let Some(arrived) = &mut self.arrived {
                        arrived.is_good = false;
                    }
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
        if let Some(byte) = self.faults.carry(byte) {
            self.tally.bytes_delivered += 1;
            let ended = self.arrive(byte, bit);
            let stations = self.stations.iter_mut();
            stations.for_each(|station| station.push(at, byte, ended.as_ref()));
        } else {
            self.tally.bytes_lost += 1;
        }
    }

    /// Records an arriving byte. `bit` is the index of the sender's bit on the line when the UART saw the start bit. If
    /// the byte completes a frame, and no byte of the frame was lost, added or reordered, returns the bit at which the
    /// frame began, and the frame's transmission. Values may differ.
    fn arrive(&mut self, byte: u8, bit: u64) -> Option<(u64, Transmission)> {
        let before = self.arrived.take();
        let mut frames = self.frames.iter_mut();
        let (frame, place, sent) = frames.find_map(|frame| {
            let (place, sent) = frame.byte_at(bit)?;
            Some((frame, place, sent))
        })?;
        let is_good = match before {
            _ if place == 0 => byte == sent,
            Some(it) if (it.begin, it.bytes) == (frame.begin, place) => it.is_good && byte == sent,
            _ => return None,
        };
        self.arrived = Some(Arrived {
            begin: frame.begin,
            bytes: place + 1,
            is_good,
        });
        (place + 1 == frame.transmission.bytes.len()).then(|| {
            frame.is_intact = is_good;
            (frame.begin, frame.transmission.clone())
        })
    }

    /// Records the outcome of each frame that ended at least two byte times ago. No more bytes of these frames can
    /// come.
    fn settle(&mut self) {
        let settled = self.line.sent.saturating_sub(2 * BITS_PER_BYTE);
        let is_settled = |frame: &SentFrame| frame.end() <= settled;
        while self.frames.front().is_some_and(is_settled)
            && let Some(frame) = self.frames.pop_front()
        {
            self.tally.frames_sent += 1;
            self.tally.frames_intact += u64::from(frame.is_intact);
            let stations = self.stations.iter_mut();
            stations.for_each(|station| station.settle(frame.begin, frame.is_intact));
        }
    }
}
