//! Values as people and programs read them.

use std::fmt;

use serde::Deserialize;
use serde_json::Value as Json;

use crate::text;

/// A value of a field.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Value<'a> {
    /// A number without sign.
    Unsigned(u64),
    /// A number with a sign.
    Signed(i64),
    /// A number with a point.
    Float(f32),
    /// A number and how many of its digits are behind the point.
    Decimal(i64, u32),
    /// Bytes, shown in hex.
    Bytes(&'a [u8]),
    /// Text.
    Text(&'a [u8]),
}

impl Value<'_> {
    /// Appends it as text: what a terminal would act on is escaped.
    #[inline]
    pub fn append_to(&self, row: &mut Vec<u8>) {
        match self {
            Self::Unsigned(number) => append_digits(*number, row),
            other => other.append_rarer(row),
        }
    }

    #[inline(never)]
    fn append_rarer(&self, row: &mut Vec<u8>) {
        match self {
            // As short as it can be: as 64 bits 0.1 has seventeen digits. JSON has no other numbers.
            Self::Float(number) if number.is_finite() => {
                row.extend(format!("{number:?}").as_bytes());
            }
            Self::Float(_) => row.extend(b"null"),
            Self::Decimal(number, decimals) => row.extend(decimal(*number, *decimals).as_bytes()),
            Self::Bytes(bytes) => text::append_hex(bytes, row),
            Self::Text(bytes) => text::escape(bytes, row),
            Self::Signed(number) => {
                if *number < 0 {
                    row.push(b'-');
                }
                append_digits(number.unsigned_abs(), row);
            }
            Self::Unsigned(_) => {}
        }
    }

    /// Appends it as JSON.
    #[inline]
    pub fn append_json_to(&self, row: &mut Vec<u8>) {
        if self.is_text() {
            self.append_json_text(row);
        } else {
            self.append_to(row);
        }
    }

    #[inline(never)]
    fn append_json_text(&self, row: &mut Vec<u8>) {
        row.push(b'"');
        let from = row.len();
        self.append_to(row);
        // What is escaped already has no control characters left.
        let is_special = |byte: &u8| matches!(byte, b'"' | b'\\');
        if row
            .get(from..)
            .is_some_and(|text| text.iter().any(is_special))
        {
            for byte in row.split_off(from) {
                if is_special(&byte) {
                    row.push(b'\\');
                }
                row.push(byte);
            }
        }
        row.push(b'"');
    }

    /// Whether it is bytes or text.
    #[inline]
    #[must_use]
    pub fn is_text(&self) -> bool {
        matches!(self, Self::Bytes(_) | Self::Text(_))
    }
}

/// The digits of each number below 1000 without zeros in front, what is behind them, and how many they are.
static DIGITS: [[u8; 4]; 1000] = {
    let mut table = [[0; 4]; 1000];
    let (mut rest, mut number): (&mut [_], u16) = (&mut table, 0);
    while let Some((entry, behind)) = rest.split_first_mut() {
        let [hundreds, tens, ones] = three_digits(number);
        *entry = match number {
            0..10 => [ones, 0, 0, 1],
            10..100 => [tens, ones, 0, 2],
            _ => [hundreds, tens, ones, 3],
        };
        number += 1;
        rest = behind;
    }
    table
};

#[expect(clippy::cast_possible_truncation, reason = "a digit is below 10")]
const fn three_digits(number: u16) -> [u8; 3] {
    let [hundreds, tens, ones] = [number / 100 % 10, number / 10 % 10, number % 10];
    [b'0' + hundreds as u8, b'0' + tens as u8, b'0' + ones as u8]
}

/// Appends the digits of a number: most of a frame's have three at most.
#[inline]
fn append_digits(number: u64, row: &mut Vec<u8>) {
    let short = usize::try_from(number)
        .ok()
        .and_then(|number| DIGITS.get(number));
    let Some([digits @ .., count]) = short else {
        return append_more_digits(number, row);
    };
    // Always three, and what is too many is cut off.
    let from = row.len();
    row.extend_from_slice(digits);
    row.truncate(from + usize::from(*count));
}

#[inline(never)]
fn append_more_digits(number: u64, row: &mut Vec<u8>) {
    append_digits(number / 1000, row);
    let [low, high, ..] = (number % 1000).to_le_bytes();
    row.extend_from_slice(&three_digits(u16::from_le_bytes([low, high])));
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = Vec::new();
        self.append_to(&mut text);
        f.pad(&String::from_utf8_lossy(&text))
    }
}

/// A decimal fraction that numbers are multiplied by, to be shown exactly.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "f64")]
pub struct Scale {
    /// What it is, times as many powers of ten as there are decimals.
    pub factor: i64,
    /// Digits behind the point.
    pub decimals: u32,
}

impl TryFrom<f64> for Scale {
    type Error = &'static str;

    fn try_from(scale: f64) -> Result<Self, Self::Error> {
        // The shortest that means it, without an exponent.
        let text = scale.to_string();
        let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
        let factor = format!("{whole}{fraction}").parse::<i64>();
        let factor = factor
            .ok()
            .filter(|factor| (1..=1_000_000_000).contains(&factor.abs()));
        let decimals = u32::try_from(fraction.len())
            .ok()
            .filter(|decimals| *decimals <= 18);
        match (factor, decimals) {
            (Some(factor), Some(decimals)) => Ok(Self { factor, decimals }),
            _ => Err("a scale is a number other than 0, of up to nine digits"),
        }
    }
}

impl Scale {
    /// A number that is shown; those that are scaled have 32 bits at most.
    pub(crate) fn of(&self, number: &Value) -> Value<'static> {
        let number = match *number {
            Value::Unsigned(number) => number.cast_signed(),
            Value::Signed(number) => number,
            _ => 0,
        };
        Value::Decimal(number.saturating_mul(self.factor), self.decimals)
    }

    /// The same as text.
    #[must_use]
    pub fn text(&self, number: i128) -> String {
        let number = i64::try_from(number).unwrap_or(i64::MAX);
        decimal(number.saturating_mul(self.factor), self.decimals)
    }

    /// The number nearest to what is shown as this.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_precision_loss,
        reason = "the cast saturates"
    )]
    pub(crate) fn number(&self, shown: &Json) -> Option<i128> {
        let scale = self.factor as f64 / 10_f64.powi(self.decimals.cast_signed());
        Some((shown.as_f64()? / scale).round() as i128)
    }
}

fn decimal(number: i64, decimals: u32) -> String {
    let (sign, digits) = (if number < 0 { "-" } else { "" }, number.unsigned_abs());
    let unit = 10_u64.pow(decimals);
    match decimals {
        0 => format!("{sign}{digits}"),
        _ => format!(
            "{sign}{}.{:0width$}",
            digits / unit,
            digits % unit,
            width = decimals as usize
        ),
    }
}
