//! Makes fields from the entries of a description.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use serde::Deserialize;
use toml::Spanned;

use crate::entries::{FieldEntry, parsed, parsed_if_any, span};
use crate::field::{Field, Type};
use crate::hex;
use crate::kind::LONGEST;
use crate::notation::Notation;
use crate::number::{Class, NumberType};
use crate::pattern::TextPlace;
use crate::problem::{Located, Mistake, reject_if};
use crate::value::{Decimal, Scale, Value};

/// The rule for a list of values.
pub(crate) const ONE_LIST: &str = "only one field can have a list of values, and only without messages: an unsigned \
    number without mask and count, counted from the front";

/// The constant value of a field, or the list of its possible values.
#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "a value is a whole number, or a list of them")]
pub(crate) enum Values {
    One(i64),
    OneOf(Vec<u32>),
}

impl Values {
    pub(crate) fn is_list(&self) -> bool {
        matches!(self, Self::OneOf(_))
    }
}

/// The number that means that there is no value.
#[derive(Clone, Copy, Deserialize)]
#[serde(untagged, expecting = "a missing value is a number")]
pub(crate) enum Missing {
    Unsigned(u64),
    Signed(i64),
    Float(f64),
}

impl Type {
    /// Returns whether the values of this type may have this notation.
    fn may_have(self, notation: Notation) -> bool {
        use Notation::{
            Bcd, Clock, Date, Decimal, Degrees, Float, Hex, Magnitude, SignMagnitude, Signed, Text,
            Unsigned,
        };
        match notation {
            Unsigned | Signed | SignMagnitude | Magnitude | Bcd => match self {
                Self::Number(number) => number.class != Class::Float,
                kind => matches!(kind, Self::Bits { .. }),
            },
            Hex => match self {
                Self::Number(number) => number.class != Class::Float,
                kind => kind == Self::Text,
            },
            Decimal | Degrees | Clock | Date | Text => self == Self::Text,
            Float => false,
        }
    }

    fn parse(name: &str) -> Result<Self, Mistake> {
        Ok(match name {
            "bytes" => Self::Bytes,
            "text" => Self::Text,
            _ => Self::Number(NumberType::parse(name, &["bytes", "text"])?),
        })
    }
}

impl Field {
    /// Returns the field of a decimal number in a text. The text begins at index `at` of the frame.
    pub(crate) fn in_text(name: String, at: i16, place: TextPlace) -> Self {
        Self {
            name,
            at,
            kind: Type::Text,
            notation: Notation::Decimal,
            text: Some(place),
            ..Self::default()
        }
    }

    /// Returns the field with these entries. `in_text` is the beginning of the frame's text and the place of the field
    /// in the text, if a pattern of the text has the field's name.
    pub(crate) fn read(
        entry: &Spanned<FieldEntry>,
        in_text: Option<(i16, TextPlace)>,
    ) -> Result<Self, Located> {
        let (span, entry) = (entry.span(), entry.get_ref());
        let name = parsed(&entry.name, column_name)?;
        let has_place = entry.at.is_some() || entry.r#type.is_some() || entry.bits.is_some();
        let found = match (in_text, &entry.at) {
            (Some((at, place)), None) if !has_place => Self::in_text(name, at, place),
            (Some(_), _) => {
                let rule = "the text has a place for this field: leave at, type and bits out";
                return Err(Located::new(span, rule));
            }
            (None, Some(at)) => Self {
                name,
                at: *at.get_ref(),
                kind: read_type(entry, span)?,
                ..Self::default()
            },
            (None, None) => {
                let rule = "a field must have a place: give at, or write the field's name into a text, as in text = \"A{x}\"";
                return Err(Located::new(span, rule));
            }
        };
        let default = match found.text {
            Some(_) => Notation::Decimal,
            None => found.kind.usual_notation(),
        };
        let given = entry.notation.as_ref().map(|notation| *notation.get_ref());
        let notation = given.unwrap_or(default);
        reject_if(
            given.is_some() && !found.kind.may_have(notation),
            crate::entries::span(entry.notation.as_ref()),
            "whole numbers may have the notations unsigned, signed, sign-magnitude, magnitude, bcd and hex, bits the same except hex, \
             and text decimal, hex, degrees, clock, date and text",
        )?;
        let [factor, offset] = [&entry.scale, &entry.offset].map(Option::as_ref);
        let scale = factor.or(offset).map(|_| {
            let [factor, offset] = [factor, offset].map(|it| it.map(|it| *it.get_ref()));
            let one = Decimal {
                digits: 1,
                decimals: 0,
            };
            Scale::new(factor.unwrap_or(one), offset.unwrap_or_default())
        });
        let field = Self {
            notation,
            decimals: entry.decimals.as_ref().map(|decimals| *decimals.get_ref()),
            names: entry
                .names
                .as_ref()
                .map(names)
                .transpose()?
                .unwrap_or_default(),
            missing: entry
                .missing
                .as_ref()
                .map(|missing| missing_value(missing, notation))
                .transpose()?,
            padding: parsed_if_any(entry.padding.as_ref(), padding)?,
            count: entry.count.as_ref().map(|count| *count.get_ref()),
            mask: entry.mask.as_ref().map(|mask| *mask.get_ref()),
            scale,
            unit: parsed_if_any(entry.unit.as_ref(), unit)?,
            ..found
        };
        field.check(entry)?;
        match &entry.value {
            Some(value) => {
                let valued = field.with(value.get_ref());
                valued.map_err(|mistake| Located::new(value.span(), mistake))
            }
            None => Ok(field),
        }
    }

