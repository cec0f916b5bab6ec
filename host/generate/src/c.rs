//! Computes the values that the template of a C receiver needs about a layout.

use framelock_formats::layout::{
    Algorithm, ByteOrder, CheckedLayout, Checksum, Crc, Encoding, FixedBits, Layout, Length,
    LengthField, Messages, Number, Patterns,
};
use minijinja::{Value, context};
use serde::Serialize;

use crate::Item;

/// The greatest length of fixed-length frames that are received with a window instead of a buffer.
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
fn smallest_type(most: u64) -> &'static str {
    match most {
        0..0x100 => "uint8_t",
        0x100..0x1_0000 => "uint16_t",
        0x1_0000..0x1_0000_0000 => "uint32_t",
        _ => "uint64_t",
    }
}

/// Returns the template values for a kind's classifier and encoder.
pub(crate) fn value(layout: &Layout, table: CrcTable) -> Value {
    let header = layout.header();
    let is_in_header =
        |bits: &FixedBits| usize::try_from(bits.at).is_ok_and(|place| place < header);
    let fixed = layout.fixed.iter().copied();
    let (in_header, in_frame): (Vec<FixedBits>, Vec<_>) = fixed.partition(is_in_header);
    let terminators: Vec<&[u8]> = layout.terminators().collect();
    let sync: Vec<&[u8]> = layout.sync.each().collect();
    let starts: Vec<u8> = sync.iter().filter_map(|it| it.first().copied()).collect();
    let starts = distinct(&starts);
    let starts = starts.iter().map(|byte| format!("byte == {byte:#04X}U"));
    let content = layout.content.iter().map(|range| match range {
        (first, last) if first == last => format!("byte == {first:#04X}U"),
        (0, last) => format!("byte <= {last:#04X}U"),
        (first, 0xFF) => format!("byte >= {first:#04X}U"),
        (first, last) => format!("(byte >= {first:#04X}U) && (byte <= {last:#04X}U)"),
    });
    let mut by_length = terminators.clone();
    by_length.sort_by_key(|it| std::cmp::Reverse(it.len()));
    let trailer = layout.trailer.map(|it| {
        context! {
            at => it.at,
            mask => hex(it.mask),
            bytes => it.bytes,
            lowest_bit => hex(it.mask & it.mask.wrapping_neg()),
            may_be_too_long => layout.longest_without_trailer() + it.bytes > layout.longest,
        }
    });
    let length = match layout.length {
        Length::Field(field) => Some(length(layout, &field)),
        _ => None,
    };
    context! {
        longest => layout.longest,
        shortest => layout.shortest,
        header,
        is_fixed => layout.length == Length::Fixed,
        is_delimited => layout.length == Length::Delimiter,
        length,
        sync => patterns(&layout.sync),
        terminator => patterns(&layout.terminator),
        starts => any_of(starts),
        content => any_of(content),
        terminators => terminators.iter().map(|it| bytes_of(it)).collect::<Vec<_>>(),
        by_length => by_length.iter().map(|it| bytes_of(it)).collect::<Vec<_>>(),
        width => terminators.iter().map(|it| it.len()).max().unwrap_or(0),
        has_others => layout.other_terminators[0].length > 0,
        may_be_too_short => layout.sync.length + layout.terminator.length < layout.shortest,
        in_header => any_of(in_header.into_iter().map(wrong_bits)),
        in_frame => any_of(in_frame.into_iter().map(wrong_bits)),
        fixed => layout.fixed.iter().copied().map(set_bits).collect::<Vec<_>>(),
        messages => layout.messages.as_ref().map(|it| messages(it, layout)),
        trailer,
        checksum => layout.checksum.as_ref().map(|it| checksum(it, table)),
    }
}

