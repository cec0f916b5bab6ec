//! Serial frames described in TOML. This crate parses a description into a format for [`framelock`]'s receivers,
//! decodes frames to values, and encodes values to frames. `docs/own-frame.md` documents all entries of a description.
//!
//! # Examples
//! ```
//! use framelock::{BufferedReceiver, Format};
//! use framelock_description::Description;
//!
//! let description = Description::parse(
//!     "motor.toml",
//!     r#"
//!         sync = "AA 55"
//!         length = 6
//!         checksum = { width = 8, polynomial = 0x4D, type = "u8", at = -1 }
//!         fields = [
//!             { name = "angle", at = 2, type = "i16le", scale = 0.1, unit = "deg" },
//!             { name = "state", at = 4, type = "u8", value = [1, 2] },
//!         ]
//!     "#,
//! )?;
//! let frame = description.encode(&[Some((-12.5).into()), Some(2.into())])?;
//! let format = description.format();
//! let buffer = vec![0; 2 * format.longest()];
//! let mut receiver = BufferedReceiver::with_buffer(format.clone(), buffer).expect("it holds a frame");
//! let mut shown = Vec::new();
//! receiver.feed(&frame, |found| {
//!     let Some((kind, frame)) = found.decoded() else {
//!         return;
//!     };
//!     for (field, content) in description.kinds[kind].values(frame) {
//!         shown.push(format!("{} {}", field.name, content.value()));
//!     }
//! });
//! assert_eq!(shown, ["angle -12.5", "state 2"]);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![allow(
    clippy::indexing_slicing,
    clippy::missing_panics_doc,
    reason = "an index out of range is a bug, which must not become an empty field"
)]
#![allow(clippy::doc_markdown, reason = "MAVLink is a name")]

mod checksum;
mod contents;
mod encode;
mod entries;
mod example;
mod field;
pub mod hex;
mod kind;
mod layouts;
mod mavlink_xml;
mod messages;
mod notation;
mod number;
mod packets;
mod pattern;
mod problem;
mod raw;
mod read;
mod read_field;
pub mod text;
mod value;

use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use framelock::{Classification, Format as _, LineEvent, Stuffing};
use framelock_formats::layout::Length;
use toml::Spanned;

pub use contents::{Content, Contents};
pub use field::{Field, Type};
pub use kind::{Kind, LONGEST, Part};
pub use layouts::Layouts;
pub use notation::Notation;
pub use number::{Class, NumberType};
pub use pattern::{Pattern, PatternValue, TextPlace};
pub use problem::{
    EncodeError, HexError, HexReason, Misfit, Mistake, Problem, ReadError, UnknownName,
};
pub use value::{Decimal, Scale, Value};

use entries::Entries;
use problem::{Located, reject_if};

/// The limit on the number of bytes in the text of a description.
const LONGEST_TEXT: usize = 1 << 20;

/// The limits on the number of entries in `any_of` and `kinds` together, and on the number of values that all kinds and
/// views of a description have together.
const MOST_KINDS: usize = 100;
const MOST_COLUMNS: usize = 40_000;

/// A file may name a file in `any_of`, and that file another file. At most this many files may follow the first file in
/// such a chain.
const MOST_FILES: usize = 3;

/// A parsed description.
#[derive(Clone, Debug)]
pub struct Description {
    /// The kinds of frames, at least one, in the order in which they are tried.
    pub kinds: Vec<Kind>,
    /// The columns for the values of all kinds and views. If [`has_kinds`](Self::has_kinds) is true, the first column
    /// contains the name of the frame's kind, view or message.
    pub columns: Vec<Column>,
    layouts: Layouts,
}

/// A column of a table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Column {
    /// The column's name. In an array, it is the array's name and the number of the value.
    pub name: String,
    /// The name of the array that contains the value, if there is one.
    pub array: Option<String>,
    /// Whether the value is text or bytes in hex in some kind. Such a value may look like a number.
    pub is_text: bool,
}

/// The name of the column that contains the kind of a frame.
pub const KIND: &str = "kind";

impl Description {
    /// Parses the text of a description. Error messages use `name` for the text.
    ///
    /// # Errors
    /// Returns the first mistake, with its line and column.
    pub fn parse(name: &str, text: &str) -> Result<Self, Problem> {
        Self::parse_within(name, text, 0)
    }

    /// Parses the text of a description. `depth` counts the files that contain this description, one inside another.
    fn parse_within(name: &str, text: &str, depth: usize) -> Result<Self, Problem> {
        let entries = toml::from_str(text).map_err(Located::from);
        entries
            .and_then(|entries| Self::read(name, &entries, depth))
            .map_err(|located| Problem::within(name, text, located))
    }

