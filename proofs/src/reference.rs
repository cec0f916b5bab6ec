//! The naive reference: it sees the whole stream at once and tries every place of it in turn.
//!
//! Written from the protocol, in its words, to be seen to be right rather than to be fast:
//!
//! * **framelock**: at each place, a frame is committed and the search goes on behind it; anything
//!   else is one byte dropped. That is the leftmost non-overlapping matches of the byte regex
//!   `(?s-u)AB.{4}\r`.
//! * **lecture**: the same, but what is no frame is dropped up to and with the byte at which that
//!   showed: one byte if it is not `'A'`, two if the second is not `'B'`, seven if the last is not
//!   CR. [`Lecture`] is BIN as the lecture's machine reads it.
//!
//! The loops run over every index in order, and never jump, so that a model checker can follow.

use framelock::{Classification, DiscardReason, Found};

/// A frame format, as a rule about bytes.
pub trait Format {
    /// Bytes in a frame.
    const LENGTH: usize;

    /// The first place, counted from 0, at which `bytes`, the beginning of a frame or a whole one,
    /// are not that. A checksum is looked at last: if it is wrong, the place is `LENGTH`.
    fn fails_at(bytes: &[u8]) -> Option<usize>;

    /// How many bytes are dropped if the frame that would begin with them fails at that place.
    #[must_use]
    fn dropped(place: usize) -> usize {
        let _ = place;
        1
    }
}

/// `'A' 'B' reserved pitch roll yaw CR`.
#[derive(Clone, Copy, Debug)]
pub enum Bin {}

impl Format for Bin {
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

/// The same frames, of which the lecture's machine drops all bytes up to the one that is wrong.
#[derive(Clone, Copy, Debug)]
pub enum Lecture {}

impl Format for Lecture {
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

impl Format for BinCrc8 {
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

/// CRC-8/AUTOSAR as its catalogue entry describes it, bit by bit.
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

/// Reports every frame of the stream, with its pitch, roll and yaw, and every byte discarded, in order. What
/// is left at the end may yet become a frame: the number of those bytes is returned.
pub fn whole_buffer<F: Format>(bytes: &[u8], mut report: impl FnMut(Found<[u8; 3]>)) -> usize {
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

/// The reference for frames of any length: at each place the format is asked about all that follows.
/// Reports every frame, with the place it begins at as its message, and every byte discarded, in order, and returns how many bytes
/// at the end may yet become a frame. If the stream is over, because a line event came, none may:
/// where it would wait, it discards a byte.
pub fn framed<F: framelock::Format>(
    format: &F,
    bytes: &[u8],
    is_over: bool,
    mut report: impl FnMut(Found<usize>),
) -> usize {
    let mut free = 0;
    for i in 0..bytes.len() {
        if i < free {
            continue;
        }
        let rest = bytes.get(i..).unwrap_or_default();
        let known = rest.get(..format.longest()).unwrap_or(rest);
        free = match format.classify(known) {
            Classification::Frame(length) => {
                report(Found::frame(length, i));
                i + length
            }
            Classification::Incomplete { .. } if !is_over => return rest.len(),
            classification => {
                let why = match classification {
                    Classification::Rejected(why) => why,
                    _ => DiscardReason::LineEvent,
                };
                report(Found::discarded(1, why));
                i + 1
            }
        };
    }
    0
}
