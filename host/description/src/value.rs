//! The values of fields, and their text forms for people and programs.

use std::fmt;
use std::io::Write as _;

use serde::Deserialize;
use serde_json::Value as Json;

use crate::text;

/// A value of a field.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Value<'a> {
    /// An unsigned number.
    Unsigned(u64),
    /// A signed number.
    Signed(i64),
    /// A floating-point number of 32 bits.
    Float(f32),
    /// A floating-point number of 64 bits.
    Double(f64),
    /// A decimal number: its digits, and the number of digits after the decimal point.
    Decimal(i128, u32),
    /// Bytes, shown in hex.
    Bytes(&'a [u8]),
    /// Text.
    Text(&'a [u8]),
    /// No value: the field has the number that means "no value", or its bytes are not a number.
    Missing,
}

impl Value<'_> {
    /// Appends the value as text. Characters on which a terminal would act are escaped.
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
            // Writes the shortest digits of the 32-bit number, NaN, inf or -inf. After a conversion to 64 bits, 0.1 would
            // be written as 0.10000000149011612.
            Self::Float(number) => write!(row, "{number:?}").expect("a vector takes any text"),
            Self::Double(number) => write!(row, "{number:?}").expect("a vector takes any text"),
            Self::Decimal(number, decimals) => append_decimal(*number, *decimals, row),
            Self::Bytes(bytes) => {
                // The prefix is `x`. Without a prefix, some programs would read 0600 and 1E05 as numbers. With the
                // prefix `0x`, other programs would read 0x06 as a number.
                row.push(b'x');
                text::append_hex(bytes, row);
            }
            Self::Text(bytes) => text::escape(bytes, row),
            Self::Missing => {}
            Self::Signed(number) => {
                if *number < 0 {
                    row.push(b'-');
                }
                append_digits(number.unsigned_abs(), row);
            }
            Self::Unsigned(number) => append_digits(*number, row),
        }
    }

    /// Appends the value as JSON. JSON has neither NaN nor infinities. Writes `null` for NaN, and for infinity a number
    /// that exceeds the range: 1e39 for 32-bit numbers, 1e309 for 64-bit numbers.
    #[inline]
    pub fn append_json_to(&self, row: &mut Vec<u8>) {
        match self {
            Self::Bytes(_) | Self::Text(_) => {
                serde_json::to_writer(row, &self.to_string()).expect("a vector takes any text");
            }
            Self::Missing => row.extend(b"null"),
            Self::Double(number) if number.is_nan() => row.extend(b"null"),
            Self::Double(f64::INFINITY) => row.extend(b"1e309"),
            Self::Double(f64::NEG_INFINITY) => row.extend(b"-1e309"),
            Self::Float(number) if number.is_nan() => row.extend(b"null"),
            Self::Float(f32::INFINITY) => row.extend(b"1e39"),
            Self::Float(f32::NEG_INFINITY) => row.extend(b"-1e39"),
            _ => self.append_to(row),
        }
    }

    /// Returns the digits of a number as an integer, and the number of decimals.
    #[must_use]
    pub(crate) fn digits(self) -> Option<(i128, u32)> {
        match self {
            Self::Unsigned(number) => Some((number.into(), 0)),
            Self::Signed(number) => Some((number.into(), 0)),
            Self::Decimal(number, decimals) => Some((number, decimals)),
            _ => None,
        }
    }

    /// Returns whether two values are the same number. Two NaNs count as the same number.
    pub(crate) fn is_same(self, other: Value) -> bool {
        let float = |value: Value| match value {
            Value::Float(number) => Some(f64::from(number)),
            Value::Double(number) => Some(number),
            value => value.digits().and_then(|_| value.to_string().parse().ok()),
        };
        match (self.digits(), other.digits()) {
            (Some((one, 0)), Some((two, 0))) => one == two,
            _ => float(self)
                .zip(float(other))
                .is_some_and(|(one, two)| one - two == 0.0 || one.is_nan() && two.is_nan()),
        }
    }

    /// Returns true if the value is bytes or text.
    #[inline]
    #[must_use]
    pub fn is_text(&self) -> bool {
        matches!(self, Self::Bytes(_) | Self::Text(_))
    }
}

