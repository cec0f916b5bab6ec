//! The receiver's engine: one word of state, and one step for each byte.
//!
//! The state is the bytes since the last commit, but only as many as can still matter: one fewer than a frame has. They
//! lie in a shift register, newest lowest. A 1 in front of the oldest byte, the marker, shows how many there are:
//!
//! ```text
//!           7        6        5        4        3        2        1        0   byte of the word
//!      ┌────────┬────────┬────────┬────────┬────────┬────────┬────────┬────────┐
//!      │   0    │   1    │ oldest │        │        │        │        │ newest │  a 7-byte format,
//!      └────────┴────────┴────────┴────────┴────────┴────────┴────────┴────────┘  full
//!      ┌────────┬────────┬────────┬────────┬────────┬────────┬────────┬────────┐
//!      │   0    │   0    │   0    │   0    │   0    │   1    │ oldest │ newest │  two bytes since
//!      └────────┴────────┴────────┴────────┴────────┴────────┴────────┴────────┘  the last commit
//! ```
//!
//! The next byte completes a frame if the marker is at the top (so no byte belongs to an earlier
//! frame), the fixed bytes agree (with the marker, one masked comparison), and the format's own
//! check holds. Otherwise the byte is shifted in, and the marker moves up until it is at the top.
//!
//! The engine keeps no position in the frame, so it cannot lose it: *every* window of the stream
//! that overlaps no committed frame is compared.

use core::fmt::Debug;
use core::ops::{BitAnd, BitOr, BitXor, Not};

use crate::noise::{BLOCK, blocks_without_start};
use crate::{DiscardReason, Found, FrameBytes, Shape};

#[cfg(test)]
#[allow(
    clippy::indexing_slicing,
    clippy::arithmetic_side_effects,
    reason = "tests"
)]
mod tests;
#[cfg(kani)]
mod verification;

/// A word that holds a frame: `u64` for frames of up to 8 bytes, `u128` for up to 16.
pub trait Word:
    Copy
    + Eq
    + Debug
    + From<u8>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Not<Output = Self>
{
    /// Bytes in the word.
    const BYTES: usize;
    /// The word 1.
    const ONE: Self;

    /// The lowest bytes of a wider word.
    fn truncated(wide: u128) -> Self;

    /// The word whose highest byte is the first of `bytes`; `None` if there are too few.
    fn load(bytes: &[u8]) -> Option<Self>;

    /// 1s in the lowest `count` bytes, fewer than the word has.
    fn lowest_bytes(count: usize) -> Self;

    /// Shifted by `count` bytes, fewer than the word has, towards the highest.
    fn up(self, count: usize) -> Self;

    /// Shifted by `count` bytes, fewer than the word has, towards the lowest.
    fn down(self, count: usize) -> Self;

    /// Bytes that are 0 above the highest that is not.
    fn leading_zero_bytes(self) -> usize;
}

macro_rules! word {
    ($word:ty) => {
        impl Word for $word {
            const BYTES: usize = size_of::<Self>();
            const ONE: Self = 1;

            #[inline]
            #[allow(clippy::cast_possible_truncation, reason = "what it is for")]
            fn truncated(wide: u128) -> Self {
                wide as Self
            }

            #[inline]
            fn load(bytes: &[u8]) -> Option<Self> {
                bytes.first_chunk().map(|bytes| Self::from_be_bytes(*bytes))
            }

            #[inline]
            fn lowest_bytes(count: usize) -> Self {
                const ALL_BUT_HIGHEST: $word = <$word>::MAX >> u8::BITS;
                ALL_BUT_HIGHEST.down((Self::BYTES - 1).wrapping_sub(count))
            }

            #[inline]
            fn up(self, count: usize) -> Self {
                self.wrapping_shl(bits(count))
            }

            #[inline]
            fn down(self, count: usize) -> Self {
                self.wrapping_shr(bits(count))
            }

            #[inline]
            fn leading_zero_bytes(self) -> usize {
                (self.leading_zeros() / u8::BITS) as usize
            }
        }
    };
}
word!(u64);
word!(u128);