    /// Returns the number's type if the values are whole numbers of a type such as `u16le`.
    fn whole_number(&self) -> Option<NumberType> {
        match self.kind {
            Type::Number(number) if number.class != Class::Float => Some(number),
            _ => None,
        }
    }

    /// Checks that each entry suits the field's type.
    fn check(&self, entry: &FieldEntry) -> Result<(), Located> {
        let whole = self.whole_number();
        let is_out = |number: usize| !(1..=LONGEST).contains(&number);
        let what = "a count";
        let most = LONGEST;
        let count = span(entry.count.as_ref());
        reject_if(
            self.count.is_some_and(is_out),
            count,
            Mistake::OutOfRange { what, most },
        )?;
        let bits = 1..=whole.map_or(0, NumberType::all_bits);
        reject_if(
            self.mask.is_some_and(|mask| !bits.contains(&mask)),
            span(entry.mask.as_ref()),
            "only a whole number can have a mask, and the mask must have some of its bits",
        )?;
        reject_if(
            self.scale.is_some() && !self.is_decimal(),
            span(entry.scale.as_ref().or(entry.offset.as_ref())),
            "only a whole number and a number in text can have a scale and an offset",
        )?;
        reject_if(
            !self.names.is_empty() && !self.is_decimal(),
            span(entry.names.as_ref()),
            "only a whole number and a number in text can have names",
        )?;
        reject_if(
            self.missing.is_some() && self.is_text(),
            span(entry.missing.as_ref()),
            "only a number can be missing",
        )?;
        reject_if(
            self.missing.is_some()
                && !self.is_bytes()
                && self.to_bits(&serde_json::Value::Null).is_err(),
            span(entry.missing.as_ref()),
            "this value does not fit the field",
        )?;
        reject_if(
            self.mask.is_some() && self.notation == Notation::Hex,
            span(entry.mask.as_ref()),
            "hex digits cannot have a mask",
        )?;
        reject_if(
            self.padding.is_some() && (self.kind != Type::Text || self.text.is_some()),
            span(entry.padding.as_ref()),
            "only text with a type can have padding",
        )?;
        let most = 9;
        let what = "the number of decimals";
        reject_if(
            self.decimals.is_some_and(|decimals| decimals > most),
            span(entry.decimals.as_ref()),
            Mistake::OutOfRange {
                what,
                most: most as usize,
            },
        )?;
        reject_if(
            self.decimals.is_some() && self.notation != Notation::Decimal,
            span(entry.decimals.as_ref()),
            "only a decimal number in text can have decimals",
        )?;
        reject_if(
            self.scale.as_ref().is_some_and(|scale| scale.factor == 0),
            span(entry.scale.as_ref()),
            "a scale must not be 0",
        )?;
        reject_if(
            entry.item.is_some(),
            span(entry.item.as_ref()),
            "item is now a pattern: give the view text = \"{},{x}\", where each comma ends a value and {x} is the field x, and \
             give the field its notation, instead of at, type and item",
        )?;
        reject_if(
            self.at < 0 && self.length().is_none(),
            span(entry.at.as_ref()),
            "a field that takes the rest of the frame must be counted from the front: change at, or give a count",
        )
    }

