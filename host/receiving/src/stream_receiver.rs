//! The receiver of described frames on a PC: as fast in streams of false starts as elsewhere.
//!
//! A false start that claims 60 000 bytes is rejected by its checksum, and the next byte may begin another one. A
//! [`BufferedReceiver`](framelock::BufferedReceiver) sums up the same bytes again for each of them. This receiver keeps
//! [running sums](RunningSums), and how far it has searched for a delimiter. Both depend on the bytes only, so every
//! classification is the same.

use std::cell::{Cell, RefCell};

use framelock::{Classification, DiscardReason, Format as _, Found, LineEvent, Parser};
use framelock_formats::layout::Length;
use framelock_formats::{AnyOf, Layout};

use crate::running_sums::{RunningSums, SHORT};

/// Bytes that are searched for a delimiter again and again, at most.
const FEW: usize = 2;

/// A receiver that delivers and discards the same bytes as a [`BufferedReceiver`](framelock::BufferedReceiver) of the
/// same format, in the same order.
#[derive(Clone, Debug)]
pub struct StreamReceiver {
    classifier: Classifier,
    /// Pending: `held[from..]`.
    held: Vec<u8>,
    from: usize,
    /// The position of the first held byte in the stream.
    position: usize,
    /// The number of pending bytes that are needed to decide about the first.
    at_least: usize,
}

impl StreamReceiver {
    /// Creates a receiver that has received nothing yet. Returns `None` if the format's frames have no bytes.
    #[must_use]
    pub fn new(format: AnyOf<'static>) -> Option<Self> {
        (format.longest() > 0).then(|| Self {
            classifier: Classifier::new(format),
            held: Vec::new(),
            from: 0,
            position: 0,
            at_least: 0,
        })
    }

    /// Decides about the first pending bytes and moves on behind them. Returns `None` if more bytes are needed.
    fn decide(&mut self) -> Option<Found<&[u8]>> {
        let start = self.from;
        let pending = self.held.get(start..).unwrap_or_default();
        if pending.is_empty() || pending.len() < self.at_least {
            return None;
        }
        let found = match self.classifier.classify(self.position + start, pending) {
            Ok(found) => found,
            Err(at_least) => {
                self.at_least = at_least;
                return None;
            }
        };
        (self.from, self.at_least) = (start + found.bytes(), 0);
        Some(found.map(|()| self.held.get(start..self.from).unwrap_or_default()))
    }

    /// Forgets the bytes that are decided, if they are most of those held.
    fn forget_decided(&mut self) {
        if self.from > self.held.len() / 2 {
            self.held.drain(..self.from);
            self.position += self.from;
            self.from = 0;
        }
    }
}

impl Parser for StreamReceiver {
    type Message<'a> = &'a [u8];

