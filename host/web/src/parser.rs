//! Any of the receivers, byte by byte.

use framelock::can_go_deaf::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock::{BufferedIn, Counters, Found, Line, LineEvent, Receiver};
use framelock_formats::AnyOf;

#[derive(Clone)]
pub(crate) enum AnyLine {
    Lecture(Line<Lecture>),
    Bin(Line<Receiver<Bin>>),
    BinCrc8(Line<Receiver<BinCrc8>>),
    Described(Line<BufferedIn<AnyOf<'static>, Vec<u8>>>),
}

/// Does the same with any of them.
macro_rules! for_any {
    ($any:expr, $line:ident => $does:expr) => {
        match $any {
            AnyLine::Lecture($line) => $does,
            AnyLine::Bin($line) => $does,
            AnyLine::BinCrc8($line) => $does,
            AnyLine::Described($line) => $does,
        }
    };
}

impl AnyLine {
    /// Takes bytes; what is decided by them, in the order of the stream.
    pub(crate) fn feed(&mut self, bytes: &[u8]) -> Vec<Found<()>> {
        let mut decided = Vec::new();
        for_any!(self, line => line.feed(bytes, |found| decided.push(found.map(|_| ()))));
        decided
    }

    /// The line is idle.
    pub(crate) fn idle(&mut self) -> Vec<Found<()>> {
        let mut decided = Vec::new();
        for_any!(self, line => line.line_event(LineEvent::Idle, |found| decided.push(found.map(|_| ()))));
        decided
    }

    pub(crate) fn counters(&self) -> &Counters {
        for_any!(self, line => line.counters())
    }

    /// The lecture's machine, if it is that.
    pub(crate) fn lecture(&self) -> Option<&Lecture> {
        match self {
            Self::Lecture(line) => Some(line.parser()),
            _ => None,
        }
    }
}
