//! Frame formats of fixed length. A format is a short `impl` of [`FixedFormat`].

use core::fmt::Debug;
use core::marker::PhantomData;

use crate::DiscardReason;
use crate::window::Word;

/// A format whose frames all have the same length, which is 1 to 16 bytes and known at compile time.
///
/// # Examples
/// A throttle of 16 bits, big endian, between FE and LF. The `impl` is all that you write for a new format. The
/// receiver, its fast path for slices, the counters and the theorems about frames of this length then apply to it.
/// ```
/// use framelock::{FixedFormat, Receiver, Shape};
///
/// struct Throttle;
///
/// impl FixedFormat for Throttle {
///     type Frame = [u8; 4];
///     type Message = u16;
///     const SHAPE: Shape<[u8; 4]> = Shape::new([Some(0xFE), None, None, Some(b'\n')]);
///     fn decode([_, high, low, _]: [u8; 4]) -> u16 { u16::from_be_bytes([high, low]) }
/// }
///
/// // With this line, `cargo check` reports mistakes in the format.
/// const _: Receiver<Throttle> = Receiver::new();
///
/// let mut receiver = Receiver::<Throttle>::new();
/// let received = [0xFE, 0x9C, 0x40, b'\n'].map(|byte| receiver.push(byte));
/// assert_eq!(received, [None, None, None, Some(40_000)]);
/// ```
///
/// # What does not compile
/// A shape whose length differs from the frame's length:
/// ```compile_fail,E0308
/// # use framelock::Shape;
/// const SHAPE: Shape<[u8; 8]> = Shape::new([Some(b'A'), Some(b'B'), None, Some(b'\r')]);
/// ```
/// A frame longer than 16 bytes:
/// ```compile_fail,E0277
/// # trait Format { type Frame: framelock::FrameBytes; }
/// # enum Long {}
/// # impl Format for Long {
/// type Frame = [u8; 25];
/// # }
/// ```
/// A format that has neither fixed bytes nor a check:
/// ```compile_fail,E0080
/// # use framelock::{FixedFormat, Receiver, Shape};
/// # struct Anything;
/// # impl FixedFormat for Anything {
/// #   type Frame = [u8; 4];
/// const SHAPE: Shape<[u8; 4]> = Shape::new([None; 4]);
/// #   type Message = [u8; 4];
/// #   fn decode(frame: [u8; 4]) -> [u8; 4] { frame }
/// # }
/// const _: Receiver<Anything> = Receiver::new();
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no format of fixed length",
    label = "not a `FixedFormat`",
    note = "`Receiver<F>` takes a `FixedFormat`; the receiver of a `Format` is `BufferedReceiver<F, B>`"
)]
pub trait FixedFormat: 'static {
    /// The bytes of a frame: `[u8; LENGTH]`.
    type Frame: FrameBytes;
    /// The decoded content of a frame.
    type Message;

    /// The fixed bytes of a frame, and their positions.
    const SHAPE: Shape<Self::Frame>;

    /// A further check, for example of the frame's checksum or of the range of a value. By default there is no such
    /// check. The receiver calls this function only with frames that agree with [`SHAPE`](Self::SHAPE).
    const CHECK: Option<fn(Self::Frame) -> bool> = None;

    /// Decodes a frame.
    #[must_use]
    fn decode(frame: Self::Frame) -> Self::Message;
}

/// A format that can also encode frames. Test your implementation with `check_encoding` of `framelock-formats`.
///
/// [`EncodeInto`](crate::EncodeInto) does the same for a [`Format`](crate::Format). There, encoding needs a buffer and
/// may fail. A frame of fixed length needs no buffer, and encoding it cannot fail, so formats of fixed length have this
/// trait.
pub trait Encode: FixedFormat {
    /// Returns the frame of a message.
    #[must_use]
    fn encode(message: Self::Message) -> Self::Frame;
}

/// The bytes of a frame of fixed length: `[u8; 1]` to `[u8; 16]`.
///
/// This trait is sealed: only these arrays implement it.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a frame of fixed length, which has 1 to 16 bytes",
    label = "not `[u8; 1]` to `[u8; 16]`"
)]
pub trait FrameBytes: AsRef<[u8]> + Copy + Eq + Debug + sealed::Words {
    /// Bytes in the frame.
    const LENGTH: usize;
}

pub(crate) mod sealed {
    /// The integer in which the receiver keeps a frame.
    pub trait Words {
        type Word: crate::window::Word;

        /// The state of a receiver that has received nothing. It contains the marker, and the note that no byte is
        /// pending (see the module `window`).
        const EMPTY: Self::Word;

        /// Returns the frame whose last byte is the lowest byte of `word`.
        fn from_word(word: Self::Word) -> Self;
    }
}

macro_rules! frames {
    ($word:ty: $($length:literal)*) => {$(
        impl FrameBytes for [u8; $length] {
            const LENGTH: usize = $length;
        }

        impl sealed::Words for [u8; $length] {
            type Word = $word;

            const EMPTY: $word = 1 | ($length - 1) << (<$word>::BITS - 4);

            #[inline]
            fn from_word(word: $word) -> Self {
                *word.to_be_bytes().last_chunk().unwrap_or(&[0; $length])
            }
        }
    )*};
}
frames!(u64: 1 2 3 4 5 6 7 8);
frames!(u128: 9 10 11 12 13 14 15 16);