    fn push_with(&mut self, byte: u8, account: impl FnMut(Found<()>)) -> Option<&[u8]> {
        self.held.push(byte);
        self.next_with(&mut [].as_slice(), account)
    }

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<&[u8]>)) {
        self.forget_decided();
        // With as much of the slice as the longest frame may have, each start before the slice is decided.
        let before = self.held.len();
        let missing = bytes.get(..self.classifier.longest).unwrap_or(bytes);
        self.held.extend_from_slice(missing);
        while self.from < before {
            match self.decide() {
                Some(one) => found(one),
                None => return,
            }
        }
        // The others are decided where they lie.
        let mut rest = bytes.get(self.from - before..).unwrap_or_default();
        self.position += self.from;
        (self.from, self.at_least) = (0, 0);
        self.held.clear();
        while !rest.is_empty() {
            match self.classifier.classify(self.position, rest) {
                Ok(one) => {
                    let (decided, others) = rest.split_at_checked(one.bytes()).unwrap_or_default();
                    self.position += decided.len();
                    rest = others;
                    found(one.map(|()| decided));
                }
                Err(at_least) => {
                    self.at_least = at_least;
                    return self.held.extend_from_slice(rest);
                }
            }
        }
    }

    fn line_event(&mut self, _: LineEvent, mut found: impl FnMut(Found<&[u8]>)) {
        while self.pending() > 0 {
            if let Some(one) = self.decide() {
                found(one);
            } else {
                found(Found::discarded(1, DiscardReason::LineEvent));
                (self.from, self.at_least) = (self.from + 1, 0);
            }
        }
    }

    fn pending(&self) -> usize {
        self.held.len() - self.from
    }

    fn reset(&mut self) {
        (self.from, self.at_least) = (self.held.len(), 0);
    }

    fn next_with(
        &mut self,
        bytes: &mut &[u8],
        mut account: impl FnMut(Found<()>),
    ) -> Option<&[u8]> {
        self.forget_decided();
        loop {
            let found = self.decide().map(|one| one.map(|_| ()));
            if let Some(one) = found {
                account(one);
                if let Found::Frame { length, .. } = one {
                    return self.held.get(self.from - length..self.from);
                }
                continue;
            }
            let (byte, rest) = bytes.split_first()?;
            self.held.push(*byte);
            *bytes = rest;
        }
    }
}

/// What begins with a byte.
#[derive(Clone, Copy, Debug)]
enum Start {
    /// No frame.
    None,
    /// Frames of one layout, which end with a delimiter: the number of the layout.
    Delimited(usize),
    /// Other frames.
    Some,
}

/// Classifies a stream from each position on, and remembers sums and searches that may be needed again.
#[derive(Clone, Debug)]
struct Classifier {
    format: AnyOf<'static>,
    longest: usize,
    starts: Vec<Start>,
    /// For each layout, if a delimiter ends its frames.
    searches: Vec<Search>,
    /// Wrong checksums have covered bytes up to this position.
    summed: usize,
    /// For each checksum, its algorithm's address.
    sums: RefCell<Vec<(usize, RunningSums)>>,
}

/// The search for a delimiter. The search from a later start on is a part of the search from an earlier one.
#[derive(Clone, Default, Debug)]
struct Search {
    /// Rejected starts were searched up to this position.
    searched: usize,
    /// From any start on, the bytes before this position are incomplete.
    incomplete: usize,
}

impl Classifier {
    fn new(format: AnyOf<'static>) -> Self {
        let start = |byte| {
            let numbered = format.0.iter().enumerate();
            let mut starting = numbered.filter(|(_, layout)| layout.starts(byte));
            match (starting.next(), starting.next()) {
                (None, _) => Start::None,
                (Some((number, layout)), None) if layout.length() == Length::Delimiter => {
                    Start::Delimited(number)
                }
                _ => Start::Some,
            }
        };
        Self {
            format,
            longest: format.longest(),
            starts: (0..=u8::MAX).map(start).collect(),
            searches: vec![Search::default(); format.0.len()],
            summed: 0,
            sums: RefCell::default(),
        }
    }

    #[inline]
    fn start(&self, byte: u8) -> Start {
        let start = self.starts.get(usize::from(byte));
        start.copied().unwrap_or(Start::Some)
    }

    /// Classifies pending bytes, at least one, from position `at` of the stream on. The error is the number of bytes
    /// that are needed.
    #[inline]
    fn classify(&mut self, at: usize, pending: &[u8]) -> Result<Found<()>, usize> {
        let starts_none = |byte: &&u8| matches!(self.start(**byte), Start::None);
        let run = pending.iter().take_while(starts_none).count();
        if run > 0 {
            return Ok(Found::discarded(run, DiscardReason::NoSync));
        }
        let bytes = pending.get(..self.longest).unwrap_or(pending);
        let classification = match pending.first().map(|byte| self.start(*byte)) {
            Some(Start::Delimited(layout)) => self.classify_delimited(layout, at, bytes),
            _ => self.ask(at, bytes, 0),
        };
        match classification {
            Classification::Frame(length) => Ok(Found::frame(length, ())),
            Classification::Rejected(why) => Ok(Found::discarded(1, why)),
            Classification::Incomplete { at_least } => Err(at_least),
        }
    }