/// The reasons to discard bytes. Each entry has the reason's name, its text, and the part of the frame in which
/// classification finds the reason: 0 is the first byte, 1 the rest of the sync, 2 the header, and 3 the rest.
const REASONS: [(&str, &str, u8); 7] = [
    ("NO_SYNC", "no frame begins with these bytes", 0),
    ("BROKEN_SYNC", "a later byte of the sync is wrong", 1),
    (
        "BAD_HEADER",
        "the length is too small, or fixed bits are wrong",
        2,
    ),
    ("TOO_LONG", "the length is too great", 2),
    ("UNKNOWN_MESSAGE", "the message is unknown", 2),
    ("CHECKSUM_MISMATCH", "the checksum is wrong", 3),
    (
        "WRONG_TERMINATOR",
        "the terminator or fixed bits are wrong",
        3,
    ),
];

/// Returns the template values that concern all kinds together.
pub(crate) fn program(layouts: &[CheckedLayout]) -> Value {
    let longest = layouts
        .iter()
        .map(|layout| layout.longest)
        .max()
        .expect("a description has a kind");
    let is_window = match layouts {
        [only] => only.length == Length::Fixed && longest <= LONGEST_WINDOW,
        _ => false,
    };
    let most = if is_window { longest } else { 3 * longest };
    let index = smallest_type(most as u64);
    let greatest = match index {
        "uint8_t" => 0xFF,
        "uint16_t" => 0xFFFF,
        _ => 0x7FFF_FFFF_usize,
    };
    let occurring: Vec<[bool; 7]> = layouts.iter().map(|layout| occurring(layout)).collect();
    let occurs = |reason: usize| {
        occurring
            .iter()
            .any(|these| these.get(reason) == Some(&true))
    };
    let reasons = REASONS
        .iter()
        .zip((0..7).map(occurs))
        .filter(|(_, occurs)| *occurs);
    let reasons = reasons.map(|((name, text, part), _)| context! { name, text, part });
    // If the kinds begin with different bytes, the first byte identifies the kind.
    let starts = |byte: u8| layouts.iter().filter(|layout| layout.starts(byte)).count();
    context! {
        index,
        is_window,
        most_room => greatest - longest,
        is_shared => (0..=u8::MAX).any(|byte| starts(byte) > 1),
        has_tables => layouts.iter().any(|layout| has_tables(layout)),
        reasons => reasons.collect::<Vec<_>>(),
    }
}

fn has_tables(layout: &Layout) -> bool {
    let is_crc = |it: &Checksum| matches!(it.algorithm, Algorithm::Crc(_));
    layout.messages.is_some() || layout.checksum.as_ref().is_some_and(is_crc)
}

/// Returns for each reason whether it can occur.
fn occurring(layout: &Layout) -> [bool; 7] {
    let header = layout.header();
    let mut fixed = layout.fixed.iter();
    let fixed_in_header = fixed.any(|it| usize::try_from(it.at).is_ok_and(|at| at < header));
    let mut fixed = layout.fixed.iter();
    let fixed_in_frame = fixed.any(|it| usize::try_from(it.at).map_or(true, |at| at >= header));
    let is_delimited = layout.length == Length::Delimiter;
    let (mut is_short, mut is_long) = (false, false);
    if let Length::Field(field) = layout.length {
        let (least, most) = limits(layout, &field);
        let (smallest, greatest) = range(layout, &field);
        let known = layout.messages.map_or(&[][..], |it| it.known);
        let is_limited = known
            .iter()
            .any(|it| u32::from(it.longest_payload) < greatest);
        let trailer = layout.trailer.map_or(0, |it| it.bytes);
        let may_not_fit = layout.longest_without_trailer() + trailer > layout.longest;
        is_short = smallest < least;
        is_long = is_limited || most < greatest || may_not_fit;
    } else if is_delimited {
        is_short = layout.sync.length + layout.terminator.length < layout.shortest;
    }
    [
        true,
        layout.sync.length > 1,
        fixed_in_header || is_short,
        is_long,
        layout.messages.is_some(),
        layout.checksum.is_some(),
        is_delimited || fixed_in_frame || layout.terminator.length > 0,
    ]
}

/// Returns the bytes without duplicates, in the order in which they first occur.
fn distinct(bytes: &[u8]) -> Vec<u8> {
    let mut distinct = Vec::new();
    for byte in bytes {
        if !distinct.contains(byte) {
            distinct.push(*byte);
        }
    }
    distinct
}

