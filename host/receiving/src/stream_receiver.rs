//! The receiver of described frames on a PC. It is as fast on streams of false starts as on other streams.
//!
//! A false start that claims 60 000 bytes is rejected by its checksum, and the next byte may begin another false start.
//! A [`BufferedReceiver`](framelock::BufferedReceiver) sums up the same bytes again for each false start. This receiver
//! keeps [running sums](RunningSums), the position up to which it has searched for a delimiter, and the outcomes in a
//! stretch that [repeats itself](Repetition). All of these depend only on the stream's bytes, so they change no
//! classification.

use std::cell::{Cell, RefCell};

use framelock::{Classification, DiscardReason, Format as _, Found, LineEvent, Parser};
use framelock_formats::layout::Length;
use framelock_formats::{AnyOf, Layout};

use crate::repetition::Repetition;
use crate::running_sums::RunningSums;

/// Layouts whose frames may begin with the same byte.
type Layouts<'a> = AnyOf<'a, &'static Layout<'static>>;

/// For up to this number of bytes, computing a checksum directly is faster than using running sums.
const SHORT: usize = 16;

/// Bytes that were already searched for a delimiter are searched again in steps of at least this length.
const FEW: usize = 2;

/// A receiver that delivers and discards the same bytes as a [`BufferedReceiver`](framelock::BufferedReceiver) of the
/// same format, in the same order.
#[derive(Clone, Debug)]
pub struct StreamReceiver {
    classifier: Classifier,
    /// The bytes that are kept. The pending bytes are `held[from..]`.
    held: Vec<u8>,
    from: usize,
    /// The position of the first held byte in the stream.
    position: usize,
    /// The first pending byte cannot be decided before this number of bytes is pending.
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

    /// Decides about the first pending bytes, and moves past them. Returns `None` if a decision needs more bytes.
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

    /// Removes the decided bytes from `held` if more than half of the held bytes are decided.
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
        // From the slice, append at most as many bytes as the longest frame has. These bytes are enough to decide about
        // each byte that is already pending.
        let before = self.held.len();
        let missing = bytes.get(..self.classifier.longest).unwrap_or(bytes);
        self.held.extend_from_slice(missing);
        while self.from < before {
            match self.decide() {
                Some(one) => found(one),
                None => return,
            }
        }
        // Decide about the rest of the slice without copying it.
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

/// The frames that may begin with a given byte.
#[derive(Clone, Debug)]
struct Start {
    /// The layouts of these frames, in order.
    layouts: Vec<&'static Layout<'static>>,
    /// The search for the delimiter, if only one layout is possible and its frames end with a delimiter.
    search: Option<Search>,
}

/// A classifier of a stream from any position on. It remembers sums and searches for later positions.
#[derive(Clone, Debug)]
struct Classifier {
    longest: usize,
    /// The possible layouts, indexed by the frame's first byte.
    starts: Vec<Start>,
    sums: Sums,
    repetition: Repetition,
}

/// A search for a delimiter. There is one search for each value of the first byte, so a later start with the same first
/// byte can use what the search for an earlier start has found.
#[derive(Clone, Default, Debug)]
struct Search {
    /// The position up to which bytes were searched for the delimiter of a start that was then rejected.
    searched: usize,
    /// The position up to which some frame was found incomplete. No delimiter ends that frame before this position.
    incomplete: usize,
}

impl Classifier {
    fn new(format: AnyOf<'static>) -> Self {
        let start = |byte| {
            let starting = format.0.iter().filter(|layout| layout.starts(byte));
            let layouts: Vec<_> = starting.collect();
            let is_delimited = matches!(&*layouts, [one] if one.length() == Length::Delimiter);
            let search = is_delimited.then(Search::default);
            Start { layouts, search }
        };
        Self {
            longest: format.longest(),
            starts: (0..=u8::MAX).map(start).collect(),
            sums: Sums::default(),
            repetition: Repetition::default(),
        }
    }

    /// Classifies the pending bytes, which begin at position `at` of the stream. At least one byte must be pending. If
    /// the bytes are incomplete, the error is the number of bytes that are needed.
    #[inline]
    fn classify(&mut self, at: usize, pending: &[u8]) -> Result<Found<()>, usize> {
        let start = |byte: &u8| self.starts.get(usize::from(*byte));
        let starts_none = |byte: &&u8| start(byte).is_some_and(|it| it.layouts.is_empty());
        let run = pending.iter().take_while(starts_none).count();
        if run > 0 {
            return Ok(Found::discarded(run, DiscardReason::NoSync));
        }
        // Look for known outcomes only among bytes that a wrong checksum has covered. Elsewhere, false starts are rare.
        if at < self.sums.covered {
            self.classify_covered(at, pending)
        } else {
            self.classify_start(at, pending)
        }
    }

    /// Returns the known outcome if there is one. Otherwise does the same as [`classify_start`](Self::classify_start).
    #[inline(never)]
    fn classify_covered(&mut self, at: usize, pending: &[u8]) -> Result<Found<()>, usize> {
        if let Some(outcome) = self.repetition.outcome(at, self.longest) {
            return Ok(outcome);
        }
        let outcome = self.classify_start(at, pending)?;
        self.repetition.note(at, pending, self.longest, outcome);
        Ok(outcome)
    }

