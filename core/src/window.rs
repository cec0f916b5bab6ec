//! The receiver's engine: one word of state, one function of state, format values and byte.
//!
//! The state is the bytes taken since the last commit, as many as can matter: one fewer than a
//! frame has. They lie in a shift register, newest lowest, and a marker in front of the oldest
//! shows how many they are:
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
//! The next byte completes a frame if none of the bytes belongs to an earlier one, so if the marker
//! has come to the top, the fixed bytes agree (both are one masked comparison), and the format's own
//! check holds. Otherwise it is shifted in, and the marker with it, but never past the top. A frame's
//! last byte is never stored, so seven bytes of history and the marker fill eight bytes.
//!
//! That is the whole receiver. It never asks where in a frame it is, so it cannot be led astray:
//! *every* window of the stream that overlaps no committed frame is tested.

use core::fmt::Debug;
use core::ops::{BitAnd, BitOr, BitXor, Shl, Shr};

/// A word that holds a frame: `u64` for formats of up to 8 bytes, `u128` for up to 16.
pub trait Word:
    Copy
    + Eq
    + Debug
    + From<u8>
    + BitAnd<Output = Self>
    + BitOr<Output = Self>
    + BitXor<Output = Self>
    + Shl<u32, Output = Self>
    + Shr<u32, Output = Self>
    + sealed::Sealed
{
    /// Bytes in the word.
    const BYTES: u32;
    /// The word 0.
    const ZERO: Self;
    /// The word 1.
    const ONE: Self;
    /// 1s in every byte but the highest.
    const ALL_BUT_HIGHEST: Self;

    /// The word's bytes, highest first.
    #[must_use]
    fn to_be_bytes(self) -> impl AsRef<[u8]>;

    /// The lowest byte.
    #[must_use]
    fn lowest(self) -> u8;

    /// How many bytes above the highest that is not 0.
    #[must_use]
    fn leading_zero_bytes(self) -> u8;

    /// The word whose highest byte is the first of `bytes`; `None` if there are too few.
    #[must_use]
    fn load(bytes: &[u8]) -> Option<Self>;
}

mod sealed {
    pub trait Sealed {}
}

/// The values of a frame format, for the engine: which byte may stand where.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shape<W> {
    length: u8,
    sync_length: u8,
    mask: W,
    pattern: W,
}

impl<W: Word> Shape<W> {
    /// Bytes in a frame.
    #[must_use]
    pub const fn length(&self) -> u8 {
        self.length
    }

    /// How many fixed bytes the frame begins with.
    #[must_use]
    pub const fn sync_length(&self) -> u8 {
        self.sync_length
    }

    /// The frame's fixed bytes: 0xFF in each, 0 in the others; the frame's last byte lowest.
    #[must_use]
    pub const fn mask(&self) -> W {
        self.mask
    }

    /// What the fixed bytes are, 0 in the others; the frame's last byte lowest.
    #[must_use]
    pub const fn pattern(&self) -> W {
        self.pattern
    }

    /// The byte that must stand at `place`, counted from 0; `None` where any may.
    pub(crate) fn fixed(&self, place: u8) -> Option<u8> {
        let behind = 8 * u32::from(self.length - 1 - place);
        ((self.mask >> behind).lowest() != 0).then(|| (self.pattern >> behind).lowest())
    }
}

macro_rules! word {
    ($word:ty) => {
        impl sealed::Sealed for $word {}

        impl Word for $word {
            const BYTES: u32 = Self::BITS / 8;
            const ZERO: Self = 0;
            const ONE: Self = 1;
            const ALL_BUT_HIGHEST: Self = Self::MAX >> 8;

            fn to_be_bytes(self) -> impl AsRef<[u8]> {
                self.to_be_bytes()
            }

            fn lowest(self) -> u8 {
                self.to_le_bytes()[0]
            }

            #[expect(clippy::cast_possible_truncation, reason = "at most 16")]
            fn leading_zero_bytes(self) -> u8 {
                (self.leading_zeros() / 8) as u8
            }

            fn load(bytes: &[u8]) -> Option<Self> {
                bytes.first_chunk().map(|bytes| Self::from_be_bytes(*bytes))
            }
        }

        impl Shape<$word> {
            /// A frame of `LENGTH` bytes: `Some(byte)` stands where it must be that byte, `None`
            /// where any may be.
            ///
            /// A length of zero, or one that the word cannot hold, does not compile.
            #[must_use]
            pub const fn new<const LENGTH: usize>(places: [Option<u8>; LENGTH]) -> Self {
                const { assert!(LENGTH >= 1 && LENGTH <= size_of::<$word>()) };
                let mut shape = Self {
                    length: 0,
                    sync_length: 0,
                    mask: 0,
                    pattern: 0,
                };
                let mut rest = places.as_slice();
                while let [place, behind @ ..] = rest {
                    shape.mask <<= 8;
                    shape.pattern <<= 8;
                    if let Some(byte) = place {
                        shape.mask |= 0xFF;
                        shape.pattern |= *byte as $word;
                        if shape.sync_length == shape.length {
                            shape.sync_length += 1;
                        }
                    }
                    shape.length += 1;
                    rest = behind;
                }
                shape
            }
        }
    };
}
word!(u64);
word!(u128);

