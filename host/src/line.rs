//! A line that frames are received from: whichever frames, and whichever machine receives them.

use anyhow::{Result, bail};
use framelock::{Accounting, Bin, BinCrc8, Counters, Lecture, LineEvent, Receiver, Setpoint};

use crate::names::{FrameName, PolicyName};

/// A receiver with its accounts.
#[derive(Clone)]
pub(crate) enum Line {
    Bin(Accounting<Receiver<Bin>>),
    BinCrc8(Accounting<Receiver<BinCrc8>>),
    Lecture(Accounting<Lecture>),
}

macro_rules! for_any {
    ($line:expr, $accounting:ident => $does:expr) => {
        match $line {
            Line::Bin($accounting) => $does,
            Line::BinCrc8($accounting) => $does,
            Line::Lecture($accounting) => $does,
        }
    };
}

impl Line {
    /// The machine for these frames under this policy. Nothing has been received yet.
    pub(crate) fn new(frame: FrameName, policy: PolicyName) -> Result<Self> {
        Ok(match (policy, frame) {
            (PolicyName::Rescan, FrameName::Bin) => Self::Bin(Accounting::default()),
            (PolicyName::Rescan, FrameName::BinCrc8) => Self::BinCrc8(Accounting::default()),
            (PolicyName::Discard, FrameName::Bin) => Self::Lecture(Accounting::default()),
            (PolicyName::Discard, FrameName::BinCrc8) => bail!(
                "--policy discard is the lecture's machine, which knows --frame bin and no other: \
                 leave one of the two out"
            ),
        })
    }

    /// Takes bytes; calls `frame` with each setpoint and the index of its frame's last byte.
    pub(crate) fn feed(&mut self, bytes: &[u8], frame: impl FnMut(usize, Setpoint)) {
        for_any!(self, line => line.feed(bytes, frame));
    }

    fn line_event(&mut self, event: LineEvent) {
        for_any!(self, line => line.line_event(event));
    }

    pub(crate) fn counters(&self) -> &Counters {
        for_any!(self, line => line.counters())
    }

    pub(crate) fn pending(&self) -> usize {
        for_any!(self, line => line.pending())
    }
}

/// A line byte by byte: it knows which bytes are pending, and so which are discarded.
#[derive(Clone)]
pub(crate) struct Watched {
    /// Has received nothing.
    fresh: Line,
    line: Line,
    pending: Vec<u8>,
}

impl Watched {
    pub(crate) fn new(line: Line) -> Self {
        Self {
            fresh: line.clone(),
            line,
            pending: Vec::new(),
        }
    }

    /// Takes a byte; gives the setpoint if it completes a frame, and the bytes that are now known to
    /// be part of no frame, oldest first.
    pub(crate) fn push(&mut self, byte: u8) -> (Option<Setpoint>, Vec<u8>) {
        let mut setpoint = None;
        self.line
            .feed(&[byte], |_, message| setpoint = Some(message));
        self.pending.push(byte);
        if setpoint.is_some() {
            self.pending.clear();
        }
        (setpoint, self.discard())
    }

    /// Drops the current frame; gives its bytes.
    pub(crate) fn line_event(&mut self, event: LineEvent) -> Vec<u8> {
        self.line.line_event(event);
        self.discard()
    }

    fn discard(&mut self) -> Vec<u8> {
        let count = self.pending.len() - self.line.pending();
        self.pending.drain(..count).collect()
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
        self.line.feed(&self.pending, |_, _| ());
    }
}