    /// Returns the field with this constant value, or with these possible values.
    fn with(self, value: &Values) -> Result<Self, Mistake> {
        match value {
            Values::One(number) => match self.to_bits(&(*number).into()) {
                Ok(bits) if !self.is_array() && !self.is_bytes() => Ok(Self {
                    constant: Some(bits),
                    ..self
                }),
                _ => Err("this value does not fit the field, or the field is an array".into()),
            },
            Values::OneOf(numbers) => {
                let number = self.whole_number().filter(|number| number.is_unsigned());
                let is_alone = self.mask.is_none() && self.count.is_none() && self.at >= 0;
                let number = number.filter(|_| is_alone).ok_or(ONE_LIST)?;
                let fits = |value: &u32| u64::from(*value) <= number.all_bits();
                if numbers.is_empty() || !numbers.iter().all(fits) {
                    return Err("these values do not fit the field".into());
                }
                let allowed = numbers.clone();
                Ok(Self { allowed, ..self })
            }
        }
    }
}

/// Reads the type, or the bits, of a field that is not a value in a text.
fn read_type(entry: &FieldEntry, span: Range<usize>) -> Result<Type, Located> {
    let kind = parsed_if_any(entry.r#type.as_ref(), Type::parse)?;
    match (kind, entry.bits) {
        (Some(kind), None) => Ok(kind),
        (None, Some(width @ 1..=64)) => Ok(Type::Bits {
            first: entry.bit.unwrap_or(0).into(),
            width,
        }),
        _ => {
            let rule = "a field must have either a type, or bits from 1 to 64";
            Err(Located::new(span, rule))
        }
    }
}

/// Reads the names of numbers. Names must differ from each other and from numbers, so that a cell of a table means one
/// number.
fn names(entry: &Spanned<BTreeMap<String, String>>) -> Result<Vec<(i64, String)>, Located> {
    let mut used = HashSet::new();
    let mut names = Vec::new();
    for (number, name) in entry.get_ref() {
        let is_name = !name.is_empty() && name.parse::<f64>().is_err() && used.insert(name);
        let number = number.parse().ok().filter(|_| is_name);
        let rule = "names are like { 0 = \"off\", 1 = \"on\" }: whole numbers, each with another name that is no number";
        let number = number.ok_or_else(|| Located::new(entry.span(), rule))?;
        names.push((number, name.clone()));
    }
    names.sort();
    Ok(names)
}

fn missing_value(entry: &Spanned<Missing>, notation: Notation) -> Result<Value<'static>, Located> {
    Ok(match *entry.get_ref() {
        Missing::Unsigned(number) => Value::Unsigned(number),
        Missing::Signed(number) => Value::Signed(number),
        Missing::Float(number) if notation == Notation::Float => Value::Double(number),
        Missing::Float(number) => {
            let number = Decimal::try_from(number);
            let number = number.map_err(|rule| Located::new(entry.span(), rule))?;
            Value::Decimal(number.digits.into(), number.decimals)
        }
    })
}

fn padding(text: &str) -> Result<u8, Mistake> {
    match &*hex::parse(&[text])? {
        &[byte] => Ok(byte),
        _ => Err("padding is one byte in hex: \"00\" or \"20\" for example".into()),
    }
}

/// Checks that a name is valid for a column, and returns it.
pub(crate) fn column_name(name: &str) -> Result<String, Mistake> {
    let plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
    let small = name.to_ascii_lowercase();
    if !name.starts_with(|c: char| c.is_ascii_alphabetic()) || !name.chars().all(plain) {
        Err("a name must have only letters, digits and _, and begin with a letter".into())
    } else if ["offset", "length", "time"].contains(&&*small) {
        Err("offset, length, time are the names of other columns: choose another name".into())
    } else {
        Ok(name.to_owned())
    }
}

fn unit(unit: &str) -> Result<String, Mistake> {
    if unit.contains(|c: char| c.is_control() || c.is_whitespace()) {
        return Err("a unit must be a word, such as deg or m/s".into());
    }
    Ok(unit.to_owned())
}
