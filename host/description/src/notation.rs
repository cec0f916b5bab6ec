//! The notations of values: how the bytes of a field, or a part of a text, are read as a number.

use serde::Deserialize;

use crate::value::Value;

/// The notation of a value. The type of a field determines the default notation, except that a value in a text is
/// decimal by default.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Notation {
    /// A whole number without a sign.
    Unsigned,
    /// A whole number in two's complement.
    Signed,
    /// A whole number whose highest bit is the sign, and whose other bits are the magnitude.
    SignMagnitude,
    /// The magnitude of a whole number in two's complement.
    Magnitude,
    /// A whole number in binary-coded decimal: each four bits hold a decimal digit.
    Bcd,
    /// A floating-point number, as in IEEE 754.
    #[serde(skip)]
    Float,
    /// Hex digits in text: two for each byte of a number type, or 1 to 16 digits if the field is a text.
    Hex,
    /// A decimal number in text.
    Decimal,
    /// Degrees and minutes in text such as `4717.11399,N`, in degrees.
    Degrees,
    /// A time in text such as `092725.00`, in seconds of the day.
    Clock,
    /// A date in text such as `311224`, as the number 20241231.
    Date,
    /// Text, or bytes that tables show in hex.
    #[default]
    Text,
}

impl Notation {
    /// Reads a number from text; `None` if the text is not a number in this notation. Blanks around a number, and
    /// between its sign and its digits, are ignored.
    pub(crate) fn read(self, text: &[u8]) -> Option<Value<'static>> {
        match (self, text) {
            (Self::Hex, _) => {
                let digits = before_blanks(after_blanks(text));
                let is_number = (1..=16).contains(&digits.len());
                Some(Value::Unsigned(hex_digits(digits).filter(|_| is_number)?))
            }
            (Self::Degrees, [text @ .., b',', letter]) => {
                let sign = match letter {
                    b'N' | b'E' => 1,
                    b'S' | b'W' => -1,
                    _ => return None,
                };
                let (number, unit, _) = decimal(text)?;
                let degrees = number / unit / 100;
                let minutes = number - 100 * degrees * unit;
                let nano = 1_000_000_000;
                let doubled = 2 * minutes * nano / (60 * unit) + 1;
                Some(Value::Decimal(sign * (degrees * nano + doubled / 2), 9))
            }
            (Self::Degrees | Self::Text, _) => None,
            _ => {
                let (number, unit, decimals) = decimal(text)?;
                let whole = number / unit;
                let (high, middle, low) = (whole / 10_000, whole / 100 % 100, whole % 100);
                Some(match self {
                    Self::Clock => {
                        let seconds = number - whole / 100 * 100 * unit;
                        Value::Decimal((3600 * high + 60 * middle) * unit + seconds, decimals)
                    }
                    Self::Date => {
                        let century = if low < 80 { 2000 } else { 1900 };
                        Value::Decimal((century + low) * 10_000 + middle * 100 + high, 0)
                    }
                    _ => Value::Decimal(number, decimals),
                })
            }
        }
    }

    /// Returns the index from which to search for the literal after a value. The blanks and the sign of a number, and
    /// the comma of degrees, belong to the value.
    pub(crate) fn least(self, text: &[u8]) -> usize {
        match self {
            Self::Text => 0,
            Self::Degrees => text
                .iter()
                .position(|byte| *byte == b',')
                .map_or(0, |at| at + 1),
            _ => text.len() - after_sign(text).1.len(),
        }
    }
}

/// Returns the sign of a number, and the rest of the text. Skips blanks before and after the sign.
fn after_sign(text: &[u8]) -> (i128, &[u8]) {
    match after_blanks(text) {
        [b'-', rest @ ..] => (-1, after_blanks(rest)),
        [b'+', rest @ ..] => (1, after_blanks(rest)),
        rest => (1, rest),
    }
}

/// Returns the text after its leading blanks.
pub(crate) fn after_blanks(text: &[u8]) -> &[u8] {
    let blanks = text.iter().take_while(|byte| **byte == b' ').count();
    &text[blanks..]
}