/// Bits in `bytes` bytes, at most 16.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "at most 16")]
fn bits(bytes: usize) -> u32 {
    (bytes as u32).wrapping_mul(u8::BITS)
}

/// The state: the bytes since the last commit that the next frame may yet include.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Window<F: FrameBytes>(F::Word);

impl<F: FrameBytes> Window<F> {
    /// Nothing held: the state at reset and after every commit.
    pub(crate) const EMPTY: Self = Self(F::Word::ONE);

    /// Bytes held at most: with one more a frame may be complete.
    const MOST: usize = F::LENGTH - 1;

    /// One step: takes `byte`, and returns the frame that it completes, which is the lowest bytes of the word.
    ///
    /// `check` is asked only about a frame whose fixed bytes agree. Apart from it, a step costs the same few operations
    /// whatever the state and the byte: a masked comparison, a shift, a look at the marker.
    #[inline]
    pub(crate) fn push(
        &mut self,
        shape: &Shape<F>,
        byte: u8,
        check: impl FnOnce(F::Word) -> bool,
    ) -> Option<F::Word> {
        let (held, marker) = (
            F::Word::lowest_bytes(Self::MOST),
            F::Word::ONE.up(Self::MOST),
        );
        let (pattern, mask) = (shape.pattern(), shape.mask());
        let last_byte = F::Word::lowest_bytes(1);
        let differs = (self.0 ^ (marker | pattern.down(1))) & (!held | mask.down(1));
        let last_differs = (F::Word::from(byte) ^ pattern) & mask & last_byte;
        let shifted = self.with(byte);
        // One branch for both: which of them differs cannot be foreseen.
        if differs | last_differs == F::Word::from(0) && check(shifted) {
            *self = Self::EMPTY;
            return Some(shifted);
        }
        *self = if self.holds(Self::MOST) {
            Self(shifted & held | marker)
        } else {
            Self(shifted)
        };
        None
    }

    /// [`push`](Self::push), which says why bytes are discarded, oldest first: those that were pending, and
    /// `byte`, up to one with which a frame may yet begin.
    ///
    /// It keeps no others. So mostly the bytes held, and `byte`, go on as a frame does: one look at them as
    /// a whole shows it.
    #[inline]
    pub(crate) fn push_with(
        &mut self,
        shape: &Shape<F>,
        byte: u8,
        check: impl FnOnce(F::Word) -> bool,
        mut discarded: impl FnMut(DiscardReason),
    ) -> Option<F::Word> {
        let with_byte = self.with(byte);
        let known = F::Word::BYTES.wrapping_sub(self.0.leading_zero_bytes()); // With `byte`.
        if shape.agrees(with_byte, known) {
            if known < F::LENGTH {
                *self = Self(with_byte);
                return None;
            }
            if check(with_byte) {
                *self = Self::EMPTY;
                return Some(with_byte);
            }
        } else if known == 1 {
            // Noise: nothing was held, and nothing is.
            discarded(DiscardReason::NoSync);
            return None;
        }
        *self = self.without_false_starts(shape, with_byte, discarded);
        None
    }

    /// With another byte, which completes no frame: from the first byte on with which one may begin. Says
    /// why each byte before it that was pending is discarded.
    // Apart, so that the usual step keeps few registers.
    #[cold]
    #[inline(never)]
    fn without_false_starts(
        self,
        shape: &Shape<F>,
        with_byte: F::Word,
        mut discarded: impl FnMut(DiscardReason),
    ) -> Self {
        let oldest = self.pending(shape).wrapping_add(1);
        let mut known = F::LENGTH;
        while known > 0 {
            if known <= oldest {
                match shape.mismatch(with_byte, known) {
                    Some(why) => discarded(why),
                    None if known == F::LENGTH => discarded(DiscardReason::ChecksumMismatch),
                    None => break,
                }
            }
            known = known.wrapping_sub(1);
        }
        Self(with_byte & F::Word::lowest_bytes(known) | F::Word::ONE.up(known))
    }

