//! Checksums: whether a frame's is right, and what it would have to be.

use crate::layout::{Algorithm, Checksum, Written, index};

/// As bytes of a frame: four, or twice as many digits.
type Text = [u8; 8];

impl Checksum<'_> {
    /// Whether a frame has the right one. `extra` is covered behind the frame's own bytes.
    #[inline]
    pub(crate) fn is_right(&self, frame: &[u8], extra: Option<u8>) -> bool {
        let stored = self.place(frame.len()).and_then(|place| frame.get(place));
        let (Some(stored), Some(covered)) = (stored, self.covered(frame)) else {
            return false;
        };
        let text = self.text(self.algorithm.of(covered, extra));
        text.iter()
            .zip(stored)
            .all(|(wanted, byte)| match self.written {
                Written::Hex => *wanted == byte.to_ascii_uppercase(),
                Written::Little | Written::Big => wanted == byte,
            })
    }

    /// Writes it into a frame whose other bytes are there; says whether there is a place for it.
    pub(crate) fn write(&self, frame: &mut [u8], extra: Option<u8>) -> bool {
        let place = self.place(frame.len());
        let (Some(place), Some(covered)) = (place, self.covered(frame)) else {
            return false;
        };
        let text = self.text(self.algorithm.of(covered, extra));
        let Some(stored) = frame.get_mut(place) else {
            return false;
        };
        for (byte, text) in stored.iter_mut().zip(text) {
            *byte = text;
        }
        true
    }

    /// The bytes that it covers.
    #[inline]
    fn covered<'a>(&self, frame: &'a [u8]) -> Option<&'a [u8]> {
        let from = index(self.from, frame.len())?;
        let to = index(self.to, frame.len())?;
        frame.get(from..to.wrapping_add(1))
    }

    /// Where it is in a frame of that length.
    #[inline]
    fn place(&self, length: usize) -> Option<core::ops::Range<usize>> {
        let at = index(self.at, length)?;
        let bytes = match self.written {
            Written::Hex => self.bytes.wrapping_mul(2),
            Written::Little | Written::Big => self.bytes,
        };
        (1..=4)
            .contains(&self.bytes)
            .then(|| at..at.wrapping_add(bytes))
    }

    /// Its lowest bytes, as they are written.
    #[inline]
    fn text(&self, sum: u32) -> Text {
        let mut text = [0; 8];
        let lowest_first = sum.to_le_bytes();
        let kept = lowest_first.get(..self.bytes).unwrap_or_default();
        match self.written {
            Written::Little => {
                for (text, byte) in text.iter_mut().zip(kept) {
                    *text = *byte;
                }
            }
            Written::Big => {
                for (text, byte) in text.iter_mut().zip(kept.iter().rev()) {
                    *text = *byte;
                }
            }
            Written::Hex => {
                let digits = kept.iter().rev().flat_map(|byte| [byte >> 4, byte & 15]);
                for (text, digit) in text.iter_mut().zip(digits) {
                    let from = if digit < 10 {
                        b'0'
                    } else {
                        b'A'.wrapping_sub(10)
                    };
                    *text = digit.wrapping_add(from);
                }
            }
        }
        text
    }
}

impl Algorithm<'_> {
    /// Of these bytes, and of one behind them if there is one. Of sums the lowest bytes are of use.
    #[inline]
    #[must_use]
    pub fn of(&self, bytes: &[u8], extra: Option<u8>) -> u32 {
        let extra = extra.as_slice();
        match self {
            Self::Crc(crc) => crc.result(crc.update(crc.update(crc.start(), bytes), extra)),
            Self::Sum => sum(sum(0, bytes), extra),
            Self::InvertedSum => !sum(sum(0, bytes), extra),
            Self::NegatedSum => sum(sum(0, bytes), extra).wrapping_neg(),
            Self::Xor => bytes
                .iter()
                .chain(extra)
                .fold(0, |xor, byte| xor ^ u32::from(*byte)),
            Self::Fletcher => {
                let [a, b] = fletcher(fletcher([0, 0], bytes), extra);
                u32::from_le_bytes([a.to_le_bytes()[0], b.to_le_bytes()[0], 0, 0])
            }
        }
    }
}

// Not inlined: a frame takes one call or two.

#[inline(never)]
fn sum(sum: u32, bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .fold(sum, |sum, byte| sum.wrapping_add((*byte).into()))
}

/// The sum of the bytes, and the sum of those sums; as wide as registers, which their lowest bytes do not notice.
#[inline(never)]
fn fletcher(sums: [u32; 2], bytes: &[u8]) -> [u32; 2] {
    bytes.iter().fold(sums, |[a, b], byte| {
        let a = a.wrapping_add((*byte).into());
        [a, b.wrapping_add(a)]
    })
}
