//! Functions for the tests of your own format. They check that the format keeps the laws of [`Format`], and that its
//! encoding agrees with its shape, its check and its decoding.

use core::fmt;

use framelock::{Classification, DiscardReason, Encode, Format, LineEvent};

/// A law of [`Format`] that a format breaks, and the bytes that show the violation.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub struct BrokenLaw {
    /// The number of the law, 1 to 6.
    pub law: u8,
    /// The index in the stream of the first classified byte.
    pub from: usize,
    /// The number of classified bytes.
    pub length: usize,
    /// The classification of these bytes.
    pub classification: Classification,
    /// The index of the changed byte in the stream, and its new value; `None` if the unchanged stream breaks the law.
    pub changed: Option<(usize, u8)>,
}

impl fmt::Display for BrokenLaw {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let what = match self.law {
            1 => {
                "a frame must have at least one and at most all of these bytes, and `at_least` must be more than the \
                 number of these bytes and at most the length of the longest frame"
            }
            2 => "a shorter prefix already had another final classification (a frame, or rejected)",
            3 => "a shorter prefix was incomplete and asked for more bytes than these",
            4 => "`starts` says that no frame begins with the first byte",
            5 => "`classify_after` and `classify` differ",
            _ => {
                "`classify_before` must reject these bytes, or return a frame that has at least one and at most all of \
                 them"
            }
        };
        let (law, from, length, classification) =
            (self.law, self.from, self.length, self.classification);
        write!(
            f,
            "law {law} is broken: the {length} bytes from offset {from} on are classified as {classification:?}, but {what}"
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

/// Checks that a format of your own keeps the laws of [`Format`]. Classifies `stream` from each position on. Then
/// changes one byte at a time to every other value, and classifies each changed stream from each position on.
///
/// Pass whole frames, including the longest and the shortest, followed by a few more bytes. Also pass streams that
/// `proptest` or a fuzzer generates. This function is a test, not a proof: bytes that it does not try may still break a
/// law. It restores `stream` at the end.
///
/// If the longest frame has up to 64 bytes, the function classifies every prefix of the bytes. If the longest frame has
/// more bytes, the function classifies only some prefixes: those near the changed byte, those near the length that the
/// format asked for, every sixteenth prefix, and the longest prefix. Once a prefix has a final classification, the
/// function classifies only the longest prefix, and changes each later byte to only sixteen values. A frame of 300
/// bytes takes seconds, even without optimisation.
///
/// # Errors
/// Returns the first law that is broken, and the bytes that show the violation.
///
/// # Examples
/// This format classifies two bytes as a frame, but changes its answer when a third byte arrives. This breaks law 2:
/// ```
/// use framelock::{DiscardReason, Format, Classification};
/// use framelock_formats::check_laws;
/// #[derive(Clone, Copy)]
/// struct Hasty;
/// impl Format for Hasty {
///     const LONGEST: usize = 3;
///     type Message<'a> = ();
///     fn classify(&self, bytes: &[u8]) -> Classification {
///         match bytes {
///             [b'<', .., b'>'] => Classification::Frame(bytes.len()),
///             [b'<', ..] if bytes.len() < 3 => Classification::Incomplete { at_least: bytes.len() + 1 },
///             _ => Classification::Rejected(DiscardReason::NoSync),
///         }
///     }
///     fn decode(&self, _: &[u8]) {}
/// }
/// let broken = check_laws(&Hasty, &mut *b"<>.".to_vec()).unwrap_err();
/// assert_eq!((broken.law, broken.from, broken.length), (2, 0, 3));
/// ```
pub fn check_laws<F: Format>(format: &F, stream: &mut [u8]) -> Result<(), BrokenLaw> {
    // Try the unchanged stream first, so that an error names a change only if the unchanged stream keeps the laws.
    for from in 0..stream.len() {
        Said::NOTHING.of_all(format, classified(format, stream, from), 1, (from, None))?;
    }
    for from in 0..stream.len() {
        let mut before = Said::NOTHING;
        for count in 1..=classified(format, stream, from).len() {
            let place = from.wrapping_add(count).wrapping_sub(1);
            let byte = stream.get(place).copied().unwrap_or_default();
            let step = if before.is_settled() && format.longest() > SHORT {
                17
            } else {
                1
            };
            for other in (0..=u8::MAX).step_by(step) {
                set(stream, place, other);
                let changed = (from, Some((place, other)));
                let tried = before.of_all(format, classified(format, stream, from), count, changed);
                set(stream, place, byte);
                tried?;
            }
            let bytes = classified(format, stream, from);
            before.of(format, bytes.get(..count).unwrap_or(bytes), (from, None))?;
        }
    }
    Ok(())
}

const EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

/// If a format's longest frame has at most this length, every prefix is classified.
const SHORT: usize = 64;

/// Returns the bytes of the stream from index `from` on, but not more bytes than the longest frame has.
fn classified<'a, F: Format>(format: &F, stream: &'a [u8], from: usize) -> &'a [u8] {
    let bytes = stream.get(from..).unwrap_or_default();
    bytes.get(..format.longest()).unwrap_or(bytes)
}