/// For each number below 1000: its digits, then zero bytes up to the third byte, and the number of digits. With this
/// table, most numbers of a frame are written without a division and without a call of `memcpy`.
static DIGITS: [[u8; 4]; 1000] = digits(false);

/// The same table, but each number has three digits, with leading zeros.
static PADDED: [[u8; 4]; 1000] = digits(true);

const fn digits(is_padded: bool) -> [[u8; 4]; 1000] {
    let mut table = [[0; 4]; 1000];
    let mut number: u16 = 0;
    while number < 1000 {
        let [hundreds, ..] = (number / 100).to_le_bytes();
        let [tens, ..] = (number / 10 % 10).to_le_bytes();
        let [ones, ..] = (number % 10).to_le_bytes();
        let [hundreds, tens, ones] = [b'0' + hundreds, b'0' + tens, b'0' + ones];
        table[number as usize] = match number {
            0..10 if !is_padded => [ones, 0, 0, 1],
            10..100 if !is_padded => [tens, ones, 0, 2],
            _ => [hundreds, tens, ones, 3],
        };
        number += 1;
    }
    table
}

/// The powers of ten with up to nine zeros.
const POWERS: [u64; 10] = {
    let mut powers = [1; 10];
    let mut zeros = 1;
    while zeros < 10 {
        powers[zeros] = 10 * powers[zeros - 1];
        zeros += 1;
    }
    powers
};

/// Appends the digits of a number.
#[inline]
fn append_digits(number: u64, row: &mut Vec<u8>) {
    let short = usize::try_from(number)
        .ok()
        .and_then(|number| DIGITS.get(number));
    let Some([digits @ .., count]) = short else {
        return append_more_digits(number, row);
    };
    // Always append three digits, then cut off the surplus ones.
    let from = row.len();
    row.extend_from_slice(digits);
    row.truncate(from + usize::from(*count));
}

#[inline(never)]
fn append_more_digits(number: u64, row: &mut Vec<u8>) {
    append_digits(number / 1000, row);
    append_three_digits(number, row);
}

/// Appends the last three digits of a number.
#[inline]
fn append_three_digits(number: u64, row: &mut Vec<u8>) {
    let [digits @ .., _] = &PADDED[(number % 1000) as usize];
    row.extend_from_slice(digits);
}

/// Appends a number with digits after the decimal point.
#[inline]
fn append_decimal(number: i128, decimals: u32, row: &mut Vec<u8>) {
    if number < 0 {
        row.push(b'-');
    }
    let digits = match u64::try_from(number.unsigned_abs()) {
        Ok(digits) if decimals <= 9 => digits,
        _ => return append_long_decimal(number.unsigned_abs(), decimals, row),
    };
    let unit = POWERS[decimals as usize];
    append_digits(digits / unit, row);
    if decimals == 0 {
        return;
    }
    row.push(b'.');
    // Append nine digits, or only the first three if these suffice, then cut off the surplus zeros.
    let fraction = digits % unit * POWERS[9 - decimals as usize];
    let end = row.len() + decimals as usize;
    append_three_digits(fraction / 1_000_000, row);
    if decimals > 3 {
        append_three_digits(fraction / 1000, row);
        append_three_digits(fraction, row);
    }
    row.truncate(end);
}

#[inline(never)]
fn append_long_decimal(digits: u128, decimals: u32, row: &mut Vec<u8>) {
    let unit = 10_u128.pow(decimals);
    let (whole, fraction, width) = (digits / unit, digits % unit, decimals as usize);
    let point = if decimals > 0 { "." } else { "" };
    let fraction = if decimals > 0 {
        format!("{fraction:0width$}")
    } else {
        String::new()
    };
    row.extend(format!("{whole}{point}{fraction}").bytes());
}

impl fmt::Display for Value<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = Vec::new();
        self.append_to(&mut text);
        f.pad(&String::from_utf8_lossy(&text))
    }
}

/// A decimal number of up to nine digits, which is shown exactly.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(try_from = "f64")]
pub struct Decimal {
    /// The number, multiplied by ten to the power of `decimals`.
    pub digits: i64,
    /// The number of digits after the decimal point.
    pub decimals: u32,
}

