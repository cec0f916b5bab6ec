//! The types of numbers, such as `u16le`, and how to read their bits.

use std::fmt;

use framelock_formats::layout::{ByteOrder, Number};

use crate::problem::{Mistake, UnknownName};

/// A number of whole bytes, such as `u16le`. `Display` writes the type's name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberType {
    /// The meaning of the number's bits.
    pub class: Class,
    /// The number of bytes: 1 to 8, or 4 or 8 in a floating-point number.
    pub bytes: usize,
    /// The order of the bytes.
    pub order: ByteOrder,
}

/// The meaning of the bits of a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Class {
    /// An unsigned number.
    Unsigned,
    /// A signed number, in two's complement.
    Signed,
    /// A floating-point number of 32 or 64 bits, as in IEEE 754.
    Float,
}

impl NumberType {
    /// Returns all types.
    fn all() -> impl Iterator<Item = Self> {
        let orders = [ByteOrder::Little, ByteOrder::Big];
        let sizes = [1, 2, 3, 4, 5, 6, 7, 8].map(|bytes| orders.map(|order| (bytes, order)));
        let classes = [Class::Unsigned, Class::Signed, Class::Float];
        let all = classes.map(|class| {
            let sizes = sizes.into_iter().flatten();
            sizes.map(move |(bytes, order)| Self {
                class,
                bytes,
                order,
            })
        });
        let is_type = |number: &Self| match number.bytes {
            1 if number.order == ByteOrder::Big => false,
            bytes => [4, 8].contains(&bytes) || number.class != Class::Float,
        };
        all.into_iter().flatten().filter(is_type)
    }

    /// Returns the type with this name. The known names in the error are `others`, then the types.
    pub(crate) fn parse(name: &str, others: &[&str]) -> Result<Self, Mistake> {
        let found = Self::all().find(|number| number.to_string() == name);
        found.ok_or_else(|| {
            let names = Self::all().map(|number| number.to_string());
            let others = others.iter().map(|other| (*other).to_owned());
            UnknownName::new(name, others.chain(names)).into()
        })
    }

    /// Returns the type of an unsigned number of up to four bytes.
    pub(crate) fn parse_unsigned(name: &str, others: &[&str]) -> Result<Self, Mistake> {
        let number = Self::parse(name, others)?;
        let rule = "this must be an unsigned number of up to four bytes: u8, u16le, u16be, u24le and so on";
        number.is_unsigned().then_some(number).ok_or(rule.into())
    }

    /// Returns whether a length, a message's number or a checksum may have this type.
    pub(crate) fn is_unsigned(self) -> bool {
        self.class == Class::Unsigned && self.bytes <= 4
    }

    /// Returns the place of a number of this type that begins at this position of the frame, as a [`Number`].
    pub(crate) fn at(self, at: usize) -> Number {
        Number::new(at, self.bytes, self.order)
    }

    /// Returns a mask with all bits of the number.
    pub(crate) fn all_bits(self) -> u64 {
        ones(8 * self.bytes)
    }

    /// Reads the bits of the number from its bytes. Missing bytes at the end are zeros that the sender has left out.
    #[inline]
    pub(crate) fn bits(self, bytes: &[u8]) -> u64 {
        let add = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        match (self.order, bytes) {
            (ByteOrder::Little, &[a, b]) => u16::from_le_bytes([a, b]).into(),
            (ByteOrder::Little, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]).into(),
            (ByteOrder::Little, bytes) => bytes.iter().rev().fold(0, add),
            (ByteOrder::Big, bytes) => {
                let bits = bytes.iter().fold(0, add);
                (bytes.len()..self.bytes).fold(bits, |bits, _| bits << 8)
            }
        }
    }

    /// Returns the position of a byte among the number's bytes in the frame. `byte` is 0 for the lowest byte.
    pub(crate) fn place(self, byte: usize) -> usize {
        match self.order {
            ByteOrder::Little => byte,
            ByteOrder::Big => self.bytes - 1 - byte,
        }
    }
}

impl fmt::Display for NumberType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let class = match self.class {
            Class::Unsigned => 'u',
            Class::Signed => 'i',
            Class::Float => 'f',
        };
        let order = match self.order {
            _ if self.bytes == 1 => "",
            ByteOrder::Little => "le",
            ByteOrder::Big => "be",
        };
        write!(f, "{class}{}{order}", 8 * self.bytes)
    }
}

/// Returns a mask of the lowest `width` bits, but of at least one bit.
pub(crate) fn ones(width: usize) -> u64 {
    u64::MAX >> 64_usize.saturating_sub(width).min(63)
}