fn hex(byte: u8) -> String {
    format!("{byte:#04X}U")
}

fn bytes_of(bytes: &[u8]) -> Vec<String> {
    bytes.iter().map(|byte| hex(*byte)).collect()
}

fn patterns(patterns: &Patterns) -> Value {
    let each: Vec<Vec<String>> = patterns.each().map(bytes_of).collect();
    context! { each, length => patterns.length }
}

/// Joins conditions with `||`. If there are several conditions, each condition gets parentheses.
fn any_of(conditions: impl Iterator<Item = String>) -> String {
    let conditions: Vec<String> = conditions.collect();
    if let [one] = &*conditions {
        return one.clone();
    }
    let each = conditions.iter().map(|it| format!("({it})"));
    each.collect::<Vec<_>>().join(" || ")
}

/// Returns the C expression for an index in a frame: the position `at`, plus `more` bytes. A negative `at` counts from
/// the frame's end.
fn index(at: i16, more: usize) -> String {
    match (at, usize::from(at.unsigned_abs())) {
        (0.., distance) => format!("{}U", distance + more),
        (_, distance) => format!("length - {}U", distance.saturating_sub(more)),
    }
}

fn wrong_bits(bits: FixedBits) -> String {
    let (at, value) = (index(bits.at, 0), hex(bits.value));
    match bits.mask {
        0xFF => format!("bytes[{at}] != {value}"),
        mask => format!("(bytes[{at}] & {}) != {value}", hex(mask)),
    }
}

fn set_bits(bits: FixedBits) -> String {
    let (at, value) = (index(bits.at, 0), hex(bits.value));
    match bits.mask {
        0xFF => format!("frame[{at}] = {value};"),
        mask => format!(
            "frame[{at}] = (uint8_t)((frame[{at}] & {}) | {value});",
            hex(!mask)
        ),
    }
}

/// Returns the expression that reads a number of 1, 2, 3, 4 or 8 bytes from an array.
fn number(array: &str, at: &str, bytes: usize, order: ByteOrder) -> String {
    let order = if order == ByteOrder::Big { "be" } else { "le" };
    match bytes {
        1 => format!("{array}[{at}]"),
        _ => format!("PREFIX_{order}{}(&{array}[{at}])", 8 * bytes),
    }
}

fn header_number(array: &str, it: &Number) -> String {
    number(array, &format!("{}U", it.at), it.bytes, it.order)
}

/// Returns the greatest value of a length field.
fn greatest(field: &LengthField) -> u32 {
    let unused = 32 - 8 * u32::try_from(field.number.bytes).unwrap_or(4);
    field.mask & (u32::MAX >> unused)
}

/// Returns the smallest and the greatest value that a length field can have if the sync is correct.
fn range(layout: &Layout, field: &LengthField) -> (u32, u32) {
    let in_sync = layout.sync.each().filter_map(|sync| {
        let bytes = sync.get(field.number.at..field.number.end())?;
        let add = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        let number = match field.number.order {
            ByteOrder::Little => bytes.iter().rev().fold(0, add),
            ByteOrder::Big => bytes.iter().fold(0, add),
        };
        Some(number & field.mask)
    });
    let values: Vec<u32> = in_sync.collect();
    let smallest = values.iter().min().copied().unwrap_or(0);
    (
        smallest,
        values.iter().max().copied().unwrap_or(greatest(field)),
    )
}

/// Returns the smallest and the greatest value of the length field for which a frame without a trailer has an allowed
/// length.
fn limits(layout: &Layout, field: &LengthField) -> (u32, u32) {
    let count = |length: usize| i64::try_from(length).unwrap_or(i64::MAX) - i64::from(field.plus);
    let factor = i64::from(field.factor);
    let least = (count(layout.shortest) + factor - 1).max(0) / factor;
    let most = count(layout.longest).max(0) / factor;
    let number = |it: i64| u32::try_from(it).unwrap_or(u32::MAX);
    (number(least), number(most))
}

