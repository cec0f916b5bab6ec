//! The notation of a value: how the bytes of a field are read.

use serde::Deserialize;

/// The notation of a value. The type of a field determines its default.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Notation {
    /// A whole number without a sign.
    #[default]
    Unsigned,
    /// A whole number in two's complement.
    Signed,
    /// A whole number whose highest bit is the sign, and whose other bits are the magnitude.
    SignMagnitude,
    /// A whole number with a decimal digit in each four bits.
    Bcd,
    /// A floating-point number, as in IEEE 754.
    #[serde(skip)]
    Float,
    /// Hex digits in text: two for each byte of a number type, or any number of digits if the field is a text.
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
    Text,
}
