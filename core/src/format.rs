//! Formats of any length: what a [`BufferedReceiver`](crate::BufferedReceiver) asks about bytes.

mod either;
mod laws;

pub use either::{Either, EitherMessage};
pub use laws::{BrokenEncoding, BrokenLaw, check_encoding, check_laws};

use crate::DiscardReason;

#[cfg(kani)]
pub(crate) mod verification;

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
/// checksums, a description. Most formats have a sync, a length and a check: see [`Headed`].
///
/// # The laws
///
/// For all `bytes` (at least one) and `more`, up to `LONGEST` together:
///
/// 1. `Frame(n)`: `1 <= n <= bytes.len()`. `Incomplete { at_least }`:
///    `bytes.len() < at_least <= LONGEST`.
/// 2. `Reject` and `Frame` stay: `judge(bytes ++ more) == judge(bytes)`.
/// 3. `Incomplete { at_least }` stays incomplete until so many bytes are there.
/// 4. A byte that does not [start](Self::starts) a frame is rejected for
///    [`NoSync`](DiscardReason::NoSync), whatever follows.
/// 5. [`judge_on`](Self::judge_on) says what `judge` does.
///
/// `Headed` and [`Either`] keep them by construction (theorem 13g). A format of another shape is
/// tried with [`check_laws`]. If a format breaks them, the receiver still neither panics nor
/// hangs nor loses a byte from its accounts (theorem 13b), but what it commits may then depend on
/// how the stream is cut into slices.
///
/// # Examples
/// Text lines, which end with a delimiter. The receiver asks again with each byte that comes;
/// `judge_on` spares it from looking through all of them again.
/// ```
/// use framelock::{BufferedReceiver, Format, DiscardReason, Verdict, check_laws};
///
/// /// `$`, then printable characters, then a line feed; 82 bytes at most.
/// struct Line;
///
/// impl Format for Line {
///     const LONGEST: usize = 82;
///     type Message<'a> = &'a [u8];
///
///     fn judge(&self, bytes: &[u8]) -> Verdict {
///         self.judge_on(bytes, 1)
///     }
///
///     fn judge_on(&self, bytes: &[u8], seen: usize) -> Verdict {
///         if bytes[0] != b'$' {
///             return Verdict::Reject(DiscardReason::NoSync);
///         }
///         for (place, byte) in bytes.iter().enumerate().skip(seen.max(1)) {
///             match byte {
///                 b'\n' => return Verdict::Frame(place + 1),
///                 b' '..=b'~' if place + 1 < Self::LONGEST => {}
///                 _ => return Verdict::Reject(DiscardReason::Terminator),
///             }
///         }
///         Verdict::Incomplete { at_least: bytes.len() + 1 }
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
///         &frame[1..frame.len() - 1]
///     }
/// }
///
/// check_laws(&Line, &mut *b"$GPTXT,hello\n".to_vec()).unwrap();
/// let mut receiver = BufferedReceiver::<_, 164>::new(Line);
/// let mut lines = Vec::new();
/// for byte in *b"noise $one\n$tw$two\n" {
///     lines.extend(receiver.push(byte).map(<[u8]>::to_vec));
/// }
/// assert_eq!(lines, [&b"one"[..], b"tw$two"]);
/// ```
pub trait Format {
    /// Bytes in the longest frame. It bounds memory, the cost of a byte, and how late a frame is
    /// delivered behind a false beginning: choose it as small as the protocol allows.
    const LONGEST: usize;

    /// What a frame means; it may borrow from the frame.
    type Message<'a>;

