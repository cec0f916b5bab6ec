//! Makes fields from the entries of a description.

use serde::Deserialize;
use toml::Spanned;

use crate::entries::{FieldEntry, parsed, parsed_if_any, span};
use crate::field::{Field, Type};
use crate::kind::LONGEST;
use crate::number::{Class, NumberType};
use crate::problem::{Located, Mistake, reject_if};
use crate::value::{Decimal, Scale};

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

impl Type {
    fn parse(name: &str) -> Result<Self, Mistake> {
        Ok(match name {
            "bytes" => Self::Bytes,
            "text" => Self::Text,
            _ => Self::Number(NumberType::parse(name, &["bytes", "text"])?),
        })
    }
}

impl Field {
    /// Returns the field with these entries.
    pub(crate) fn read(entry: &Spanned<FieldEntry>) -> Result<Self, Located> {
        let (span, entry) = (entry.span(), entry.get_ref());
        let kind = match (
            parsed_if_any(entry.r#type.as_ref(), Type::parse)?,
            entry.bits,
        ) {
            (Some(kind), None) => kind,
            (None, Some(width @ 1..=64)) => Type::Bits {
                first: entry.bit.into(),
                width,
            },
            _ => {
                let rule = "a field must have either a type, or bits from 1 to 64";
                return Err(Located::new(span, rule));
            }
        };
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
            name: parsed(&entry.name, column_name)?,
            at: *entry.at.get_ref(),
            kind,
            count: entry.count.as_ref().map(|count| *count.get_ref()),
            mask: entry.mask.as_ref().map(|mask| *mask.get_ref()),
            scale,
            unit: parsed_if_any(entry.unit.as_ref(), unit)?,
            item: entry.item.as_ref().map(|item| *item.get_ref()),
            ..Self::default()
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

    /// Returns the number's type if the field has whole numbers of whole bytes.
    fn whole_number(&self) -> Option<NumberType> {
        match self.kind {
            Type::Number(number) if number.class != Class::Float => Some(number),
            _ => None,
        }
    }

    /// Checks that each entry suits the field's type.
    fn check(&self, entry: &FieldEntry) -> Result<(), Located> {
        let (whole, is_bits) = (self.whole_number(), matches!(self.kind, Type::Bits { .. }));
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
            self.scale.is_some() && whole.is_none() && !is_bits,
            span(entry.scale.as_ref().or(entry.offset.as_ref())),
            "only a whole number can have a scale and an offset",
        )?;
        reject_if(
            self.scale.as_ref().is_some_and(|scale| scale.factor == 0),
            span(entry.scale.as_ref()),
            "a scale must not be 0",
        )?;
        reject_if(
            self.item.is_some() && self.kind != Type::Text,
            span(entry.item.as_ref()),
            "only text can have an item",
        )?;
        reject_if(
            self.at < 0 && self.length().is_none(),
            entry.at.span(),
            "a field that takes the rest of the frame must be counted from the front: change at, or give a count",
        )
    }

    /// Returns the field with this constant value, or with these possible values.
    fn with(self, value: &Values) -> Result<Self, Mistake> {
        match value {
            Values::One(number) => match self.to_bits(&(*number).into()) {
                Ok(bits) if !self.is_array() && !self.is_text() => Ok(Self {
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