fn length(layout: &Layout, field: &LengthField) -> Value {
    let (least, most) = limits(layout, field);
    let (smallest, greatest) = range(layout, field);
    let read = header_number("bytes", &field.number);
    let all = u32::MAX >> (32 - 8 * field.number.bytes);
    let is_whole = field.mask & all == all;
    let wide = field.number.bytes > 2 || layout.longest > 0x5555;
    let counted = if wide { "(uint32_t)field" } else { "field" };
    let counted = match field.factor {
        1 => counted.to_owned(),
        factor => format!("{counted} * {factor}U"),
    };
    let (sign, opposite) = if field.plus < 0 {
        ('-', '+')
    } else {
        ('+', '-')
    };
    let plus = field.plus.unsigned_abs();
    let shifted = |sign| {
        if plus == 0 {
            String::new()
        } else {
            format!(" {sign} {plus}U")
        }
    };
    let count = field.number.bytes;
    let parts = (0..count).filter_map(|byte| {
        let shift = 8 * if field.number.order == ByteOrder::Big {
            count - 1 - byte
        } else {
            byte
        };
        let mask = field
            .mask
            .checked_shr(u32::try_from(shift).ok()?)?
            .to_le_bytes()[0];
        let place = format!("frame[{}U]", field.number.at + byte);
        let value = match shift {
            0 => "field".to_owned(),
            _ => format!("(field >> {shift}U)"),
        };
        match mask {
            0 => None,
            0xFF if shift == 0 => Some(format!("{place} = (uint8_t)field;")),
            0xFF => Some(format!("{place} = (uint8_t){value};")),
            _ => Some(format!(
                "{place} = (uint8_t)(({place} & {}) | ({value} & {}));",
                hex(!mask),
                hex(mask)
            )),
        }
    });
    context! {
        type => if wide { "uint32_t" } else { smallest_type(all.into()) },
        field => if is_whole { read } else { format!("{read} & {:#X}U", field.mask & all) },
        least => Some(least).filter(|it| smallest < *it),
        most => Some(most).filter(|it| *it < greatest),
        length => format!("{counted}{}", shifted(sign)),
        written => match field.factor {
            1 => format!("(uint32_t)length{}", shifted(opposite)),
            factor => format!("((uint32_t)length{}) / {factor}U", shifted(opposite)),
        },
        writes => parts.collect::<Vec<_>>(),
    }
}

/// Returns a table's rows.
fn rows(numbers: &[u64]) -> Vec<String> {
    let most = numbers.iter().max().copied().unwrap_or_default();
    let digits = smallest_type(most).trim_matches(|c: char| !c.is_ascii_digit());
    let digits = 2 + digits.parse::<usize>().unwrap_or(8) / 4;
    let rows = numbers.chunks(if digits > 6 { 8 } else { 12 });
    let row = |row: &[u64]| {
        let row: Vec<String> = row.iter().map(|it| format!("{it:#0digits$X}U")).collect();
        row.join(", ")
    };
    rows.map(row).collect()
}

fn array(numbers: &[u64]) -> Value {
    let kind = smallest_type(numbers.iter().max().copied().unwrap_or_default());
    context! { type => kind, rows => rows(numbers) }
}

fn messages(messages: &Messages, layout: &Layout) -> Value {
    let column = |of: fn(&framelock_formats::layout::KnownMessage) -> u64| {
        messages.known.iter().map(of).collect::<Vec<u64>>()
    };
    let longest = column(|it| it.longest_payload.into());
    let extra = column(|it| it.extra.map_or(0x100, u64::from));
    let is_limited = match layout.length {
        Length::Field(field) => longest.iter().any(|it| *it < greatest(&field).into()),
        _ => false,
    };
    let has_extra = layout.checksum.is_some() && extra.iter().any(|it| *it < 0x100);
    context! {
        count => messages.known.len(),
        type => smallest_type(2 * messages.known.len() as u64),
        in_bytes => header_number("bytes", &messages.number),
        in_frame => header_number("frame", &messages.number),
        numbers => array(&column(|it| it.number.into())),
        longest => is_limited.then(|| array(&longest)),
        extra => has_extra.then(|| array(&extra)),
        all_extra => extra.iter().all(|it| *it < 0x100),
    }
}

