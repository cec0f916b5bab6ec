//! The errors of this crate. Programs match on the values; `Display` writes the texts for people.

use std::fmt;
use std::io;
use std::ops::Range;

use framelock_formats::layout::{self, Contradiction};
use thiserror::Error;

use crate::kind::LONGEST;
use crate::text::{nearest, quoted};
use crate::{MOST_COLUMNS, MOST_KINDS, Part};

/// A mistake in a description, and its position in the text. `Display` writes `name:line:column: mistake`.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error("{name}:{line}:{column}: {mistake}")]
pub struct Problem {
    /// The name of the description.
    pub name: String,
    /// The bytes of the text that contain the mistake.
    pub span: Range<usize>,
    /// The line of the first of these bytes, counted from 1.
    pub line: usize,
    /// The column of the first of these bytes, counted in characters from 1.
    pub column: usize,
    /// The mistake.
    pub mistake: Mistake,
}

impl Problem {
    /// Returns the problem with the name, the line and the column that a text gives it.
    pub(crate) fn within(name: &str, text: &str, found: Located) -> Self {
        let Located { span, mistake } = found;
        let before = &text[..span.start];
        Self {
            name: name.to_owned(),
            line: before.matches('\n').count() + 1,
            column: before.chars().rev().take_while(|&c| c != '\n').count() + 1,
            span,
            mistake,
        }
    }
}

/// A mistake and the bytes of the text that contain it.
#[derive(Debug)]
pub(crate) struct Located {
    pub(crate) span: Range<usize>,
    pub(crate) mistake: Mistake,
}

impl Located {
    pub(crate) fn new(span: Range<usize>, mistake: impl Into<Mistake>) -> Self {
        let mistake = mistake.into();
        Self { span, mistake }
    }
}

/// A mistake without a position belongs to the beginning of the text, because something is missing.
impl From<Mistake> for Located {
    fn from(mistake: Mistake) -> Self {
        Self::new(0..0, mistake)
    }
}

