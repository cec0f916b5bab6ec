//! Two protocols on one line.

use framelock::{DiscardReason, Format, Verdict};

/// Two formats on one line, UBX and NMEA for example. Where no frame of the first begins, the
/// second is asked. For more nest them in the second place: `Either(A, Either(B, C))`.
///
/// The first must know each of its frames by the frame's own bytes, as every format of
/// [`Headed`](crate::Headed) does: else `decode` takes the frame for one of the second. An `Either` does
/// not, for its second is asked only when enough bytes have come for its first to reject them.
///
/// # Examples
/// ```
/// use framelock::{BufferedReceiver, Format, Verdict};
/// use framelock_formats::{Either, EitherMessage, Headed};
///
/// /// Frames of three bytes, which begin with one of their own.
/// struct Three(u8);
///
/// impl Format for Three {
///     const LONGEST: usize = 3;
///     type Message<'a> = &'a [u8];
///     fn judge(&self, bytes: &[u8]) -> Verdict {
///         Headed { sync: &[self.0], header: 1, longest: 3 }.judge(bytes, |_| Some(3), |_| true)
///     }
///     fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
///         &frame[1..]
///     }
/// }
///
/// let mut receiver = BufferedReceiver::<_, 6>::new(Either(Three(b'$'), Three(b'#')));
/// let mut found = Vec::new();
/// for byte in *b"$ab #cd" {
///     match receiver.push(byte) {
///         Some(EitherMessage::First(text)) => found.push((1, text.to_vec())),
///         Some(EitherMessage::Second(text)) => found.push((2, text.to_vec())),
///         None => {}
///     }
/// }
/// assert_eq!(found, [(1, b"ab".to_vec()), (2, b"cd".to_vec())]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Either<A, B>(
    /// Asked first.
    pub A,
    /// Asked where no frame of the first begins.
    pub B,
);

/// A message of one of two formats.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EitherMessage<A, B> {
    /// Of the first.
    First(A),
    /// Of the second.
    Second(B),
}

/// How far on in a frame it is found.
const fn further_on(why: DiscardReason) -> u8 {
    match why {
        DiscardReason::NoSync => 0,
        DiscardReason::BrokenSync => 1,
        DiscardReason::Header => 2,
        DiscardReason::Terminator => 3,
        DiscardReason::Check => 4,
        // `LineEvent`: no format has it for a reason.
        _ => 5,
    }
}

/// What `format` says of as many of the bytes as it may be asked about.
#[inline]
fn ask<F: Format>(format: &F, bytes: &[u8]) -> Verdict {
    format.judge(bytes.get(..F::LONGEST).unwrap_or(bytes))
}

impl<A: Format, B: Format> Format for Either<A, B> {
    const LONGEST: usize = if A::LONGEST > B::LONGEST {
        A::LONGEST
    } else {
        B::LONGEST
    };
    type Message<'a> = EitherMessage<A::Message<'a>, B::Message<'a>>;

    #[inline]
    fn judge(&self, bytes: &[u8]) -> Verdict {
        match ask(&self.0, bytes) {
            Verdict::Reject(why) => match ask(&self.1, bytes) {
                // Of two reasons the one that was found further on in the frame.
                Verdict::Reject(other) => Verdict::Reject(if further_on(other) > further_on(why) {
                    other
                } else {
                    why
                }),
                verdict => verdict,
            },
            verdict => verdict,
        }
    }

    #[inline]
    fn starts(&self, byte: u8) -> bool {
        self.0.starts(byte) || self.1.starts(byte)
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Self::Message<'a> {
        match ask(&self.0, frame) {
            Verdict::Frame(_) => EitherMessage::First(self.0.decode(frame)),
            // More bytes may have come before the first rejected it, so it may be incomplete here.
            _ => EitherMessage::Second(self.1.decode(frame)),
        }
    }
}
