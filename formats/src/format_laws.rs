//! Tests for a format of your own: whether it keeps the laws of [`Format`], and whether its encoding fits it.

use core::fmt;
use core::ops::Range;

use framelock::{DiscardReason, Encode, Format, Verdict};

/// A law of [`Format`] that a format breaks, and the bytes that show it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct BrokenLaw {
    /// Which one, 1 to 5.
    pub law: u8,
    /// The first of the bytes in the stream.
    pub from: usize,
    /// How many bytes were judged.
    pub length: usize,
    /// What was said of them.
    pub verdict: Verdict,
    /// The place of the byte that was changed, and what it was changed to; nothing if the stream breaks
    /// the law as it is.
    pub changed: Option<(usize, u8)>,
}

impl fmt::Display for BrokenLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.law {
            1 => "the length is more than there is, or than the longest frame's, or nothing",
            2 => "fewer bytes were a frame or rejected, and now it is something else",
            3 => "fewer bytes said that nothing could be said before more are there",
            4 => "`starts` says that none begins with this byte",
            _ => "`judge_on` says something else than `judge`",
        };
        let (law, from, length, verdict) = (self.law, self.from, self.length, self.verdict);
        write!(
            f,
            "law {law} is broken: of the {length} bytes from offset {from} on it says {verdict:?}, but {what}"
        )?;
        if let Some((place, byte)) = self.changed {
            write!(
                f,
                " (with the byte at offset {place} changed to {byte:#04X})"
            )?;
        }
        Ok(())
    }
}

impl core::error::Error for BrokenLaw {}

/// Tries whether a format of one's own keeps the laws of [`Format`]: on `stream` from each of its
/// bytes on, and on the same with any one byte changed to any other value.
///
/// Give it whole frames, the longest and the shortest, with a little behind them, and streams that
/// `proptest` or a fuzzer makes up. It is a test: what it does not try may still break a law.
/// `stream` is left as it was. It asks some thousand times the square of the longest frame's length
/// for each byte of the stream: seconds for 64 bytes.
///
/// # Errors
/// The first law that is broken, and the bytes that show it.
///
/// # Examples
/// A text that is rejected for one reason, and for another when more of it is there:
/// ```
/// use framelock::{DiscardReason, Format, Verdict};
/// use framelock_formats::check_laws;
/// struct Hasty;
/// impl Format for Hasty {
///     const LONGEST: usize = 3;
///     type Message<'a> = ();
///     fn judge(&self, bytes: &[u8]) -> Verdict {
///         match bytes {
///             [b'<', .., b'>'] => Verdict::Frame(bytes.len()),
///             [b'<', ..] if bytes.len() < 3 => Verdict::Incomplete { at_least: bytes.len() + 1 },
///             _ => Verdict::Reject(DiscardReason::NoSync),
///         }
///     }
///     fn decode(&self, _: &[u8]) {}
/// }
/// let broken = check_laws(&Hasty, &mut *b"<>.".to_vec()).unwrap_err();
/// assert_eq!((broken.law, broken.from, broken.length), (2, 0, 3));
/// ```
pub fn check_laws<F: Format>(format: &F, stream: &mut [u8]) -> Result<(), BrokenLaw> {
    let whole = 0..stream.len();
    try_from_each(format, stream, whole.clone(), None)?;
    for place in whole {
        let Some(&byte) = stream.get(place) else {
            break;
        };
        // From further back on it is not among the bytes that are judged.
        let reached = place.saturating_sub(F::LONGEST)..place.saturating_add(1);
        for other in 0..=u8::MAX {
            set(stream, place, other);
            let tried = try_from_each(format, stream, reached.clone(), Some((place, other)));
            set(stream, place, byte);
            tried?;
        }
    }
    Ok(())
}

fn try_from_each<F: Format>(
    format: &F,
    stream: &[u8],
    places: Range<usize>,
    changed: Option<(usize, u8)>,
) -> Result<(), BrokenLaw> {
    for from in places {
        let bytes = stream.get(from..).unwrap_or_default();
        let bytes = bytes.get(..F::LONGEST).unwrap_or(bytes);
        if let Some((law, length, verdict)) = broken_by(format, bytes) {
            return Err(BrokenLaw {
                law,
                from,
                length,
                verdict,
                changed,
            });
        }
    }
    Ok(())
}

fn set(stream: &mut [u8], place: usize, byte: u8) {
    if let Some(at) = stream.get_mut(place) {
        *at = byte;
    }
}

