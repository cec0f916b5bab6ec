//! Computes the values that only the template of a C receiver needs.

use framelock_formats::layout::{
    Algorithm, ByteOrder, CheckedLayout, Crc, KnownMessage, Layout, Length, LengthField,
};
use minijinja::{Value, context};

use crate::layout::greatest;

/// The greatest length of frames that are received with a window instead of a buffer. Only frames of a single kind with
/// a fixed length are received with a window.
const LONGEST_WINDOW: usize = 16;

/// The size of the table with which C code computes a CRC.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum CrcTable {
    /// A table of 16 entries, with two look-ups for each byte.
    #[default]
    Nibbles,
    /// A table of 256 entries.
    Bytes,
}

/// Returns the smallest unsigned type that holds numbers up to `most`.
pub(crate) fn smallest_type(most: u64) -> &'static str {
    match most {
        0..0x100 => "uint8_t",
        0x100..0x1_0000 => "uint16_t",
        0x1_0000..0x1_0000_0000 => "uint32_t",
        _ => "uint64_t",
    }
}

/// Returns the template values that concern all kinds together.
pub(crate) fn program(layouts: &[CheckedLayout], longest: usize, are_packets: bool) -> Value {
    let is_window = match layouts {
        [only] => only.length == Length::Fixed && longest <= LONGEST_WINDOW && !are_packets,
        _ => false,
    };
    let is_moved = !is_window && !are_packets;
    let most = if is_moved { 3 * longest } else { longest };
    let index = smallest_type(most as u64);
    let greatest = match index {
        "uint8_t" => 0xFF,
        "uint16_t" => 0xFFFF,
        _ => 0x7FFF_FFFF_usize,
    };
    // If the kinds begin with different bytes, the first byte identifies the kind.
    let starts = |byte: u8| layouts.iter().filter(|layout| layout.starts(byte)).count();
    context! {
        index,
        is_window,
        most_room => greatest - longest,
        is_shared => (0..=u8::MAX).any(|byte| starts(byte) > 1),
    }
}

/// Returns the values for a kind's classifier.
pub(crate) fn value(layout: &CheckedLayout, table: CrcTable) -> Value {
    let crc = match layout.checksum.map(|checksum| checksum.algorithm) {
        Some(Algorithm::Crc(parameters)) => Some(crc(&parameters, table)),
        _ => None,
    };
    let (least, most) = match layout.length {
        Length::Field(field) => limits(layout, &field),
        _ => (None, None),
    };
    let known = layout.messages.map_or(&[][..], |it| it.known);
    context! { crc, least, most, ..messages(known, layout) }
}

/// Returns the columns of a table of messages. Leaves out a column that no frame depends on.
fn messages(known: &[KnownMessage], layout: &Layout) -> Value {
    let longest = known.iter().map(|it| u32::from(it.longest_payload));
    let is_limited = match layout.length {
        Length::Field(field) => longest.clone().any(|longest| longest < greatest(&field)),
        _ => false,
    };
    // 256 means that there is no extra byte.
    let extra = known.iter().map(|it| it.extra.map_or(0x100, u16::from));
    let has_extra = layout.checksum.is_some() && extra.clone().any(|extra| extra < 0x100);
    context! {
        messages => known.iter().map(|message| message.number).collect::<Vec<_>>(),
        message_type => smallest_type(2 * known.len() as u64),
        longest => is_limited.then(|| longest.collect::<Vec<_>>()),
        all_extra => extra.clone().all(|extra| extra < 0x100),
        extra => has_extra.then(|| extra.collect::<Vec<_>>()),
    }
}

/// Returns the smallest and the greatest value of the length field for which a frame without a trailer has an allowed
/// length. A limit is `None` if no header with a correct sync violates it.
fn limits(layout: &Layout, field: &LengthField) -> (Option<i64>, Option<i64>) {
    let (plus, factor) = (i64::from(field.plus), i64::from(field.factor));
    let count = |length: usize| i64::try_from(length).expect("a frame's length") - plus;
    let least = (count(layout.shortest) + factor - 1).max(0) / factor;
    let most = count(layout.longest).max(0) / factor;
    let in_sync = layout.sync.each().filter_map(|sync| {
        let bytes = sync.get(field.number.at..field.number.end())?;
        let add = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        let number = match field.number.order {
            ByteOrder::Little => bytes.iter().rev().fold(0, add),
            ByteOrder::Big => bytes.iter().fold(0, add),
        };
        Some(i64::from(field.value(number)))
    });
    let in_sync: Vec<i64> = in_sync.collect();
    let smallest = in_sync.iter().copied().min().unwrap_or(0);
    let greatest_in_sync = in_sync.iter().copied().max();
    let greatest = greatest_in_sync.unwrap_or(greatest(field).into());
    (
        Some(least).filter(|least| smallest < *least),
        Some(most).filter(|most| *most < greatest),
    )
}

/// Returns the template values for a CRC. If the CRC processes the lowest bit of each byte first, the lowest bits of
/// the register hold the CRC. Otherwise the highest bits hold the CRC.
fn crc(crc: &Crc, table: CrcTable) -> Value {
    let bits = match crc.width {
        ..=8 => 8,
        9..=16 => 16,
        _ => 32,
    };
    // Converts a register whose highest bits hold the CRC to the register of the C code.
    let placed = |register: u32| {
        if crc.reflected_in {
            register.reverse_bits()
        } else {
            register >> (32 - bits)
        }
    };
    let unused = 32 - crc.width;
    let polynomial = crc.polynomial << unused;
    let (step, count) = match table {
        CrcTable::Nibbles => (4, 16),
        CrcTable::Bytes => (8, 256),
    };
    let entry = |index: u32| {
        let first = if crc.reflected_in {
            index.reverse_bits()
        } else {
            index << (32 - step)
        };
        let remainder = (0..step).fold(first, |register, _| {
            (register << 1) ^ if register >> 31 == 1 { polynomial } else { 0 }
        });
        placed(remainder)
    };
    context! {
        bits,
        initial => placed(crc.initial << unused),
        // The number of bits by which the result is shifted at the end.
        unused => if crc.reflected_in { 0 } else { bits - crc.width },
        with_bytes => table == CrcTable::Bytes,
        entries => (0..count).map(entry).collect::<Vec<u32>>(),
    }
}

/// Returns the entries of a table in C: several in a line, all with the same number of digits.
#[expect(clippy::needless_pass_by_value, reason = "a filter")]
pub(crate) fn rows(numbers: Vec<u64>) -> String {
    let most = numbers.iter().max().expect("a table has entries");
    let (digits, in_row) = match smallest_type(*most) {
        "uint8_t" => (4, 12),
        "uint16_t" => (6, 12),
        _ => (10, 8),
    };
    let entry = |number: &u64| format!("{number:#0digits$X}U");
    let rows = numbers
        .chunks(in_row)
        .map(|row| row.iter().map(entry).collect::<Vec<_>>().join(", "));
    rows.collect::<Vec<_>>().join(",\n    ")
}

/// Returns two arguments for a C function: a string literal of these bytes, and their number.
#[expect(clippy::needless_pass_by_value, reason = "a filter")]
pub(crate) fn text(bytes: Vec<u8>) -> String {
    let escaped = bytes.iter().map(|byte| match byte {
        b' '..=b'~' if !b"\"\\?".contains(byte) => char::from(*byte).to_string(),
        _ => format!("\\{byte:03o}"),
    });
    format!("\"{}\", {}U", escaped.collect::<String>(), bytes.len())
}