    /// Classifies pending bytes whose first byte may begin a frame.
    #[inline]
    fn classify_start(&mut self, at: usize, pending: &[u8]) -> Result<Found<()>, usize> {
        let bytes = pending.get(..self.longest).unwrap_or(pending);
        let first = bytes.first().copied().unwrap_or_default();
        let classification = match self.starts.get_mut(usize::from(first)) {
            Some(Start {
                layouts,
                search: Some(search),
            }) => classify_delimited(&mut self.sums, layouts, search, at, bytes),
            Some(start) => self.sums.ask(&start.layouts, at, bytes, 0),
            None => Classification::Rejected(DiscardReason::NoSync),
        };
        match classification {
            Classification::Frame(length) => Ok(Found::frame(length, ())),
            Classification::Rejected(why) => Ok(Found::discarded(1, why)),
            Classification::Incomplete { at_least } => Err(at_least),
        }
    }
}

/// Classifies bytes whose first byte may begin frames of only one layout. The frames of this layout end with a
/// delimiter. If these bytes were already searched for the delimiter of an earlier, rejected start, passes a growing
/// part of them to the layout, until the layout decides.
fn classify_delimited(
    sums: &mut Sums,
    layouts: &[&'static Layout<'static>],
    search: &mut Search,
    at: usize,
    bytes: &[u8],
) -> Classification {
    // A layout always decides when it gets as many bytes as its longest frame has.
    let longest = layouts.first().map(|layout| layout.longest());
    let bytes = longest
        .and_then(|longest| bytes.get(..longest))
        .unwrap_or(bytes);
    let mut seen = search.incomplete.saturating_sub(at);
    let mut classification = Classification::Incomplete { at_least: 0 };
    while at < search.searched && seen + FEW < bytes.len() {
        let more = ((bytes.len() - seen) / 4).max(FEW);
        let beginning = bytes.get(..seen + more).unwrap_or(bytes);
        classification = sums.ask(layouts, at, beginning, seen);
        if !matches!(classification, Classification::Incomplete { .. }) {
            break;
        }
        seen += more;
    }
    if matches!(classification, Classification::Incomplete { .. }) {
        classification = sums.ask(layouts, at, bytes, seen);
    }
    match classification {
        Classification::Incomplete { .. } => seen = bytes.len(),
        Classification::Rejected(_) => search.searched = search.searched.max(at + bytes.len()),
        Classification::Frame(_) => {}
    }
    search.incomplete = search.incomplete.max(at + seen);
    classification
}

/// The running sums of a stream.
#[derive(Clone, Default, Debug)]
struct Sums {
    /// The position after the last byte that a wrong checksum has covered.
    covered: usize,
    /// The running sums for each checksum. The address of the algorithm identifies the checksum.
    running: RefCell<Vec<(usize, RunningSums)>>,
}

impl Sums {
    /// Classifies bytes by these layouts. Uses running sums for bytes that a wrong checksum has already covered.
    #[inline]
    fn ask(
        &mut self,
        layouts: &[&'static Layout<'static>],
        at: usize,
        bytes: &[u8],
        seen: usize,
    ) -> Classification {
        let layouts = AnyOf(layouts);
        if at < self.covered {
            return self.ask_with_sums(layouts, at, bytes, seen);
        }
        let classification = layouts.classify_after(bytes, seen);
        if classification == Classification::Rejected(DiscardReason::ChecksumMismatch) {
            self.note_covered(layouts, at, bytes, seen);
        }
        classification
    }

    /// Records the end of the bytes that the wrong checksums of these layouts cover.
    fn note_covered(&mut self, layouts: Layouts, at: usize, bytes: &[u8], seen: usize) {
        let end = Cell::new(self.covered);
        let _ = layouts.classify_with(bytes, seen, |algorithm, covered, extra| {
            if covered.len() > SHORT {
                end.set(end.get().max(at + offset(covered, bytes) + covered.len()));
            }
            algorithm.of(covered, extra)
        });
        self.covered = end.get();
    }

    fn ask_with_sums(
        &self,
        layouts: Layouts,
        at: usize,
        bytes: &[u8],
        seen: usize,
    ) -> Classification {
        layouts.classify_with(bytes, seen, |algorithm, covered, extra| {
            if covered.len() <= SHORT {
                return algorithm.of(covered, extra);
            }
            let at = at + offset(covered, bytes);
            let key = std::ptr::from_ref(algorithm).addr();
            let mut running = self.running.borrow_mut();
            let place = running.iter().position(|(known, _)| *known == key);
            let place = place.unwrap_or_else(|| {
                running.push((key, RunningSums::new(algorithm)));
                running.len() - 1
            });
            match running.get_mut(place) {
                Some((_, sums)) => sums.of(algorithm, at, covered, extra),
                None => algorithm.of(covered, extra),
            }
        })
    }
}

/// Returns the offset at which the slice `part` begins in `bytes`, which contain the slice.
#[inline]
fn offset(part: &[u8], bytes: &[u8]) -> usize {
    part.as_ptr().addr() - bytes.as_ptr().addr()
}
