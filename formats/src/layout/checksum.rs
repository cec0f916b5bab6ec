//! The checksum of a layout.

/// A checksum in a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Checksum<'a> {
    /// The algorithm that computes the checksum.
    pub algorithm: Algorithm<'a>,
    /// The number of bytes of the checksum, 1 to 4. If a sum has more bytes, only its lowest bytes are used. With
    /// [`Encoding::Hex`], the checksum takes twice this number of bytes in the frame.
    pub bytes: usize,
    /// The encoding of the checksum in the frame.
    pub encoding: Encoding,
    /// The offset of the checksum's first byte.
    pub at: i16,
    /// The offset of the first byte that the checksum covers.
    pub from: i16,
    /// The offset of the last byte that the checksum covers.
    pub to: i16,
    /// The first value of a sum or an XOR. A CRC has its own [`initial`](Crc::initial).
    pub initial: u32,
    /// The number that the result of any algorithm is XORed with. A CRC also has its own [`xor_out`](Crc::xor_out).
    pub xor_out: u32,
    /// Whether the covered bytes are pairs of hexadecimal digits, as in Modbus ASCII. Then the checksum is computed
    /// from the bytes that the digits stand for.
    pub over_hex_digits: bool,
}

impl Checksum<'_> {
    /// Returns a checksum in the last `bytes` bytes of the frame: the sum of all preceding bytes, little-endian.
    #[inline]
    #[must_use]
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_possible_wrap,
        reason = "there are 4 at most"
    )]
    pub const fn at_the_end(bytes: usize) -> Self {
        let at = (bytes as i16).wrapping_neg();
        Self {
            algorithm: Algorithm::Sum,
            bytes,
            encoding: Encoding::Little,
            at,
            from: 0,
            to: at.wrapping_sub(1),
            initial: 0,
            xor_out: 0,
            over_hex_digits: false,
        }
    }

    /// Returns the number of bytes in the frame that hold the checksum.
    #[inline(always)]
    #[must_use]
    pub const fn encoded_bytes(&self) -> usize {
        match self.encoding {
            Encoding::Hex => self.bytes.wrapping_mul(2),
            Encoding::Little | Encoding::Big => self.bytes,
        }
    }
}

/// The encoding of a checksum in the frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Encoding {
    /// As a number, the lowest byte first.
    Little,
    /// As a number, the highest byte first.
    Big,
    /// As text: two hexadecimal digits for each byte, the highest byte first. Encoding writes upper-case digits, but
    /// receivers also accept lower-case digits.
    Hex,
}

/// The algorithm that computes a checksum.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Algorithm<'a> {
    /// A cyclic redundancy check.
    Crc(Crc<'a>),
    /// The sum of the bytes. For the inverted sum, such as 0xFFFF - sum in two bytes, set all bits of
    /// [`xor_out`](Checksum::xor_out). For the negated sum, which gives zero when added to the sum of the bytes, set
    /// all bits of both [`initial`](Checksum::initial) and `xor_out`.
    Sum,
    /// The sum of the bytes. A carry out of the checksum's highest bit is added to the sum.
    CarrySum,
    /// The sum of 16-bit words, whose bytes are in the order of the [encoding](Checksum::encoding). A last single byte
    /// is the first byte of a word whose second byte is 0.
    SumWords,
    /// The exclusive or of the bytes.
    Xor,
    /// The exclusive or of 16-bit words, which are as in [`SumWords`](Self::SumWords).
    XorWords,
    /// Fletcher's checksum: two sums of 8 bits. The low byte is the sum of the bytes. After each byte, the new low byte
    /// is added to the high byte.
    Fletcher,
}

/// A cyclic redundancy check of 8 to 32 bits, with the parameters of the catalogue at
/// <https://reveng.sourceforge.io/crc-catalogue>.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Crc<'a> {
    /// The number of bits.
    pub width: u32,
    /// The polynomial without its highest power: `poly`.
    pub polynomial: u32,
    /// The first value of the register: `init`.
    pub initial: u32,
    /// Whether each byte is processed from its lowest bit on: `refin`.
    pub reflected_in: bool,
    /// Whether the lowest bit of the result comes first: `refout`.
    pub reflected_out: bool,
    /// The number that the result is xored with: `xorout`.
    pub xor_out: u32,
    /// The table. It takes flash, but saves time.
    pub table: Table<'a>,
}

impl Crc<'_> {
    /// Returns a CRC that is not reflected, begins with 0, is not xored, and has no table.
    #[inline]
    #[must_use]
    pub const fn new(width: u32, polynomial: u32) -> Self {
        Self {
            width,
            polynomial,
            initial: 0,
            reflected_in: false,
            reflected_out: false,
            xor_out: 0,
            table: Table::None,
        }
    }
}

/// A table with the CRC remainder of each byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Table<'a> {
    /// No table. The CRC is computed bit by bit, except a reflected CRC of 16 bits with the polynomial 0x1021.
    None,
    /// A table for a CRC of 8 bits, which [`Crc::table_of_bytes`] computes. It takes 256 bytes.
    Bytes(&'a [u8; 256]),
    /// A table for any CRC, which [`Crc::table_of_words`] computes. It takes 1 KiB.
    Words(&'a [u32; 256]),
}
