//! Converts the values of rows to the bits, the digits or the bytes of a field.

use serde_json::{Number, Value as Json};

use crate::field::{Field, Type, width};
use crate::notation::{Notation, to_bcd};
use crate::number::{Class, ones};
use crate::problem::{Misfit, UnknownName};
use crate::value::{Decimal, Scale, Value};
use crate::{hex, text};

/// The greatest number of digits of a decimal number in text.
const MOST_DIGITS: u32 = 18;

impl Field {
    /// Returns the bits of a value, at the positions of the mask. The error says why the value does not fit the field.
    pub(crate) fn to_bits(&self, value: &Json) -> Result<u64, Misfit> {
        if self.class() == Class::Float {
            return self.float_bits(value);
        }
        let mask = self.mask.unwrap_or(ones(self.width()));
        let all = ones(width(mask));
        let (half, most) = (i128::from(all >> 1), i128::from(all));
        let (least, most) = match (self.notation, self.class()) {
            (Notation::Bcd, _) => (0, largest_bcd(all).into()),
            (Notation::SignMagnitude, _) => (-half, half),
            (Notation::Magnitude, _) => (0, half),
            (_, Class::Signed) => (!half, half),
            _ => (0, most),
        };
        let number = self.whole(value, least, most)?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "the lowest bits are the value"
        )]
        let bits = match self.notation {
            Notation::Bcd => to_bcd(number as u64),
            Notation::SignMagnitude if number < 0 => (half + 1 - number) as u64,
            _ => number as u64 & all,
        };
        let bits = bits << mask.trailing_zeros();
        if bits & !mask != 0 {
            return Err(Misfit::OutsideMask(mask));
        }
        Ok(bits)
    }

    #[expect(clippy::cast_possible_truncation, reason = "the nearest number")]
    fn float_bits(&self, value: &Json) -> Result<u64, Misfit> {
        let number = match (value, self.missing) {
            (_, Some(missing)) if is_nothing(value) => missing.to_string().parse().ok(),
            (Json::Null, None) => Some(f64::NAN),
            (Json::Number(number), _) => number.to_string().parse().ok(),
            // Infinity, or NaN.
            (Json::String(text), _) => text.trim().parse().ok(),
            _ => None,
        };
        let number: f64 = number.ok_or(Misfit::Not("a number"))?;
        Ok(match self.value_width() {
            64 => number.to_bits(),
            _ => (number as f32).to_bits().into(),
        })
    }

    /// Returns the number that a value means before scaling, if the value is a name or means that there is no value.
    fn named(&self, value: &Json) -> Result<Option<Value<'static>>, Misfit> {
        if is_nothing(value) && self.missing.is_some() {
            return Ok(self.missing);
        }
        let Some(name) = value.as_str().filter(|_| !self.names.is_empty()) else {
            return Ok(None);
        };
        let found = self.names.iter().find(|(_, known)| known == name);
        let known = self.names.iter().map(|(_, known)| known);
        let unknown = || Misfit::Name(UnknownName::new(name, known));
        let (number, _) = found.ok_or_else(unknown)?;
        Ok(Some(Value::Signed(*number)))
    }

    /// Returns the whole number before scaling that is nearest to a value. Returns an error if this number is not from
    /// `least` to `most`.
    fn whole(&self, value: &Json, least: i128, most: i128) -> Result<i128, Misfit> {
        let number = match (self.named(value)?, &self.scale) {
            (Some(number), _) => number.digits().map(|(digits, _)| digits),
            (None, Some(scale)) => scale.number(value),
            (None, None) => value.as_number().and_then(Number::as_i128),
        };
        let shown = |number: i128| match &self.scale {
            Some(scale) => scale.text(number),
            None => number.to_string(),
        };
        number
            .filter(|number| (least..=most).contains(number))
            .ok_or_else(|| Misfit::NotBetween {
                is_whole: self.scale.is_none(),
                least: shown(least),
                most: shown(most),
            })
    }

    /// Returns the bytes of a text, of bytes in hex, or of a number in text. The error says why the value does not fit
    /// the field.
    pub(crate) fn to_bytes(&self, value: &Json) -> Result<Vec<u8>, Misfit> {
        let mut bytes = match (self.kind, self.notation) {
            (Type::Bytes, _) => {
                let text = value.as_str();
                let text = text.ok_or(Misfit::Not("bytes in hex, as text"))?;
                hex::parse(&[text.strip_prefix('x').unwrap_or(text)]).map_err(Misfit::Hex)?
            }
            (_, Notation::Text) => text::unescaped(value.as_str().ok_or(Misfit::Not("text"))?),
            _ => self.digits_of(value)?,
        };
        let Some(wanted) = self.count else {
            return Ok(bytes);
        };
        if let (Some(padding), true) = (self.padding, bytes.len() < wanted) {
            bytes.resize(wanted, padding);
        } else if self.kind == Type::Text && self.is_decimal() {
            // Fill a number with zeros after its sign.
            let sign = usize::from(bytes.first() == Some(&b'-'));
            let zeros = wanted.saturating_sub(bytes.len());
            bytes.splice(sign..sign, std::iter::repeat_n(b'0', zeros));
        }
        if bytes.len() != wanted {
            let given = bytes.len();
            return Err(Misfit::Length { given, wanted });
        }
        Ok(bytes)
    }

    /// Returns the digits of a number in text.
    fn digits_of(&self, value: &Json) -> Result<Vec<u8>, Misfit> {
        let digits = match self.notation {
            Notation::Hex => format!("{:X}", self.whole(value, 0, u64::MAX.into())?),
            Notation::Decimal => {
                let (digits, decimals) = match self.named(value)?.and_then(Value::digits) {
                    Some(named) => named,
                    None => self.decimal(value)?,
                };
                Value::Decimal(digits, decimals).to_string()
            }
            _ => return Err(Misfit::NoInverse),
        };
        Ok(digits.into_bytes())
    }

    /// Returns the digits of the decimal number before scaling that is nearest to a value, and the number of decimals.
    /// If the description does not give a number of decimals, uses the number that the value needs, at most 9.
    fn decimal(&self, value: &Json) -> Result<(i128, u32), Misfit> {
        let one = Decimal {
            digits: 1,
            decimals: 0,
        };
        let scale = self.scale.unwrap_or(Scale::new(one, Decimal::default()));
        let number = value.as_number().ok_or(Misfit::Not("a number"))?;
        let decimals = self.decimals.unwrap_or_else(|| {
            let given = decimals(&number.to_string()) - i64::from(scale.decimals);
            u32::try_from(given.clamp(0, 9)).expect("a small number")
        });
        let most = 10_i128.pow(MOST_DIGITS) - 1;
        let digits = scale.with_decimals(decimals).number(value);
        let digits = digits.filter(|digits| (-most..=most).contains(digits));
        let digits = digits.ok_or(Misfit::Not("a number of up to 18 digits"))?;
        Ok((digits, decimals))
    }

    /// Returns the hex digits of a number, in the order of its bytes in the frame.
    pub(crate) fn hex_digits(&self, bits: u64) -> Vec<u8> {
        let Type::Number(number) = self.kind else {
            return Vec::new();
        };
        let mut bytes = vec![0; number.bytes];
        for (at, byte) in bits.to_le_bytes()[..number.bytes].iter().enumerate() {
            bytes[number.place(at)] = *byte;
        }
        let mut digits = Vec::new();
        text::append_hex(&bytes, &mut digits);
        digits
    }
}

