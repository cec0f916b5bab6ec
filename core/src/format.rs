//! Formats of any length: what a [`BufferedReceiver`](crate::BufferedReceiver) asks about bytes.

use crate::DiscardReason;

#[cfg(kani)]
pub mod verification;

/// What the bytes from some place of the stream on are.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Verdict {
    /// No frame begins here, whatever follows.
    Reject(DiscardReason),
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
/// 2. `Reject` and `Frame` stay: `judge(bytes ++ more) == judge(bytes)`.
/// 3. `Incomplete { at_least }` stays incomplete until so many bytes are there.
/// 4. A byte that does not [start](Self::starts) a frame is rejected for
///    [`NoSync`](DiscardReason::NoSync), whatever follows.
/// 5. [`judge_on`](Self::judge_on) says what `judge` does.
///
/// Every `Layout` keeps them (theorem 13g). A format of another shape is tried with `check_laws`,
/// of the same crate. If a format breaks them, the receiver still neither panics nor hangs nor loses a byte
/// from its accounts (theorem 13b), but what it commits may then depend on how the stream is cut into slices.
///
/// # Functions for any format
/// A function for every format with messages of one kind needs `'static`, as one for every
/// [`Parser`](crate::Parser) does: `F: for<'a> Format<Message<'a> = &'a [u8]> + 'static`.
///
/// # Examples
/// Text lines, which end with a delimiter. The receiver asks again with each byte that comes;
/// `judge_on` spares it from looking through all of them again.
/// ```
/// use framelock::{BufferedReceiver, DiscardReason, Format, Verdict};
///
/// /// `$`, then text, then a line feed; 82 bytes at most.
/// struct Line;
///
/// impl Format for Line {
///     const LONGEST: usize = 82;
///     type Message<'a> = &'a [u8];
///
///     fn judge(&self, bytes: &[u8]) -> Verdict { self.judge_on(bytes, 0) }
///
///     fn judge_on(&self, bytes: &[u8], seen: usize) -> Verdict {
///         if bytes[0] != b'$' {
///             return Verdict::Reject(DiscardReason::NoSync);
///         }
///         match bytes.iter().skip(seen).position(|&byte| byte == b'\n') {
///             Some(place) => Verdict::Frame(seen + place + 1),
///             None if bytes.len() < Self::LONGEST => Verdict::Incomplete { at_least: bytes.len() + 1 },
///             None => Verdict::Reject(DiscardReason::WrongTerminator),
///         }
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { &frame[1..frame.len() - 1] }
/// }
///
/// // Law 5 holds, whatever was seen before.
/// let text = b"$GPTXT,hello\n";
/// for bytes in (1..=text.len()).map(|length| &text[..length]) {
///     assert!((0..bytes.len()).all(|seen| Line.judge_on(bytes, seen) == Line.judge(bytes)));
/// }
///
/// let mut receiver = BufferedReceiver::<_, 164>::new(Line);
/// let mut lines = Vec::new();
/// for byte in *b"noise $one\n$tw$two\n" {
///     lines.extend(receiver.push(byte).map(<[u8]>::to_vec));
/// }
/// assert_eq!(lines, [&b"one"[..], b"tw$two"]);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no `Format`",
    label = "not a `Format`",
    note = "`BufferedReceiver<F, N>` takes a `Format`; the receiver of a `FixedFormat` is `Receiver<F>`"
)]
pub trait Format {
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
    fn judge(&self, bytes: &[u8]) -> Verdict;

    /// [`judge`](Self::judge), knowing that the first `seen` bytes were incomplete (0 if nothing is
    /// known): for formats that search for a delimiter.
    #[inline]
    #[must_use]
    fn judge_on(&self, bytes: &[u8], seen: usize) -> Verdict {
        let _ = seen;
        self.judge(bytes)
    }

    /// Whether a frame may begin with this byte.
    #[inline]
    #[must_use]
    fn starts(&self, byte: u8) -> bool {
        self.judge(&[byte]) != Verdict::Reject(DiscardReason::NoSync)
    }

    /// What a frame means. It is asked about what [`judge`](Self::judge) found to be one.
    #[must_use]
    fn decode<'a>(&self, frame: &'a [u8]) -> Self::Message<'a>;
}
