//! The errors of this crate. Programs match on the values; `Display` writes the texts for people.

use std::fmt;
use std::io;
use std::ops::Range;

use thiserror::Error;

use crate::text::{nearest, quoted};

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
    /// Returns the mistake with the name of its text, and its line and column in the text.
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

/// Converts the error of the TOML parser. Suggests a known key that resembles an unknown key.
impl From<toml::de::Error> for Located {
    fn from(error: toml::de::Error) -> Self {
        let mut message = error.message().to_owned();
        // The parser names the unknown key and the known keys only in its message: "unknown field `a`, expected ..".
        if message.starts_with("unknown field")
            && let [_, name, _, known @ ..] = &*message.split('`').collect::<Vec<_>>()
        {
            let known: Vec<&str> = known.iter().copied().step_by(2).collect();
            let suggested = format!("`{};", nearest(name, &known));
            message = message.replacen("`,", &suggested, 1);
        }
        Self::new(error.span().unwrap_or(0..0), Mistake::Toml(message))
    }
}

/// A mistake in a description.
#[derive(Clone, PartialEq, Eq, Debug, Error)]
pub enum Mistake {
    /// The text is not TOML, a table lacks a key or has an unknown key, or a value has the wrong type.
    #[error("{0}")]
    Toml(String),
    /// An entry breaks a rule, or contradicts another entry.
    #[error("{0}")]
    Rule(&'static str),
    /// The parts of a kind of frames contradict each other.
    #[error("{}{message}{}", prefix(.kind.as_ref()), suffix(*.bytes))]
    Layout {
        /// The kind's name, if the kind is in `[[kinds]]`.
        kind: Option<String>,
        /// The contradiction.
        message: &'static str,
        /// If a length is too small or too great, the limit that it breaks.
        bytes: Option<usize>,
    },
    /// A text is not bytes in hex.
    #[error(transparent)]
    Hex(#[from] HexError),
    /// The name of a type or a checksum, for example, is unknown.
    #[error(transparent)]
    Unknown(#[from] UnknownName),
    /// A file of `any_of` has a mistake.
    #[error(transparent)]
    Within(Box<Problem>),
    /// A file of `any_of` cannot be read.
    #[error("{0}")]
    File(String),
    /// A number is out of its range.
    #[error("{what} must be from 1 to {most}")]
    OutOfRange {
        /// The meaning of the number.
        what: &'static str,
        /// The greatest number.
        most: usize,
    },
    /// A field shares bits with another part.
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
    /// Two kinds or two values have the same name.
    #[error("two {things} called {name}")]
    SameName {
        /// Either `kinds are` or `values are`.
        things: &'static str,
        /// The name.
        name: String,
    },
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

fn prefix(kind: Option<&String>) -> String {
    kind.map_or(String::new(), |kind| format!("kind {kind}: "))
}

fn suffix(bytes: Option<usize>) -> String {
    bytes.map_or(String::new(), |bytes| format!(" ({bytes} bytes)"))
}

impl From<&'static str> for Mistake {
    fn from(rule: &'static str) -> Self {
        Self::Rule(rule)
    }
}

/// Returns a mistake at this position if the condition holds.
pub(crate) fn reject_if(
    is_wrong: bool,
    span: Range<usize>,
    mistake: impl Into<Mistake>,
) -> Result<(), Located> {
    if is_wrong {
        return Err(Located::new(span, mistake));
    }
    Ok(())
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
    /// The word is neither one byte nor a range of bytes.
    #[error("is not a byte, or a range such as 20-7E")]
    Range,
}

/// An unknown name. `Display` suggests the most similar known name, if any is similar enough, and lists the first known
/// names.
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

/// The reason why a file cannot be read as a description.
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
    /// The file begins like XML, but is not XML.
    #[error("{name}: {error}")]
    Xml {
        /// The name of the file.
        name: String,
        /// The error of the parser.
        error: roxmltree::Error,
    },
    /// The XML file has no message.
    #[error("{0} is XML without a message of MAVLink; other descriptions are TOML files")]
    NoMessage(String),
    /// A message of MAVLink's definition has a mistake.
    #[error(
        "{file}, message {name:?}: a message has a name, an id that no other message has, and fields of at most 255 bytes; a \
         field has a name, and a type: char, int8_t, uint8_t and so on to uint64_t, float, double, or an array such as float[4]"
    )]
    Message {
        /// The name of the file that was read. The message may be in a file that this file includes.
        file: String,
        /// The name of the message.
        name: String,
    },
}

/// The reason why values cannot be encoded.
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
    /// A receiver would not deliver the frame as a frame of the wanted kind.
    #[error("a frame with these values would be received as a frame of another kind")]
    OtherKind,
    /// A text cannot be made from its values.
    #[error(
        "missing field `{0}`: it cannot be made from other values, because no single pattern without {{}} describes it"
    )]
    NoText(String),
    /// Another part of the frame changes bytes of this field, or the field is a value in a text and contains the
    /// literal that ends the value.
    #[error("{0} cannot have this value: the description gives its bytes another value")]
    Determined(String),
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
    /// The value is not of this type.
    #[error("is not {0}")]
    Not(&'static str),
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
    /// The value is the number of a message that is not listed.
    #[error("is no message: the description lists the messages")]
    NoMessage,
    /// The text is neither a number nor one of the field's names.
    #[error("is neither a number nor a name: {0}")]
    Name(UnknownName),
    /// Numbers in this notation cannot be written.
    #[error("cannot be written: only decimal and hex numbers in text can")]
    NoInverse,
    /// The text is not bytes in hex.
    #[error("is not bytes in hex: {0}")]
    Hex(HexError),
    /// The text or the bytes do not have the field's length.
    #[error("has {given} bytes instead of {wanted}")]
    Length {
        /// The number of bytes in the value.
        given: usize,
        /// The number of bytes in the field.
        wanted: usize,
    },
}