fn set(stream: &mut [u8], place: usize, byte: u8) {
    if let Some(at) = stream.get_mut(place) {
        *at = byte;
    }
}

/// The format's answers about shorter prefixes of the same bytes.
#[derive(Clone, Copy)]
struct Said {
    /// The final classification, which must not change; `None` if all shorter prefixes were incomplete.
    settled: Option<Classification>,
    /// The number of bytes in the longest prefix that was incomplete.
    incomplete: usize,
    /// The greatest number of bytes that an incomplete classification asked for. Any shorter prefix must be incomplete.
    due: usize,
}

impl Said {
    const NOTHING: Self = Self {
        settled: None,
        incomplete: 0,
        due: 1,
    };

    const fn is_settled(&self) -> bool {
        self.settled.is_some()
    }

    /// Classifies prefixes of `bytes` that have `count` bytes or more, and checks each classification.
    fn of_all<F: Format>(
        mut self,
        format: &F,
        bytes: &[u8],
        count: usize,
        place: (usize, Option<(usize, u8)>),
    ) -> Result<(), BrokenLaw> {
        let all = bytes.len();
        for length in count..=all {
            let is_near = length.wrapping_sub(count) < 4 || self.due.abs_diff(length) < 4;
            let is_near = !self.is_settled() && (is_near || length % 16 == 0);
            if is_near || length == all || format.longest() <= SHORT {
                self.of(format, bytes.get(..length).unwrap_or_default(), place)?;
            }
        }
        Ok(())
    }

    /// Classifies these bytes. Returns an error if the classification breaks a law.
    fn of<F: Format>(
        &mut self,
        format: &F,
        bytes: &[u8],
        (from, changed): (usize, Option<(usize, u8)>),
    ) -> Result<(), BrokenLaw> {
        let length = bytes.len();
        let classification = format.classify(bytes);
        let in_bounds = match classification {
            Classification::Frame(frame) => 1 <= frame && frame <= length,
            Classification::Incomplete { at_least } => {
                length < at_least && at_least <= format.longest()
            }
            Classification::Rejected(_) => true,
        };
        let starts = bytes.first().is_some_and(|&first| format.starts(first));
        let as_searched = |seen| format.classify_after(bytes, seen) == classification;
        let is_final_before = |&event: &LineEvent| match format.classify_before(bytes, event) {
            Classification::Frame(frame) => 1 <= frame && frame <= length,
            Classification::Incomplete { .. } => false,
            Classification::Rejected(_) => true,
        };
        let law = if !in_bounds {
            1
        } else if self.settled.is_some_and(|before| before != classification) {
            2
        } else if length < self.due && !matches!(classification, Classification::Incomplete { .. })
        {
            3
        } else if !starts && classification != Classification::Rejected(DiscardReason::NoSync) {
            4
        } else if !as_searched(0)
            || self.incomplete > 0
                && !(as_searched(self.incomplete / 2) && as_searched(self.incomplete))
        {
            5
        } else if matches!(classification, Classification::Incomplete { .. })
            && !EVENTS.iter().all(is_final_before)
        {
            6
        } else {
            match classification {
                Classification::Incomplete { at_least } => {
                    (self.incomplete, self.due) = (length, self.due.max(at_least));
                }
                _ => self.settled = Some(classification),
            }
            return Ok(());
        };
        Err(BrokenLaw {
            law,
            from,
            length,
            classification,
            changed,
        })
    }
}

/// A contradiction between a format's encoding and its other parts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum BrokenEncoding {
    /// [`SHAPE`](framelock::FixedFormat::SHAPE) has another byte at this index than the encoded frame.
    Shape(usize),
    /// [`CHECK`](framelock::FixedFormat::CHECK) rejects the encoded frame.
    Check,
    /// [`decode`](framelock::FixedFormat::decode) returns another message than the one that was encoded.
    Decode,
}

impl fmt::Display for BrokenEncoding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape(place) => {
                write!(f, "encode: the byte at index {place} differs from SHAPE")
            }
            Self::Check => f.write_str("encode: CHECK rejects the frame"),
            Self::Decode => f.write_str("decode returns a different message from the encoded one"),
        }
    }
}

impl core::error::Error for BrokenEncoding {}

/// Checks that the encoding of a fixed-length format agrees with the rest of the format. The frame of `message` must
/// have the fixed bytes of the shape, pass the check, and decode to `message`. The function tests one message, so call
/// it with many messages.
///
/// # Errors
/// Returns the first part of the format that contradicts the encoding.
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
