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
            Self::Bytes(table) => table,
            Self::Named(name) => {
                let mut all = NAMES.iter().copied();
                let named = all.find(|(known, _)| known == name);
                let known = NAMES.iter().map(|(known, _)| *known);
                let unknown = || UnknownName::new(name, known).into();
                return named.map(|(_, stuffing)| stuffing).ok_or_else(unknown);
            }
        };
        let (mut keys, mut bytes) = (Vec::new(), Vec::new());
        for (key, text) in table {
            keys.push(&**key);
            bytes.extend(hex::parse(&[text])?);
        }
        let escaped = |delimiter, escape, codes| Stuffing::Escape {
            delimiter,
            escape,
            codes,
        };
        // The keys are in alphabetical order.
        let stuffing = match (&*keys, &*bytes) {
            (["delimiter", "escape", "xor"], &[delimiter, escape, xor]) => {
                escaped(delimiter, escape, Codes::Xor(xor))
            }
            (
                ["delimiter", "delimiter_code", "escape", "escape_code"],
                &[delimiter, code, escape, other],
            ) => {
                let codes = Codes::Pair {
                    delimiter: code,
                    escape: other,
                };
                escaped(delimiter, escape, codes)
            }
            (["end", "escape"] | ["end", "escape", "start"], [end, escape, start @ ..])
                if start.len() + 2 == keys.len() =>
            {
                Stuffing::Doubled {
                    escape: *escape,
                    start: start.first().copied(),
                    end: *end,
                }
            }
            _ => return Err(FORMS.into()),
        };
        let differ = (1..bytes.len()).all(|at| !bytes[..at].contains(&bytes[at]));
        let is_doubled = matches!(stuffing, Stuffing::Doubled { .. });
        let encodes_all = || stuffing.stuff(&bytes, &mut [0; 10]).is_some();
        if differ && (is_doubled || encodes_all()) {
            Ok(stuffing)
        } else {
            Err(EQUAL.into())
        }
    }
}