    fn read(name: &str, entries: &Entries, depth: usize) -> Result<Self, Located> {
        let (shipped_names, own) = (&entries.any_of, &entries.kinds);
        let count = shipped_names.len() + own.len();
        let (what, most) = ("the number of kinds", MOST_KINDS);
        reject_if(count > most, 0..0, Mistake::OutOfRange { what, most })?;
        let mut kinds = Vec::new();
        for one in shipped_names {
            let found = named(one.get_ref(), name, depth);
            kinds.extend(
                found
                    .map_err(|mistake| Located::new(one.span(), mistake))?
                    .kinds,
            );
        }
        for kind in own {
            let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
            let (span, kind) = (kind.span(), kind.get_ref());
            let name = kind.name.as_ref().map_or("", |name| name.get_ref());
            let is_wrong = name.is_empty() || !name.chars().all(plain);
            let rule = "a kind must have a name of letters, digits, - and _";
            reject_if(is_wrong, span.clone(), rule)?;
            let has_kinds = !kind.kinds.is_empty() || !kind.any_of.is_empty();
            reject_if(has_kinds, span, "a kind cannot contain kinds or any_of")?;
            let kind = kind.clone().within(entries.clone());
            kinds.push(Kind::read(name, &kind, true)?);
        }
        if let Some(name) = &entries.name {
            let rule = "only a kind in [[kinds]] has a name: leave the name out";
            return Err(Located::new(name.span(), rule));
        }
        if let (Some(first), []) = (shipped_names.first(), &**own) {
            let rule = "any_of names complete descriptions: move the other keys into [[kinds]]";
            reject_if(entries.has_parts(), first.span(), rule)?;
        }
        if kinds.is_empty() {
            let stem = Path::new(name).file_stem().and_then(OsStr::to_str);
            kinds.push(Kind::read(stem.unwrap_or(name), entries, false)?);
        }
        let first = entries.fields.first().map(Spanned::span);
        let first = first.or(own.first().map(Spanned::span));
        let columns = columns(&kinds);
        let columns = columns.map_err(|mistake| Located::new(first.unwrap_or(0..0), mistake))?;
        let layouts = Layouts::concat(kinds.iter().map(|kind| &kind.layouts));
        let all = layouts.all();
        for (number, layout) in all.iter().enumerate() {
            let entry = number.checked_sub(kinds.len() - own.len());
            let span = entry.map_or(0..0, |entry| own[entry].span());
            let rule = "all kinds must have the same packets, because a line has only one kind of delimiter";
            reject_if(
                kinds[number].layouts.packets() != layouts.packets(),
                span.clone(),
                rule,
            )?;
            if let Some(earlier) = all[..number].iter().position(|other| other == layout) {
                let [kind, earlier] = [number, earlier].map(|number| kinds[number].name.clone());
                return Err(Located::new(span, Mistake::NeverOccurs { kind, earlier }));
            }
        }
        Ok(Self {
            kinds,
            columns,
            layouts,
        })
    }

    /// Returns the format for a receiver.
    #[must_use]
    pub fn format(&self) -> &Layouts {
        &self.layouts
    }

    /// Returns whether a receiver delivers these bytes as one frame, at the latest when a pause follows them.
    #[must_use]
    pub fn is_frame(&self, bytes: &[u8]) -> bool {
        let format = &self.layouts;
        let classification = match format.classify(bytes) {
            Classification::Incomplete { .. } => format.classify_before(bytes, LineEvent::Idle),
            classification => classification,
        };
        classification == Classification::Frame(bytes.len())
    }

    /// Returns the bytes that a sender sends for a frame: the frame itself, or the packet with its delimiters, but
    /// without breaks. If the frame's own bytes determine its end, no delimiter follows the packet, except in DLE
    /// framing. Returns `None` if no packet has these bytes.
    #[must_use]
    pub fn sent(&self, frame: &[u8]) -> Option<Vec<u8>> {
        let Some(stuffing) = self.layouts.packets() else {
            return Some(frame.to_vec());
        };
        // An escaped byte takes two bytes, and so does a delimiter of DLE framing.
        let mut bytes = vec![0; 2 * frame.len() + 4];
        let (last, before) = stuffing.stuff(frame, &mut bytes)?.split_last()?;
        let ends_by_itself = self.layouts.all()[self.number(frame)].length != Length::Silence
            && matches!(stuffing, Stuffing::Escape { .. } | Stuffing::Cobs);
        let last = (!ends_by_itself).then_some(*last);
        Some(before.iter().copied().chain(last).collect())
    }

