//! From what is written of a field to the field.

use toml::Spanned;

use crate::build::LONGEST;
use crate::field::{Class, Field, Type};
use crate::written::{AppendixEntry, FieldEntry, Problem, Values, wrong};

/// Names that rows have besides the fields.
const TAKEN: [&str; 3] = ["offset", "length", "time"];

/// A name that a column may have.
fn column_name(name: &Spanned<String>) -> Result<String, Problem> {
    let text = name.get_ref();
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    if !text.starts_with(|c: char| c.is_ascii_lowercase()) || !text.chars().all(plain) {
        return wrong(
            name,
            "a name has small letters, digits and _, and begins with a letter",
        );
    }
    if TAKEN.contains(&text.as_str()) {
        let what = format!(
            "{} are other columns' names: take another",
            TAKEN.join(", ")
        );
        return wrong(name, what);
    }
    Ok(text.clone())
}

/// What is appended.
pub(crate) fn appended(entry: &AppendixEntry, bytes: usize) -> Result<Field, Problem> {
    Ok(Field {
        name: column_name(&entry.name)?,
        count: Some(bytes),
        is_appended: true,
        ..Field::default()
    })
}

/// A field.
pub(crate) fn field(spanned: &Spanned<FieldEntry>) -> Result<Field, Problem> {
    let entry = spanned.get_ref();
    let name = column_name(&entry.name)?;
    let kind = match (entry.kind, entry.bits) {
        (Some(kind), None) => kind.0,
        (None, Some(width @ 1..=64)) => Type::Bits {
            first: entry.bit.into(),
            width,
        },
        _ => {
            return wrong(
                spanned,
                "a field has a type, or else bits, which are 1 to 64",
            );
        }
    };
    if entry
        .count
        .is_some_and(|count| !(1..=LONGEST).contains(&count))
    {
        return wrong(spanned, format!("a count is from 1 to {LONGEST}"));
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
            "a mask is for whole numbers, and has bits that they have",
        );
    }
    let is_short = match kind {
        Type::Bits { width, .. } => width <= 32,
        _ => number.is_some_and(|number| number.bytes <= 4),
    };
    if let Some(scale) = entry.scale.as_ref().filter(|_| !is_short) {
        return wrong(scale, "a scale is for whole numbers of up to 32 bits");
    }
    if let Some(unit) = &entry.unit
        && unit
            .get_ref()
            .chars()
            .any(|c| c.is_control() || c.is_whitespace())
    {
        return wrong(unit, "a unit is a word, such as deg or m/s");
    }
    let mut field = Field {
        name,
        at: *entry.at.get_ref(),
        kind,
        count: entry.count,
        mask: entry.mask.as_ref().map(|mask| *mask.get_ref()),
        scale: entry.scale.as_ref().map(|scale| scale.get_ref().0.clone()),
        unit: entry.unit.as_ref().map(|unit| unit.get_ref().clone()),
        ..Field::default()
    };
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
        let what = "what takes all that is left is counted from the front; or give a count";
        return wrong(&entry.at, what);
    }
    Ok(field)
}
