//! A frame format that a description has: what a receiver asks about it, and its values.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

use framelock::{DiscardReason, Format as _, Verdict};
use framelock_formats::Headed;
use serde::Deserialize;
use serde_json::Value as Json;

use super::checksum::Checksum;
use super::field::{Field, Front, Number, Place, put};

/// Bytes in the longest frame that may be described.
pub(crate) const LONGEST: usize = 2048;

/// A format.
pub(super) struct Format {
    /// What a frame may begin with, all of the same length; none if it may begin with anything.
    pub(super) syncs: Vec<Vec<u8>>,
    pub(super) length: Length,
    /// Bytes that must be there before the length is known.
    pub(super) header: usize,
    pub(super) shortest: usize,
    pub(super) longest: usize,
    /// Bytes at the end that are counted from the end.
    pub(super) trailer: usize,
    pub(super) terminator: Vec<u8>,
    pub(super) check: Option<Check>,
    pub(super) fields: Vec<Field>,
}

/// What says how long a frame is.
pub(super) enum Length {
    Fixed(usize),
    Field(LengthField),
    /// It ends with the first terminator.
    Terminator,
}

/// A number in the header, and what is to be added to it for the length of the whole frame.
#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LengthField {
    pub(super) at: Front,
    #[serde(rename = "type")]
    pub(super) number: Number,
    pub(super) plus: i32,
}

/// A checksum in a frame.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Check {
    #[serde(rename = "name")]
    pub(super) checksum: Checksum,
    #[serde(rename = "type")]
    pub(super) number: Number,
    pub(super) at: Place,
    /// The first byte that it covers.
    #[serde(default)]
    from: Place,
    /// The last; else the one in front of it.
    to: Option<Place>,
    pub(super) extra: Option<Extra>,
}

/// A byte that is appended to those that a checksum covers: which one, a number in the header says.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Extra {
    pub(super) at: Front,
    #[serde(rename = "type")]
    pub(super) number: Number,
    of: BTreeMap<Id, u8>,
}

/// What an extra byte depends on.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
struct Id(u64);

impl TryFrom<String> for Id {
    type Error = String;

    fn try_from(text: String) -> Result<Self, String> {
        text.parse()
            .map(Self)
            .map_err(|_| format!("{text} is not a number: number = byte is wanted"))
    }
}

/// A format, shared by the receiver and all that reads its frames.
#[derive(Clone)]
pub(crate) struct Described(pub(super) Arc<Format>);

impl framelock::Format for Described {
    const LONGEST: usize = LONGEST;
    type Message<'a> = &'a [u8];

    fn judge(&self, bytes: &[u8]) -> Verdict {
        self.judge_on(bytes, 0)
    }

    fn judge_on(&self, bytes: &[u8], seen: usize) -> Verdict {
        let format = &*self.0;
        let mut headed = Headed {
            sync: format.sync(bytes),
            header: format.header,
            longest: format.longest,
        };
        if let Length::Terminator = format.length {
            headed.longest = format.header;
            return match headed.judge(bytes, |sync| Some(sync.len()), |_| true) {
                Verdict::Frame(_) => format.search(bytes, seen),
                verdict => verdict,
            };
        }
        headed.judge_and_say_why(
            bytes,
            |header| format.length_of(header),
            |frame| format.mismatch(frame),
        )
    }

