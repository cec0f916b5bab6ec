//! The entry `packets`: how bytes of a packet are replaced, so that the delimiter occurs only between packets.

use framelock::{Codes, Stuffing};
use serde::Deserialize;

use crate::hex;
use crate::problem::{Mistake, UnknownName};

/// A name, or the bytes of the stuffing.
#[derive(Clone, Deserialize)]
#[serde(
    untagged,
    deny_unknown_fields,
    expecting = "packets are \"slip\", \"hdlc\", \"cobs\", \"dle\" or \"break\", or bytes in hex: { delimiter, escape, xor }, \
                 { delimiter, escape, delimiter_code, escape_code }, or { escape, start, end }, where start may be missing"
)]
pub(crate) enum Packets {
    Named(String),
    Xor {
        delimiter: Byte,
        escape: Byte,
        xor: Byte,
    },
    Pair {
        delimiter: Byte,
        escape: Byte,
        delimiter_code: Byte,
        escape_code: Byte,
    },
    Doubled {
        escape: Byte,
        start: Option<Byte>,
        end: Byte,
    },
}

/// A byte in hex.
#[derive(Clone, Copy, Deserialize)]
#[serde(try_from = "String")]
pub(crate) struct Byte(u8);

impl TryFrom<String> for Byte {
    type Error = &'static str;

    fn try_from(text: String) -> Result<Self, Self::Error> {
        match hex::parse(&[text]).as_deref() {
            Ok(&[byte]) => Ok(Self(byte)),
            _ => Err("not a byte in hex"),
        }
    }
}

/// The names of stuffings.
const NAMES: &[(&str, Stuffing)] = &[
    ("slip", Stuffing::SLIP),
    ("hdlc", Stuffing::HDLC),
    ("cobs", Stuffing::Cobs),
    ("dle", Stuffing::DLE),
    ("break", Stuffing::Break),
];

impl Packets {
    /// Returns the stuffing. The bytes with a meaning of their own must differ.
    pub(crate) fn stuffing(&self) -> Result<Stuffing, Mistake> {
        let differ = |bytes: &[u8]| (1..bytes.len()).all(|at| !bytes[..at].contains(&bytes[at]));
        let (stuffing, is_right) = match *self {
            Self::Named(ref name) => {
                let named = NAMES.iter().find(|(known, _)| known == name);
                let known = NAMES.iter().map(|(known, _)| *known);
                return match named {
                    Some((_, stuffing)) => Ok(*stuffing),
                    None => Err(UnknownName::new(name, known).into()),
                };
            }
            Self::Xor {
                delimiter: Byte(delimiter),
                escape: Byte(escape),
                xor: Byte(xor),
            } => (
                Stuffing::Escape {
                    delimiter,
                    escape,
                    codes: Codes::Xor(xor),
                },
                differ(&[delimiter, escape]) && ![0, delimiter ^ escape].contains(&xor),
            ),
            Self::Pair {
                delimiter: Byte(delimiter),
                escape: Byte(escape),
                delimiter_code: Byte(code),
                escape_code: Byte(other),
            } => (
                Stuffing::Escape {
                    delimiter,
                    escape,
                    codes: Codes::Pair {
                        delimiter: code,
                        escape: other,
                    },
                },
                differ(&[delimiter, escape]) && differ(&[delimiter, code, other]),
            ),
            Self::Doubled {
                escape: Byte(escape),
                start,
                end: Byte(end),
            } => {
                let start = start.map(|Byte(start)| start);
                let bytes = [&[escape, end][..], start.as_slice()].concat();
                (Stuffing::Doubled { escape, start, end }, differ(&bytes))
            }
        };
        let rule = "packets: the delimiter, the escape byte and the codes must differ, or no receiver could tell them apart";
        if is_right {
            Ok(stuffing)
        } else {
            Err(rule.into())
        }
    }
}