impl TryFrom<f64> for Decimal {
    type Error = &'static str;

    fn try_from(number: f64) -> Result<Self, Self::Error> {
        // The shortest digits that represent the number, without an exponent.
        let text = number.to_string();
        let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
        let digits = format!("{whole}{fraction}").parse::<i64>();
        let digits = digits.ok().filter(|digits| digits.abs() < 1_000_000_000);
        let decimals = u32::try_from(fraction.len())
            .ok()
            .filter(|decimals| *decimals <= 18);
        match (digits, decimals) {
            (Some(digits), Some(decimals)) => Ok(Self { digits, decimals }),
            _ => Err("a scale and an offset must be numbers of up to nine digits"),
        }
    }
}

/// A decimal factor and a decimal offset that convert a number into the exact number to show.
#[derive(Clone, Copy, Debug)]
pub struct Scale {
    /// The factor, multiplied by ten to the power of `decimals`.
    pub factor: i128,
    /// The offset, multiplied by ten to the power of `decimals`.
    pub offset: i128,
    /// The number of digits after the decimal point.
    pub decimals: u32,
    /// The factor and the offset as 64-bit numbers, if these suffice to scale any 32-bit number.
    small: Option<(i64, i64)>,
}

impl Scale {
    /// Returns the scale with this factor and this offset.
    pub(crate) fn new(factor: Decimal, offset: Decimal) -> Self {
        let decimals = factor.decimals.max(offset.decimals);
        let [factor, offset] =
            [factor, offset].map(|it| i128::from(it.digits) * 10_i128.pow(decimals - it.decimals));
        let small = |number: i128, bits: u32| {
            i64::try_from(number)
                .ok()
                .filter(|it| it.unsigned_abs() >> bits == 0)
        };
        Self {
            factor,
            offset,
            decimals,
            small: small(factor, 30).zip(small(offset, 61)),
        }
    }

    /// Converts a number into the number to show.
    #[inline]
    pub(crate) fn of(&self, number: &Value) -> Value<'static> {
        let small = match *number {
            Value::Unsigned(number) => u32::try_from(number).ok().map(i64::from),
            Value::Signed(number) => i32::try_from(number).ok().map(i64::from),
            _ => None,
        };
        if let (Some(number), Some((factor, offset))) = (small, self.small) {
            return Value::Decimal((number * factor + offset).into(), self.decimals);
        }
        let Some((digits, decimals)) = number.digits() else {
            return Value::Missing;
        };
        let scale = self.with_decimals(decimals);
        Value::Decimal(scale.shown(digits), scale.decimals)
    }

    /// Returns the scale for numbers that are multiplied by ten to the power of `decimals`.
    pub(crate) fn with_decimals(&self, decimals: u32) -> Self {
        Self {
            offset: self.offset.saturating_mul(10_i128.pow(decimals)),
            decimals: self.decimals + decimals,
            small: None,
            ..*self
        }
    }

    fn shown(&self, number: i128) -> i128 {
        number
            .saturating_mul(self.factor)
            .saturating_add(self.offset)
    }

    /// Returns the scaled number as text.
    #[must_use]
    pub fn text(&self, number: i128) -> String {
        Value::Decimal(self.shown(number), self.decimals).to_string()
    }

    /// Returns the unscaled number that is nearest to a shown number. If two numbers are equally near, returns the
    /// greater one.
    pub(crate) fn number(&self, shown: &Json) -> Option<i128> {
        let (sign, factor) = (self.factor.signum(), self.factor.checked_abs()?);
        // `twice` rounds down. This does not change the result, because all other numbers in the division are whole.
        let doubled = self.twice(&shown.as_number()?.to_string(), sign)?;
        let doubled = doubled.checked_sub(2 * sign * self.offset)?;
        doubled.checked_add(factor)?.checked_div_euclid(2 * factor)
    }

    /// Reads a JSON number. Returns twice this number, multiplied by `sign`, in units of the last decimal of this
    /// scale, rounded down.
    fn twice(&self, text: &str, sign: i128) -> Option<i128> {
        let (mantissa, exponent) = text.split_once(['e', 'E']).unwrap_or((text, "0"));
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let digits = format!("{whole}{fraction}").parse::<i128>().ok()?;
        let digits = digits.checked_mul(2 * sign)?;
        let more = i64::from(self.decimals) + exponent.parse::<i64>().ok()?
            - i64::try_from(fraction.len()).ok()?;
        let power = 10_i128.checked_pow(u32::try_from(more.unsigned_abs()).ok()?);
        match power {
            Some(power) if more >= 0 => digits.checked_mul(power),
            Some(power) => Some(digits.div_euclid(power)),
            // The power of ten is too great. A number that is divided by it is rounded down to 0 or -1. Only 0 can be
            // multiplied by it.
            None => (more < 0 || digits == 0).then_some(digits.signum().min(0)),
        }
    }
}