/// A mistake in a description.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum Mistake {
    /// The text is not TOML, or a value has the wrong type.
    #[error("{0}")]
    Toml(String),
    /// A table has a key that means nothing.
    #[error("unknown field `{name}`{}; expected one of `{}`", nearest(.name, .known), .known.join("`, `"))]
    UnknownKey {
        /// The key.
        name: String,
        /// The keys that the table may have.
        known: Vec<&'static str>,
    },
    /// A table lacks a key.
    #[error("missing field `{0}`")]
    MissingKey(&'static str),
    /// The parts of the layout contradict each other.
    #[error("{}", .0.message)]
    Contradiction(Contradiction),
    /// No frame has all parts of the layout. This part cannot be written.
    #[error("{}", no_frame(*.0))]
    NoFrame(layout::Part),
    /// A field has bytes of another part.
    #[error("{field} overlaps the {part}")]
    Overlap {
        /// The field's name.
        field: String,
        /// The other part.
        part: &'static str,
    },
    /// A field is outside a frame that must contain it.
    #[error("{field} is not in a frame of {length} bytes")]
    Outside {
        /// The field's name.
        field: String,
        /// The length of the frame.
        length: usize,
    },
    /// A text is not bytes in hex.
    #[error(transparent)]
    Hex(#[from] HexError),
    /// A key that lists bytes lists none.
    #[error("no bytes: leave the key out if there are none")]
    NoBytes,
    /// A content allows no byte.
    #[error("no bytes: leave the key out if a frame may contain any")]
    NoContent,
    /// The syncs of a kind have different lengths.
    #[error("all alternatives for the bytes that a frame begins with must have the same length")]
    DifferentLengths,
    /// The terminators of a kind have too many lengths.
    #[error("a frame can have terminators of at most three lengths")]
    ManyTerminators,
    /// A word in a content is not a byte or a range.
    #[error("'{}' is not a byte, or a range such as 20-7E", quoted(.0))]
    Range(String),
    /// A number that is needed early is counted from the end.
    #[error("this is needed before the frame's end is known: count it from the front, 0 or more")]
    FromEnd,
    /// A type has an unknown name.
    #[error(
        "there is no type \"{}\": u8, u16le, u24le, u32le and u64le have the lowest byte first, u16be and so on the \
         highest; i8, i16le and so on have a sign; f32le, f32be; for fields bytes and text; for checksums in digits \
         hex8, hex16, hex24 and hex32", quoted(.0)
    )]
    UnknownType(String),
    /// The number of a length, a message or a checksum has another type.
    #[error(
        "this must be an unsigned number of up to four bytes: u8, u16le, u16be, u24le and so on"
    )]
    NotUnsigned,
    /// A checksum has an unknown name.
    #[error(
        "there is no checksum \"{}\"; the nearest names are {}. The names are sum, inverted-sum, negated-sum, xor, \
         fletcher-8, and those of the CRCs of 8 to 32 bits in the catalogue at \
         https://reveng.sourceforge.io/crc-catalogue; give any other CRC by width, polynomial, initial, reflected and \
         xor", quoted(.name), .nearest.join(", ")
    )]
    UnknownChecksum {
        /// The name.
        name: String,
        /// The nearest names.
        nearest: Vec<String>,
    },
    /// A checksum has neither a name nor parameters, or both.
    #[error("give a name, or a CRC's width and polynomial; then initial, reflected and xor")]
    Algorithm,
    /// A kind has a fixed length and a length field.
    #[error(
        "length is for frames of the same length, length_field for frames that contain their length: leave one out"
    )]
    TwoLengths,
    /// Neither a length nor a terminator ends a frame.
    #[error("nothing ends a frame: give length, length_field or terminator")]
    NoEnd,
    /// Frames of fixed length have bounds.
    #[error("every frame has this length: leave shortest and longest out")]
    NeedlessBounds,
    /// The greatest length is missing.
    #[error(
        "give longest, the number of bytes in the longest frame: as few as possible, because after a false start a \
         frame may be delayed by that many bytes"
    )]
    NoLongest,
    /// The shortest frame has no room for its parts.
    #[error(
        "frames of {shortest} bytes are too short: the header and the parts that are counted from the end have {least}"
    )]
    TooShort {
        /// The length of the shortest frame.
        shortest: usize,
        /// The number of bytes in its parts.
        least: usize,
    },
    /// The longest frame is too long.
    #[error("longest: a frame can have at most {LONGEST} bytes")]
    TooLong,
    /// A field that cannot have a list of values has one.
    #[error(
        "only one field can have a list of values, and only without messages: an unsigned number without mask and \
         count, counted from the front"
    )]
    ValueList,
    /// The values of a list do not fit the field.
    #[error("these values do not fit the field")]
    UnfitValues,
    /// A value does not fit the field.
    #[error("this value does not fit the field, or the field is an array")]
    UnfitValue,
    /// A name is no name of a column.
    #[error("a name must have only letters, digits and _, and begin with a letter")]
    ColumnName,
    /// A name is the name of another column.
    #[error("{} are the names of other columns: choose another name", .0.join(", "))]
    ReservedName(&'static [&'static str]),
    /// A field has no type, or two.
    #[error("a field must have either a type, or bits from 1 to 64")]
    FieldType,
    /// The number of values is impossible.
    #[error("a count must be from 1 to {LONGEST}")]
    Count,
    /// A field cannot have this mask.
    #[error("only a whole number can have a mask, and the mask must have some of its bits")]
    Mask,
    /// A field cannot have a scale.
    #[error("only a whole number can have a scale and an offset")]
    Scale,
    /// A scale is 0.
    #[error("a scale must not be 0")]
    ZeroScale,
    /// A unit is not a word.
    #[error("a unit must be a word, such as deg or m/s")]
    Unit,
    /// A field cannot have an item.
    #[error("only text can have an item")]
    Item,
    /// A field that takes the rest is counted from the end.
    #[error(
        "a field that takes the rest of the frame must be counted from the front: change at, or give a count"
    )]
    RestFromEnd,
    /// A field that takes the rest gets nothing.
    #[error("no bytes of the frame are left for this field")]
    NoRest,
    /// There are too many kinds.
    #[error("{0} kinds of frames: at most {MOST_KINDS} are allowed")]
    ManyKinds(usize),
    /// There are too many values.
    #[error("a row has more than {MOST_COLUMNS} values")]
    ManyColumns,
    /// A kind has no name, or an impossible one.
    #[error("a kind must have a name of letters, digits, - and _")]
    KindName,
    /// A kind contains kinds.
    #[error("a kind cannot contain kinds or any_of")]
    NestedKinds,
    /// A description has a name.
    #[error("only a kind in [[kinds]] has a name: leave the name out")]
    NeedlessName,
    /// A list of descriptions is part of another description.
    #[error("any_of names complete descriptions: move the other keys into [[kinds]]")]
    AnyOf,
    /// There is no such shipped description.
    #[error(transparent)]
    UnknownDescription(#[from] UnknownName),
    /// Two kinds have the same name.
    #[error("two kinds are called {0}")]
    SameKindName(String),
    /// Two values have the same name.
    #[error("two values are called {0}")]
    SameName(String),
    /// Two kinds have different values with the same name.
    #[error("two kinds have different values called {0}")]
    DifferentValues(String),
    /// A kind is never found.
    #[error(
        "kind {kind} never occurs: each of its frames is also one of kind {earlier}, which is tried first"
    )]
    NeverOccurs {
        /// The kind.
        kind: String,
        /// The kind that is found instead.
        earlier: String,
    },
}

fn no_frame(part: layout::Part) -> &'static str {
    match part {
        layout::Part::Sync => {
            "sync: no frame can be made, because other parts determine these bytes"
        }
        layout::Part::Messages => {
            "messages: no frame can be made, because other parts determine the number"
        }
        layout::Part::Fixed(_) => {
            "fixed: no frame can be made, because other parts exclude this value"
        }
        layout::Part::Terminator => {
            "terminator: no frame can be made, because other parts exclude this end, or contain it"
        }
        _ => {
            "length: no frame can be made, because no length in its header is in the limits and agrees with the fixed \
             values"
        }
    }
}