/// Returns the number of decimals of a JSON number, which may have an exponent.
fn decimals(number: &str) -> i64 {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    let fraction = mantissa
        .split_once('.')
        .map_or(0, |(_, digits)| digits.len());
    i64::try_from(fraction).unwrap_or(0) - exponent.parse::<i64>().unwrap_or(0)
}

/// Returns the number if the value is a text with a number, and otherwise the value.
pub(crate) fn number_or_text(value: &Json) -> Json {
    let Some(text) = value.as_str().map(str::trim) else {
        return value.clone();
    };
    let whole = text.parse::<u64>().map(Json::from);
    let exact = || serde_json::from_str::<Number>(text).map(Json::from);
    let float = || {
        text.parse::<f64>()
            .ok()
            .and_then(Number::from_f64)
            .map(Json::from)
    };
    let number = whole.ok().or_else(|| exact().ok()).or_else(float);
    number.unwrap_or_else(|| value.clone())
}

/// Returns whether a value means that there is no value.
pub(crate) fn is_nothing(value: &Json) -> bool {
    value.is_null() || *value == ""
}

/// Returns the largest number in binary-coded decimal that has no bits outside `all`.
fn largest_bcd(all: u64) -> u64 {
    (0..16).rev().fold(0, |number, digit| {
        10 * number + (all >> (4 * digit) & 15).min(9)
    })
}