impl fmt::Display for Scale {
    /// Writes the factor, and the offset if there is one: `0.01`, or `0.01, plus -1000.00`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        Value::Decimal(self.factor, self.decimals).fmt(f)?;
        match self.offset {
            0 => Ok(()),
            offset => write!(f, ", plus {}", Value::Decimal(offset, self.decimals)),
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    fn decimal(number: i128, decimals: u32) -> String {
        let (sign, digits) = (if number < 0 { "-" } else { "" }, number.unsigned_abs());
        let unit = 10_u128.pow(decimals);
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

    /// Each shown number is converted to the nearest number, although it may have more decimals than the scale.
    #[test]
    fn shown_numbers_become_the_nearest_numbers() {
        let number = |digits, decimals, shown: &str| {
            let scale = Scale::new(Decimal { digits, decimals }, Decimal::default());
            scale.number(&serde_json::from_str(shown).expect("a number"))
        };
        assert_eq!(number(2, 0, "0.6"), Some(0));
        assert_eq!(number(2, 0, "1.4"), Some(1));
        assert_eq!(number(-2, 0, "0.6"), Some(0));
        assert_eq!(number(1, 1, "-1e-300"), Some(0));
        let mut random = ChaCha8Rng::seed_from_u64(1);
        for _ in 0..100_000 {
            // The shown number is in units of 10 to the power of -9.
            let [mut digits, shown] =
                [(); 2].map(|()| random.random_range(-1_000_000_i64..=1_000_000));
            digits += i64::from(digits == 0);
            let decimals = random.random_range(0..=6);
            let offset = random.random_range(-1_000..=1_000);
            let scale = Scale::new(
                Decimal { digits, decimals },
                Decimal {
                    digits: offset,
                    decimals,
                },
            );
            let text = decimal(shown.into(), 9);
            let shown_number = serde_json::from_str(&text).expect("a number");
            let found = scale.number(&shown_number).expect("a number in the range");
            let unit = 10_i128.pow(9 - decimals);
            let away = (scale.shown(found) * unit - i128::from(shown)).abs();
            let most = i128::from(digits.abs()) * unit;
            assert!(2 * away <= most, "{scale:?}: {text} became {found}");
        }
    }

    /// The fast functions for scaling and writing numbers agree with simple functions.
    #[test]
    fn scaled_numbers_have_exact_digits() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut count_small = 0;
        for _ in 0..100_000 {
            let decimals = random.random_range(0..=18);
            let digits = |random: &mut ChaCha8Rng| {
                let most = 10_i64.pow(random.random_range(0..=9));
                random.random_range(-most..=most)
            };
            let digits = [digits(&mut random), digits(&mut random)];
            let [factor, offset] = digits.map(|digits| Decimal { digits, decimals });
            let scale = Scale::new(factor, offset);
            let bits = random.random::<u64>() >> random.random_range(0..64);
            let (number, value) = if random.random() {
                (i128::from(bits), Value::Unsigned(bits))
            } else {
                (bits.cast_signed().into(), Value::Signed(bits.cast_signed()))
            };
            let scaled = scale.of(&value);
            assert_eq!(scaled, Value::Decimal(scale.shown(number), decimals));
            assert_eq!(scaled.to_string(), decimal(scale.shown(number), decimals));
            count_small += u32::from(scale.small.is_some() && bits < 1 << 31);
            let plain = bits.to_string();
            assert_eq!(Value::Unsigned(bits).to_string(), plain);
        }
        assert!((20_000..80_000).contains(&count_small), "{count_small}");
    }
}
