//! Reads values from comma-separated text, as in NMEA. Such values cannot be encoded, so rows for encoding contain the
//! whole text instead.

use serde::Deserialize;

use crate::value::Value;

/// One part of a comma-separated text: the part's index, counted from 0, and its form.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
pub struct Item(usize, Form);

/// The form of a part.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Form {
    Text,
    /// A decimal number.
    Number,
    /// Degrees and minutes such as 4717.11399. The next part is N, S, E or W.
    Degrees,
    /// A time such as 092725.00, in seconds of the day.
    Clock,
    /// A date such as 311224, as the number 20241231.
    Date,
}

impl Item {
    /// Returns true if the item's values are text.
    pub(crate) fn is_text(self) -> bool {
        self.1 == Form::Text
    }

    /// Returns the item's part of the text; `None` if the part is missing or has another form.
    pub(crate) fn part(self, text: &[u8]) -> Option<&[u8]> {
        let Self(number, form) = self;
        let mut commas = text.iter().enumerate().filter(|(_, byte)| **byte == b',');
        let mut comma = || commas.next().map(|(at, _)| at);
        let from = match number.checked_sub(1) {
            None => 0,
            Some(before) => {
                (0..before)
                    .try_fold((), |(), _| comma().map(drop))
                    .and(comma())?
                    + 1
            }
        };
        if form == Form::Degrees {
            comma();
        }
        let part = text.get(from..comma().unwrap_or(text.len()))?;
        (!part.is_empty())
            .then_some(part)
            .filter(|part| self.value(part).is_some())
    }

    /// Reads the value of the item's part.
    pub(crate) fn value(self, part: &[u8]) -> Option<Value<'_>> {
        let Self(_, form) = self;
        let (part, letter) = match (form, part) {
            (Form::Text, _) => return Some(Value::Text(part)),
            (Form::Degrees, [part @ .., b',', letter]) => (part, *letter),
            (Form::Degrees, _) => return None,
            _ => (part, 0),
        };
        let (number, decimals) = decimal(part)?;
        let unit = 10_i128.pow(decimals);
        let whole = number / unit;
        Some(match form {
            Form::Degrees => {
                let sign = match letter {
                    b'N' | b'E' => 1,
                    b'S' | b'W' => -1,
                    _ => return None,
                };
                let degrees = whole / 100;
                let minutes = number - 100 * degrees * unit;
                let nano = 1_000_000_000;
                let doubled = 2 * minutes * nano / (60 * unit) + 1;
                Value::Decimal(sign * (degrees * nano + doubled / 2), 9)
            }
            Form::Clock => {
                let (hours, minutes) = (whole / 10_000, whole / 100 % 100);
                let seconds = number - whole / 100 * 100 * unit;
                Value::Decimal((3600 * hours + 60 * minutes) * unit + seconds, decimals)
            }
            Form::Date => {
                let (day, month, year) = (whole / 10_000, whole / 100 % 100, whole % 100);
                let century = if year < 80 { 2000 } else { 1900 };
                Value::Decimal((century + year) * 10_000 + month * 100 + day, 0)
            }
            _ => Value::Decimal(number, decimals),
        })
    }
}

/// Reads a number of up to eighteen characters. Returns its digits as an integer, and the number of decimals.
fn decimal(text: &[u8]) -> Option<(i128, u32)> {
    let (sign, digits) = match text {
        [b'-', digits @ ..] => (-1, digits),
        [b'+', digits @ ..] | digits => (1, digits),
    };
    let (mut number, mut count, mut point) = (0_i64, 0, None);
    for byte in digits {
        match byte {
            b'0'..=b'9' => {
                number = 10 * number + i64::from(byte - b'0');
                count += 1;
            }
            b'.' if point.is_none() => point = Some(count),
            _ => return None,
        }
    }
    (count > 0 && text.len() <= 18)
        .then(|| (sign * i128::from(number), count - point.unwrap_or(count)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_as_numbers() {
        let text = b"GPGGA,092725.00,4717.11399,N,00833.91590,W,1,08,-1.01,,x,311299,0030.5,S";
        for (number, form, shown) in [
            (0, Form::Text, "GPGGA"),
            (1, Form::Clock, "34045.00"),
            (2, Form::Degrees, "47.285233167"),
            (4, Form::Degrees, "-8.565265000"),
            (6, Form::Number, "1"),
            (7, Form::Number, "8"),
            (8, Form::Number, "-1.01"),
            (9, Form::Number, ""),
            (10, Form::Number, ""),
            (10, Form::Degrees, ""),
            (11, Form::Date, "19991231"),
            (12, Form::Degrees, "-0.508333333"),
            (13, Form::Text, "S"),
            (14, Form::Text, ""),
        ] {
            let item = Item(number, form);
            let value = item.part(text).and_then(|part| item.value(part));
            let value = value.map(|value| value.to_string()).unwrap_or_default();
            assert_eq!(value, shown, "{number}");
        }
    }
}
