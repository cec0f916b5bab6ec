//! Frame formats of fixed length: an `impl` of [`FixedFormat`], a few lines.

use core::fmt::Debug;
use core::marker::PhantomData;

use crate::DiscardReason;
use crate::window::Word;

/// A frame format of fixed length, 1 to 16 bytes, known at compile time.
///
/// # Examples
/// A throttle of 16 bits, big endian, between FE and LF. This is all that a new format takes; the receiver,
/// its slice path, the accounting and the theorems about every format come with it.
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
/// // So that `cargo check` finds mistakes in a format: what could go wrong does not compile.
/// const _: Receiver<Throttle> = Receiver::new();
///
/// let mut receiver = Receiver::<Throttle>::new();
/// let received = [0xFE, 0x9C, 0x40, b'\n'].map(|byte| receiver.push(byte));
/// assert_eq!(received, [None, None, None, Some(40_000)]);
/// ```
///
/// # What does not compile
/// A shape of another length than the frame:
/// ```compile_fail,E0308
/// # use framelock::Shape;
/// const SHAPE: Shape<[u8; 8]> = Shape::new([Some(b'A'), Some(b'B'), None, Some(b'\r')]);
/// ```
/// A frame longer than 16 bytes:
/// ```compile_fail,E0277
/// # trait Format { type Frame: framelock::Frame; }
/// # enum Long {}
/// # impl Format for Long {
/// type Frame = [u8; 25];
/// # }
/// ```
/// A format that every window of the stream would be a frame of:
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
    /// `[u8; LENGTH]`.
    type Frame: FrameBytes;
    /// What a frame means.
    type Message;

    /// Which byte must stand where.
    const SHAPE: Shape<Self::Frame>;

    /// What is checked beyond the fixed bytes, if anything: a checksum, a range. It is asked only
    /// about frames whose fixed bytes agree.
    const CHECK: Option<fn(Self::Frame) -> bool> = None;

    /// What a frame means.
    #[must_use]
    fn decode(frame: Self::Frame) -> Self::Message;
}

/// A format whose frames can be made as well as received. `check_encoding` of `framelock-formats` is a test for it.
pub trait Encode: FixedFormat {
    /// The frame that means it.
    #[must_use]
    fn encode(message: Self::Message) -> Self::Frame;
}

/// The bytes of a frame of fixed length: `[u8; 1]` to `[u8; 16]`.
///
/// This trait is sealed: these arrays implement it, and nothing else can.
#[diagnostic::on_unimplemented(
    message = "a frame of fixed length has 1 to 16 bytes; `{Self}` is none",
    label = "not `[u8; 1]` to `[u8; 16]`"
)]
pub trait FrameBytes: AsRef<[u8]> + Copy + Eq + Debug + sealed::Words {
    /// Bytes in the frame.
    const LENGTH: usize;
}

pub(crate) mod sealed {
    /// How the receiver keeps a frame.
    pub trait Words {
        type Word: crate::window::Word;

        /// The frame whose last byte is the lowest of `word`.
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

            #[inline]
            fn from_word(word: $word) -> Self {
                *word.to_be_bytes().last_chunk().unwrap_or(&[0; $length])
            }
        }
    )*};
}
frames!(u64: 1 2 3 4 5 6 7 8);
frames!(u128: 9 10 11 12 13 14 15 16);

/// Which byte must stand where in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shape<F> {
    /// The fixed bytes, 0 in the other places. The frame's last byte is lowest, here and below.
    pattern: u128,
    /// 0xFF in the places of fixed bytes, 0 in the others.
    mask: u128,
    /// How many fixed bytes the frame begins with: its sync.
    sync: usize,
    frame: PhantomData<F>,
}

impl<const LENGTH: usize> Shape<[u8; LENGTH]> {
    /// A frame of `LENGTH` bytes: `Some(byte)` where it must be that byte, `None` where any may be.
    #[must_use]
    pub const fn new(places: [Option<u8>; LENGTH]) -> Self {
        let mut shape = Self {
            pattern: 0,
            mask: 0,
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
        shape
    }
}

impl<F: FrameBytes> Shape<F> {
    /// Whether any byte is fixed.
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

    /// Whether a frame may begin with the lowest `known` bytes of `word`, at least one and at most a
    /// frame's length, as far as the fixed bytes tell.
    #[inline]
    pub(crate) fn agrees(&self, word: F::Word, known: usize) -> bool {
        self.differs(word, known) == F::Word::from(0)
    }

    /// If none may: why not. It is the first place at which they differ that tells.
    #[inline]
    pub(crate) fn mismatch(&self, word: F::Word, known: usize) -> Option<DiscardReason> {
        let differs = self.differs(word, known);
        if differs == F::Word::from(0) {
            return None;
        }
        let from_there = F::Word::BYTES.wrapping_sub(differs.leading_zero_bytes());
        Some(match known.wrapping_sub(from_there) {
            place if place >= self.sync => DiscardReason::WrongTerminator,
            0 => DiscardReason::NoSync,
            _ => DiscardReason::BrokenSync,
        })
    }

    #[inline]
    fn differs(&self, word: F::Word, known: usize) -> F::Word {
        let unknown = F::LENGTH.wrapping_sub(known);
        (word ^ self.pattern().down(unknown)) & self.mask().down(unknown)
    }

    /// The first place at which `frame` has another byte than the fixed one, the frame's first being 0.
    /// Nothing if all fixed bytes agree. It is for tests: it looks at the frame byte by byte.
    #[must_use]
    pub fn wrong_place(&self, frame: F) -> Option<usize> {
        let bytes = frame.as_ref().iter();
        let word = bytes.fold(0, |word: u128, &byte| word << u8::BITS | u128::from(byte));
        let differs = (word ^ self.pattern) & self.mask;
        let behind = F::LENGTH.wrapping_sub(1);
        (differs != 0).then(|| behind.wrapping_sub(differs.ilog2() as usize / 8))
    }
}