    fn starts(&self, byte: u8) -> bool {
        let syncs = &self.0.syncs;
        syncs.is_empty() || syncs.iter().any(|sync| sync.first() == Some(&byte))
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

impl Format {
    /// Of all that a frame may begin with, what fits these bytes best.
    fn sync(&self, bytes: &[u8]) -> &[u8] {
        let fits = |sync: &&Vec<u8>| sync.iter().zip(bytes).take_while(|(a, b)| a == b).count();
        // Of equal ones the last is taken: it makes no difference.
        self.syncs
            .iter()
            .max_by_key(fits)
            .map_or(&[], Vec::as_slice)
    }

    /// The length of a frame with this header, if there is such a frame.
    fn length_of(&self, header: &[u8]) -> Option<usize> {
        let extra = self.check.as_ref().and_then(|check| check.extra.as_ref());
        if extra.is_some_and(|extra| extra.byte(header).is_none()) {
            return None;
        }
        let mut in_header = self.fields.iter().filter(|field| self.is_in_header(field));
        if !in_header.all(|field| field.is_right(header)) {
            return None;
        }
        let length = match &self.length {
            Length::Fixed(length) => *length,
            Length::Field(field) => {
                let counted = field.number.at(field.at, header)?;
                usize::try_from(counted.checked_add_signed(field.plus.into())?).ok()?
            }
            Length::Terminator => return None,
        };
        (length >= self.shortest).then_some(length)
    }

    fn is_in_header(&self, field: &Field) -> bool {
        let end = field.length().map(|length| field.at.distance() + length);
        !field.at.is_from_end() && end.is_some_and(|end| end <= self.header)
    }

    /// Looks for the terminator; `seen` bytes were without a whole one.
    fn search(&self, bytes: &[u8], seen: usize) -> Verdict {
        let length = self.terminator.len();
        let from = self.header.max(seen.saturating_sub(length - 1));
        let bytes = bytes.get(..self.longest).unwrap_or(bytes);
        let mut places = bytes.get(from..).unwrap_or_default().windows(length);
        match places.position(|place| place == self.terminator) {
            Some(place) => {
                let end = from + place + length;
                let frame = bytes.get(..end).unwrap_or_default();
                if end < self.shortest {
                    return Verdict::Reject(DiscardReason::Header);
                }
                self.mismatch(frame)
                    .map_or(Verdict::Frame(end), Verdict::Reject)
            }
            None if bytes.len() == self.longest => Verdict::Reject(DiscardReason::Terminator),
            None => Verdict::Incomplete {
                at_least: bytes.len() + 1,
            },
        }
    }

    /// What is wrong with a frame whose header is right.
    fn mismatch(&self, frame: &[u8]) -> Option<DiscardReason> {
        if !frame.ends_with(&self.terminator) || !self.fields.iter().all(|it| it.is_right(frame)) {
            return Some(DiscardReason::Terminator);
        }
        let check = self.check.as_ref()?;
        let at = check.at.index(frame.len())?;
        let stored = frame.get(at..at + check.number.length)?;
        (check.bytes(frame)? != stored).then_some(DiscardReason::Check)
    }
}

impl Check {
    /// The first and the last place in a frame of that length that it covers.
    pub(super) fn covers(&self, length: usize) -> Option<[usize; 2]> {
        let last = match self.to {
            Some(to) => to.index(length),
            None => self.at.index(length)?.checked_sub(1),
        };
        Some([self.from.index(length)?, last?])
    }

    /// The bytes of the checksum that a frame is to have.
    fn bytes(&self, frame: &[u8]) -> Option<Vec<u8>> {
        let [from, to] = self.covers(frame.len())?;
        let extra = self.extra.as_ref().and_then(|extra| extra.byte(frame));
        let checksum = self.checksum.of(frame.get(from..=to)?, extra);
        Some(self.number.bytes(checksum))
    }
}

impl Extra {
    fn byte(&self, frame: &[u8]) -> Option<u8> {
        let id = self.number.at(self.at, frame)?;
        self.of.get(&Id(id)).copied()
    }
}

impl Described {
    /// Bytes in the longest frame.
    pub(crate) fn longest(&self) -> usize {
        self.0.longest
    }

    /// The fields that frames differ in.
    fn fields(&self) -> impl Iterator<Item = &Field> {
        self.0
            .fields
            .iter()
            .filter(|field| field.constant.is_none())
    }

    /// The names of a frame's values, in their order: an array has a number behind its name.
    pub(crate) fn columns(&self) -> Vec<Column> {
        let columns = self.fields().flat_map(|field| {
            let array = field.is_array().then(|| field.name.clone());
            (0..field.values()).map(move |number| Column {
                name: field.column(number),
                array: array.clone(),
                is_text: field.is_text(),
            })
        });
        columns.collect()
    }

    /// What the fields of a frame are.
    pub(crate) fn values(&self, frame: &[u8]) -> impl Iterator<Item = Named<'_>> {
        self.fields().map(|field| Named {
            name: &field.name,
            count: field.values(),
            value: field.read(frame),
        })
    }

    /// The frame with these values, in the order of the columns.
    pub(crate) fn encode(&self, values: &[Option<Json>]) -> Result<Vec<u8>, String> {
        let format = &*self.0;
        let (mut values, mut written, mut front) = (values.iter(), Vec::new(), format.header);
        for field in &format.fields {
            let row: Vec<&Json> = match &field.constant {
                Some(constant) => vec![constant],
                None => values.by_ref().take(field.values()).flatten().collect(),
            };
            let is_nothing = |value: &&Json| value.is_null() || *value == "";
            if format.is_optional(field) && row.iter().all(is_nothing) {
                continue;
            }
            if row.len() < field.values() {
                return Err(format!("missing field `{}`", field.name));
            }
            let parse = |(number, value): (usize, &&Json)| {
                field
                    .parse(value)
                    .map_err(|why| format!("{} {} {why}", field.column(number), quote(value)))
            };
            let row = row.iter().enumerate().map(parse);
            let row = row.collect::<Result<Vec<_>, _>>()?;
            if !field.at.is_from_end() {
                let length = field.length().or(row.first().map(Vec::len));
                front = front.max(field.at.distance() + length.unwrap_or_default());
            }
            written.push((field, row));
        }
        let length = match format.length {
            Length::Fixed(length) => length,
            _ => front + format.trailer,
        };
        let mut frame = format.syncs.first().cloned().unwrap_or_default();
        frame.resize(length, 0);
        if let Length::Field(field) = &format.length {
            let counted = (length as u64).wrapping_sub(i64::from(field.plus).cast_unsigned());
            put(&mut frame, field.at.0, &field.number.bytes(counted));
        }
        for (field, row) in written {
            for (number, bytes) in row.iter().enumerate() {
                field.write(number, bytes, &mut frame);
            }
        }
        let end = length.saturating_sub(format.terminator.len());
        put(&mut frame, end, &format.terminator);
        if let Some(check) = &format.check
            && let (Some(at), Some(bytes)) = (check.at.index(length), check.bytes(&frame))
        {
            put(&mut frame, at, &bytes);
        }
        // Too long, of a kind that there is not, with a terminator in a text.
        if length <= format.longest && self.judge(&frame) == Verdict::Frame(length) {
            return Ok(frame);
        }
        Err(format!(
            "there is no frame of {length} bytes with these values: the description has frames of {} \
             to {} bytes, and says what they begin with, of which kind they are, and how they end",
            format.shortest, format.longest
        ))
    }
}

/// A value in a message: what was not meant to be a number may be long.
pub(crate) fn quote(value: &Json) -> String {
    value.to_string().chars().take(40).collect()
}

impl Format {
    /// Whether a frame may be too short for it.
    pub(super) fn is_optional(&self, field: &Field) -> bool {
        let end = field.at.distance() + field.length().unwrap_or(0);
        !field.at.is_from_end() && end + field.margin > self.shortest
    }
}

/// A value's name in a table.
#[derive(Clone)]
pub(crate) struct Column {
    pub(crate) name: String,
    /// The name of the array that it is of.
    pub(crate) array: Option<String>,
    /// Bytes in hex, or text: what looks like a number is none.
    pub(crate) is_text: bool,
}

/// A field of one frame.
pub(crate) struct Named<'a> {
    pub(crate) name: &'a str,
    /// How many values it has.
    pub(crate) count: usize,
    /// The value, or all of an array; none if the frame is too short to have it.
    pub(crate) value: Option<Json>,
}

impl Named<'_> {
    /// Each value as text.
    pub(crate) fn texts(&self) -> impl Iterator<Item = Cow<'_, str>> {
        let values = match &self.value {
            Some(Json::Array(values)) => values.as_slice(),
            value => value.as_slice(),
        };
        values.iter().map(|value| match value {
            Json::String(text) => text.into(),
            number => number.to_string().into(),
        })
    }
}

/// The name and the values; numbers as wide as those of one byte, so that they stand in columns.
impl fmt::Display for Named<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)?;
        self.texts().try_for_each(|text| write!(f, " {text:>3}"))
    }
}