    /// Classifies bytes that only this layout may begin with. Bytes that were searched for an earlier start are searched
    /// once more, in small steps, to remember how many are incomplete.
    fn classify_delimited(&mut self, layout: usize, at: usize, bytes: &[u8]) -> Classification {
        let Some(mut search) = self.searches.get(layout).cloned() else {
            return self.ask(at, bytes, 0);
        };
        // With as many bytes as its longest frame has, the layout decides.
        let longest = self.format.0.get(layout).map(Layout::longest);
        let bytes = longest
            .and_then(|longest| bytes.get(..longest))
            .unwrap_or(bytes);
        let mut seen = search.incomplete.saturating_sub(at);
        let mut classification = Classification::Incomplete { at_least: 0 };
        while at < search.searched && seen + FEW < bytes.len() {
            let more = ((bytes.len() - seen) / 4).max(FEW);
            let beginning = bytes.get(..seen + more).unwrap_or(bytes);
            classification = self.ask(at, beginning, seen);
            if !matches!(classification, Classification::Incomplete { .. }) {
                break;
            }
            seen += more;
        }
        if matches!(classification, Classification::Incomplete { .. }) {
            classification = self.ask(at, bytes, seen);
        }
        match classification {
            Classification::Incomplete { .. } => seen = bytes.len(),
            Classification::Rejected(_) => search.searched = search.searched.max(at + bytes.len()),
            Classification::Frame(_) => {}
        }
        search.incomplete = search.incomplete.max(at + seen);
        if let Some(place) = self.searches.get_mut(layout) {
            *place = search;
        }
        classification
    }

    /// Asks the format. Bytes that a wrong checksum has covered get running sums.
    #[inline]
    fn ask(&mut self, at: usize, bytes: &[u8], seen: usize) -> Classification {
        if at < self.summed {
            return self.ask_with_sums(at, bytes, seen);
        }
        let classification = self.format.classify_after(bytes, seen);
        if classification == Classification::Rejected(DiscardReason::ChecksumMismatch) {
            self.note_covered(at, bytes, seen);
        }
        classification
    }

    /// Notes how far the wrong checksums of these bytes reach.
    fn note_covered(&mut self, at: usize, bytes: &[u8], seen: usize) {
        let summed = Cell::new(self.summed);
        let _ = self
            .format
            .classify_with(bytes, seen, |algorithm, covered, extra| {
                let end = at + offset(covered, bytes) + covered.len();
                if covered.len() <= SHORT {
                    return algorithm.of(covered, extra);
                }
                summed.set(summed.get().max(end));
                algorithm.of(covered, extra)
            });
        self.summed = summed.get();
    }

    fn ask_with_sums(&self, at: usize, bytes: &[u8], seen: usize) -> Classification {
        self.format
            .classify_with(bytes, seen, |algorithm, covered, extra| {
                let at = at + offset(covered, bytes);
                let key = std::ptr::from_ref(algorithm).addr();
                let mut sums = self.sums.borrow_mut();
                let place = sums.iter().position(|(known, _)| *known == key);
                let place = place.unwrap_or_else(|| {
                    sums.push((key, RunningSums::new(algorithm)));
                    sums.len() - 1
                });
                match sums.get_mut(place) {
                    Some((_, sums)) => sums.of(algorithm, at, covered, extra),
                    None => algorithm.of(covered, extra),
                }
            })
    }
}

/// Returns the place of a slice in the bytes of which it is a part.
#[inline]
fn offset(part: &[u8], bytes: &[u8]) -> usize {
    part.as_ptr().addr() - bytes.as_ptr().addr()
}
