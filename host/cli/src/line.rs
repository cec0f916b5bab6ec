//! A line that frames are received from: whichever frames, and whichever machine receives them.

use anyhow::{Result, bail};
use framelock::can_go_deaf::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{
    BufferedIn, Counters, DiscardReason, Encode, Format as _, Found, Line, LineEvent, Receiver,
};
use framelock_formats::AnyOf;
use framelock_simulation::FrameFormat;

use crate::frame::Frame;
use crate::names::PolicyName;

/// A line with any of the machines at its end.
#[derive(Clone)]
pub(crate) enum AnyLine {
    Bin(Line<Receiver<Bin>>),
    BinCrc8(Line<Receiver<BinCrc8>>),
    Lecture(Line<Lecture>),
    Buffered(Line<BufferedIn<AnyOf<'static>, Vec<u8>>>),
}

macro_rules! for_any {
    ($any:expr, $line:ident => $does:expr) => {
        match $any {
            AnyLine::Bin($line) => $does,
            AnyLine::BinCrc8($line) => $does,
            AnyLine::Lecture($line) => $does,
            AnyLine::Buffered($line) => $does,
        }
    };
}

impl AnyLine {
    /// The machine for these frames under this policy. Nothing has been received yet.
    pub(crate) fn new(frame: &Frame, policy: PolicyName) -> Result<Self> {
        Ok(match (policy, frame.setpoints) {
            (PolicyName::Rescan, Some(FrameFormat::Bin)) => Self::Bin(Line::default()),
            (PolicyName::Rescan, Some(FrameFormat::BinCrc8)) => Self::BinCrc8(Line::default()),
            (PolicyName::Rescan, None) => {
                let format = frame.description.format();
                match BufferedIn::within(format, vec![0; 2 * format.longest()]) {
                    Some(receiver) => Self::Buffered(Line::new(receiver)),
                    None => bail!("--frame {frame}: its frames have no bytes"),
                }
            }
            (PolicyName::Discard, Some(FrameFormat::Bin)) => Self::Lecture(Line::default()),
            (PolicyName::Discard, _) => bail!(
                "--policy discard is the lecture's machine, which knows --frame bin and no other: \
                 leave one of the two out"
            ),
        })
    }

    /// Takes bytes; says what becomes of them, in the order of the stream. A message is the frame's
    /// bytes; of setpoints all but the reserved one.
    pub(crate) fn feed(&mut self, bytes: &[u8], found: impl FnMut(Found<&[u8]>)) {
        match self {
            Self::Bin(line) => line.feed(bytes, encoded(Bin::encode, found)),
            Self::BinCrc8(line) => line.feed(bytes, encoded(BinCrc8::encode, found)),
            Self::Lecture(line) => line.feed(bytes, encoded(Bin::encode, found)),
            Self::Buffered(line) => line.feed(bytes, frame_alone(found)),
        }
    }

    /// No more bytes will come for what is pending; says what becomes of it.
    pub(crate) fn line_event(&mut self, event: LineEvent, found: impl FnMut(Found<&[u8]>)) {
        match self {
            Self::Bin(line) => line.line_event(event, encoded(Bin::encode, found)),
            Self::BinCrc8(line) => line.line_event(event, encoded(BinCrc8::encode, found)),
            Self::Lecture(line) => line.line_event(event, encoded(Bin::encode, found)),
            Self::Buffered(line) => line.line_event(event, frame_alone(found)),
        }
    }

    pub(crate) fn counters(&self) -> &Counters {
        for_any!(self, line => line.counters())
    }

    pub(crate) fn pending(&self) -> usize {
        for_any!(self, line => line.pending())
    }
}

/// Gives `found` each frame without its kind.
fn frame_alone(mut found: impl FnMut(Found<&[u8]>)) -> impl FnMut(Found<(usize, &[u8])>) {
    move |one| found(one.map(|(_, frame)| frame))
}

/// Gives `found` each setpoint as the frame that means it.
fn encoded<const N: usize>(
    encode: impl Fn(Setpoint) -> [u8; N],
    mut found: impl FnMut(Found<&[u8]>),
) -> impl FnMut(Found<Setpoint>) {
    move |one| {
        let mut frame = None;
        found(one.map(|setpoint| frame.insert(encode(setpoint)).as_slice()));
    }
}

/// A line byte by byte: it knows which bytes are pending, and what has become of the others.
#[derive(Clone)]
pub(crate) struct Watched {
    /// Has received nothing.
    fresh: AnyLine,
    line: AnyLine,
    pending: Vec<u8>,
}

/// What has become of bytes: a frame, or why they are in none.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Piece {
    pub(crate) bytes: Vec<u8>,
    pub(crate) discarded: Option<DiscardReason>,
}

impl Watched {
    pub(crate) fn new(line: AnyLine) -> Self {
        Self {
            fresh: line.clone(),
            line,
            pending: Vec::new(),
        }
    }

    /// Takes a byte; says what has become of bytes, oldest first.
    pub(crate) fn push(&mut self, byte: u8) -> Vec<Piece> {
        self.pending.push(byte);
        let mut pieces = Vec::new();
        self.line.feed(&[byte], |found| {
            pieces.push(piece(&mut self.pending, &found));
        });
        pieces
    }

    /// No more bytes will come for what is pending; says what becomes of it.
    pub(crate) fn line_event(&mut self, event: LineEvent) -> Vec<Piece> {
        let mut pieces = Vec::new();
        self.line
            .line_event(event, |found| pieces.push(piece(&mut self.pending, &found)));
        pieces
    }

    /// The bytes that may yet be part of a frame: the machine is in the state of their number.
    pub(crate) fn pending(&self) -> &[u8] {
        &self.pending
    }

    pub(crate) fn counters(&self) -> &Counters {
        self.line.counters()
    }

    /// Counts from now on. What is pending has been received already, and counts.
    pub(crate) fn reset_counters(&mut self) {
        self.line = self.fresh.clone();
        self.line.feed(&self.pending, |_| ());
    }
}

/// The first of the pending bytes, of which this has become.
fn piece(pending: &mut Vec<u8>, found: &Found<&[u8]>) -> Piece {
    Piece {
        bytes: pending.drain(..found.bytes().min(pending.len())).collect(),
        discarded: match *found {
            Found::Frame { .. } => None,
            Found::Discarded { why, .. } => Some(why),
        },
    }
}
