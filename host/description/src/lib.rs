//! Serial frames described in TOML. This crate parses a description into a format for [`framelock`]'s receivers,
//! decodes frames to values, and encodes values to frames. The command line, the web page and tests use this crate.
//! `docs/own-frame.md` documents all entries of a description.
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
//! let mut receiver = BufferedReceiver::with_buffer(format, vec![0; 2 * format.longest()]).ok_or("it holds a frame")?;
//! let mut shown = Vec::new();
//! receiver.feed(&frame, |found| {
//!     let Some((kind, frame)) = found.message().map(|frame| frame.message()) else {
//!         return;
//!     };
//!     for (field, content) in description.kinds[kind].shown(frame) {
//!         let value = content.values().next();
//!         shown.push(format!("{} {}", field.name, value.unwrap()));
//!     }
//! });
//! assert_eq!(shown, ["angle -12.5", "state 2"]);
//! # Ok::<(), String>(())
//! ```
#![forbid(unsafe_code)]

mod checksum;
mod encode;
mod entries;
mod field;
pub mod hex;
mod item;
mod kept;
mod kind;
mod positions;
pub mod text;
mod validate;
mod value;

use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::Read;
use std::path::Path;

use framelock::{Classification, Format as _, LineEvent};
use framelock_formats::{AnyOf, CheckedLayout};

pub use field::{Class, Field, NumberType, Type};
pub use item::Item;
pub use kind::{Content, Contents, Kind, LONGEST};
pub use positions::Part;
pub use value::{Decimal, Scale, Value};

use entries::{FrameEntry, Problem, at, missing, wrong};

/// The limit on the number of bytes in the text of a description.
const LONGEST_TEXT: usize = 1 << 20;

/// The limits on the number of kinds in a description, and on the number of values in a row.
const MOST_KINDS: usize = 100;
const MOST_COLUMNS: usize = 10_000;

/// A parsed description.
///
/// The memory of the description's [`format`](Self::format) is never freed: a few hundred bytes, and 1 KiB for each
/// CRC.
#[derive(Clone, Debug)]
pub struct Description {
    /// The kinds of frames, at least one, in the order in which they are tried.
    pub kinds: Vec<Kind>,
    /// The columns for the values of all kinds. If there are several kinds, the first column contains the name of the
    /// kind.
    pub columns: Vec<Column>,
    layouts: &'static [CheckedLayout<'static>],
}

/// A value's name in a table.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Column {
    /// The value's own name.
    pub name: String,
    /// The name of the array that contains the value.
    pub array: Option<String>,
    /// Whether the value is text or bytes in hex, even if it looks like a number.
    pub is_text: bool,
}

/// The name of the column that contains the kind of a frame.
pub const KIND: &str = "kind";

impl Description {
    /// Parses the text of a description. Error messages use `name` for the text.
    ///
    /// # Errors
    /// Returns the first mistake, with its line and column.
    pub fn parse(name: &str, text: &str) -> Result<Self, String> {
        let read = toml::from_str::<FrameEntry>(text)
            .map_err(|error| Problem(error.span().unwrap_or_default(), told(error.message())));
        read.and_then(|written| described(name, &written))
            .map_err(|Problem(place, what)| {
                let before = text.get(..place.start).unwrap_or(text);
                let line = before.matches('\n').count() + 1;
                let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
                format!("{name}:{line}:{column}: {what}")
            })
    }