    /// What `bytes` begin with: 1 to `LONGEST` of them.
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

/// The usual shape: sync bytes, a header that tells the length, a check over the whole frame.
///
/// # Examples
/// A length byte and a CRC: `'A' 'B' length payload crc8`, up to 16 bytes of payload.
/// ```
/// use framelock::{BufferedReceiver, Format, Headed, Verdict};
/// # fn crc(bytes: &[u8]) -> u8 { bytes.iter().fold(0, |crc: u8, byte| (crc ^ byte).rotate_left(3)) }
///
/// struct Short;
///
/// impl Format for Short {
///     const LONGEST: usize = 3 + 16 + 1;
///     type Message<'a> = &'a [u8];
///
///     fn judge(&self, bytes: &[u8]) -> Verdict {
///         Headed { sync: b"AB", header: 3, longest: Self::LONGEST }.judge(
///             bytes,
///             |header| Some(3 + usize::from(header[2]) + 1),
///             |frame| matches!(frame, [checked @ .., check] if crc(checked) == *check),
///         )
///     }
///
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
///         &frame[3..frame.len() - 1]
///     }
/// }
///
/// let mut frame = b"AB\x05hello".to_vec();
/// frame.push(crc(&frame));
/// let mut receiver = BufferedReceiver::<_, { 2 * Short::LONGEST }>::new(Short);
/// let mut received = Vec::new();
/// for &byte in [b"AB\x09noise", &frame[..]].concat().iter() {
///     received.extend(receiver.push(byte).map(<[u8]>::to_vec));
/// }
/// assert_eq!(received, [b"hello"]);
/// ```
/// Thirty-two bytes, always: iBUS, which `framelock-formats` has.
/// ```
/// use framelock::{BufferedReceiver, Format, Headed, Verdict};
///
/// struct Ibus;
///
/// impl Format for Ibus {
///     const LONGEST: usize = 32;
///     type Message<'a> = [u16; 14];
///
///     fn judge(&self, bytes: &[u8]) -> Verdict {
///         Headed { sync: &[0x20, 0x40], header: 2, longest: 32 }.judge(
///             bytes,
///             |_| Some(32),
///             |frame| {
///                 let sum = frame[..30].iter().fold(!0_u16, |sum, &byte| sum.wrapping_sub(byte.into()));
///                 frame[30..] == sum.to_le_bytes()
///             },
///         )
///     }
///
///     fn decode(&self, frame: &[u8]) -> [u16; 14] {
///         core::array::from_fn(|i| u16::from_le_bytes([frame[2 + 2 * i], frame[3 + 2 * i]]))
///     }
/// }
/// const _: BufferedReceiver<Ibus, 64> = BufferedReceiver::new(Ibus);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Headed<'a> {
    /// The bytes that each frame begins with; none if the header alone tells.
    pub sync: &'a [u8],
    /// Bytes that must be there before the length is known: the sync and as many more as it takes, but one at
    /// least.
    pub header: usize,
    /// Bytes in the longest frame: at least `header`, at most [`Format::LONGEST`].
    pub longest: usize,
}

impl Headed<'_> {
    /// What `bytes` begin with.
    ///
    /// `length` gives the frame's length in bytes from its header, the sync included, or `None` if no frame
    /// has such a header. A length below `header` or above `longest` is none either. `check` is asked
    /// about frames that are there in full. Both must give the same answer for the same bytes.
    #[inline]
    #[must_use]
    pub fn judge(
        &self,
        bytes: &[u8],
        length: impl FnOnce(&[u8]) -> Option<usize>,
        check: impl FnOnce(&[u8]) -> bool,
    ) -> Verdict {
        self.judge_and_say_why(bytes, length, |frame| {
            (!check(frame)).then_some(DiscardReason::Check)
        })
    }

    /// [`judge`](Self::judge) for frames that can be wrong in more than their checksum: `mismatch` says
    /// what is wrong with a frame that is there in full, a [`Terminator`](DiscardReason::Terminator) for example.
    #[inline]
    #[must_use]
    pub fn judge_and_say_why(
        &self,
        bytes: &[u8],
        length: impl FnOnce(&[u8]) -> Option<usize>,
        mismatch: impl FnOnce(&[u8]) -> Option<DiscardReason>,
    ) -> Verdict {
        let mut why = DiscardReason::NoSync;
        for (byte, sync) in bytes.iter().zip(self.sync) {
            if byte != sync {
                return Verdict::Reject(why);
            }
            why = DiscardReason::BrokenSync;
        }
        let known = self.header.max(self.sync.len()).max(1);
        let Some(header) = bytes.get(..known) else {
            // A wrong sync byte is seen as soon as it is there.
            let at_least = if bytes.len() < self.sync.len() {
                bytes.len().wrapping_add(1)
            } else {
                known
            };
            return Verdict::Incomplete { at_least };
        };
        match length(header) {
            Some(length) if known <= length && length <= self.longest => {
                match bytes.get(..length) {
                    None => Verdict::Incomplete { at_least: length },
                    Some(frame) => match mismatch(frame) {
                        None => Verdict::Frame(length),
                        Some(why) => Verdict::Reject(why),
                    },
                }
            }
            _ => Verdict::Reject(DiscardReason::Header),
        }
    }
}