/// The fixed bytes of a frame, and their positions.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shape<F> {
    /// The fixed bytes, and 0 at all other positions. Here and in `mask`, the lowest byte stands for the frame's last
    /// byte.
    pattern: u128,
    /// 0xFF at the positions of fixed bytes, and 0 at all others.
    mask: u128,
    /// The fixed bytes again, in reverse order: the element at index 0 stands for the frame's last byte. A
    /// microcontroller needs fewer instructions to look up a byte than to shift a word.
    from_end: [Option<u8>; 16],
    /// The length of the sync: the number of fixed bytes at the start of the frame.
    sync: usize,
    frame: PhantomData<F>,
}

impl<const LENGTH: usize> Shape<[u8; LENGTH]> {
    /// Creates the shape of a frame of `LENGTH` bytes. `places` has `Some(byte)` at each position that must hold that
    /// byte, and `None` at each position that may hold any byte.
    #[must_use]
    pub const fn new(places: [Option<u8>; LENGTH]) -> Self {
        let mut shape = Self {
            pattern: 0,
            mask: 0,
            from_end: [None; 16],
            sync: 0,
            frame: PhantomData,
        };
        let mut rest = places.as_slice();
        let mut in_sync = true;
        while let [place, behind @ ..] = rest {
            let (byte, fixed) = match *place {
                Some(byte) => (byte, u8::MAX),
                None => (0, 0),
            };
            in_sync &= place.is_some();
            shape.pattern = shape.pattern << u8::BITS | byte as u128;
            shape.mask = shape.mask << u8::BITS | fixed as u128;
            shape.sync = shape.sync.wrapping_add(in_sync as usize);
            rest = behind;
        }
        let mut rest = places.as_slice();
        let mut slots: &mut [Option<u8>] = &mut shape.from_end;
        while let ([before @ .., place], [slot, further @ ..]) = (rest, slots) {
            *slot = *place;
            (rest, slots) = (before, further);
        }
        shape
    }
}

impl<F: FrameBytes> Shape<F> {
    /// Returns whether the frame has a fixed byte.
    pub(crate) const fn has_fixed_bytes(&self) -> bool {
        self.mask != 0
    }

    #[inline]
    pub(crate) fn pattern(&self) -> F::Word {
        F::Word::truncated(self.pattern)
    }

    #[inline]
    pub(crate) fn mask(&self) -> F::Word {
        F::Word::truncated(self.mask)
    }

    /// Returns whether a frame may begin with the lowest `known` bytes of `word`, considering only the fixed bytes.
    /// `known` is at least one and at most a frame's length.
    #[inline]
    pub(crate) fn agrees(&self, word: F::Word, known: usize) -> bool {
        let unknown = F::LENGTH.wrapping_sub(known);
        let differing = (word ^ self.pattern().down(unknown)) & self.mask().down(unknown);
        differing == F::Word::from(0)
    }

    /// Returns whether `byte` may be at the position that is `following` bytes before the frame's last byte.
    ///
    /// Looks up the fixed byte instead of shifting the pattern, because on a microcontroller a shift by a variable
    /// amount takes many more instructions.
    #[inline]
    pub(crate) fn accepts(&self, byte: u8, following: usize) -> bool {
        match self.from_end.get(following) {
            Some(Some(fixed)) => *fixed == byte,
            _ => true,
        }
    }

    /// Returns the reason why no frame can begin with the lowest `known` bytes of `word`, or `None` if a frame can.
    /// `known` is at least one and at most a frame's length.
    #[inline]
    pub(crate) fn mismatch(&self, word: F::Word, known: usize) -> Option<DiscardReason> {
        self.mismatch_at_top(word.up(F::Word::BYTES.wrapping_sub(known)), known)
    }

    /// Returns the reason why no frame can begin with the highest `known` bytes of `word`, or `None` if a frame can.
    /// The first byte that differs from the shape decides the reason.
    #[inline]
    pub(crate) fn mismatch_at_top(&self, word: F::Word, known: usize) -> Option<DiscardReason> {
        let below = F::Word::BYTES.wrapping_sub(F::LENGTH);
        let differing = (word ^ self.pattern().up(below)) & self.mask().up(below);
        let first_byte = F::Word::BYTES.wrapping_sub(1);
        if self.sync > 0 && differing.down(first_byte) != F::Word::from(0) {
            return Some(DiscardReason::NoSync);
        }
        let place = differing.leading_zero_bytes();
        (place < known).then(|| self.reason_after_first(place))
    }

    /// Returns the reason to reject a frame whose first wrong byte is at `place`, counted from 0. If the frame has a
    /// sync, the caller must already know that the first sync byte is right.
    #[inline]
    pub(crate) const fn reason_after_first(&self, place: usize) -> DiscardReason {
        if place < self.sync {
            DiscardReason::BrokenSync
        } else {
            DiscardReason::WrongTerminator
        }
    }

    /// Returns the first position, counted from 0, at which `frame` differs from the shape's fixed byte, or `None` if
    /// all fixed bytes agree. Use this function only in tests, because it examines the frame byte by byte.
    #[must_use]
    pub fn wrong_place(&self, frame: F) -> Option<usize> {
        let bytes = frame.as_ref().iter();
        let word = bytes.fold(0, |word: u128, &byte| word << u8::BITS | u128::from(byte));
        let differs = (word ^ self.pattern) & self.mask;
        let behind = F::LENGTH.wrapping_sub(1);
        (differs != 0).then(|| behind.wrapping_sub(differs.ilog2() as usize / 8))
    }
}