    /// Returns the format for a receiver. The format's message consists of the index of the frame's kind, and the
    /// frame.
    #[must_use]
    pub fn format(&self) -> AnyOf<'static> {
        AnyOf(self.layouts)
    }

    /// Returns whether a receiver delivers these bytes as one frame, at the latest when a pause follows them.
    #[must_use]
    pub fn is_frame(&self, bytes: &[u8]) -> bool {
        let format = self.format();
        let classification = match format.classify(bytes) {
            Classification::Incomplete { .. } => format.classify_before(bytes, LineEvent::Idle),
            classification => classification,
        };
        classification == Classification::Frame(bytes.len())
    }

    /// Returns the index of a frame's kind.
    #[must_use]
    #[inline]
    pub fn number(&self, frame: &[u8]) -> usize {
        self.format().decode(frame).0
    }

    /// Returns the view that shows a frame, or the frame's kind if no view fits.
    #[must_use]
    pub fn kind(&self, frame: &[u8]) -> Option<&Kind> {
        self.shown().nth(self.shown_number(frame))
    }

    /// Returns the name of a frame's kind, view or message, which is the value of the column [`KIND`].
    #[must_use]
    pub fn name(&self, frame: &[u8]) -> Option<&str> {
        self.kind(frame).map(|kind| kind.name_of(frame))
    }

    /// Returns the index of the kind or view that shows a frame, in the order of [`shown`](Self::shown).
    #[must_use]
    #[inline]
    pub fn shown_number(&self, frame: &[u8]) -> usize {
        let number = if self.kinds.len() == 1 {
            0
        } else {
            self.number(frame)
        };
        let mut before = 0;
        for (other, kind) in self.kinds.iter().enumerate() {
            if other == number {
                return kind.view(frame).map_or(before, |view| before + 1 + view);
            }
            before += 1 + kind.views.len();
        }
        before
    }

    /// Returns an iterator over the kinds. The views of each kind follow the kind.
    pub fn shown(&self) -> impl Iterator<Item = &Kind> {
        self.kinds.iter().flat_map(Kind::with_views)
    }

    /// Returns the names of all kinds, views and messages.
    #[must_use]
    pub fn kind_names(&self) -> Vec<&str> {
        let messages = self.shown().flat_map(|kind| &kind.message_names);
        let kinds = self.shown().map(|kind| &*kind.name);
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
    pub fn plain_columns(&self) -> &[Column] {
        match &*self.kinds {
            [kind] if self.has_kinds() => {
                let count: usize = kind.varying_fields().map(Field::values).sum();
                self.columns.get(1..=count).unwrap_or_default()
            }
            _ => &self.columns,
        }
    }

    /// Returns true if there are several kinds or views, so that the output must name the kind of a frame.
    #[must_use]
    pub fn has_kinds(&self) -> bool {
        has_kinds(&self.kinds)
    }
}

/// Returns the parser's error message. If the error is an unknown name, adds the nearest known name.
fn told(message: &str) -> String {
    let unknown = message.strip_prefix("unknown field").unwrap_or_default();
    let names: Vec<&str> = unknown.split('`').skip(1).step_by(2).collect();
    match (&*names, message.split_once(", expected")) {
        ([name, names @ ..], Some((what, expected))) => {
            let nearest = text::nearest(name, names);
            format!("{what}{nearest}; expected{expected}")
        }
        _ => message.to_owned(),
    }
}

/// Reads the text of a description from a file.
///
/// # Errors
/// Returns an error if the file cannot be read, is not text, or is too long. Never reads more than the limit.
pub fn read(path: &Path) -> Result<String, String> {
    let name = path.display();
    let mut bytes = Vec::new();
    File::open(path)
        .and_then(|file| file.take(LONGEST_TEXT as u64 + 1).read_to_end(&mut bytes))
        .map_err(|error| format!("cannot read {name}: {error}; a description is a TOML file"))?;
    if bytes.len() > LONGEST_TEXT {
        return Err(format!(
            "{name} is longer than {LONGEST_TEXT} bytes: a description is a TOML file of some lines"
        ));
    }
    String::from_utf8(bytes)
        .map_err(|_| format!("{name} is not text: a description is a TOML file"))
}

fn described(name: &str, written: &FrameEntry) -> Result<Description, Problem> {
    let count = written.kinds.len() + written.any_of.len();
    if count > MOST_KINDS {
        let what = format!("{count} kinds of frames: at most {MOST_KINDS} are allowed");
        return missing(&what);
    }
    let mut kinds = Vec::new();
    for name in &written.any_of {
        let Some(text) = shipped(name.get_ref()) else {
            return wrong(name, no_such_shipped(name.get_ref()));
        };
        let shipped = Description::parse(name.get_ref(), text).map_err(at(name))?;
        kinds.extend(shipped.kinds);
    }
    for kind in &written.kinds {
        let whole = kind.get_ref();
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
        let name = whole.name.as_ref();
        let Some(name) = name.filter(|name| name.get_ref().chars().all(plain)) else {
            return wrong(kind, "a kind must have a name of letters, digits, - and _");
        };
        if !whole.kinds.is_empty() || !whole.any_of.is_empty() {
            return wrong(name, "a kind cannot contain kinds or any_of");
        }
        let whole = whole.clone().within(written);
        kinds.push(validate::kind(name.get_ref(), &whole, true)?);
    }
    if let Some(name) = &written.name {
        return wrong(
            name,
            "only a kind in [[kinds]] has a name: leave the name out",
        );
    }
    if let (Some(name), []) = (written.any_of.first(), &*written.kinds)
        && written.has_more()
    {
        let what = "any_of names complete descriptions: move the other keys into [[kinds]]";
        return wrong(name, what);
    }
    if kinds.is_empty() {
        kinds.push(validate::kind(name, written, false)?);
    }
    let columns = columns(&kinds).map_err(|what| {
        let place = written.fields.first().map(toml::Spanned::span);
        let of_kind = || written.kinds.first().map(toml::Spanned::span);
        Problem(place.or_else(of_kind).unwrap_or(0..0), what)
    })?;
    let layouts: Vec<CheckedLayout> = kinds.iter().map(|kind| kind.layout).collect();
    for (number, layout) in layouts.iter().enumerate() {
        if let Some(earlier) = layouts.iter().take(number).position(|it| it == layout)
            && let (Some(kind), Some(earlier)) = (kinds.get(number), kinds.get(earlier))
        {
            let what = format!(
                "kind {} never occurs: each of its frames is also one of kind {}, which is tried first",
                kind.name, earlier.name
            );
            let entry = number.checked_sub(kinds.len() - written.kinds.len());
            let entry = entry.and_then(|entry| written.kinds.get(entry));
            return Err(Problem(entry.map_or(0..0, toml::Spanned::span), what));
        }
    }
    Ok(Description {
        kinds,
        columns,
        layouts: kept::kept(layouts),
    })
}

