//! Checks the checksum in a frame, or computes and writes it.

use crate::layout::{Algorithm, Checksum, Encoding, index};

impl Checksum<'_> {
    /// Returns true if the checksum in the frame is correct.
    ///
    /// Negative offsets count back from `length`. The checksum covers `extra` after the frame's own bytes, although
    /// this byte is not sent.
    #[inline(always)]
    pub(crate) fn is_right(&self, frame: &[u8], length: usize, extra: Option<u8>) -> bool {
        let stored = self.place(length).and_then(|place| frame.get(place));
        let (Some(stored), Some(covered)) = (stored, self.covered(frame, length)) else {
            return false;
        };
        if self.over_hex_digits && !are_pairs_of_digits(covered) {
            return false;
        }
        let sum = self.of(covered, extra);
        let number = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        let digits = |number: u32, digit: &u8| {
            let digit = char::from(*digit).to_digit(16)?;
            Some(number << 4 | digit)
        };
        let stored = match self.encoding {
            Encoding::Little => Some(stored.iter().rev().fold(0, number)),
            Encoding::Big => Some(stored.iter().fold(0, number)),
            Encoding::Hex => stored.iter().try_fold(0, digits),
        };
        stored == Some(sum & self.bits())
    }

    /// Writes the checksum into a frame that is otherwise complete. Returns false if the frame is too short.
    ///
    /// Negative offsets count back from `length`.
    pub(crate) fn write(&self, frame: &mut [u8], length: usize, extra: Option<u8>) -> bool {
        let place = self.place(length);
        let (Some(place), Some(covered)) = (place, self.covered(frame, length)) else {
            return false;
        };
        let sum = self.of(covered, extra);
        let Some(stored) = frame.get_mut(place) else {
            return false;
        };
        let lowest_first = sum.to_le_bytes().into_iter().take(self.bytes);
        match self.encoding {
            Encoding::Little => fill(stored, lowest_first),
            Encoding::Big => fill(stored, lowest_first.rev()),
            Encoding::Hex => fill(stored, lowest_first.rev().flat_map(digits)),
        }
        true
    }

    /// Computes the checksum of `bytes`, and of the byte `extra` after them if there is one. If the checksum has `n`
    /// bytes, only the lowest `n` bytes of the result are valid.
    ///
    /// # Examples
    /// ```
    /// use framelock_formats::layout::Checksum;
    /// // The negated sum: with it, the sum of all bytes is 0.
    /// let negated = Checksum { initial: 0xFF, xor_out: 0xFF, ..Checksum::at_the_end(1) };
    /// assert_eq!(negated.of(&[1, 2], None) & 0xFF, 0xFD);
    /// ```
    #[inline(always)]
    #[must_use]
    pub fn of(&self, bytes: &[u8], extra: Option<u8>) -> u32 {
        let sum = match &self.algorithm {
            Algorithm::Crc(crc) => {
                let register = crc.update(crc.start(), bytes);
                crc.result(match extra {
                    Some(extra) => crc.update(register, &[extra]),
                    None => register,
                })
            }
            Algorithm::Fletcher => fletcher(bytes, extra),
            Algorithm::Sum if !self.over_hex_digits => {
                let first = self.initial.wrapping_add(extra.map_or(0, u32::from));
                let add = |sum: u32, byte: &u8| sum.wrapping_add((*byte).into());
                bytes.iter().fold(first, add)
            }
            Algorithm::Xor if !self.over_hex_digits => {
                let first = self.initial ^ extra.map_or(0, u32::from);
                bytes.iter().fold(first, |xor, byte| xor ^ u32::from(*byte))
            }
            _ => self.rare_sum(bytes, extra),
        };
        sum ^ self.xor_out
    }

    /// Computes a sum or an XOR that few protocols have: with carry, of words, or over hexadecimal digits.
    #[inline(never)]
    fn rare_sum(&self, bytes: &[u8], extra: Option<u8>) -> u32 {
        let is_of_words = matches!(self.algorithm, Algorithm::SumWords | Algorithm::XorWords);
        let mut is_upper = is_of_words && self.encoding != Encoding::Little;
        let mut sum = self.initial;
        let mut add = |byte: u8| {
            let value = u32::from(byte) << if is_upper { 8 } else { 0 };
            is_upper = is_of_words && !is_upper;
            sum = match self.algorithm {
                Algorithm::Xor | Algorithm::XorWords => sum ^ value,
                Algorithm::CarrySum => self.carried(sum, value),
                _ => sum.wrapping_add(value),
            };
        };
        if self.over_hex_digits {
            decoded(bytes).for_each(&mut add);
        } else {
            bytes.iter().copied().for_each(&mut add);
        }
        extra.into_iter().for_each(add);
        sum
    }

    /// Returns the sum of two numbers. A carry out of the checksum's bits is added to the lowest bit.
    fn carried(&self, sum: u32, value: u32) -> u32 {
        let (next, is_carry) = sum.overflowing_add(value);
        if is_carry || next > self.bits() {
            (next & self.bits()).wrapping_add(1)
        } else {
            next
        }
    }

    /// Returns the mask of the checksum's bits.
    #[inline(always)]
    fn bits(&self) -> u32 {
        let unused = 32_usize.saturating_sub(self.bytes.wrapping_mul(8));
        u32::MAX >> unused.min(31)
    }

    /// Returns the bytes that the checksum covers.
    #[inline(always)]
    fn covered<'a>(&self, frame: &'a [u8], length: usize) -> Option<&'a [u8]> {
        let from = index(self.from, length)?;
        let to = index(self.to, length)?;
        frame.get(from..to.wrapping_add(1))
    }

    /// Returns the range of the checksum in a frame. Negative offsets count back from `length`.
    #[inline(always)]
    fn place(&self, length: usize) -> Option<core::ops::Range<usize>> {
        let at = index(self.at, length)?;
        (1..=4)
            .contains(&self.bytes)
            .then(|| at..at.wrapping_add(self.encoded_bytes()))
    }
}