    /// Takes a slice, and says what becomes of each byte but those pending at the end: the same, and
    /// in the same order, as byte by byte, wherever a stream is cut into slices.
    ///
    /// Where the slice has room for a frame, nothing needs to be held: every place at which a frame
    /// may begin is compared where it lies. Only the ends of the slice go through the window.
    #[inline]
    pub(crate) fn feed(
        &mut self,
        shape: &Shape<F>,
        bytes: &[u8],
        check: impl Fn(F::Word) -> bool,
        mut found: impl FnMut(Found<F::Word>),
    ) {
        // What is held came before the slice: until a commit, or until as many bytes have come as can
        // be held.
        let mut at = 0_usize;
        while *self != Self::EMPTY && at < Self::MOST {
            let Some(&byte) = bytes.get(at) else {
                return;
            };
            self.push_and_tell(shape, byte, &check, &mut found);
            at = at.wrapping_add(1);
        }
        // Now all that is pending lies in the slice. It is looked at there, once more.
        at = at.wrapping_sub(self.pending(shape));
        *self = Self::EMPTY;
        let mut rest = bytes.get(at..).unwrap_or_default();
        let first_of =
            |bytes| Some(F::Word::load(bytes)?.down(F::Word::BYTES.wrapping_sub(F::LENGTH)));
        let length = F::LENGTH;
        'rounds: loop {
            let count = blocks_without_start(rest, |byte| shape.agrees(byte.into(), 1));
            if count > 0 {
                let why = DiscardReason::NoSync;
                found(Found::Discarded { count, why });
                rest = rest.get(count..).unwrap_or_default();
            }
            // The next block has a start. Places are compared until a block's are dropped: to look for
            // blocks at each of them would cost more than it saves.
            let mut dropped = 0_usize;
            while dropped < BLOCK {
                let Some(message) = first_of(rest) else {
                    break 'rounds;
                };
                if shape.agrees(message, length) && check(message) {
                    found(Found::Frame { length, message });
                    rest = rest.get(length..).unwrap_or_default();
                    continue;
                }
                let (count, why) = (1, shape.mismatch(message, length));
                let why = why.unwrap_or(DiscardReason::ChecksumMismatch);
                found(Found::Discarded { count, why });
                rest = rest.get(count..).unwrap_or_default();
                dropped = dropped.wrapping_add(count);
            }
        }
        // Too few bytes are left to compare them as a whole.
        for &byte in rest {
            self.push_and_tell(shape, byte, &check, &mut found);
        }
    }

    #[inline]
    fn push_and_tell(
        &mut self,
        shape: &Shape<F>,
        byte: u8,
        check: impl FnOnce(F::Word) -> bool,
        mut found: impl FnMut(Found<F::Word>),
    ) {
        let count = 1;
        let frame = self.push_with(shape, byte, check, |why| {
            found(Found::Discarded { count, why });
        });
        if let Some(message) = frame {
            let length = F::LENGTH;
            found(Found::Frame { length, message });
        }
    }

    /// How many bytes are held because a frame may yet include them: 0 to one fewer than it has.
    // It shifts by amounts that vary, which takes a microcontroller much code: once is enough.
    #[inline(never)]
    pub(crate) fn pending(self, shape: &Shape<F>) -> usize {
        if self == Self::EMPTY {
            return 0;
        }
        let mut pending = Self::MOST;
        while pending > 0 && !(self.holds(pending) && shape.agrees(self.0, pending)) {
            pending = pending.wrapping_sub(1);
        }
        pending
    }

    /// Whether the same bytes are pending in both: then both do the same with every byte that follows.
    pub(crate) fn agrees_with(self, other: Self, shape: &Shape<F>) -> bool {
        let pending = self.pending(shape);
        let differs = (self.0 ^ other.0) & F::Word::lowest_bytes(pending);
        pending == other.pending(shape) && differs == F::Word::from(0)
    }

    /// The bytes held, and `byte` behind them: newest lowest. What is above them may be anything.
    #[inline]
    fn with(self, byte: u8) -> F::Word {
        self.0.up(1) | F::Word::from(byte)
    }

    /// Whether at least `count` bytes are held.
    #[inline]
    fn holds(self, count: usize) -> bool {
        self.0.down(count) != F::Word::from(0)
    }
}