fn has_kinds(kinds: &[Kind]) -> bool {
    kinds.len() > 1
        || kinds
            .iter()
            .any(|kind| !kind.views.is_empty() || !kind.message_names.is_empty())
}

/// Returns the columns of all kinds. The columns of an array have the array's name and a number. Kinds may share a
/// column.
fn columns(kinds: &[Kind]) -> Result<Vec<Column>, String> {
    let mut columns: Vec<Column> = Vec::new();
    let all = || {
        kinds
            .iter()
            .flat_map(|kind| std::iter::once(kind).chain(&kind.views))
    };
    let has_kinds = has_kinds(kinds);
    if has_kinds {
        columns.push(Column {
            name: KIND.to_owned(),
            array: None,
            is_text: true,
        });
    }
    let mut names: Vec<&str> = kinds.iter().map(|kind| &*kind.name).collect();
    names.sort_unstable();
    if let Some([name, _]) = names
        .windows(2)
        .find(|pair| matches!(pair, [a, b] if a == b))
    {
        return Err(format!("two kinds are called {name}"));
    }
    let fields = all().flat_map(Kind::varying_fields);
    if fields.map(Field::values).sum::<usize>() > MOST_COLUMNS {
        return Err(format!("a row has more than {MOST_COLUMNS} values"));
    }
    let mut places = HashMap::<String, usize>::new();
    let different = |name: &str| Err(format!("two kinds have different values called {name}"));
    for kind in all() {
        let mut own = HashSet::new();
        if has_kinds {
            own.insert(KIND.to_owned());
        }
        for field in kind.varying_fields() {
            let mut shared = 0;
            for number in 0..field.values() {
                let column = Column {
                    name: field.column(number),
                    array: field.is_array().then(|| field.name.clone()),
                    is_text: field.is_text(),
                };
                // The header of a table may be in capitals.
                if !own.insert(column.name.to_ascii_lowercase()) {
                    return Err(format!("two values are called {}", column.name));
                }
                let known = places.get(&column.name);
                match known.and_then(|&place| columns.get(place)) {
                    Some(other) if *other == column => shared += 1,
                    Some(_) => return different(&column.name),
                    None => {
                        places.insert(column.name.clone(), columns.len());
                        columns.push(column);
                    }
                }
            }
            // If several kinds share an array, they share all of its columns.
            let is_it = |column: &&Column| column.array.as_deref() == Some(&field.name);
            if shared > 0 && columns.iter().filter(is_it).count().max(1) != field.values() {
                return different(&field.name);
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
    "bin" "bin-crc8" "sbus" "ibus" "ibus-any" "ibus-telemetry" "crsf" "ubx" "nmea" "rtcm" "gnss" "mavlink" "mavlink1" "mavlink2" "six-axes"
    "six-axes-be"
);

/// Returns the text of the shipped description with this name.
#[must_use]
pub fn shipped(name: &str) -> Option<&'static str> {
    let found = SHIPPED.iter().find(|(shipped, _)| *shipped == name);
    found.map(|(_, text)| *text)
}

/// Returns the error for a name that no shipped description has.
#[must_use]
pub fn no_such_shipped(name: &str) -> String {
    let names: Vec<&str> = SHIPPED.iter().map(|(name, _)| *name).collect();
    text::no_such(name, &names)
}
