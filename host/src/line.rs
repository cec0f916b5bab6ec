//! A line that frames are received from: whichever frames, and whichever machine receives them.

use anyhow::{Result, bail};
use framelock::{
    Accounting, Bin, BinCrc8, BufferedReceiver, Counters, Event, Format, Found, Lecture, LineEvent,
    Mismatch, Parser, Receiver, Setpoint,
};
use framelock_simulation::FrameFormat;

use crate::frame::{Described, Frame, LONGEST};
use crate::names::PolicyName;

/// A receiver with its accounts.
#[derive(Clone)]
pub(crate) enum Line {
    Bin(Accounting<Receiver<Bin>>),
    BinCrc8(Accounting<Receiver<BinCrc8>>),
    Lecture(Accounting<Lecture>),
    Buffered(Box<Accounting<BufferedReceiver<Described, { 2 * LONGEST }>>>),
}

macro_rules! for_any {
    ($line:expr, $accounting:ident => $does:expr) => {
        match $line {
            Line::Bin($accounting) => $does,
            Line::BinCrc8($accounting) => $does,
            Line::Lecture($accounting) => $does,
            Line::Buffered($accounting) => $does,
        }
    };
}

impl Line {
    /// The machine for these frames under this policy. Nothing has been received yet.
    pub(crate) fn new(frame: &Frame, policy: PolicyName) -> Result<Self> {
        Ok(match (policy, frame.setpoints) {
            (PolicyName::Rescan, Some(FrameFormat::Bin)) => Self::Bin(Accounting::default()),
            (PolicyName::Rescan, Some(FrameFormat::BinCrc8)) => {
                Self::BinCrc8(Accounting::default())
            }
            (PolicyName::Rescan, None) => {
                let receiver = BufferedReceiver::new(frame.described.clone());
                Self::Buffered(Box::new(Accounting::new(receiver)))
            }
            (PolicyName::Discard, Some(FrameFormat::Bin)) => Self::Lecture(Accounting::default()),
            (PolicyName::Discard, _) => bail!(
                "--policy discard is the lecture's machine, which knows --frame bin and no other: \
                 leave one of the two out"
            ),
        })
    }

    /// Takes bytes; says what becomes of them, in the order of the stream. A message is the frame's
    /// bytes; of setpoints all but the reserved one.
    pub(crate) fn feed(&mut self, bytes: &[u8], event: impl FnMut(Found<&[u8]>)) {
        match self {
            Self::Bin(line) => feed(line, bytes, Bin::encode, event),
            Self::BinCrc8(line) => feed(line, bytes, BinCrc8::encode, event),
            Self::Lecture(line) => feed(line, bytes, Bin::encode, event),
            Self::Buffered(line) => line.feed(bytes, event),
        }
    }

    /// No more bytes will come for what is pending; says what becomes of it.
    pub(crate) fn line_event(&mut self, why: LineEvent, mut event: impl FnMut(Found<&[u8]>)) {
        let count = self.pending();
        match self {
            Self::Bin(line) => line.line_event(why),
            Self::BinCrc8(line) => line.line_event(why),
            Self::Lecture(line) => line.line_event(why),
            Self::Buffered(line) => return line.line_event(why, event),
        }
        if count > 0 {
            let why = Mismatch::LineEvent;
            event(Found::Dropped { count, why });
        }
    }

    pub(crate) fn counters(&self) -> &Counters {
        for_any!(self, line => line.counters())
    }

    pub(crate) fn pending(&self) -> usize {
        for_any!(self, line => line.pending())
    }
}

/// Feeds a receiver of setpoints.
fn feed<P: Parser<Message = Setpoint>, const N: usize>(
    line: &mut Accounting<P>,
    bytes: &[u8],
    encode: impl Fn(Setpoint) -> [u8; N],
    mut event: impl FnMut(Found<&[u8]>),
) {
    line.feed_events(bytes, |found| match found {
        Event::Frame { message, .. } => event(Found::Frame {
            length: N,
            message: &encode(message),
        }),
        Event::Dropped { count, why } => event(Found::Dropped { count, why }),
    });
}

/// A line byte by byte: it knows which bytes are pending, and what has become of the others.
#[derive(Clone)]
pub(crate) struct Watched {
    /// Has received nothing.
    fresh: Line,
    line: Line,
    pending: Vec<u8>,
}

/// What has become of bytes: a frame, or why they are in none.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Piece {
    pub(crate) bytes: Vec<u8>,
    pub(crate) dropped: Option<Mismatch>,
}

impl Watched {
    pub(crate) fn new(line: Line) -> Self {
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
    let (count, dropped) = match *found {
        Found::Frame { length, .. } => (length, None),
        Found::Dropped { count, why } => (count, Some(why)),
    };
    Piece {
        bytes: pending.drain(..count.min(pending.len())).collect(),
        dropped,
    }
}

/// Why bytes are in no frame, in a word or two.
pub(crate) const fn reason(why: Mismatch) -> &'static str {
    match why {
        Mismatch::NoSync => "no sync",
        Mismatch::BrokenSync => "broken sync",
        Mismatch::Header => "header",
        Mismatch::Terminator => "terminator",
        Mismatch::Check => "check",
        Mismatch::LineEvent => "line event",
    }
}