/// The first law that the verdicts about some first bytes of `bytes` break, how many they were, and
/// the verdict.
fn broken_by<F: Format>(format: &F, bytes: &[u8]) -> Option<(u8, usize, Verdict)> {
    let mut settled = None;
    // Of fewer bytes: so many were incomplete, and so many must be there before more can be said.
    let mut incomplete = 0;
    let mut due = 1;
    for length in 1..=bytes.len() {
        let bytes = bytes.get(..length).unwrap_or_default();
        let verdict = format.judge(bytes);
        let in_bounds = match verdict {
            Verdict::Frame(frame) => 1 <= frame && frame <= length,
            Verdict::Incomplete { at_least } => length < at_least && at_least <= F::LONGEST,
            Verdict::Reject(_) => true,
        };
        let starts = bytes.first().is_some_and(|&first| format.starts(first));
        let as_searched = |seen| format.judge_on(bytes, seen) == verdict;
        let law = if !in_bounds {
            1
        } else if settled.is_some_and(|before| before != verdict) {
            2
        } else if length < due && !matches!(verdict, Verdict::Incomplete { .. }) {
            3
        } else if !starts && verdict != Verdict::Reject(DiscardReason::NoSync) {
            4
        } else if ![0, incomplete / 2, incomplete].into_iter().all(as_searched) {
            5
        } else {
            match verdict {
                Verdict::Incomplete { at_least } => (incomplete, due) = (length, due.max(at_least)),
                _ => settled = Some(verdict),
            }
            continue;
        };
        return Some((law, length, verdict));
    }
    None
}

/// How a format's encoding contradicts the rest of it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum BrokenEncoding {
    /// [`SHAPE`](framelock::FixedFormat::SHAPE) has another byte at this place, the first being 0.
    Shape(usize),
    /// [`CHECK`](framelock::FixedFormat::CHECK) refuses the frame.
    Check,
    /// [`decode`](framelock::FixedFormat::decode) gives another message.
    Decode,
}

impl fmt::Display for BrokenEncoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape(place) => {
                write!(
                    f,
                    "encode: the byte at place {place} is not the one that SHAPE has there"
                )
            }
            Self::Check => f.write_str("encode: CHECK refuses the frame"),
            Self::Decode => f.write_str("decode gives another message than encode was given"),
        }
    }
}

impl core::error::Error for BrokenEncoding {}

/// Tries whether a format of fixed length contradicts itself: the frame of `message` must have the shape's
/// fixed bytes, pass the check, and decode to `message`. It is a test: call it with many messages.
///
/// # Errors
/// What the encoding contradicts first.
///
/// # Examples
/// ```
/// use framelock::motion::{BinCrc8, Setpoint};
/// use framelock::{Encode, FixedFormat, Shape};
/// use framelock_formats::{BrokenEncoding, check_encoding};
/// for byte in 0..=u8::MAX {
///     check_encoding::<BinCrc8>(Setpoint { pitch: byte, roll: 0x41, yaw: !byte })?;
/// }
///
/// struct Mistaken; // Its shape ends in CR, its frames in LF.
/// impl FixedFormat for Mistaken {
///     type Frame = [u8; 3];
///     type Message = u8;
///     const SHAPE: Shape<[u8; 3]> = Shape::new([Some(b'#'), None, Some(b'\r')]);
///     fn decode([_, number, _]: [u8; 3]) -> u8 { number }
/// }
/// impl Encode for Mistaken {
///     fn encode(number: u8) -> [u8; 3] { [b'#', number, b'\n'] }
/// }
/// assert_eq!(check_encoding::<Mistaken>(7), Err(BrokenEncoding::Shape(2)));
/// # Ok::<(), BrokenEncoding>(())
/// ```
#[expect(clippy::needless_pass_by_value, reason = "as `encode` takes it")]
pub fn check_encoding<F>(message: F::Message) -> Result<(), BrokenEncoding>
where
    F: Encode,
    F::Message: Clone + PartialEq,
{
    let frame = F::encode(message.clone());
    if let Some(place) = F::SHAPE.wrong_place(frame) {
        return Err(BrokenEncoding::Shape(place));
    }
    if F::CHECK.is_some_and(|check| !check(frame)) {
        return Err(BrokenEncoding::Check);
    }
    if F::decode(frame) != message {
        return Err(BrokenEncoding::Decode);
    }
    Ok(())
}