/// A text that is not bytes in hex.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
#[error("word {number}, '{word}', {reason}")]
pub struct HexError {
    /// The number of the wrong word, counted from 1.
    pub number: usize,
    /// The beginning of the wrong word.
    pub word: String,
    /// The reason.
    pub reason: HexReason,
}

/// The reason why a word is not bytes in hex.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum HexReason {
    /// The word has a character that is not a hex digit.
    #[error("has '{0}', which is no hex digit")]
    Digit(String),
    /// The word has an odd number of digits, or none.
    #[error("is not a whole number of bytes: two digits make a byte")]
    Odd,
}

/// An unknown name. `Display` suggests the nearest known name, and lists the first known names.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub struct UnknownName {
    /// The unknown name.
    pub name: String,
    /// The known names.
    pub known: Vec<String>,
}

impl UnknownName {
    /// Returns the error for a name that is not one of the known names.
    pub fn new(name: &str, known: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let known = known.into_iter().map(Into::into).collect();
        let name = name.to_owned();
        Self { name, known }
    }
}

impl fmt::Display for UnknownName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        /// The number of names that are listed.
        const LISTED: usize = 20;
        let listed = &self.known[..LISTED.min(self.known.len())];
        let (name, nearest) = (quoted(&self.name), nearest(&self.name, &self.known));
        let listed_names = listed.join(", ");
        write!(f, "there is no {name}{nearest}; there are {listed_names}")?;
        match self.known.len() - listed.len() {
            0 => Ok(()),
            others => write!(f, " and {others} others"),
        }
    }
}

/// A file that has no description.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The file cannot be read.
    #[error("cannot read {name}: {error}; a description is a TOML file")]
    Io {
        /// The name of the file.
        name: String,
        /// The error of the system.
        error: io::Error,
    },
    /// The file is too long.
    #[error("{0} is longer than {limit} bytes: a description is a TOML file of some lines", limit = crate::LONGEST_TEXT)]
    TooLong(String),
    /// The file is not text.
    #[error("{0} is not text: a description is a TOML file")]
    NotText(String),
}

/// Values that no frame has.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum EncodeError {
    /// A value is missing.
    #[error("missing field `{0}`")]
    Missing(String),
    /// A value does not fit its field.
    #[error("{column} {value} {reason}")]
    Value {
        /// The name of the value's column.
        column: String,
        /// The beginning of the value.
        value: String,
        /// The reason.
        reason: Misfit,
    },
    /// There is no kind with this name.
    #[error("kind: {0}")]
    Kind(UnknownName),
    /// A receiver takes the frame for a frame of another kind.
    #[error("a frame with these values would be received as a frame of another kind")]
    OtherKind,
    /// Another part of the frame determines the bytes of this field.
    #[error("{0} cannot have this value: the description gives its bytes another value")]
    Determined(String),
    /// The messages of a kind do not contain this number.
    #[error("{field} {value}: there is no such message: the description lists the messages")]
    UnknownMessage {
        /// The field with the number.
        field: String,
        /// The number.
        value: String,
    },
    /// No frame has these values.
    #[error(
        "there is no frame of {length} bytes with these values: the description allows frames of {shortest} to \
         {longest} bytes, and determines their first bytes, their content, their kind and their last bytes"
    )]
    NoFrame {
        /// The length that the values need.
        length: usize,
        /// The length of the shortest frame.
        shortest: usize,
        /// The length of the longest frame.
        longest: usize,
    },
}

/// The reason why a value does not fit its field.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum Misfit {
    /// The value is not a number.
    #[error("is not a number")]
    NotNumber,
    /// The value is not a number in the field's range.
    #[error("is not a {}number from {least} to {most}", if *.is_whole { "whole " } else { "" })]
    NotBetween {
        /// Whether the numbers are whole.
        is_whole: bool,
        /// The smallest number.
        least: String,
        /// The greatest number.
        most: String,
    },
    /// The value has bits outside the mask.
    #[error("has other bits than the mask {0:#X}")]
    OutsideMask(u64),
    /// The value is not a text.
    #[error("is not text")]
    NotText,
    /// The value is not a text with bytes in hex.
    #[error("is not bytes in hex, as text")]
    NotBytes,
    /// The text is not bytes in hex.
    #[error("is not bytes in hex: {0}")]
    Hex(HexError),
    /// The text has another length.
    #[error("has {given} bytes instead of {wanted}")]
    Length {
        /// The number of bytes in the text.
        given: usize,
        /// The number of bytes in the field.
        wanted: usize,
    },
}

impl fmt::Display for Part<'_> {
    /// Writes the part's name: `sync` for example, or the column of a value.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(field, number) => f.write_str(&field.column(*number)),
            other => f.write_str(other.name()),
        }
    }
}