/// The state: the bytes taken since the last commit that the next frame may yet include.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Window<W>(W);

impl<W: Word> Window<W> {
    /// Nothing held: the state at reset and after every commit.
    pub const EMPTY: Self = Self(W::ONE);

    /// The state that holds the lowest `count` bytes of `history`, newest lowest; no more than the
    /// format can need, one fewer than its frame has. Every state is made by some such call, and
    /// every one so made is reached by the stream that consists of those bytes.
    #[must_use]
    pub fn holding(shape: &Shape<W>, history: W, count: u8) -> Self {
        let count = count.min(shape.length - 1);
        Self(history & lowest_bytes(count) | marker(count))
    }

    /// How many bytes are held.
    #[must_use]
    pub fn count(self) -> u8 {
        W::BYTES.to_le_bytes()[0] - 1 - self.0.leading_zero_bytes()
    }

    /// The bytes held, newest lowest, 0 above.
    #[must_use]
    pub fn history(self) -> W {
        self.0 ^ marker(self.count())
    }

    /// The bytes held and, behind them, `byte`: newest lowest, 0 above.
    #[must_use]
    pub fn with(self, byte: u8) -> W {
        self.history() << 8 | W::from(byte)
    }

    /// One step: the next state, and whether [`with(byte)`](Self::with) is a frame that `byte`
    /// completes.
    ///
    /// `check` is asked about a window only if the fixed bytes of it agree; it may be anything.
    /// Without a check, a step costs the same few operations whatever the state and the byte: a
    /// masked comparison, a shift, a look at the marker.
    #[inline]
    #[must_use]
    pub fn push(self, shape: &Shape<W>, byte: u8, check: impl FnOnce(W) -> bool) -> (Self, bool) {
        let most = shape.length - 1;
        let differing = (self.0 ^ (marker::<W>(most) | shape.pattern >> 8))
            & (above::<W>(most) | shape.mask >> 8);
        let last_agrees = (byte ^ shape.pattern.lowest()) & shape.mask.lowest() == 0;
        if last_agrees && differing == W::ZERO && check(self.with(byte)) {
            return (Self::EMPTY, true);
        }
        let shifted = self.extended(byte).0;
        if self.holds(most) {
            (Self(shifted & lowest_bytes(most) | marker(most)), false)
        } else {
            (Self(shifted), false)
        }
    }

    /// With one byte more. Of a state that holds as many bytes as the format can need, it is no
    /// state, but its [`word`](Self::word) ends in the frame that the byte may complete.
    #[inline]
    pub(crate) fn extended(self, byte: u8) -> Self {
        Self(self.0 << 8 | W::from(byte))
    }

    /// Whether at least so many bytes are held.
    #[inline]
    pub(crate) fn holds(self, count: u8) -> bool {
        self.0 >> (8 * u32::from(count)) != W::ZERO
    }

    /// The bytes held, newest lowest; what is above them may be anything.
    #[inline]
    pub(crate) fn word(self) -> W {
        self.0
    }
}

/// A word with 1s in every byte but the lowest `count`, fewer than the word has.
fn above<W: Word>(count: u8) -> W {
    (W::ALL_BUT_HIGHEST << 8 | W::from(u8::MAX)) << (8 * u32::from(count))
}

/// The marker in front of `count` bytes.
fn marker<W: Word>(count: u8) -> W {
    W::ONE << (8 * u32::from(count))
}

/// A word with 1s in its lowest `count` bytes; `count` is at most one fewer than the word has.
fn lowest_bytes<W: Word>(count: u8) -> W {
    W::ALL_BUT_HIGHEST >> (8 * (W::BYTES - 1 - u32::from(count)))
}
