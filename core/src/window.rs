//! The receiver's engine: one word of state, and one step for each byte.
//!
//! The state holds the newest bytes since the last delivered frame, always fewer bytes than a frame has. Older bytes no
//! longer matter. The bytes lie in a shift register, the newest in the lowest position. The marker, a bit that is 1
//! just above the oldest byte, shows how many bytes are held:
//!
//! ```text
//!           7        6        5        4        3        2        1        0   byte of the word
//!      ┌────────┬────────┬────────┬────────┬────────┬────────┬────────┬────────┐
//!      │   0    │   1    │ oldest │        │        │        │        │ newest │  a 7-byte format,
//!      └────────┴────────┴────────┴────────┴────────┴────────┴────────┴────────┘  full
//!      ┌────────┬────────┬────────┬────────┬────────┬────────┬────────┬────────┐
//!      │   0    │   0    │   0    │   0    │   0    │   1    │ oldest │ newest │  two bytes since
//!      └────────┴────────┴────────┴────────┴────────┴────────┴────────┴────────┘  the last frame
//! ```
//!
//! The next byte completes a frame if three conditions hold:
//!
//! * The marker is at the top, so none of the bytes belongs to an earlier frame.
//! * The fixed bytes agree with the shape. One masked comparison tests the marker and the fixed bytes together.
//! * The frame passes the format's own check.
//!
//! Otherwise the byte is shifted in, and the marker moves up unless it is at the top.
//!
//! [`push`](Window::push) keeps no position in the frame. It compares *every* stretch of the stream with the shape, if
//! the stretch is as long as a frame and overlaps no delivered frame.
//!
//! [`push_with`](Window::push_with) also reports discarded bytes, so it needs the number of pending bytes. It stores a
//! *note* in the word's four highest bits. The note states how many more bytes can become pending. `push` does not need
//! the note, and shifts it out. A note of 0 is ambiguous: either the window is full of pending bytes, or the last call
//! was `push`.

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

    /// Returns the lowest bytes of a wider word.
    fn truncated(wide: u128) -> Self;

    /// Returns the word whose highest byte is the first of `bytes`, or `None` if `bytes` is shorter than a word.
    fn load(bytes: &[u8]) -> Option<Self>;

    /// Returns a word with 1s in its lowest `count` bytes. `count` is less than the size of the word.
    fn lowest_bytes(count: usize) -> Self;

    /// Shifts left by `count` bytes. `count` is less than the number of bytes in the word.
    fn up(self, count: usize) -> Self;

    /// Shifts right by `count` bytes. `count` is less than the number of bytes in the word.
    fn down(self, count: usize) -> Self;

    /// Returns the number of leading zero bytes.
    fn leading_zero_bytes(self) -> usize;

    /// Returns the number in the four highest bits.
    fn note(self) -> usize;

    /// Returns the word whose four highest bits are `note`, at most 15, and whose other bits are 0.
    fn of_note(note: usize) -> Self;
}

macro_rules! word {
    ($word:ty) => {
        impl Word for $word {
            const BYTES: usize = size_of::<Self>();
            const ONE: Self = 1;

            #[inline]
            #[allow(clippy::cast_possible_truncation, reason = "truncation is the purpose")]
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

            #[inline]
            #[allow(clippy::cast_possible_truncation, reason = "four bits")]
            fn note(self) -> usize {
                (self >> (Self::BITS - 4)) as usize
            }

            #[inline]
            fn of_note(note: usize) -> Self {
                (note as Self) << (Self::BITS - 4)
            }
        }
    };
}
word!(u64);
word!(u128);

/// Returns the number of bits in `bytes` bytes, at most 16 bytes.
#[inline]
#[expect(clippy::cast_possible_truncation, reason = "at most 16")]
fn bits(bytes: usize) -> u32 {
    (bytes as u32).wrapping_mul(u8::BITS)
}

/// The state: the newest bytes since the last delivered frame, at most one byte fewer than a frame has.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Window<F: FrameBytes>(F::Word);

/// The rest of a slice after a step of [`feed`](Window::feed), and the number of bytes that the step has discarded.
struct Taken<'b> {
    rest: &'b [u8],
    dropped: usize,
}

impl<F: FrameBytes> Window<F> {
    /// The window that holds no byte: the state at reset and after every delivered frame.
    pub(crate) const EMPTY: Self = Self(F::EMPTY);

    /// The largest number of bytes held, one fewer than a frame has.
    const MOST: usize = F::LENGTH - 1;