    /// Returns the line event that ends frames if their own bytes do not end them; `None` if no frame needs such an
    /// event.
    #[must_use]
    pub fn ending_event(&self) -> Option<LineEvent> {
        let mut all = self.layouts.all().iter();
        match self.layouts.packets() {
            Some(Stuffing::Break) => Some(LineEvent::Break),
            Some(_) => None,
            None => all
                .any(|layout| layout.length == Length::Silence)
                .then_some(LineEvent::Idle),
        }
    }

    /// Returns the index of a frame's kind.
    #[must_use]
    #[inline]
    pub fn number(&self, frame: &[u8]) -> usize {
        self.layouts.decode(frame).0
    }

    /// Returns the view that shows a frame, or the frame's kind if no view fits.
    #[must_use]
    pub fn kind(&self, frame: &[u8]) -> Option<&Kind> {
        self.kinds_and_views().nth(self.view_number(frame))
    }

    /// Returns the name of a frame's kind, view or message, which is the value of the column [`KIND`].
    #[must_use]
    pub fn name(&self, frame: &[u8]) -> Option<&str> {
        self.kind(frame).map(|kind| kind.name_of(frame))
    }

    /// Returns the index of the kind or view that shows a frame, in the order of
    /// [`kinds_and_views`](Self::kinds_and_views).
    #[must_use]
    #[inline]
    pub fn view_number(&self, frame: &[u8]) -> usize {
        let number = if self.kinds.len() == 1 {
            0
        } else {
            self.number(frame)
        };
        let mut before = 0;
        for (other, kind) in self.kinds.iter().enumerate() {
            if other == number {
                return kind.view_of(frame).map_or(before, |view| before + 1 + view);
            }
            before += 1 + kind.views.len();
        }
        before
    }

    /// Returns an iterator over the kinds. The views of each kind follow the kind.
    pub fn kinds_and_views(&self) -> impl Iterator<Item = &Kind> {
        self.kinds.iter().flat_map(Kind::with_views)
    }

    /// Returns the names of all kinds, views and messages.
    #[must_use]
    pub fn kind_names(&self) -> Vec<&str> {
        let messages = self.kinds_and_views().flat_map(|kind| &kind.message_names);
        let kinds = self.kinds_and_views().map(|kind| &*kind.name);
        let mut names = Vec::new();
        for name in kinds.chain(messages.map(|(_, name)| *name)) {
            if !names.contains(&name) {
                names.push(name);
            }
        }
        names
    }

    /// Returns the columns of a table without a header. If there is only one kind, these are its columns, without the
    /// columns of its views. Otherwise these are all columns.
    #[must_use]
    pub fn plain_columns(&self) -> Vec<&Column> {
        let kind = (self.kinds.len() == 1).then(|| &self.kinds[0]);
        let is_of_kind = |column: &&Column| {
            let is_name = |field: &Field| {
                (0..field.values()).any(|number| field.column(number) == column.name)
            };
            kind.is_none_or(|kind| kind.varying_fields().any(is_name))
        };
        self.columns.iter().filter(is_of_kind).collect()
    }

    /// Returns true if there are several kinds, or a kind has views or named messages. The output must then name the
    /// kind of each frame.
    #[must_use]
    pub fn has_kinds(&self) -> bool {
        has_kinds(&self.kinds)
    }
}

/// Reads the text of a description from a file. A definition of MAVLink's messages, in XML, becomes a description.
///
/// # Errors
/// Returns an error if the file cannot be read, is not text, or is too long, or if a definition has a mistake. Does not
/// read a file beyond the limit of 1 MiB.
pub fn read(path: &Path) -> Result<String, ReadError> {
    let text = read_text(path)?;
    let beginning = text.trim_start_matches('\u{FEFF}').trim_start();
    if beginning.starts_with('<') {
        return mavlink_xml::description(path, &text);
    }
    Ok(text)
}

/// Reads a text from a file.
pub(crate) fn read_text(path: &Path) -> Result<String, ReadError> {
    let name = path.display().to_string();
    let mut bytes = Vec::new();
    let read = File::open(path)
        .and_then(|file| file.take(LONGEST_TEXT as u64 + 1).read_to_end(&mut bytes));
    match read {
        Err(error) => Err(ReadError::Io { name, error }),
        Ok(length) if length > LONGEST_TEXT => Err(ReadError::TooLong(name)),
        Ok(_) => String::from_utf8(bytes).map_err(|_| ReadError::NotText(name)),
    }
}

