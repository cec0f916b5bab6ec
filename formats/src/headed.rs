//! The usual shape of a frame: sync, length, check.

use framelock::{DiscardReason, Verdict};

/// The usual shape: sync bytes, a header that tells the length, a check over the whole frame.
///
/// # Examples
/// A length byte and a CRC: `'A' 'B' length payload crc8`, up to 16 bytes of payload.
/// ```
/// use framelock::{BufferedReceiver, Format, Verdict};
/// use framelock_formats::Headed;
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
/// Thirty-two bytes, always: as [`Ibus`](crate::Ibus) does.
/// ```
/// use framelock::{BufferedReceiver, Format, Verdict};
/// use framelock_formats::Headed;
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
    /// Bytes in the longest frame: at least `header`, at most [`LONGEST`](framelock::Format::LONGEST).
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
