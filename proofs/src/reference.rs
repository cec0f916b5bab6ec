//! The naive reference. It sees the whole stream at once and tries each position in turn.
//!
//! It follows the protocol's text, and is written to be obviously right rather than fast:
//!
//! * **framelock**: if a frame begins at a position, the reference delivers the frame and continues after the frame.
//!   Otherwise it drops one byte. So the frames of [`Bin`] are the leftmost non-overlapping matches of the byte regex
//!   `(?s-u)AB.{4}\r`.
//! * **lecture**: as for framelock, but if there is no frame, the reference drops all bytes up to and including the
//!   first wrong one: one byte if the first is not `'A'`, two if the second is not `'B'`, seven if the last is not CR.
//!   The function `dropped` of [`Lecture`] returns this number.
//!
//! The loops visit every index in order and never jump, so that a model checker can follow them.

use framelock::{Classification, DiscardReason, Found, LineEvent};

/// A frame format, as a rule about bytes.
pub trait NaiveFormat {
    /// Bytes in a frame.
    const LENGTH: usize;

    /// Returns the first position, counted from 0, at which `bytes` differ from a frame. `bytes` holds at most `LENGTH`
    /// bytes. If only the checksum is wrong, the result is `LENGTH`.
    fn fails_at(bytes: &[u8]) -> Option<usize>;

    /// Returns the number of bytes to drop if the frame's first wrong byte is at this position.
    #[must_use]
    fn dropped(place: usize) -> usize {
        let _ = place;
        1
    }
}

/// `'A' 'B' reserved pitch roll yaw CR`.
#[derive(Clone, Copy, Debug)]
pub enum Bin {}

impl NaiveFormat for Bin {
    const LENGTH: usize = 7;

    fn fails_at(bytes: &[u8]) -> Option<usize> {
        bytes
            .iter()
            .enumerate()
            .position(|(place, &byte)| match place {
                0 => byte != b'A',
                1 => byte != b'B',
                6 => byte != b'\r',
                _ => false,
            })
    }
}

/// The frames of [`Bin`] for the lecture's machine, which drops all bytes up to and including the first wrong one.
#[derive(Clone, Copy, Debug)]
pub enum Lecture {}

impl NaiveFormat for Lecture {
    const LENGTH: usize = Bin::LENGTH;

    fn fails_at(bytes: &[u8]) -> Option<usize> {
        Bin::fails_at(bytes)
    }

    fn dropped(place: usize) -> usize {
        place + 1
    }
}

/// `'A' 'B' reserved pitch roll yaw crc CR`.
#[derive(Clone, Copy, Debug)]
pub enum BinCrc8 {}

impl NaiveFormat for BinCrc8 {
    const LENGTH: usize = 8;

    fn fails_at(bytes: &[u8]) -> Option<usize> {
        let fixed = bytes
            .iter()
            .enumerate()
            .position(|(place, &byte)| match place {
                0 => byte != b'A',
                1 => byte != b'B',
                7 => byte != b'\r',
                _ => false,
            });
        fixed.or(match bytes {
            [_, _, payload @ .., crc, _] if bytes.len() == Self::LENGTH => {
                (crc8(payload) != *crc).then_some(Self::LENGTH)
            }
            _ => None,
        })
    }
}

/// Computes CRC-8/AUTOSAR bit by bit, as its catalogue entry describes it.
#[must_use]
pub fn crc8(payload: &[u8]) -> u8 {
    let mut register = 0xFF;
    for &byte in payload {
        register ^= byte;
        for _ in 0..8 {
            register = if register & 0x80 == 0 {
                register << 1
            } else {
                (register << 1) ^ 0x2F
            };
        }
    }
    register ^ 0xFF
}

/// Reports every frame of the stream with its pitch, roll and yaw, and every discarded byte, in order. Returns the
/// number of bytes at the end that may still become a frame.
pub fn whole_buffer<F: NaiveFormat>(bytes: &[u8], mut report: impl FnMut(Found<[u8; 3]>)) -> usize {
    let mut free = 0;
    for i in 0..bytes.len() {
        if i < free {
            continue;
        }
        let candidate = bytes
            .get(i..bytes.len().min(i + F::LENGTH))
            .unwrap_or_default();
        if let Some(place) = F::fails_at(candidate) {
            let count = F::dropped(place);
            let why = match place {
                0 => DiscardReason::NoSync,
                1 => DiscardReason::BrokenSync,
                place if place == F::LENGTH => DiscardReason::ChecksumMismatch,
                _ => DiscardReason::WrongTerminator,
            };
            report(Found::discarded(count, why));
            free = i + count;
        } else if candidate.len() < F::LENGTH {
            return bytes.len() - i;
        } else if let &[_, _, _, pitch, roll, yaw, ..] = candidate {
            let (length, message) = (F::LENGTH, [pitch, roll, yaw]);
            report(Found::frame(length, message));
            free = i + length;
        }
    }
    0
}

/// The reference for frames of any length. Asks the format at one position after another, each time about at most as
/// many bytes as the longest frame has. Reports every frame and every discarded byte, in order. A frame's message is
/// the position at which the frame begins. Returns the number of bytes at the end that may still become a frame. If a
/// line event ends the stream (`end`), this number is 0: the reference asks
/// [`classify_before`](framelock::Format::classify_before) instead of waiting. Once it has done so, each byte that
/// `classify` rejects is discarded as [`LineEvent`](DiscardReason::LineEvent).
pub fn framed<F: framelock::Format>(
    format: &F,
    bytes: &[u8],
    end: Option<LineEvent>,
    mut report: impl FnMut(Found<usize>),
) -> usize {
    let (mut free, mut has_waited) = (0, false);
    for i in 0..bytes.len() {
        if i < free {
            continue;
        }
        let rest = bytes.get(i..).unwrap_or_default();
        let known = rest.get(..format.longest()).unwrap_or(rest);
        let classification = match (format.classify(known), end) {
            (Classification::Incomplete { .. }, Some(event)) => {
                has_waited = true;
                format.classify_before(known, event)
            }
            (Classification::Incomplete { .. }, None) => return rest.len(),
            (Classification::Rejected(_), _) if has_waited => {
                Classification::Rejected(DiscardReason::LineEvent)
            }
            (classification, _) => classification,
        };
        free = i + match classification {
            Classification::Frame(length) => {
                report(Found::frame(length, i));
                length
            }
            classification => {
                let why = match classification {
                    Classification::Rejected(why) => why,
                    _ => DiscardReason::LineEvent,
                };
                report(Found::discarded(1, why));
                1
            }
        };
    }
    0
}