fn before_blanks(mut text: &[u8]) -> &[u8] {
    while let [rest @ .., b' '] = text {
        text = rest;
    }
    text
}

/// Reads a decimal number of up to eighteen digits. Returns three numbers: its digits as a whole number with the sign,
/// ten to the power of its decimals, and the number of its decimals.
fn decimal(text: &[u8]) -> Option<(i128, i128, u32)> {
    let (sign, digits) = after_sign(text);
    let (mut number, mut count, mut point) = (0_i64, 0, None);
    for byte in before_blanks(digits) {
        match byte {
            b'0'..=b'9' if count < 18 => {
                number = 10 * number + i64::from(byte - b'0');
                count += 1;
            }
            b'.' if point.is_none() => point = Some(count),
            _ => return None,
        }
    }
    let decimals = count - point.unwrap_or(count);
    (count > 0).then(|| (sign * i128::from(number), 10_i128.pow(decimals), decimals))
}

/// Reads hex digits; `None` if a byte is not a hex digit.
pub(crate) fn hex_digits(digits: &[u8]) -> Option<u64> {
    let mut digits = digits.iter();
    digits.try_fold(0, |number, digit| {
        Some(number << 4 | u64::from(char::from(*digit).to_digit(16)?))
    })
}

/// Reads a decimal digit from each four bits; `None` if four bits are not a digit.
pub(crate) fn bcd(bits: u64) -> Option<u64> {
    let mut digits = (0..16).rev().map(|digit| bits >> (4 * digit) & 15);
    digits.try_fold(0, |number, digit| {
        (digit < 10).then_some(10 * number + digit)
    })
}

/// Returns the decimal digits of a number, in four bits each.
pub(crate) fn to_bcd(number: u64) -> u64 {
    (0..16).rev().fold(0, |bits, digit| {
        (bits << 4) | (number / 10_u64.pow(digit) % 10)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_of_a_text_are_read_as_numbers() {
        for (notation, text, shown) in [
            (Notation::Clock, "092725.00", "34045.00"),
            (Notation::Degrees, "4717.11399,N", "47.285233167"),
            (Notation::Degrees, "00833.91590 ,W", "-8.565265000"),
            (Notation::Degrees, "0030.5,S", "-0.508333333"),
            (Notation::Degrees, "0030.5,X", ""),
            (Notation::Degrees, "0030.5", ""),
            (Notation::Date, "311299", "19991231"),
            (Notation::Date, "311224", "20241231"),
            (Notation::Decimal, "08", "8"),
            (Notation::Decimal, "-1.01", "-1.01"),
            (Notation::Decimal, "  + 409.1 ", "409.1"),
            (Notation::Decimal, "- .5", "-0.5"),
            (Notation::Decimal, "5.", "5"),
            (
                Notation::Decimal,
                "123456789012345678",
                "123456789012345678",
            ),
            (Notation::Decimal, "1234567890123456789", ""),
            (Notation::Decimal, "", ""),
            (Notation::Decimal, "-", ""),
            (Notation::Decimal, "1.2.3", ""),
            (Notation::Decimal, "12g", ""),
            (Notation::Hex, "00ffFF ", "65535"),
            (Notation::Hex, "FFFFFFFFFFFFFFFF", "18446744073709551615"),
            (Notation::Hex, "10000000000000000", ""),
            (Notation::Hex, "0x1", ""),
            (Notation::Hex, "", ""),
        ] {
            let value = notation.read(text.as_bytes());
            let value = value.map(|value| value.to_string()).unwrap_or_default();
            assert_eq!(value, shown, "{notation:?} {text}");
        }
    }

    #[test]
    fn four_bits_are_a_digit() {
        assert_eq!(bcd(0x1234_5678_9012_3456), Some(1_234_567_890_123_456));
        assert_eq!(bcd(0x1A), None);
        for number in [0, 7, 10, 99, 1_234_567_890_123_456, 9_999_999_999_999_999] {
            assert_eq!(bcd(to_bcd(number)), Some(number));
        }
    }
}
