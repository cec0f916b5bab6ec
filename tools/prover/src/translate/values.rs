//! Operands.

use anyhow::{Result, bail};

use super::function::FunctionWriter;
use crate::llvm::{Cursor, Token, Type};

/// What an operation works on.
pub(super) struct Operand<'a> {
    pub(super) of: Type,
    /// Its first word, which is all of it unless it is a structure.
    pub(super) token: &'a Token,
    /// The expression of C.
    pub(super) text: String,
}

impl FunctionWriter<'_, '_> {
    /// A type, attributes, and a value of it.
    pub(super) fn operand<'a>(&mut self, at: &mut Cursor<'a>) -> Result<Operand<'a>> {
        let of = at.of_type()?;
        at.skip_attributes();
        self.value(at, of)
    }

    pub(super) fn value<'a>(&mut self, at: &mut Cursor<'a>, of: Type) -> Result<Operand<'a>> {
        let token = at.next()?;
        let text = match token {
            Token::Local(name) => self.name(name),
            Token::Global(name) => format!("((pointer){})", self.program.constant_name(name)?),
            Token::Number(number) => self.integer(&of, *number)?,
            Token::Word(word) => match word.as_str() {
                "true" => self.integer(&of, 1)?,
                "false" => self.integer(&of, 0)?,
                "null" => "((pointer)0)".to_owned(),
                "undef" | "poison" => format!("nondet_{}()", self.program.type_name(&of)?),
                "zeroinitializer" => format!("(({}){{0}})", self.program.type_name(&of)?),
                "inttoptr" => {
                    at.sign('(')?;
                    let address = self.operand(at)?;
                    at.word("to")?;
                    at.of_type()?;
                    at.sign(')')?;
                    format!("((pointer){})", address.text)
                }
                other => bail!("the value {other} is not modelled"),
            },
            Token::Sign('{') => {
                let mut parts = Vec::new();
                while !at.try_sign('}') {
                    parts.push(self.operand(at)?.text);
                    at.try_sign(',');
                }
                format!(
                    "(({}){{{}}})",
                    self.program.type_name(&of)?,
                    parts.join(", ")
                )
            }
            other => bail!("the value {other:?} is not modelled"),
        };
        Ok(Operand { of, token, text })
    }

    fn integer(&mut self, of: &Type, number: i128) -> Result<String> {
        let (bits, name) = (of.bits()?, self.program.type_name(of)?);
        let unsigned = number.cast_unsigned() & (u128::MAX >> (128 - bits));
        let (high, low) = (unsigned >> 64, unsigned & u128::from(u64::MAX));
        Ok(if high == 0 {
            format!("(({name}){low}ull)")
        } else {
            format!("(({name})((u128){high}ull << 64 | {low}ull))")
        })
    }
}

impl Operand<'_> {
    /// The number that it is.
    pub(super) fn number(&self) -> Result<i128> {
        match self.token {
            Token::Number(number) => Ok(*number),
            _ => bail!("a length that is not known in advance is not modelled"),
        }
    }
}

impl Type {
    pub(super) fn bits(&self) -> Result<u32> {
        match self {
            Self::Integer(bits) => Ok(*bits),
            // As a number, for comparisons.
            Self::Pointer => Ok(64),
            other => bail!("arithmetic on {other:?} is not modelled"),
        }
    }
}
