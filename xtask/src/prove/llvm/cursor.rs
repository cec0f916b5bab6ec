//! Reads types and values from tokens.

use anyhow::{Context as _, Result, bail};

use super::ir::{Packed, Type, Value};
use super::lexer::Token;
use super::parse::Reader;

const VALUES: [&str; 9] = [
    "true",
    "false",
    "null",
    "undef",
    "poison",
    "zeroinitializer",
    "none",
    "getelementptr",
    "inttoptr",
];

pub(super) struct Cursor<'a> {
    pub(super) rest: &'a [Token],
    pub(super) reader: &'a Reader<'a>,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(tokens: &'a [Token], reader: &'a Reader<'a>) -> Self {
        Self {
            rest: tokens,
            reader,
        }
    }

    pub(super) fn next(&mut self) -> Result<&'a Token> {
        let (first, rest) = self.rest.split_first().context("the line ends too early")?;
        self.rest = rest;
        Ok(first)
    }

    pub(super) fn is_sign(&self, wanted: char) -> bool {
        self.rest.first() == Some(&Token::Sign(wanted))
    }

    pub(super) fn try_sign(&mut self, wanted: char) -> bool {
        let found = self.is_sign(wanted);
        if found {
            self.rest = &self.rest[1..];
        }
        found
    }

    pub(super) fn sign(&mut self, wanted: char) -> Result<()> {
        if self.try_sign(wanted) {
            return Ok(());
        }
        bail!("expected {wanted} before {:?}", self.rest.first());
    }

    pub(super) fn is_word(&self, wanted: &str) -> bool {
        matches!(self.rest.first(), Some(Token::Word(word)) if word == wanted)
    }

    pub(super) fn word(&mut self, wanted: &str) -> Result<()> {
        if self.is_word(wanted) {
            self.rest = &self.rest[1..];
            return Ok(());
        }
        bail!("expected {wanted} before {:?}", self.rest.first());
    }

    pub(super) fn local(&mut self) -> Result<String> {
        match self.next()? {
            Token::Local(name) => Ok(name.clone()),
            other => bail!("expected a %name, found {other:?}"),
        }
    }

    pub(super) fn global(&mut self) -> Result<String> {
        match self.next()? {
            Token::Global(name) => Ok(self.reader.global(name.clone())),
            other => bail!("expected a @name, found {other:?}"),
        }
    }

    pub(super) fn number(&mut self) -> Result<i128> {
        match self.next()? {
            Token::Number(number) => Ok(*number),
            other => bail!("expected a number, found {other:?}"),
        }
    }

    pub(super) fn index(&mut self) -> Result<usize> {
        Ok(usize::try_from(self.number()?)?)
    }

    pub(super) fn label(&mut self) -> Result<String> {
        self.word("label")?;
        self.local()
    }

    /// Skips attributes: words that are neither a type nor a value, with what belongs to them.
    pub(super) fn skip_attributes(&mut self) {
        while let Some(Token::Word(word)) = self.rest.first() {
            if is_type(word) || VALUES.contains(&word.as_str()) {
                return;
            }
            self.rest = &self.rest[1..];
            if word == "align" && matches!(self.rest.first(), Some(Token::Number(_))) {
                self.rest = &self.rest[1..];
            }
            if self.is_sign('(') {
                let mut depth = 0;
                while let Some((first, rest)) = self.rest.split_first() {
                    self.rest = rest;
                    match first {
                        Token::Sign('(') => depth += 1,
                        Token::Sign(')') => depth -= 1,
                        _ => {}
                    }
                    if depth == 0 {
                        break;
                    }
                }
            }
        }
    }

    pub(super) fn of_type(&mut self) -> Result<Type> {
        Ok(match self.next()? {
            Token::Word(word) if word == "void" => Type::Void,
            Token::Word(word) if word == "ptr" => Type::Pointer,
            Token::Word(word) => match word.strip_prefix('i').map(str::parse) {
                Some(Ok(bits)) if bits <= 128 => Type::Integer(bits),
                _ => bail!("the type {word} is not modelled"),
            },
            Token::Local(name) => {
                let named = self.reader.types.get(name);
                named.with_context(|| format!("no type %{name}"))?.clone()
            }
            Token::Sign('{') => Type::Structure(self.types_until('}')?, Packed::No),
            Token::Sign('<') if self.is_sign('{') => {
                self.sign('{')?;
                let fields = self.types_until('}')?;
                self.sign('>')?;
                Type::Structure(fields, Packed::Yes)
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

    fn types_until(&mut self, end: char) -> Result<Vec<Type>> {
        let mut types = Vec::new();
        while !self.try_sign(end) {
            types.push(self.of_type()?);
            self.try_sign(',');
        }
        Ok(types)
    }

    pub(super) fn value(&mut self, of: &Type) -> Result<Value> {
        Ok(match self.next()? {
            Token::Local(name) => Value::Local(name.clone()),
            Token::Global(name) => Value::Global(self.reader.global(name.clone())),
            Token::Number(number) => Value::Integer(*number),
            Token::Bytes(bytes) => Value::Bytes(bytes.clone()),
            Token::Word(word) => match word.as_str() {
                "true" => Value::Integer(1),
                "false" => Value::Integer(0),
                "null" | "zeroinitializer" => Value::Zero,
                "undef" | "poison" => Value::Undefined,
                "inttoptr" => {
                    self.sign('(')?;
                    self.of_type()?;
                    let address = self.number()?;
                    self.word("to")?;
                    self.of_type()?;
                    self.sign(')')?;
                    Value::Address(address)
                }
                "getelementptr" => self.constant_offset()?,
                word => bail!("the value {word} is not modelled"),
            },
            Token::Sign('{' | '[') => Value::Aggregate(self.typed_values()?),
            Token::Sign('<') if self.is_sign('{') && matches!(of, Type::Structure(..)) => {
                self.sign('{')?;
                let parts = self.typed_values()?;
                self.sign('>')?;
                Value::Aggregate(parts)
            }
            other => bail!("expected a value, found {other:?}"),
        })
    }

    /// Values with their types until the bracket closes.
    pub(super) fn typed_values(&mut self) -> Result<Vec<(Type, Value)>> {
        let mut parts = Vec::new();
        while !self.try_sign('}') && !self.try_sign(']') && !self.try_sign(')') {
            parts.push(self.typed_value()?);
            self.try_sign(',');
        }
        Ok(parts)
    }

    pub(super) fn typed_value(&mut self) -> Result<(Type, Value)> {
        let of = self.of_type()?;
        self.skip_attributes();
        let value = self.value(&of)?;
        Ok((of, value))
    }

    /// `getelementptr inbounds (i8, ptr @x, i64 4)`
    fn constant_offset(&mut self) -> Result<Value> {
        self.skip_attributes();
        self.sign('(')?;
        let unit = self.of_type()?;
        self.sign(',')?;
        let (_, address) = self.typed_value()?;
        self.sign(',')?;
        let (_, Value::Integer(count)) = self.typed_value()? else {
            bail!("an offset that is no number");
        };
        self.sign(')')?;
        Ok(Value::Offset(
            Box::new(address),
            count * i128::from(unit.size()),
        ))
    }
}

fn is_type(word: &str) -> bool {
    let integer = || {
        let digits = word.strip_prefix('i');
        digits.is_some_and(|digits| digits.parse::<u32>().is_ok())
    };
    word == "void" || word == "ptr" || integer()
}
