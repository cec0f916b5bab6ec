//! The receiver's slice path: frames that lie in a slice are found there, without going through
//! the window byte by byte.
//!
//! Frames that follow each other are compared a row at a time. Everywhere else starts, the places
//! at which a frame may begin, are judged a block at a time: at which of them the fixed bytes
//! agree is found for all together, and costs the same whatever the bytes are. So no stream makes
//! the slice path slow.

use crate::receiver::first_mismatch;
use crate::scan::{BLOCK, Places};
use crate::window::Word;
use crate::{Format, Frame, Mismatch, Policy, Sink};

/// The longest frame that any [`Word`] holds.
const LONGEST: usize = 16;

/// Bytes that the frames which begin in a block may reach into.
pub(crate) const REACH: usize = BLOCK + LONGEST;

/// A slice shorter than this is as well pushed byte by byte: behind the bytes that the receiver
/// must push first there may be no room for a block.
pub(crate) const SHORTEST: usize = LONGEST + REACH;

/// Frames compared together.
const ROW: usize = 8;

/// Finds the frames that begin at `from` or later, as far as whole blocks go; returns the start
/// behind the last that was judged.
///
/// If that is not behind a frame, or behind what a receiver that discards took for one, at least
/// as many bytes follow as a receiver can hold.
#[inline]
pub(crate) fn scan<F: Format, P: Policy, S: Sink<F::Message>>(
    bytes: &[u8],
    from: usize,
    sink: &mut S,
) -> usize {
    let mut at = from;
    let mut frame_end = from;
    loop {
        // Behind a frame another is likely.
        if at == frame_end {
            at = rows::<F, S>(bytes, at, sink);
        }
        let Some(judged) = block::<F, P, S>(bytes, at, sink) else {
            return at;
        };
        frame_end = at + judged;
        at = frame_end.max(at + BLOCK);
    }
}

/// Takes frames from `from` on as long as they follow each other, in whole rows; returns the place
/// behind the last.
#[inline]
pub(crate) fn rows<F: Format, S: Sink<F::Message>>(
    bytes: &[u8],
    from: usize,
    sink: &mut S,
) -> usize {
    // Whole words are compared, which may be longer than frames.
    let unused = 8 * (F::Word::BYTES - u32::from(F::SHAPE.length()));
    let mask = F::SHAPE.mask() << unused;
    let pattern = F::SHAPE.pattern() << unused;
    let size = ROW * F::Frame::LENGTH + F::Word::BYTES as usize;

    let mut at = from;
    while let Some(row) = bytes.get(at..).and_then(|rest| rest.get(..size)) {
        let words = (0..ROW).filter_map(|n| F::Word::load(row.get(n * F::Frame::LENGTH..)?));
        let differing = words
            .clone()
            .fold(F::Word::ZERO, |any, word| any | (word ^ pattern) & mask);
        if differing != F::Word::ZERO {
            break;
        }
        for word in words {
            let frame = F::Frame::from_word(word >> unused);
            if !F::check(frame) {
                return at;
            }
            at += F::Frame::LENGTH;
            sink.frame(at - 1, F::decode(frame));
        }
    }
    at
}

/// Judges every start in the block at `at`: it is part of a frame, or dropped. `None` if the slice
/// may end before a frame that begins in the block does.
///
/// Returns the place, counted from `at`, behind the last frame, or behind what a receiver that
/// discards took for one; 0 if there is none.
#[inline]
fn block<F: Format, P: Policy, S: Sink<F::Message>>(
    bytes: &[u8],
    at: usize,
    sink: &mut S,
) -> Option<usize> {
    let bytes = bytes.get(at..)?.first_chunk()?;
    let starts = Starts::new::<F>(bytes)?;
    // Every start before the first is judged. Candidates are sought from the second on.
    let (mut judged, mut from) = (0, 0);
    while let Some(start) = starts.candidate::<P>(from) {
        (judged, from) = starts.judge::<F, P, S>(judged, start, at, bytes, sink)?;
    }
    starts.report_dropped::<F, S>(from_on(judged), bytes, sink);
    Some(judged as usize)
}

/// Sets of starts in a block, a bit for each start, the first start's lowest.
pub(crate) struct Starts {
    /// Where the first byte is a frame's first, or any may be.
    first: u64,
    /// Where, besides, all sync bytes agree.
    sync: u64,
    /// Where all fixed bytes agree.
    fixed: u64,
}