    /// Takes `byte`. If `byte` completes a frame, returns the frame, in the lowest bytes of the word.
    ///
    /// Calls `check` only with a frame that agrees with the shape. Apart from `check`, each byte costs the same few
    /// operations in every state: a masked comparison, a shift, and a test of the marker.
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
        // Marker and fixed bytes share one branch, because it is unpredictable which of them differs.
        if differs | last_differs == F::Word::from(0) && check(shifted) {
            *self = Self::EMPTY;
            return Some(shifted);
        }
        *self = Self(self.without_oldest(shifted));
        None
    }

    /// Does the same as [`push`](Self::push), and reports the discarded bytes with their reasons, oldest first.
    /// Discards the oldest pending bytes, and if necessary `byte`, too, until a frame can begin with the rest.
    #[inline]
    pub(crate) fn push_with(
        &mut self,
        shape: &Shape<F>,
        byte: u8,
        check: impl FnOnce(F::Word) -> bool,
        discarded: impl FnMut(DiscardReason),
    ) -> Option<F::Word> {
        let room = self.room(shape);
        self.push_with_room(room, shape, byte, check, discarded)
    }

    /// Does the same as [`push_with`](Self::push_with) in a window in which `room` more bytes can become pending.
    #[inline]
    fn push_with_room(
        &mut self,
        room: usize,
        shape: &Shape<F>,
        byte: u8,
        check: impl FnOnce(F::Word) -> bool,
        mut discarded: impl FnMut(DiscardReason),
    ) -> Option<F::Word> {
        let with_byte = self.with(byte);
        let held = self.without_oldest(with_byte);
        // The pending bytes agree with the shape, so only `byte` can differ.
        if !shape.accepts(byte, room) {
            if room == Self::MOST {
                // Noise: no byte was pending before, and none is pending now.
                discarded(DiscardReason::NoSync);
                *self = Self(held | Self::note(0));
                return None;
            }
            discarded(shape.reason_after_first(Self::MOST.wrapping_sub(room)));
        } else if room > 0 {
            *self = Self(held | F::Word::of_note(room.wrapping_sub(1)));
            return None;
        } else if check(with_byte) {
            *self = Self::EMPTY;
            return Some(with_byte);
        } else {
            discarded(DiscardReason::ChecksumMismatch);
        }
        // The oldest pending byte has been discarded. The other pending bytes and `byte` lie at the top of `bytes`.
        // Discard bytes from their front until a frame can begin with the rest.
        let mut count = Self::MOST.wrapping_sub(room);
        let mut bytes = with_byte.up(F::Word::BYTES.wrapping_sub(count));
        while count > 0 {
            let Some(why) = shape.mismatch_at_top(bytes, count) else {
                break;
            };
            discarded(why);
            (bytes, count) = (bytes.up(1), count.wrapping_sub(1));
        }
        *self = Self(held | Self::note(count));
        None
    }

    /// Returns how many more bytes can become pending. Reads this number from the note, or computes it if there is no
    /// note.
    #[inline]
    fn room(self, shape: &Shape<F>) -> usize {
        let note = self.0.note();
        if note > 0 || self.is_full() && shape.agrees(self.0, Self::MOST) {
            note
        } else {
            self.room_without_note(shape)
        }
    }

    #[cold]
    #[inline(never)]
    fn room_without_note(self, shape: &Shape<F>) -> usize {
        Self::MOST.wrapping_sub(self.pending_without_note(shape))
    }

    /// Returns the note of a window in which `count` bytes are pending.
    #[inline]
    fn note(count: usize) -> F::Word {
        F::Word::of_note(Self::MOST.wrapping_sub(count))
    }

    /// Takes a slice. Reports the outcome of each byte, except the bytes that are pending at the end. The outcomes and
    /// their order are those of [`push_with`](Self::push_with), however a stream is cut into slices.
    ///
    /// The first bytes go through the window until it has no byte from before the slice. Then the function compares the
    /// slice's own bytes with the shape. When less than a [`Word`] is left, the bytes go through the window again.
    #[inline]
    pub(crate) fn feed(
        &mut self,
        shape: &Shape<F>,
        bytes: &[u8],
        check: impl Fn(F::Word) -> bool,
        mut found: impl FnMut(Found<F::Word>),
    ) {
        // Bytes from before the slice may be pending. Push bytes of the slice one by one until the earlier bytes are
        // decided.
        let mut at = 0_usize;
        while at < Self::MOST && self.pending(shape) != 0 {
            let Some(&byte) = bytes.get(at) else {
                return;
            };
            self.push_and_tell(shape, byte, &check, &mut found);
            at = at.wrapping_add(1);
        }
        let mut rest = self.give_back(shape, bytes, at);
        'rounds: loop {
            rest = Self::skip_blocks(shape, rest, &mut found);
            // If the rest has a whole block, the first block contains a byte that can begin a frame. Compare with the
            // shape at one position after another, until `BLOCK` bytes have been discarded. Searching for skippable
            // blocks at each position would cost more time than it saves.
            let mut dropped = 0_usize;
            while dropped < BLOCK {
                let Some(taken) = Self::take(shape, rest, &check, &mut found) else {
                    break 'rounds;
                };
                (rest, dropped) = (taken.rest, dropped.wrapping_add(taken.dropped));
            }
        }
        // The rest of the slice is shorter than a word, but may still contain a whole frame.
        for &byte in rest {
            self.push_and_tell(shape, byte, &check, &mut found);
        }
    }

    /// Empties the window. Returns the slice from the first pending byte on. `taken` bytes of the slice have been
    /// pushed, and all pending bytes are among them.
    #[inline]
    fn give_back<'b>(&mut self, shape: &Shape<F>, bytes: &'b [u8], taken: usize) -> &'b [u8] {
        let at = taken.wrapping_sub(self.pending(shape));
        *self = Self::EMPTY;
        bytes.get(at..).unwrap_or_default()
    }

    /// Discards the leading blocks in which no byte can begin a frame. Returns the rest of the slice.
    #[inline]
    fn skip_blocks<'b>(
        shape: &Shape<F>,
        bytes: &'b [u8],
        found: &mut impl FnMut(Found<F::Word>),
    ) -> &'b [u8] {
        let count = blocks_without_start(bytes, |byte| shape.agrees(byte.into(), 1));
        if count == 0 {
            return bytes;
        }
        let why = DiscardReason::NoSync;
        found(Found::Discarded { count, why });
        bytes.get(count..).unwrap_or_default()
    }

    /// Delivers the frame with which the slice begins, or discards the slice's first byte. Returns `None` if the slice
    /// is shorter than a word.
    #[inline]
    fn take<'b>(
        shape: &Shape<F>,
        bytes: &'b [u8],
        check: impl Fn(F::Word) -> bool,
        found: &mut impl FnMut(Found<F::Word>),
    ) -> Option<Taken<'b>> {
        let length = F::LENGTH;
        let message = F::Word::load(bytes)?.down(F::Word::BYTES.wrapping_sub(length));
        if shape.agrees(message, length) && check(message) {
            found(Found::Frame { length, message });
            let rest = bytes.get(length..).unwrap_or_default();
            return Some(Taken { rest, dropped: 0 });
        }
        let (count, why) = (1, shape.mismatch(message, length));
        let why = why.unwrap_or(DiscardReason::ChecksumMismatch);
        found(Found::Discarded { count, why });
        let rest = bytes.get(count..).unwrap_or_default();
        Some(Taken { rest, dropped: 1 })
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

    /// Returns the number of pending bytes, always less than a frame's length. Pending bytes are those at the end of
    /// the stream that may still become part of a frame.
    #[inline]
    pub(crate) fn pending(self, shape: &Shape<F>) -> usize {
        match self.0.note() {
            0 => self.pending_without_note(shape),
            room => Self::MOST.wrapping_sub(room),
        }
    }

    /// Returns the number of pending bytes of a window whose note is 0.
    // Never inlined, because shifts by variable amounts need much code on a microcontroller.
    #[inline(never)]
    fn pending_without_note(self, shape: &Shape<F>) -> usize {
        let mut pending = Self::MOST;
        while pending > 0 && !(self.holds(pending) && shape.agrees(self.0, pending)) {
            pending = pending.wrapping_sub(1);
        }
        pending
    }

    /// Returns whether the same bytes are pending in both windows. If so, both windows treat all later bytes alike.
    pub(crate) fn agrees_with(self, other: Self, shape: &Shape<F>) -> bool {
        let pending = self.pending(shape);
        let differs = (self.0 ^ other.0) & F::Word::lowest_bytes(pending);
        pending == other.pending(shape) && differs == F::Word::from(0)
    }

    /// Returns the bytes held, followed by `byte` in the lowest position. The bits above the oldest byte may have any
    /// value.
    #[inline]
    fn with(self, byte: u8) -> F::Word {
        self.0.up(1) | F::Word::from(byte)
    }

    /// Returns the state after one more byte was shifted in. `with_byte` is the shifted word. If the window was full,
    /// drops the oldest byte and puts the marker back.
    #[inline]
    fn without_oldest(self, with_byte: F::Word) -> F::Word {
        if self.is_full() {
            with_byte & F::Word::lowest_bytes(Self::MOST) | F::Word::ONE.up(Self::MOST)
        } else {
            with_byte
        }
    }

    /// Returns whether the marker is at the top.
    #[inline]
    fn is_full(self) -> bool {
        self.0 & F::Word::ONE.up(Self::MOST) != F::Word::from(0)
    }

    /// Returns whether at least `count` bytes are held. The note must be 0, because the bits of another note would
    /// count as the marker.
    #[inline]
    fn holds(self, count: usize) -> bool {
        self.0.down(count) != F::Word::from(0)
    }
}