/// Returns true if the bytes are pairs of hexadecimal digits.
#[cold]
fn are_pairs_of_digits(bytes: &[u8]) -> bool {
    bytes.len() & 1 == 0 && bytes.iter().all(u8::is_ascii_hexdigit)
}

/// Returns an iterator over the bytes that pairs of hexadecimal digits stand for.
fn decoded(digits: &[u8]) -> impl Iterator<Item = u8> {
    let value = |digit: u8| match digit {
        b'0'..=b'9' => digit & 15,
        _ => (digit & 15).wrapping_add(9),
    };
    let pairs = digits.chunks_exact(2);
    pairs.map(move |pair| pair.iter().fold(0, |byte, digit| byte << 4 | value(*digit)))
}

/// Returns the two hexadecimal digits of a byte.
fn digits(byte: u8) -> [u8; 2] {
    [byte >> 4, byte & 15].map(|digit| match digit {
        0..10 => digit.wrapping_add(b'0'),
        _ => digit.wrapping_add(b'A' - 10),
    })
}

/// Copies bytes into `place`, and stops when `place` is full or there are no more bytes.
pub(crate) fn fill(place: &mut [u8], bytes: impl Iterator<Item = u8>) {
    place
        .iter_mut()
        .zip(bytes)
        .for_each(|(byte, it)| *byte = it);
}

/// Computes the Fletcher checksum. The lowest eight bits of the result are the sum of the bytes. After each byte, this
/// sum is added to a second sum, in the next eight bits.
#[inline(never)]
fn fletcher(bytes: &[u8], extra: Option<u8>) -> u32 {
    // The sums use full registers, because the upper bits never affect the low bytes.
    let (mut a, mut b) = (0_u32, 0_u32);
    for byte in bytes {
        a = a.wrapping_add((*byte).into());
        b = b.wrapping_add(a);
    }
    if let Some(extra) = extra {
        a = a.wrapping_add(extra.into());
        b = b.wrapping_add(a);
    }
    a & 0xFF | (b & 0xFF) << 8
}