impl Starts {
    #[inline]
    pub(crate) fn new<F: Format>(bytes: &[u8; REACH]) -> Option<Self> {
        let mut starts = Self {
            first: u64::MAX,
            sync: u64::MAX,
            fixed: u64::MAX,
        };
        let mut agreeing = Places::ALL;
        for place in 0..F::SHAPE.length() {
            let behind = bytes.get(usize::from(place)..)?;
            if let Some(wanted) = F::SHAPE.fixed(place) {
                agreeing.keep(wanted, behind.first_chunk()?);
            }
            if place == 0 {
                starts.first = agreeing.bits();
            }
            if place + 1 == F::SHAPE.sync_length() {
                starts.sync = agreeing.bits();
            }
        }
        starts.fixed = agreeing.bits();
        Some(starts)
    }

    /// The first start, from `from` on, where to look closer. A receiver that discards must do so
    /// wherever a frame may begin: even one that fails takes other starts with it.
    #[inline]
    pub(crate) fn candidate<P: Policy>(&self, from: u32) -> Option<u32> {
        let all = if P::RESCANS { self.fixed } else { self.first };
        let candidates = all & from_on(from);
        (candidates != 0).then_some(candidates.trailing_zeros())
    }

    /// Judges the candidate `start`, and with it those from `judged` to it. Returns the start behind
    /// the last that is judged then, and the one from which to seek the next candidate.
    #[inline]
    pub(crate) fn judge<F: Format, P: Policy, S: Sink<F::Message>>(
        &self,
        judged: u32,
        start: u32,
        at: usize,
        bytes: &[u8; REACH],
        sink: &mut S,
    ) -> Option<(u32, u32)> {
        let window = window_at::<F>(bytes, start)?;
        let mismatch = first_mismatch::<F>(window, F::SHAPE.length());
        if P::RESCANS && mismatch.is_some() {
            // The check failed: this start is dropped with those around it.
            return Some((judged, start + 1));
        }
        self.report_dropped::<F, S>(from_on(judged) & !from_on(start), bytes, sink);
        let length = if let Some((place, why)) = mismatch {
            sink.dropped(usize::from(place) + 1, why);
            u32::from(place) + 1
        } else {
            let end = at + start as usize + F::Frame::LENGTH;
            sink.frame(end - 1, F::decode(F::Frame::from_word(window)));
            u32::from(F::SHAPE.length())
        };
        Some((start + length, start + length))
    }

    /// Tells `sink` why no frame begins at any of the starts `dropped`.
    pub(crate) fn report_dropped<F: Format, S: Sink<F::Message>>(
        &self,
        dropped: u64,
        bytes: &[u8; REACH],
        sink: &mut S,
    ) {
        if !S::WANTS_DROPPED {
            return;
        }
        let mut tell = |dropped: u64, why| {
            if dropped != 0 {
                sink.dropped(dropped.count_ones() as usize, why);
            }
        };
        tell(dropped & !self.first, Mismatch::NoSync);
        if F::CHECK_KNOWN_AT == F::SHAPE.length() {
            // The check comes behind all fixed bytes, so it fails only where these agree.
            tell(dropped & self.first & !self.sync, Mismatch::BrokenSync);
            tell(dropped & self.sync & !self.fixed, Mismatch::Terminator);
            tell(dropped & self.fixed, Mismatch::Check);
            return;
        }
        let mut rest = dropped & self.first;
        while rest != 0 {
            let window = window_at::<F>(bytes, rest.trailing_zeros());
            if let Some((_, why)) =
                window.and_then(|window| first_mismatch::<F>(window, F::SHAPE.length()))
            {
                tell(1, why);
            }
            rest &= rest - 1;
        }
    }
}

/// The starts from `start` on.
fn from_on(start: u32) -> u64 {
    u64::MAX.checked_shl(start).unwrap_or(0)
}

/// The frame-length window that begins at `start`, its last byte lowest; `None` if a word does not
/// fit there.
#[inline]
fn window_at<F: Format>(bytes: &[u8], start: u32) -> Option<F::Word> {
    let word = F::Word::load(bytes.get(start as usize..)?)?;
    Some(word >> (8 * (F::Word::BYTES - u32::from(F::SHAPE.length()))))
}
