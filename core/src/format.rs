//! The trait of frame formats of any length. A [`BufferedReceiver`](crate::BufferedReceiver) asks its format about the
//! received bytes.

use core::fmt;

use crate::{DiscardReason, Found, LineEvent};

#[cfg(kani)]
pub mod verification;

/// The classification of the stream from some position on.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Classification {
    /// No frame begins here, whatever bytes follow.
    Rejected(DiscardReason),
    /// A frame may begin here.
    Incomplete {
        /// The number of bytes that the format needs before its classification can change. The bytes are counted from
        /// the position on.
        at_least: usize,
    },
    /// A frame of this length begins here, whatever bytes follow.
    Frame(usize),
}

/// A frame format of any length, fixed or varying.
///
/// A format is a value, so it may hold data that is known only at run time: an address, or a table of checksums. In
/// most formats, a frame consists of a sync, a length, a payload and a checksum. Describe such a format with the type
/// `Layout` of `framelock-formats` instead of implementing this trait.
///
/// # The laws
///
/// For all `bytes` (at least one) and `more`, with at most [`longest`](Self::longest) bytes together:
///
/// 1. If the answer is `Frame(n)`, then `1 <= n <= bytes.len()`. If it is `Incomplete { at_least }`, then
///    `bytes.len() < at_least <= longest()`.
/// 2. `Rejected` and `Frame` are final: `classify(bytes ++ more) == classify(bytes)`.
/// 3. If `bytes` are `Incomplete { at_least }`, then `bytes ++ more` are also `Incomplete` as long as `bytes ++ more`
///    has fewer than `at_least` bytes.
/// 4. A byte that does not [start](Self::starts) a frame is rejected with [`NoSync`](DiscardReason::NoSync),
///    whatever bytes follow.
/// 5. [`classify_after`](Self::classify_after) returns the same as `classify`.
/// 6. If `bytes` are `Incomplete`, [`classify_before`](Self::classify_before) returns either `Frame(n)`, where
///    `1 <= n <= bytes.len()`, or `Rejected`.
///
/// Every `Layout` keeps these laws (proved for streams of up to six bytes). If you implement a format yourself, test it
/// with `check_laws` of `framelock-formats`. If a format breaks the laws, the receiver still does not panic, does not
/// hang, and counts every byte. But the delivered frames may then depend on how the stream is cut into slices.
///
/// # Functions for any format
/// If a function accepts every format with a certain type of message, its bound must include `'static`, for example:
/// `F: for<'a> Format<Message<'a> = &'a [u8]> + 'static`. The documentation of [`Parser`](crate::Parser) explains why.
///
/// # A format is `Clone`
/// Each [`Frame`] contains a clone of its format. Put tables behind a reference or an `Arc`, so that a clone copies no
/// table.
///
/// # Examples
/// Text lines, which end with a delimiter. The receiver asks this format again after each byte. `classify_after`
/// searches only the new bytes for the delimiter.
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
/// // Law 5 holds, however many bytes were already classified.
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
pub trait Format: Clone {
    /// Bytes in the longest frame. This number bounds the memory, the cost per byte, and the delay of a frame after a
    /// false start. Choose it as small as the protocol allows.
    const LONGEST: usize;

    /// The decoded content of a frame. It may borrow from the frame.
    type Message<'a>;

    /// Returns the number of bytes in the longest frame of this format value: `LONGEST`, or a smaller number for
    /// formats that are read from a file.
    #[inline]
    #[must_use]
    fn longest(&self) -> usize {
        Self::LONGEST
    }

    /// Classifies a stream that begins with `bytes`, which are 1 to `longest()` bytes.
    #[must_use]
    fn classify(&self, bytes: &[u8]) -> Classification;

    /// Does the same as [`classify`](Self::classify). The caller must already know that the first `seen` bytes are
    /// incomplete. So if a format searches for a delimiter, it can skip these bytes. `seen` may be 0.
    #[inline]
    #[must_use]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        let _ = seen;
        self.classify(bytes)
    }

    /// Classifies [incomplete](Classification::Incomplete) bytes that a line event follows. No more bytes will follow
    /// `bytes`, so the function decides whether a frame begins here and ends among these bytes.
    ///
    /// The function returns `Frame` in two cases: silence ends the format's frames, or the format has several kinds of
    /// frames and `classify` waited for a longer frame than the one with which `bytes` begin. The default returns
    /// `Rejected` with the reason [`LineEvent`](DiscardReason::LineEvent). If the function returns another reason, the
    /// receiver drops the first byte with this reason.
    #[inline]
    #[must_use]
    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        let _ = (bytes, event);
        Classification::Rejected(DiscardReason::LineEvent)
    }

    /// Returns whether a frame may begin with this byte.
    #[inline]
    #[must_use]
    fn starts(&self, byte: u8) -> bool {
        self.classify(&[byte]) != Classification::Rejected(DiscardReason::NoSync)
    }

    /// Decodes a frame. The receiver calls this function only if [`classify`](Self::classify) or
    /// [`classify_before`](Self::classify_before) has found that the bytes are a frame.
    #[must_use]
    fn decode<'a>(&self, frame: &'a [u8]) -> Self::Message<'a>;
}

/// A frame that a [`BufferedReceiver`](crate::BufferedReceiver) or a [`PacketReceiver`](crate::PacketReceiver) has
/// delivered. It is decoded on request.
///
/// It consists of a pointer, a length, and the format, which usually has size zero. So a receiver returns the frame in
/// two registers, and no time is spent on decoding until the program asks for the message.
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

    /// Returns all bytes of the frame, as they were received.
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

impl<'a, F: Format> Found<Frame<'a, F>> {
    /// Returns the decoded message if the outcome is a frame.
    ///
    /// ```
    /// # use framelock::{BufferedReceiver, Classification, Format, LineEvent};
    /// # #[derive(Clone, Copy)]
    /// # struct Pair;
    /// # impl Format for Pair {
    /// #     const LONGEST: usize = 2;
    /// #     type Message<'a> = u8;
    /// #     fn classify(&self, bytes: &[u8]) -> Classification {
    /// #         if bytes.len() < 2 { Classification::Incomplete { at_least: 2 } } else { Classification::Frame(2) }
    /// #     }
    /// #     fn decode(&self, frame: &[u8]) -> u8 { frame[1] }
    /// # }
    /// let mut values = Vec::new();
    /// let mut receiver = BufferedReceiver::<_, [u8; 4]>::new(Pair);
    /// receiver.feed(&[0, 7, 0, 9], |found| values.extend(found.decoded()));
    /// assert_eq!(values, [7, 9]);
    /// ```
    #[inline]
    pub fn decoded(self) -> Option<F::Message<'a>> {
        self.message().map(|frame| frame.message())
    }
}

/// A format that can also encode frames. For formats of fixed length there is [`Encode`](crate::Encode).
pub trait EncodeInto: Format {
    /// Writes the frame of `message` to the front of `into`, and returns the frame.
    ///
    /// # Errors
    /// Returns the reason why the message was not encoded. After an error the content of `into` is unspecified.
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
    /// The format has no frame for this message. For example, its payload is too long, or a field is out of range.
    InvalidMessage,
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::BufferTooShort => "the frame is longer than the buffer",
            Self::InvalidMessage => {
                "the format has no frame for this message, for example because its payload is too long"
            }
        })
    }
}

impl core::error::Error for EncodeError {}
