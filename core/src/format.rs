//! Formats of any length: what a [`BufferedReceiver`](crate::BufferedReceiver) asks about bytes.

use core::fmt;

use crate::DiscardReason;

#[cfg(kani)]
pub mod verification;

/// What the bytes from some place of the stream on are.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Classification {
    /// No frame begins here, whatever follows.
    Rejected(DiscardReason),
    /// A frame may begin here.
    Incomplete {
        /// Nothing more can be said before so many bytes are there.
        at_least: usize,
    },
    /// The first so many bytes are a frame, whatever follows.
    Frame(usize),
}

/// How frames stand in a stream: a format of any length, fixed or varying.
///
/// A format is a value, so it may hold what is known at run time only: an address, a table of
/// checksums. Most are a matter of sync, length and check: for these `framelock-formats` has `Layout`, a value.
///
/// # The laws
///
/// For all `bytes` (at least one) and `more`, up to [`longest`](Self::longest) together:
///
/// 1. `Frame(n)`: `1 <= n <= bytes.len()`. `Incomplete { at_least }`: `bytes.len() < at_least <= longest()`.
/// 2. `Rejected` and `Frame` stay: `classify(bytes ++ more) == classify(bytes)`.
/// 3. `Incomplete { at_least }` stays incomplete until so many bytes are there.
/// 4. A byte that does not [start](Self::starts) a frame is rejected for
///    [`NoSync`](DiscardReason::NoSync), whatever follows.
/// 5. [`classify_after`](Self::classify_after) says what `classify` does.
///
/// Every `Layout` keeps them (theorem 13g). A format of another shape is tried with `check_laws`,
/// of the same crate. If a format breaks them, the receiver still neither panics nor hangs nor loses a byte
/// from its accounts (theorem 13b), but what it commits may then depend on how the stream is cut into slices.
///
/// # Functions for any format
/// A function for every format with messages of one kind needs `'static`, as one for every
/// [`Parser`](crate::Parser) does: `F: for<'a> Format<Message<'a> = &'a [u8]> + 'static`.
///
/// # A format is `Copy`
/// Each [`Frame`] holds its format. Derive `Clone` and `Copy`; put tables behind a reference.
///
/// # Examples
/// Text lines, which end with a delimiter. The receiver asks again with each byte that comes;
/// `classify_after` spares it from looking through all of them again.
/// ```
/// use framelock::{BufferedReceiver, DiscardReason, Format, Classification};
///
/// /// `$`, then text, then a line feed; 82 bytes at most.
/// #[derive(Clone, Copy)]
/// struct Line;
///
/// impl Format for Line {
///     const LONGEST: usize = 82;
///     type Message<'a> = &'a [u8];
///
///     fn classify(&self, bytes: &[u8]) -> Classification { self.classify_after(bytes, 0) }
///
///     fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
///         if bytes[0] != b'$' {
///             return Classification::Rejected(DiscardReason::NoSync);
///         }
///         match bytes.iter().skip(seen).position(|&byte| byte == b'\n') {
///             Some(place) => Classification::Frame(seen + place + 1),
///             None if bytes.len() < Self::LONGEST => Classification::Incomplete { at_least: bytes.len() + 1 },
///             None => Classification::Rejected(DiscardReason::WrongTerminator),
///         }
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[1..frame.len() - 1] }
/// }
///
/// // Law 5 holds, whatever was seen before.
/// let text = b"$GPTXT,hello\n";
/// for bytes in (1..=text.len()).map(|length| &text[..length]) {
///     assert!((0..bytes.len()).all(|seen| Line.classify_after(bytes, seen) == Line.classify(bytes)));
/// }
///
/// let mut receiver = BufferedReceiver::<_, [u8; 164]>::new(Line);
/// let mut lines = Vec::new();
/// for byte in *b"noise $one\n$tw$two\n" {
///     lines.extend(receiver.push(byte).map(|line| line.message().to_vec()));
/// }
/// assert_eq!(lines, [&b"one"[..], b"tw$two"]);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no `Format`",
    label = "not a `Format`",
    note = "`BufferedReceiver<F, B>` takes a `Format`; the receiver of a `FixedFormat` is `Receiver<F>`"
)]
pub trait Format: Copy {
    /// Bytes in the longest frame. It bounds memory, the cost of a byte, and how late a frame is
    /// delivered behind a false beginning: choose it as small as the protocol allows.
    const LONGEST: usize;

    /// What a frame means; it may borrow from the frame.
    type Message<'a>;

    /// Bytes in the longest frame of this value: `LONGEST` or fewer, for formats that are read from a file.
    #[inline]
    #[must_use]
    fn longest(&self) -> usize {
        Self::LONGEST
    }

    /// What `bytes` begin with: 1 to `longest()` of them.
    #[must_use]
    fn classify(&self, bytes: &[u8]) -> Classification;

    /// [`classify`](Self::classify), knowing that the first `seen` bytes were incomplete (0 if nothing is
    /// known): for formats that search for a delimiter.
    #[inline]
    #[must_use]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        let _ = seen;
        self.classify(bytes)
    }

    /// Whether a frame may begin with this byte.
    #[inline]
    #[must_use]
    fn starts(&self, byte: u8) -> bool {
        self.classify(&[byte]) != Classification::Rejected(DiscardReason::NoSync)
    }

    /// What a frame means. It is asked about what [`classify`](Self::classify) found to be one.
    #[must_use]
    fn decode<'a>(&self, frame: &'a [u8]) -> Self::Message<'a>;
}

/// A frame that a [`BufferedReceiver`](crate::BufferedReceiver) has delivered. It is decoded on request.
///
/// It consists of a pointer, a length, and the format, which mostly has no size. So a receiver returns it in two
/// registers, and a byte that completes no frame pays nothing for decoding.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Frame<'a, F> {
    format: F,
    bytes: &'a [u8],
}

impl<'a, F: Format> Frame<'a, F> {
    /// Wraps bytes that the format has found to be a frame.
    #[inline]
    pub(crate) const fn new(format: F, bytes: &'a [u8]) -> Self {
        Self { format, bytes }
    }

    /// Returns all bytes of the frame, as they came.
    #[inline]
    #[must_use]
    pub const fn bytes(&self) -> &'a [u8] {
        self.bytes
    }

    /// Decodes the frame, by [`Format::decode`].
    #[inline]
    #[must_use]
    pub fn message(&self) -> F::Message<'a> {
        self.format.decode(self.bytes)
    }
}

/// A format whose frames can be made as well as received. For frames of fixed length there is
/// [`Encode`](crate::Encode).
pub trait EncodeInto: Format {
    /// Writes the frame of `message` to the front of `into`, and returns the frame.
    ///
    /// # Errors
    /// Returns the reason why there is no frame. Then the content of `into` is unspecified.
    fn encode_into<'b>(
        &self,
        message: Self::Message<'_>,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError>;
}

/// The reason why a message was not encoded.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EncodeError {
    /// The frame is longer than the buffer.
    BufferTooShort,
    /// The format has no frame for this message: its payload is too long, or a field is out of range.
    InvalidMessage,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::BufferTooShort => "the frame is longer than the buffer",
            Self::InvalidMessage => {
                "the format has no frame for this message: its payload is too long, or a field is out of range"
            }
        })
    }
}

impl core::error::Error for EncodeError {}
