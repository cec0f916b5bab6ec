//! Checks the fields of a description, and that no two parts of a frame overlap.

use std::collections::BTreeMap;
use std::ops::Range;

use framelock_formats::layout::FixedBits;

use toml::Spanned;

use crate::entries::{FieldEntry, FrameEntry, Problem, TrailerEntry, Values, wrong};
use crate::field::{Class, Field, Type};
use crate::kind::{Kind, LONGEST};
use crate::positions::checksum_position;
use crate::value::{Decimal, Scale};

/// Names that no field may have, because other columns have them.
const TAKEN: [&str; 3] = ["offset", "length", "time"];

/// Checks that a name is valid for a column, and returns it.
fn column_name(name: &Spanned<String>) -> Result<String, Problem> {
    let text = name.get_ref();
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    if !text.starts_with(|c: char| c.is_ascii_alphabetic()) || !text.chars().all(plain) {
        return wrong(
            name,
            "a name must have only letters, digits and _, and begin with a letter",
        );
    }
    if TAKEN.iter().any(|taken| text.eq_ignore_ascii_case(taken)) {
        let taken = TAKEN.join(", ");
        return wrong(
            name,
            format!("{taken} are the names of other columns: choose another name"),
        );
    }
    Ok(text.clone())
}

/// Returns the field of a trailer of `bytes` bytes.
pub(super) fn appended(entry: &TrailerEntry, bytes: usize) -> Result<Field, Problem> {
    Ok(Field {
        name: column_name(&entry.name)?,
        count: Some(bytes),
        is_appended: true,
        ..Field::default()
    })
}

/// Checks the entry of a field and returns the field.
pub(super) fn field(spanned: &Spanned<FieldEntry>) -> Result<Field, Problem> {
    let entry = spanned.get_ref();
    let name = column_name(&entry.name)?;
    let kind = match (entry.kind, entry.bits) {
        (Some(kind), None) => kind,
        (None, Some(width @ 1..=64)) => Type::Bits {
            first: entry.bit.into(),
            width,
        },
        _ => {
            return wrong(
                spanned,
                "a field must have either a type, or bits from 1 to 64",
            );
        }
    };
    let is_possible = |count| (1..=LONGEST).contains(&count);
    if !entry.count.is_none_or(is_possible) {
        return wrong(spanned, format!("a count must be from 1 to {LONGEST}"));
    }
    let number = match kind {
        Type::Number(number) if number.class != Class::Float => Some(number),
        _ => None,
    };
    if let Some(mask) = &entry.mask
        && number.is_none_or(|number| *mask.get_ref() == 0 || *mask.get_ref() > number.all())
    {
        return wrong(
            mask,
            "only a whole number can have a mask, and the mask must have some of its bits",
        );
    }
    let scale = entry.scale.as_ref().or(entry.offset.as_ref());
    if let Some(scale) = scale.filter(|_| number.is_none() && entry.bits.is_none()) {
        return wrong(scale, "only a whole number can have a scale and an offset");
    }
    if let Some(scale) = entry.scale.as_ref().filter(|it| it.get_ref().digits == 0) {
        return wrong(scale, "a scale must not be 0");
    }
    let decimal = |entry: &Option<Spanned<Decimal>>| entry.as_ref().map(|it| *it.get_ref());
    let (factor, offset) = (decimal(&entry.scale), decimal(&entry.offset));
    let one = Decimal {
        digits: 1,
        decimals: 0,
    };
    let is_blank = |c: char| c.is_control() || c.is_whitespace();
    if let Some(unit) = &entry.unit
        && unit.get_ref().contains(is_blank)
    {
        return wrong(unit, "a unit must be a word, such as deg or m/s");
    }
    let mut field = Field {
        name,
        at: *entry.at.get_ref(),
        kind,
        count: entry.count,
        mask: entry.mask.as_ref().map(|mask| *mask.get_ref()),
        scale: scale.map(|_| Scale::new(factor.unwrap_or(one), offset.unwrap_or_default())),
        unit: entry.unit.as_ref().map(|unit| unit.get_ref().clone()),
        item: entry.item.as_ref().map(|item| *item.get_ref()),
        ..Field::default()
    };
    if let Some(item) = entry.item.as_ref().filter(|_| field.kind != Type::Text) {
        return wrong(item, "only text can have an item");
    }
    if let Some(value) = &entry.value
        && let Values::One(number) = *value.get_ref()
    {
        match field.to_bits(&number.into()) {
            Ok(bits) if !field.is_array() && !field.is_text() => field.constant = Some(bits),
            _ => {
                return wrong(
                    value,
                    "this value does not fit the field, or the field is an array",
                );
            }
        }
    }
    if field.at < 0 && field.length().is_none() {
        let what = "a field that takes the rest of the frame must be counted from the front: change at, or give a count";
        return wrong(&entry.at, what);
    }
    Ok(field)
}

