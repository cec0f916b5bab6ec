//! Arbitrary layouts, for the harnesses.

use framelock::any_format::{any_up_to, part};

use crate::layout::{
    Algorithm, ByteOrder, Checksum, Crc, Encoding, FixedBits, KnownMessage, Layout, Length,
    LengthField, Messages, Number, Patterns, Table, Trailer,
};

/// The parts that a layout borrows: up to `F` fixed bits and `M` messages.
pub(super) struct Parts<const F: usize, const M: usize> {
    fixed: [FixedBits; F],
    messages: [KnownMessage; M],
}

impl<const F: usize, const M: usize> Parts<F, M> {
    pub(super) fn any() -> Self {
        Self {
            fixed: core::array::from_fn(|_| FixedBits {
                at: kani::any(),
                mask: kani::any(),
                value: kani::any(),
            }),
            messages: core::array::from_fn(|_| KnownMessage {
                number: kani::any(),
                longest_payload: kani::any(),
                extra: kani::any(),
            }),
        }
    }

    /// Returns an arbitrary layout with none, some or all of these parts, but without a sync, a terminator, a content
    /// or a checksum.
    pub(super) fn layout(&self) -> Layout<'_> {
        Layout {
            sync: Patterns::NONE,
            length: match kani::any::<u8>() {
                0 => Length::Fixed,
                1 => Length::Delimiter,
                2 => Length::Silence,
                _ => Length::Field(LengthField {
                    number: any_number(),
                    mask: kani::any(),
                    factor: kani::any(),
                    plus: kani::any(),
                }),
            },
            shortest: kani::any(),
            longest: kani::any(),
            fixed: part(&self.fixed, 0, any_up_to(F)),
            messages: kani::any::<bool>().then(|| Messages {
                number: any_number(),
                known: part(&self.messages, 0, any_up_to(M)),
            }),
            checksum: None,
            terminator: Patterns::NONE,
            behind: any_up_to(2),
            content: &[],
            other_terminators: [Patterns::NONE; 2],
            trailer: kani::any::<bool>().then(|| Trailer {
                at: kani::any(),
                mask: kani::any(),
                bytes: kani::any(),
            }),
        }
    }
}

/// Returns patterns that consist of these two sequences. The sequences may be equal.
pub(super) fn patterns<const LENGTH: usize>(bytes: &[[u8; LENGTH]; 2]) -> Patterns<'_> {
    Patterns {
        bytes: bytes.as_flattened(),
        length: LENGTH,
    }
}

/// Returns an arbitrary number.
pub(super) fn any_number() -> Number {
    Number {
        at: kani::any(),
        bytes: kani::any(),
        order: if kani::any() {
            ByteOrder::Little
        } else {
            ByteOrder::Big
        },
    }
}

/// Returns an arbitrary checksum without a table.
pub(super) fn any_checksum() -> Checksum<'static> {
    Checksum {
        algorithm: match kani::any::<u8>() {
            0 => Algorithm::Sum,
            1 => Algorithm::CarrySum,
            2 => Algorithm::SumWords,
            3 => Algorithm::Xor,
            4 => Algorithm::XorWords,
            5 => Algorithm::Fletcher,
            _ => Algorithm::Crc(Crc {
                width: kani::any(),
                polynomial: kani::any(),
                initial: kani::any(),
                reflected_in: kani::any(),
                reflected_out: kani::any(),
                xor_out: kani::any(),
                table: Table::None,
            }),
        },
        bytes: kani::any(),
        encoding: match kani::any::<u8>() {
            0 => Encoding::Little,
            1 => Encoding::Big,
            _ => Encoding::Hex,
        },
        at: kani::any(),
        from: kani::any(),
        to: kani::any(),
        initial: kani::any(),
        xor_out: kani::any(),
        over_hex_digits: kani::any(),
    }
}
