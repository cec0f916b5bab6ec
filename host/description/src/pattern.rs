//! Patterns of texts, such as `A{pitch}B{roll}`, and the places of values in a text.

use crate::notation::{Notation, after_blanks};
use crate::problem::Mistake;
use crate::read_field::column_name;

/// A pattern of a text. In a literal, a blank stands for one or more blanks.
#[derive(Clone, PartialEq, Eq, Default, Debug)]
pub struct Pattern {
    /// The literal before the first value. It may be empty.
    pub first: Vec<u8>,
    /// The values in the order of the text.
    pub values: Vec<PatternValue>,
}

/// A value of a pattern.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct PatternValue {
    /// The name of the value's field; `None` for bytes that the pattern skips, `{}`.
    pub name: Option<String>,
    /// The notation of the value; text for skipped bytes.
    pub notation: Notation,
    /// The literal after the value. The value ends where this literal begins. Only the literal after the last value may
    /// be empty: then the value reaches to the end of the text.
    pub after: Vec<u8>,
}

/// The place of a field's value in a text.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct TextPlace {
    /// The index of the pattern in the patterns of the field's kind.
    pub pattern: usize,
    /// The index of the value in the pattern.
    pub value: usize,
}

impl Pattern {
    /// Parses a pattern such as `A{pitch}B{roll}\r\n`.
    pub(crate) fn parse(text: &str) -> Result<Self, Mistake> {
        let mut pattern = Self::default();
        let mut rest = text;
        loop {
            let literal = literal(&mut rest)?;
            let is_last = rest.is_empty();
            match pattern.values.last_mut() {
                Some(value) => value.after = literal,
                None => pattern.first = literal,
            }
            let Some((name, others)) = rest.strip_prefix('{').and_then(|rest| rest.split_once('}'))
            else {
                reject(
                    !is_last,
                    "a brace is not closed: {name} is a value, and {{ is a brace",
                )?;
                return Ok(pattern);
            };
            let is_adjacent = pattern
                .values
                .last()
                .is_some_and(|value| value.after.is_empty());
            reject(
                is_adjacent,
                "two values need a character between them, where the first one ends",
            )?;
            let name = (!name.is_empty()).then(|| column_name(name)).transpose()?;
            let after = Vec::new();
            pattern.values.push(PatternValue {
                name,
                notation: Notation::Text,
                after,
            });
            rest = others;
        }
    }

    /// Returns the index of the value with this name.
    pub(crate) fn position(&self, name: &str) -> Option<usize> {
        let mut values = self.values.iter();
        values.position(|value| value.name.as_deref() == Some(name))
    }
}

impl Pattern {
    /// Returns whether a text begins with the pattern's first literal. If the pattern begins with skipped bytes,
    /// returns whether the text contains the literal after these bytes.
    pub(crate) fn begins(&self, text: &[u8]) -> bool {
        match (begins(&self.first, text), &*self.values) {
            (Some(0), [first, ..]) if first.name.is_none() => end(&first.after, text, 0).is_some(),
            (beginning, _) => beginning.is_some(),
        }
    }

    /// Returns the number of the first value, which is 0, and the index at which the value begins; `None` if the text
    /// begins with other bytes.
    pub(crate) fn start(&self, text: &[u8]) -> Option<(usize, usize)> {
        Some((0, begins(&self.first, text)?))
    }

    /// Returns the bytes of a value, and the index after the literal that follows it; `None` if the text differs from
    /// the pattern before the value. If the text does not contain this literal, the value reaches to the end of the
    /// text. The search begins at `from`: the number of this value or of an earlier value, and the index at which that
    /// value begins.
    pub(crate) fn find<'t>(
        &self,
        text: &'t [u8],
        number: usize,
        from: (usize, usize),
    ) -> Option<(&'t [u8], usize)> {
        let (first, mut at) = from;
        for value in &self.values[first..number] {
            at += value.end(text.get(at..)?)?.1;
        }
        let rest = text.get(at..)?;
        // Without this literal, the text has no further value.
        let (end, next) = self.values[number]
            .end(rest)
            .unwrap_or((rest.len(), usize::MAX - at));
        Some((&rest[..end], at + next))
    }

    /// Returns the text with these values.
    pub(crate) fn text(&self, values: &[Vec<u8>]) -> Vec<u8> {
        let mut text = self.first.clone();
        for (value, described) in values.iter().zip(&self.values) {
            text.extend(value);
            text.extend(&described.after);
        }
        text
    }
}

impl PatternValue {
    /// Returns the index of the literal after the value, and the index after that literal. The text must begin with the
    /// value.
    #[inline]
    fn end(&self, text: &[u8]) -> Option<(usize, usize)> {
        end(&self.after, text, self.notation.least(text))
    }
}

/// Returns the number of bytes of a literal at the beginning of a text; `None` if the text begins with other bytes.
fn begins(literal: &[u8], text: &[u8]) -> Option<usize> {
    let mut rest = text;
    for byte in literal {
        let (first, others) = rest.split_first()?;
        rest = match byte {
            b' ' if *first == b' ' => after_blanks(others),
            _ if byte == first => others,
            _ => return None,
        };
    }
    Some(text.len() - rest.len())
}

/// Returns the indices of the first byte of a literal in a text and of the byte after the literal. The literal begins
/// at index `from` or later. An empty literal is at the end of the text.
fn end(literal: &[u8], text: &[u8], from: usize) -> Option<(usize, usize)> {
    let rest = text.get(from..)?;
    match literal {
        [] => Some((text.len(), text.len())),
        [byte] if *byte != b' ' => {
            let at = from + rest.iter().position(|other| other == byte)?;
            Some((at, at + 1))
        }
        _ => (from..text.len()).find_map(|at| Some((at, at + begins(literal, &text[at..])?))),
    }
}

fn reject(is_wrong: bool, rule: &'static str) -> Result<(), Mistake> {
    if is_wrong { Err(rule.into()) } else { Ok(()) }
}

/// Takes the literal at the beginning of the rest of a pattern, up to a value or the end.
fn literal(rest: &mut &str) -> Result<Vec<u8>, Mistake> {
    let mut literal: Vec<u8> = Vec::new();
    while let Some(c) = rest.chars().next() {
        let mut taken = c.len_utf8();
        let mut bytes = rest.as_bytes()[..taken].to_vec();
        match (c, rest.as_bytes().get(1)) {
            ('{', Some(b'{')) | ('}', Some(b'}')) | ('\\', Some(b'\\')) => taken = 2,
            ('{', _) => break,
            ('\\', Some(b'r')) => (taken, bytes) = (2, b"\r".to_vec()),
            ('\\', Some(b'n')) => (taken, bytes) = (2, b"\n".to_vec()),
            ('\\', Some(b't')) => (taken, bytes) = (2, b"\t".to_vec()),
            ('\\', Some(b'x')) => {
                let digits = rest
                    .get(2..4)
                    .and_then(|digits| u8::from_str_radix(digits, 16).ok());
                let rule = "\\x needs two hex digits, as in \\x0D";
                (taken, bytes) = (4, vec![digits.ok_or(rule)?]);
            }
            ('\\', _) => return Err("\\ begins \\r, \\n, \\t, \\x0D or \\\\".into()),
            // Several blanks are the same as one.
            (' ', _) if literal.last() == Some(&b' ') => bytes.clear(),
            _ => {}
        }
        literal.extend(bytes);
        *rest = &rest[taken..];
    }
    Ok(literal)
}