fn checksum(it: &Checksum, table: CrcTable) -> Value {
    let algorithm = match it.algorithm {
        Algorithm::Crc(_) => "CRC",
        Algorithm::Sum => "sum",
        Algorithm::InvertedSum => "inverted sum",
        Algorithm::NegatedSum => "negated sum",
        Algorithm::Xor => "exclusive or",
        _ => "Fletcher checksum",
    };
    let from = usize::from(it.from.unsigned_abs());
    let to = usize::from(it.to.unsigned_abs());
    let count = match (it.from >= 0, it.to >= 0) {
        (true, true) => format!("{}U", to + 1 - from),
        (false, false) => format!("{}U", from + 1 - to),
        (true, false) if to + from == 1 => "length".to_owned(),
        (true, false) => format!("length - {}U", to + from - 1),
        (false, true) => format!("{}U - length", to + 1 + from),
    };
    let order = match it.encoding {
        Encoding::Big => ByteOrder::Big,
        _ => ByteOrder::Little,
    };
    let writes = (0..it.bytes).map(|byte| {
        let shift = 8 * if order == ByteOrder::Big {
            it.bytes - 1 - byte
        } else {
            byte
        };
        let value = match shift {
            0 => "sum".to_owned(),
            _ => format!("(sum >> {shift}U)"),
        };
        format!("frame[{}] = (uint8_t){value};", index(it.at, byte))
    });
    context! {
        algorithm,
        type => smallest_type(u64::MAX >> (64 - 8 * it.bytes)),
        bytes => it.bytes,
        is_hex => it.encoding == Encoding::Hex,
        at => index(it.at, 0),
        from => index(it.from, 0),
        count,
        stored => number("bytes", &index(it.at, 0), it.bytes, order),
        writes => writes.collect::<Vec<_>>(),
        crc => match it.algorithm {
            Algorithm::Crc(it) => Some(crc(&it, table)),
            _ => None,
        },
    }
}

/// Returns the template values for a CRC. If the CRC processes the lowest bit of each byte first, the lowest bits of
/// the register hold the CRC. Otherwise the highest bits hold the CRC.
fn crc(crc: &Crc, table: CrcTable) -> Value {
    let bits = match crc.width {
        ..=8 => 8,
        9..=16 => 16,
        _ => 32,
    };
    let aligned = |value: u32| {
        let highest = value << (32 - crc.width);
        if crc.reflected_in {
            highest.reverse_bits()
        } else {
            highest >> (32 - bits)
        }
    };
    let polynomial = aligned(crc.polynomial);
    let all = u32::MAX >> (32 - bits);
    let (index_bits, entries) = match table {
        CrcTable::Nibbles => (4, 16),
        CrcTable::Bytes => (8, 256),
    };
    let entry = |index: u32| {
        (0..index_bits).fold(
            if crc.reflected_in {
                index
            } else {
                index << (bits - index_bits)
            },
            |register, _| {
                if crc.reflected_in {
                    register >> 1 ^ if register & 1 == 1 { polynomial } else { 0 }
                } else {
                    let is_divided = register >> (bits - 1) & 1 == 1;
                    (register << 1 ^ if is_divided { polynomial } else { 0 }) & all
                }
            },
        )
    };
    let entries: Vec<u64> = (0..entries).map(|index| entry(index).into()).collect();
    let unused = bits - crc.width;
    let is_narrowed = !crc.reflected_in && unused > 0;
    context! {
        bits,
        width => crc.width,
        unused => is_narrowed.then_some(unused),
        reflected_in => crc.reflected_in,
        is_reversed => crc.reflected_in != crc.reflected_out,
        initial => format!("{:#X}U", aligned(crc.initial)),
        xor_out => Some(crc.xor_out).filter(|it| *it > 0).map(|it| format!("{it:#X}U")),
        with_bytes => table == CrcTable::Bytes,
        rows => rows(&entries),
        count => entries.len(),
    }
}

