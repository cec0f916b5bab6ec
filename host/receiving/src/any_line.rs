//! A line with a receiver that is chosen at run time.

use std::fmt;

use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{
    BufferedReceiver, Counters, Encode, Format as _, Found, Frame, Line, LineEvent, PacketReceiver,
    Receiver,
};
use framelock_description::Layouts;
use thiserror::Error;

use crate::protocol::{FrameFormat, Protocol};

/// The choice of the receiver. The receivers differ in what they do with the bytes of a broken frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
pub enum Policy {
    /// The lecture's machine, which discards the bytes of a broken frame; bin only
    Lecture,
    /// framelock's receiver, which searches the bytes of a broken frame for the next frame
    #[default]
    Framelock,
}

impl fmt::Display for Policy {
    /// Writes the name of the machine: `lecture` or `framelock`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Lecture => "lecture",
            Self::Framelock => "framelock",
        })
    }
}

/// A choice of frames and receiver that is not possible.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum LineError {
    /// The lecture's machine receives only BIN.
    #[error(
        "--policy lecture is the lecture's machine, which knows --frame bin and no other: leave one of the two out"
    )]
    LectureReceivesBin,
    /// The frames have no bytes.
    #[error("--frame {0} describes frames of 0 bytes: describe frames of at least one byte")]
    NoBytes(String),
}

/// A line with a receiver that is chosen at run time.
#[derive(Clone, Debug)]
pub enum AnyLine {
    /// The lecture's machine.
    Lecture(Line<Lecture>),
    /// The receiver of BIN.
    Bin(Line<Receiver<Bin>>),
    /// The receiver of BIN-CRC8.
    BinCrc8(Line<Receiver<BinCrc8>>),
    /// The receiver of the frames of a description.
    Described(Line<BufferedReceiver<Layouts, Vec<u8>>>),
    /// The receiver of the packets of a description.
    Packets(Line<PacketReceiver<Layouts, Vec<u8>>>),
}

/// Evaluates an expression with the line inside any variant.
macro_rules! for_any {
    ($any:expr, $line:ident => $does:expr) => {
        match $any {
            AnyLine::Lecture($line) => $does,
            AnyLine::Bin($line) => $does,
            AnyLine::BinCrc8($line) => $does,
            AnyLine::Described($line) => $does,
            AnyLine::Packets($line) => $does,
        }
    };
}

impl AnyLine {
    /// Creates the receiver for these frames and this policy.
    ///
    /// # Errors
    /// Returns an error if the lecture's machine is chosen and does not receive these frames, or if these frames have
    /// no bytes.
    pub fn new(protocol: &Protocol, policy: Policy) -> Result<Self, LineError> {
        match (policy, protocol.setpoints) {
            (Policy::Lecture, Some(FrameFormat::Bin)) => Ok(Self::Lecture(Line::default())),
            (Policy::Lecture, _) => Err(LineError::LectureReceivesBin),
            (Policy::Framelock, Some(FrameFormat::Bin)) => Ok(Self::Bin(Line::default())),
            (Policy::Framelock, Some(FrameFormat::BinCrc8)) => Ok(Self::BinCrc8(Line::default())),
            (Policy::Framelock, None) => {
                let format = protocol.description.format();
                let buffer = vec![0; 2 * format.longest()];
                let line = if format.packets().is_some() {
                    let receiver = PacketReceiver::with_buffer(format.clone(), buffer);
                    receiver.map(|receiver| Self::Packets(Line::new(receiver)))
                } else {
                    let receiver = BufferedReceiver::with_buffer(format.clone(), buffer);
                    receiver.map(|receiver| Self::Described(Line::new(receiver)))
                };
                line.ok_or_else(|| LineError::NoBytes(protocol.name.clone()))
            }
        }
    }

    /// Takes bytes. Calls `found` with the outcome of each byte that is no longer pending, in the order of the stream.
    /// The message of a frame is the frame's bytes without the delimiters and the stuffing of a packet. The reserved
    /// byte of a frame of setpoints is reported as 0.
    pub fn feed(&mut self, bytes: &[u8], found: impl FnMut(Found<&[u8]>)) {
        match self {
            Self::Lecture(line) => line.feed(bytes, encoded(Bin::encode, found)),
            Self::Bin(line) => line.feed(bytes, encoded(Bin::encode, found)),
            Self::BinCrc8(line) => line.feed(bytes, encoded(BinCrc8::encode, found)),
            Self::Described(line) => line.feed(bytes, frame_alone(found)),
            Self::Packets(line) => line.feed(bytes, frame_alone(found)),
        }
    }

    /// Takes a line event. Calls `found` with the outcome of each byte that is no longer pending. Afterwards no byte is
    /// pending, except a packet's delimiter: with most ways of stuffing, a pause directly after it changes nothing.
    pub fn line_event(&mut self, event: LineEvent, found: impl FnMut(Found<&[u8]>)) {
        match self {
            Self::Lecture(line) => line.line_event(event, encoded(Bin::encode, found)),
            Self::Bin(line) => line.line_event(event, encoded(Bin::encode, found)),
            Self::BinCrc8(line) => line.line_event(event, encoded(BinCrc8::encode, found)),
            Self::Described(line) => line.line_event(event, frame_alone(found)),
            Self::Packets(line) => line.line_event(event, frame_alone(found)),
        }
    }

    /// Returns the line's counters.
    #[must_use]
    pub fn counters(&self) -> &Counters {
        for_any!(self, line => line.counters())
    }

    /// Returns the number of pending bytes, which may still become part of a frame.
    #[must_use]
    pub fn pending(&self) -> usize {
        for_any!(self, line => line.pending())
    }

    /// Returns the lecture's machine, or `None` if this line has framelock's receiver.
    #[must_use]
    pub fn lecture(&self) -> Option<&Lecture> {
        match self {
            Self::Lecture(line) => Some(line.parser()),
            _ => None,
        }
    }
}

/// Converts each frame to its bytes, for `found`.
fn frame_alone(mut found: impl FnMut(Found<&[u8]>)) -> impl FnMut(Found<Frame<'_, Layouts>>) {
    move |one| found(one.map(|frame| frame.bytes()))
}

/// Converts each setpoint to its frame, for `found`.
fn encoded<const N: usize>(
    encode: impl Fn(Setpoint) -> [u8; N],
    mut found: impl FnMut(Found<&[u8]>),
) -> impl FnMut(Found<Setpoint>) {
    move |one| {
        let mut frame = None;
        found(one.map(|setpoint| frame.insert(encode(setpoint)).as_slice()));
    }
}