/// Sets the end of each field that takes the rest of the frame. The last `from_end` bytes of the frame hold the parts
/// that are counted from the end, so the field ends before these bytes.
pub(super) fn take_what_is_left(
    fields: &mut [Field],
    written: &FrameEntry,
    from_end: usize,
) -> Result<(), Problem> {
    for (field, entry) in fields.iter_mut().zip(&written.fields) {
        // If all frames have the same length, a field that takes the rest also has a fixed length.
        if let (Some(length), None) = (&written.length, field.length()) {
            let distance = usize::from(field.at.unsigned_abs());
            field.count = length.get_ref().checked_sub(distance + from_end);
            if field.count.is_none_or(|left| left == 0) {
                return wrong(entry, "no bytes of the frame are left for this field");
            }
        }
        let is_placed = field.at < 0 || field.constant.is_some();
        if !is_placed && written.length.is_none() {
            field.margin = from_end;
        }
    }
    fields.iter_mut().for_each(Field::prepare);
    Ok(())
}

/// Returns the bits that are the same in every frame, and for each entry of this list the index of its field.
pub(super) fn fixed_bits(fields: &[Field]) -> (Vec<FixedBits>, Vec<usize>) {
    let (mut fixed, mut owners) = (Vec::new(), Vec::new());
    for (number, field) in fields.iter().enumerate() {
        let Some(constant) = field.constant else {
            continue;
        };
        let mut bytes = BTreeMap::<usize, (u8, u8)>::new();
        field.each_bit(0, |place, _, of_value| {
            let (mask, value) = bytes.entry(place / 8).or_default();
            *mask |= 1 << (place % 8);
            *value |= u8::from(constant >> of_value & 1 == 1) << (place % 8);
        });
        for (byte, (mask, value)) in bytes {
            let byte = u16::try_from(byte).unwrap_or(u16::MAX);
            let at = field.at.saturating_add_unsigned(byte);
            fixed.push(FixedBits { at, mask, value });
            owners.push(number);
        }
    }
    (fixed, owners)
}

/// Checks that every part fits into a frame of `length` bytes and that no two parts overlap. `longest` is the length of
/// the longest frame, which has every field.
pub(super) fn check_positions(
    written: &FrameEntry,
    kind: &Kind,
    length: usize,
    longest: usize,
) -> Result<(), Problem> {
    let whole = |bytes: Range<usize>| (8 * bytes.start..8 * bytes.end).collect();
    // For each part: its position in the text, its name, and the indexes of its bits.
    let mut claims: Vec<(Range<usize>, &str, Vec<usize>)> = Vec::new();
    // If the terminator has several alternatives, a field may share the terminator's bytes. The field then selects one
    // of the alternatives.
    let terminator = written
        .terminator
        .as_ref()
        .filter(|it| !it.get_ref().may_be_a_field());
    if let Some(terminator) = terminator {
        let from = length.saturating_sub(terminator.get_ref().first.length);
        claims.push((terminator.span(), "the terminator", whole(from..length)));
    }
    if let (Some(entry), Some(checksum)) = (&written.checksum, kind.layout.checksum) {
        let bytes = checksum_position(&checksum, length).unwrap_or_default();
        claims.push((entry.span(), "the checksum", whole(bytes)));
    }
    for (field, entry) in kind.fields.iter().zip(&written.fields) {
        let entry = entry.get_ref();
        // An item shares the bytes of its text.
        if field.item.is_some() {
            continue;
        }
        if length < longest && kind.shortest_with(field).is_some() {
            continue;
        }
        let mut bits = Vec::new();
        match (field.position(length), field.length()) {
            (Some(bytes), _) => field.each_bit(bytes.len(), |bit, _, _| {
                bits.push(8 * bytes.start + bit);
            }),
            // The frame is too short for the field. A bit after the frame's end makes the check below fail.
            (None, Some(_)) => bits.push(8 * length),
            (None, None) => {}
        }
        claims.push((entry.at.span(), &field.name, bits));
    }
    let mut owners: Vec<Option<&str>> = vec![None; 8 * length];
    for (span, name, bits) in claims {
        for bit in bits {
            let Some(owner) = owners.get_mut(bit) else {
                let what = format!("{name} is not in a frame of {length} bytes");
                return Err(Problem(span, what));
            };
            if let Some(other) = owner.replace(name) {
                let what = format!("{name} overlaps {other}");
                return Err(Problem(span, what));
            }
        }
    }
    Ok(())
}
