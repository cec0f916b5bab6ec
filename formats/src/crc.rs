//! Computes cyclic redundancy checks from their parameters.
//!
//! The register has 32 bits. For a CRC that processes the lowest bit of each byte first (`reflected_in`), the lowest
//! bits of the register hold the reflected CRC. For any other CRC, the highest bits of the register hold the CRC.

use crate::layout::{Crc, Table};

impl Crc<'_> {
    /// Returns the initial value of the register.
    #[inline]
    pub(crate) const fn start(&self) -> u32 {
        self.aligned(self.initial)
    }

    /// Returns the register after processing these bytes.
    #[inline(always)]
    pub(crate) fn update(&self, register: u32, bytes: &[u8]) -> u32 {
        let shift = if self.reflected_in { 0 } else { 24 };
        match self.table {
            Table::None if self.is_mcrf4xx() => mcrf4xx(register, bytes),
            Table::None => self.run(register, bytes, |byte| self.remainder(byte)),
            Table::Bytes(table) => self.run(register, bytes, |byte| {
                u32::from(entry(table, byte)) << shift
            }),
            Table::Words(table) => self.run(register, bytes, |byte| entry(table, byte)),
        }
    }

    /// Returns the CRC, given the register after all bytes.
    #[inline(always)]
    pub(crate) const fn result(&self, register: u32) -> u32 {
        let crc = match (self.reflected_in, self.reflected_out) {
            (false, false) => register.wrapping_shr(self.unused()),
            (true, true) => register,
            (true, false) => register.reverse_bits().wrapping_shr(self.unused()),
            (false, true) => register.reverse_bits(),
        };
        crc ^ self.xor_out
    }

    /// Computes the table of an 8-bit CRC, for [`Table::Bytes`].
    #[must_use]
    pub const fn table_of_bytes(&self) -> [u8; 256] {
        let mut table = [0; 256];
        fill!(table, byte => self.narrow(byte));
        table
    }

    /// Computes the table of a CRC of any width, for [`Table::Words`].
    #[must_use]
    pub const fn table_of_words(&self) -> [u32; 256] {
        let mut table = [0; 256];
        fill!(table, byte => self.remainder(byte));
        table
    }

    /// Returns the number of register bits that the CRC does not use.
    const fn unused(&self) -> u32 {
        32_u32.saturating_sub(self.width)
    }

    /// Returns the bits of a CRC at their position in the register.
    const fn aligned(&self, bits: u32) -> u32 {
        let highest = bits.wrapping_shl(self.unused());
        if self.reflected_in {
            highest.reverse_bits()
        } else {
            highest
        }
    }

    #[inline(always)]
    fn run(&self, register: u32, bytes: &[u8], remainder: impl Fn(u8) -> u32) -> u32 {
        bytes.iter().fold(register, |register, byte| {
            let [lowest, .., highest] = register.to_le_bytes();
            let (out, rest) = if self.reflected_in {
                (lowest, register >> 8)
            } else {
                (highest, register << 8)
            };
            // A CRC of 8 bits has shifted out all its bits. If the width is constant, the test saves an instruction.
            let rest = if self.width == 8 { 0 } else { rest };
            remainder(out ^ byte) ^ rest
        })
    }

    /// Returns the value to xor into the register after the register has shifted out this byte. Computes the value bit
    /// by bit.
    pub(crate) const fn remainder(&self, byte: u8) -> u32 {
        let polynomial = self.aligned(self.polynomial);
        let mut register = u32::from_le_bytes([byte, 0, 0, 0]);
        if !self.reflected_in {
            register = register.swap_bytes();
        }
        let mut bit = 0_u8;
        while bit < 8 {
            register = if self.reflected_in {
                let divisor = if register & 1 == 0 { 0 } else { polynomial };
                register >> 1 ^ divisor
            } else {
                let divisor = if register >> 31 == 0 { 0 } else { polynomial };
                register << 1 ^ divisor
            };
            bit = bit.wrapping_add(1);
        }
        register
    }

    /// Returns the [`remainder`](Self::remainder) of an 8-bit CRC.
    pub(crate) const fn narrow(&self, byte: u8) -> u8 {
        let [lowest, .., highest] = self.remainder(byte).to_le_bytes();
        if self.reflected_in { lowest } else { highest }
    }

    const fn is_mcrf4xx(&self) -> bool {
        self.width == 16 && self.polynomial == 0x1021 && self.reflected_in
    }
}

#[inline]
fn entry<T: Copy + Default>(table: &[T; 256], byte: u8) -> T {
    table.get(usize::from(byte)).copied().unwrap_or_default()
}

/// Fills a table by computing each entry from its index.
macro_rules! fill {
    ($table:ident, $byte:ident => $entry:expr) => {
        let mut rest: &mut [_] = &mut $table;
        let mut $byte = 0_u8;
        while let Some((place, behind)) = rest.split_first_mut() {
            *place = $entry;
            $byte = $byte.wrapping_add(1);
            rest = behind;
        }
    };
}
use fill;

/// Updates MAVLink's CRC (CRC-16/MCRF4XX), or one with another initial value or final XOR, in steps of four bytes.
///
/// Let `y` be `1/x`. To divide 32 bits by `x^16 + x^12 + x^5 + 1`, multiply them by `1 / (1 + y^4 + y^11 + y^16)`. Up
/// to `y^31`, this factor equals `(1 + y^8 + y^22)(1 + (y^4 + y^11)(1 + y^16))`. The result is the quotient. The
/// remainder is the last 16 bits of the product of the quotient and `1 + x^5 + x^12`.
#[inline(never)]
fn mcrf4xx(register: u32, bytes: &[u8]) -> u32 {
    let (mut wide, mut rest) = (register, bytes);
    while let Some((four, behind)) = rest.split_first_chunk() {
        let bits = u32::from_le_bytes(*four) ^ wide;
        let bits = bits ^ bits << 8 ^ bits << 22;
        let both = bits << 4 ^ bits << 11;
        let quotient = bits ^ both ^ both << 16;
        wide = (quotient ^ quotient >> 5 ^ quotient >> 12) >> 16;
        rest = behind;
    }
    rest.iter().fold(wide, |crc, byte| {
        let [low, ..] = crc.to_le_bytes();
        let low = low ^ byte;
        let low = u32::from(low ^ low << 4);
        crc >> 8 ^ low << 8 ^ low << 3 ^ low >> 4
    })
}