/// A field in C.
#[derive(Serialize, Default)]
pub(crate) struct Access {
    /// The type of the field's values.
    #[serde(rename = "type")]
    kind: String,
    /// The expression that reads the field's value from `frame`.
    read: String,
    /// The statement that writes the field's value into `frame`.
    write: String,
}

/// Returns the type of a field in C, and the code that reads and writes it.
pub(crate) fn access(item: &Item) -> Access {
    let more = |size: usize| match (item.is_array, size) {
        (false, _) => String::new(),
        (true, 1) => " + i".to_owned(),
        (true, size) => format!(" + {size}U * i"),
    };
    let kind = c_type(&item.number);
    let member = format!(
        "message->{}{}",
        item.name,
        if item.is_array { "[i]" } else { "" }
    );
    let wide = if item.width.max(8 * item.bytes) > 32 {
        "64"
    } else {
        ""
    };
    let as_bits = match &*item.number {
        "f32" => format!("PREFIX_bits_of({member})"),
        number if number.starts_with('i') => format!("(u{kind}){member}"),
        _ => member,
    };
    let at = index(item.at, 0);
    if let Some(first) = item.first {
        let mask = (1_u64 << item.width.min(63)) - 1;
        let place = if item.is_array {
            format!("(uint16_t)({first}U{})", more(item.width))
        } else {
            format!("{first}U")
        };
        let read = if first + item.width <= 8 && !item.is_array {
            let shifted = match first {
                0 => format!("frame[{at}]"),
                _ => format!("(uint8_t)(frame[{at}] >> {first}U)"),
            };
            format!("{shifted} & {mask:#04X}U")
        } else {
            format!("PREFIX_bits{wide}(&frame[{at}], {place}, {}U)", item.width)
        };
        let write = format!(
            "PREFIX_put_bits{wide}(&frame[{at}], {place}, {}U, {as_bits});",
            item.width
        );
        return Access {
            read: cast(item, &kind, &read),
            write,
            kind,
        };
    }
    let at = format!("{at}{}", more(item.bytes));
    let order = if item.order == "be" {
        ByteOrder::Big
    } else {
        ByteOrder::Little
    };
    let mut read = number("frame", &at, item.bytes, order);
    let mut bits = as_bits;
    if let Some(mask) = item.mask {
        let (suffix, wide) = if wide.is_empty() {
            ("U", "uint32_t")
        } else {
            ("ULL", "uint64_t")
        };
        let cast = if item.shift > 0 || item.number.starts_with('i') {
            format!("({wide}){bits}")
        } else {
            bits
        };
        let shifted = |value: &str, shift: &str| match item.shift {
            0 => value.to_owned(),
            by => format!("({value} {shift} {by}U)"),
        };
        read = shifted(&format!("({read} & {mask:#X}{suffix})"), ">>");
        bits = format!("({} & {mask:#X}{suffix})", shifted(&cast, "<<"));
    }
    let write = match item.bytes {
        1 => format!("frame[{at}] = (uint8_t)(frame[{at}] | {bits});"),
        bytes => format!(
            "PREFIX_put_{}{wide}(&frame[{at}], {bytes}U, {bits});",
            item.order
        ),
    };
    Access {
        read: cast(item, &kind, &read),
        write,
        kind,
    }
}

/// Returns the expression that casts the number `read` to the field's type.
fn cast(item: &Item, kind: &str, read: &str) -> String {
    if item.number == "f32" {
        return format!("PREFIX_float({read})");
    }
    if item.is_narrow_signed {
        let wide = if item.width > 32 { "64" } else { "" };
        return format!("({kind})PREFIX_signed{wide}({read}, {}U)", item.width);
    }
    let is_plain =
        item.first.is_none() && item.mask.is_none() && kind.starts_with('u') && item.bytes != 3;
    if is_plain {
        read.to_owned()
    } else {
        format!("({kind})({read})")
    }
}

/// Returns the C type of a field.
fn c_type(number: &str) -> String {
    match number.split_at(1) {
        ("f", _) => "float".to_owned(),
        ("u", bits) => format!("uint{bits}_t"),
        (_, bits) => format!("int{bits}_t"),
    }
}