/// Returns the shipped description with this name. If there is none, `name` is the path of a file, relative to the
/// folder of the file `parent`.
fn named(name: &str, parent: &str, depth: usize) -> Result<Description, Mistake> {
    let path = Path::new(parent).with_file_name(name);
    let (name, text) = match shipped(name) {
        Ok(text) => (name.to_owned(), text.to_owned()),
        Err(unknown) if !path.exists() => return Err(unknown.into()),
        Err(_) if depth >= MOST_FILES => {
            return Err("any_of: these files contain each other".into());
        }
        Err(_) => {
            let text = read(&path).map_err(|error| Mistake::File(error.to_string()))?;
            (path.display().to_string(), text)
        }
    };
    let found = Description::parse_within(&name, &text, depth + 1);
    found.map_err(|problem| Mistake::Within(Box::new(problem)))
}

fn has_kinds(kinds: &[Kind]) -> bool {
    kinds.len() > 1
        || kinds
            .iter()
            .any(|kind| !kind.views.is_empty() || !kind.message_names.is_empty())
}

fn same_name(things: &'static str, name: &str) -> Mistake {
    let name = name.to_owned();
    Mistake::SameName { things, name }
}

/// Returns the columns of all kinds and their views. The columns of an array have the array's name and a number. Kinds
/// and views may share a column.
fn columns(kinds: &[Kind]) -> Result<Vec<Column>, Mistake> {
    let mut columns: Vec<Column> = Vec::new();
    let has_kinds = has_kinds(kinds);
    if has_kinds {
        columns.push(Column {
            name: KIND.to_owned(),
            array: None,
            is_text: true,
        });
    }
    let mut names = HashSet::new();
    if let Some(kind) = kinds.iter().find(|kind| !names.insert(&*kind.name)) {
        return Err(same_name("kinds are", &kind.name));
    }
    let all = || kinds.iter().flat_map(Kind::with_views);
    let fields = all().flat_map(Kind::varying_fields);
    if fields.map(Field::values).sum::<usize>() > MOST_COLUMNS {
        let (what, most) = ("the number of values in a row", MOST_COLUMNS);
        return Err(Mistake::OutOfRange { what, most });
    }
    let mut places = HashMap::<String, usize>::new();
    // The greatest number of values of each array. All columns of an array are side by side, among the columns of the
    // first kind that has the array.
    let mut counts = HashMap::<(&str, bool), usize>::new();
    for field in all().flat_map(Kind::varying_fields) {
        let count = counts.entry((&field.name, field.is_array())).or_default();
        *count = field.values().max(*count);
    }
    for kind in all() {
        let mut own = HashSet::new();
        if has_kinds {
            own.insert(KIND.to_owned());
        }
        for field in kind.varying_fields() {
            let count = counts.remove(&(&*field.name, field.is_array()));
            for number in 0..count.unwrap_or(field.values()) {
                let name = field.column(number);
                // The header of a table may be in capitals, so names must differ in more than case.
                if number < field.values() && !own.insert(name.to_ascii_lowercase()) {
                    return Err(same_name("values are", &name));
                }
                let is_text = field.is_text();
                let array = field.is_array().then(|| field.name.clone());
                if let Some(&place) = places.get(&name) {
                    let shared = &mut columns[place];
                    shared.is_text |= is_text;
                    shared.array = shared.array.take().or(array);
                    continue;
                }
                places.insert(name.clone(), columns.len());
                columns.push(Column {
                    name,
                    array,
                    is_text,
                });
            }
        }
    }
    Ok(columns)
}

/// Lists the names of files in `frames`, and their texts.
macro_rules! shipped {
    ($($name:literal)*) => {
        &[$(($name, include_str!(concat!("../frames/", $name, ".toml")))),*]
    };
}

/// The names of the shipped descriptions, and their texts.
pub const SHIPPED: &[(&str, &str)] = shipped!(
    "bin" "bin-crc8" "sbus" "sbus-any" "ibus" "ibus-any" "ibus-telemetry" "crsf" "ubx" "nmea" "rtcm" "gnss" "mavlink" "mavlink1" "mavlink2" "six-axes"
    "six-axes-be" "axes-text" "modbus-rtu" "slip" "cobs" "hdlc" "kiss" "dmx512" "dsmr-p1" "vedirect"
);

/// Returns the text of the shipped description with this name.
///
/// # Errors
/// The error names the shipped descriptions.
pub fn shipped(name: &str) -> Result<&'static str, UnknownName> {
    let found = SHIPPED.iter().find(|(shipped, _)| *shipped == name);
    let known = || SHIPPED.iter().map(|(name, _)| *name);
    found
        .map(|(_, text)| *text)
        .ok_or_else(|| UnknownName::new(name, known()))
}
