//! The entry `packets`: the bytes between packets, and the replacements of these bytes inside packets.

use std::collections::BTreeMap;

use framelock::{Codes, Stuffing};
use serde::Deserialize;

use crate::hex;
use crate::problem::{Mistake, UnknownName};

/// A name, or the bytes of the stuffing in hex.
#[derive(Clone, Deserialize)]
#[serde(untagged, expecting = "packets are a name or a table of bytes in hex")]
pub(crate) enum Packets {
    Named(String),
    Bytes(BTreeMap<String, String>),
}

/// The names of stuffings.
const NAMES: &[(&str, Stuffing)] = &[
    ("slip", Stuffing::SLIP),
    ("hdlc", Stuffing::HDLC),
    ("cobs", Stuffing::Cobs),
    ("dle", Stuffing::DLE),
    ("break", Stuffing::Break),
];

const FORMS: &str = "packets have a name, or these bytes in hex: delimiter, escape and xor; delimiter, escape, delimiter_code and \
                     escape_code; or escape, end and perhaps start";

const EQUAL: &str = "packets: the delimiter, the escape byte and the codes must differ, or no receiver could tell them apart";

impl Packets {
    /// Returns the stuffing.
    pub(crate) fn stuffing(&self) -> Result<Stuffing, Mistake> {
        let table = match self {
            Self::Named(name) => {
                let named = NAMES.iter().find(|(known, _)| known == name);
                let known = NAMES.iter().map(|(known, _)| *known);
                return named.map_or_else(
                    || Err(UnknownName::new(name, known).into()),
                    |(_, stuffing)| Ok(*stuffing),
                );
            }
            Self::Bytes(table) => table,
        };
        let (mut keys, mut bytes) = (Vec::new(), Vec::new());
        for (key, text) in table {
            keys.push(&**key);
            bytes.extend(hex::parse(&[text])?);
        }
        // The keys are in alphabetical order.
        let (stuffing, is_right) = match (&*keys, &*bytes) {
            (["delimiter", "escape", "xor"], &[delimiter, escape, xor]) => {
                let codes = Codes::Xor(xor);
                let is_right = delimiter != escape && ![0, delimiter ^ escape].contains(&xor);
                (
                    Stuffing::Escape {
                        delimiter,
                        escape,
                        codes,
                    },
                    is_right,
                )
            }
            (
                ["delimiter", "delimiter_code", "escape", "escape_code"],
                &[delimiter, code, escape, other],
            ) => {
                let codes = Codes::Pair {
                    delimiter: code,
                    escape: other,
                };
                let is_right = ![code, escape, other].contains(&delimiter) && code != other;
                (
                    Stuffing::Escape {
                        delimiter,
                        escape,
                        codes,
                    },
                    is_right,
                )
            }
            (["end", "escape", "start"], &[end, escape, start]) => {
                let is_right = end != escape && ![end, escape].contains(&start);
                (
                    Stuffing::Doubled {
                        escape,
                        start: Some(start),
                        end,
                    },
                    is_right,
                )
            }
            (["end", "escape"], &[end, escape]) => (
                Stuffing::Doubled {
                    escape,
                    start: None,
                    end,
                },
                end != escape,
            ),
            _ => return Err(FORMS.into()),
        };
        is_right.then_some(stuffing).ok_or(EQUAL.into())
    }
}
