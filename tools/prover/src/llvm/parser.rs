//! Parses types and attributes, and calculates the sizes of types.

use std::collections::HashMap;

use anyhow::{Context as _, Result, bail};

use super::token::Token;

const VALUES: [&str; 8] = [
    "true",
    "false",
    "null",
    "undef",
    "poison",
    "zeroinitializer",
    "inttoptr",
    "getelementptr",
];

pub(crate) struct Cursor<'a> {
    pub(crate) rest: &'a [Token],
    /// The named types.
    types: &'a HashMap<String, Vec<Token>>,
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(tokens: &'a [Token], types: &'a HashMap<String, Vec<Token>>) -> Self {
        Self {
            rest: tokens,
            types,
        }
    }

    pub(crate) fn next(&mut self) -> Result<&'a Token> {
        let (first, rest) = self.rest.split_first().context("the line ends too early")?;
        self.rest = rest;
        Ok(first)
    }

    fn take(&mut self, wanted: impl Fn(&Token) -> bool) -> bool {
        match self.rest.split_first() {
            Some((first, rest)) if wanted(first) => {
                self.rest = rest;
                true
            }
            _ => false,
        }
    }

    pub(crate) fn try_sign(&mut self, wanted: char) -> bool {
        self.take(|token| *token == Token::Sign(wanted))
    }

    pub(crate) fn sign(&mut self, wanted: char) -> Result<()> {
        if self.try_sign(wanted) {
            return Ok(());
        }
        bail!("expected `{wanted}` before {:?}", self.rest.first());
    }

    pub(crate) fn try_word(&mut self, wanted: &str) -> bool {
        self.take(|token| token.is_word(wanted))
    }

    pub(crate) fn word(&mut self, wanted: &str) -> Result<()> {
        if self.try_word(wanted) {
            return Ok(());
        }
        bail!("expected `{wanted}` before {:?}", self.rest.first());
    }

    pub(crate) fn local(&mut self) -> Result<&'a str> {
        match self.next()? {
            Token::Local(name) => Ok(name),
            other => bail!("expected a %name, found {other:?}"),
        }
    }

    pub(crate) fn global(&mut self) -> Result<&'a str> {
        match self.next()? {
            Token::Global(name) => Ok(name),
            other => bail!("expected a @name, found {other:?}"),
        }
    }

    pub(crate) fn number(&mut self) -> Result<i128> {
        match self.next()? {
            Token::Number(number) => Ok(*number),
            other => bail!("expected a number, found {other:?}"),
        }
    }

    pub(crate) fn label(&mut self) -> Result<&'a str> {
        self.word("label")?;
        self.local()
    }

    /// Skips attributes: words that are neither a type nor a value, with their arguments.
    pub(crate) fn skip_attributes(&mut self) {
        let begins_type = |word: &str| ["void", "ptr"].contains(&word) || bits(word).is_some();
        let is_attribute = |token: &Token| match token {
            Token::Word(word) => !begins_type(word) && !VALUES.contains(&word.as_str()),
            _ => false,
        };
        loop {
            if self.try_word("align") {
                self.take(|token| matches!(token, Token::Number(_)));
            } else if !self.take(is_attribute) {
                return;
            }
            let mut depth = usize::from(self.try_sign('('));
            while depth > 0 {
                match self.next() {
                    Ok(Token::Sign('(')) => depth += 1,
                    Ok(Token::Sign(')')) => depth -= 1,
                    Ok(_) => {}
                    Err(_) => return,
                }
            }
        }
    }

    pub(crate) fn of_type(&mut self) -> Result<Type> {
        Ok(match self.next()? {
            Token::Word(word) if word == "void" => Type::Void,
            Token::Word(word) if word == "ptr" => Type::Pointer,
            Token::Word(word) => match bits(word) {
                Some(bits) if bits <= 128 => Type::Integer(bits),
                _ => bail!("the type {word} is not modelled"),
            },
            Token::Local(name) => {
                let named = self.types.get(name);
                let named = named.with_context(|| format!("no type %{name}"))?;
                Cursor::new(named, self.types).of_type()?
            }
            Token::Sign(open @ ('{' | '<')) => {
                let packed = *open == '<';
                if packed {
                    self.sign('{')?;
                }
                let mut fields = Vec::new();
                while !self.try_sign('}') {
                    fields.push(self.of_type()?);
                    self.try_sign(',');
                }
                if packed {
                    self.sign('>')?;
                }
                Type::Structure { fields, packed }
            }
            Token::Sign('[') => {
                let length = u64::try_from(self.number()?)?;
                self.word("x")?;
                let of = self.of_type()?;
                self.sign(']')?;
                Type::Array(length, Box::new(of))
            }
            other => bail!("expected a type, found {other:?}"),
        })
    }
}

/// Returns the number of bits of a type such as `i8`.
fn bits(word: &str) -> Option<u32> {
    word.strip_prefix('i')?.parse().ok()
}

#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Type {
    Void,
    Pointer,
    Integer(u32),
    Structure { fields: Vec<Type>, packed: bool },
    Array(u64, Box<Type>),
}

impl Type {
    /// Returns the size in memory in bytes, including padding. A pointer has eight bytes, and no
    /// alignment exceeds 16, as on every 64-bit machine that Rust's tools run on.
    pub(crate) fn size(&self) -> u64 {
        match self {
            Self::Void => 0,
            Self::Pointer => 8,
            Self::Integer(bits) => u64::from(bits.div_ceil(8)).next_multiple_of(self.alignment()),
            Self::Structure { fields, packed } => {
                let aligned = |at: u64, to: &Self| match packed {
                    true => at,
                    false => at.next_multiple_of(to.alignment()),
                };
                let end = fields
                    .iter()
                    .fold(0, |at, field| aligned(at, field) + field.size());
                aligned(end, self)
            }
            Self::Array(length, of) => length * of.size(),
        }
    }

    fn alignment(&self) -> u64 {
        match self {
            Self::Void | Self::Structure { packed: true, .. } => 1,
            Self::Pointer => 8,
            Self::Integer(bits) => u64::from(bits.div_ceil(8)).next_power_of_two().min(16),
            Self::Structure { fields, .. } => fields.iter().map(Self::alignment).max().unwrap_or(1),
            Self::Array(_, of) => of.alignment(),
        }
    }
}
