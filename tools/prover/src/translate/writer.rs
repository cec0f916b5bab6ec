//! Writes values: their names, their declarations, and the operands of statements.

use std::collections::HashMap;
use std::fmt::Write as _;

use anyhow::{Result, bail};

use super::Program;
use crate::llvm::{Cursor, Module, Token, Type};

/// Writes one function.
pub(super) struct FunctionWriter<'p, 'm> {
    pub(super) program: &'p mut Program<'m>,
    pub(super) symbol: &'p str,
    /// The C names of values, by their LLVM names.
    names: HashMap<String, String>,
    pub(super) declared: String,
    pub(super) text: String,
}

/// An operand of an operation.
pub(super) struct Operand<'a> {
    pub(super) of: Type,
    /// The operand's first token. For `inttoptr`, the first token of its argument. A name or number is a single token.
    pub(super) token: &'a Token,
    /// The C expression.
    pub(super) text: String,
}

impl<'p, 'm> FunctionWriter<'p, 'm> {
    pub(super) fn new(program: &'p mut Program<'m>, symbol: &'p str) -> Self {
        Self {
            program,
            symbol,
            names: HashMap::new(),
            declared: String::new(),
            text: String::new(),
        }
    }

    /// Returns a cursor over tokens of the module.
    pub(super) fn cursor<'a>(&self, tokens: &'a [Token]) -> Cursor<'a>
    where
        'm: 'a,
    {
        Cursor::new(tokens, &self.program.module.types)
    }

    pub(super) fn module(&self) -> &'m Module {
        self.program.module
    }

    /// Returns the C name of LLVM's `%local`.
    pub(super) fn name(&mut self, local: &str) -> String {
        let new = format!("v{}", self.names.len());
        self.names.entry(local.to_owned()).or_insert(new).clone()
    }

    /// Declares the value `to`. Returns its name.
    pub(super) fn declare(&mut self, to: &str, of: &Type) -> Result<String> {
        let (name, of) = (self.name(to), self.program.type_name(of)?);
        writeln!(self.declared, "  {of} {name};")?;
        Ok(name)
    }

    /// Declares an array of bytes.
    pub(super) fn declare_bytes(&mut self, to: &str, bytes: u64) -> Result<()> {
        let name = self.name(to);
        writeln!(self.declared, "  u8 {name}[{}];", bytes.max(1))?;
        Ok(())
    }

    pub(super) fn line(&mut self, text: &str) -> Result<()> {
        writeln!(self.text, "  {text}")?;
        Ok(())
    }

    /// Declares `to`, and assigns it this value, truncated to its type.
    pub(super) fn assign(&mut self, to: &str, of: &Type, value: &str) -> Result<()> {
        let to = self.declare(to, of)?;
        match of {
            Type::Integer(bits) => self.line(&format!("{to} = (u{bits})({value});")),
            _ => self.line(&format!("{to} = {value};")),
        }
    }

    /// Writes an assertion that fails if execution reaches it.
    pub(super) fn fails(&mut self, says: &str) -> Result<()> {
        self.line(&format!(
            "__CPROVER_assert(0, \"{says}\"); __CPROVER_assume(0);"
        ))
    }

    /// Parses a type, attributes, and a value of this type.
    pub(super) fn operand<'a>(&mut self, at: &mut Cursor<'a>) -> Result<Operand<'a>> {
        let of = at.of_type()?;
        at.skip_attributes();
        self.value(at, of)
    }

    pub(super) fn value<'a>(&mut self, at: &mut Cursor<'a>, of: Type) -> Result<Operand<'a>> {
        let token = at.next()?;
        let text = match token {
            Token::Local(name) => self.name(name),
            Token::Global(name) => format!("((pointer)&{})", self.program.constant_name(name)?),
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
                    let text = format!("((pointer){})", address.text);
                    let token = address.token;
                    return Ok(Operand { of, token, text });
                }
                "getelementptr" => {
                    // Only the `i8` form is modelled: a base plus an offset in bytes.
                    while !at.try_sign('(') {
                        at.next()?;
                    }
                    at.word("i8")?;
                    at.sign(',')?;
                    let base = self.operand(at)?;
                    at.sign(',')?;
                    let offset = self.operand(at)?;
                    at.sign(')')?;
                    format!("({} + {})", base.text, offset.text)
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
    /// Returns the operand's value if it is a literal number.
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
            // Compare pointers as numbers.
            Self::Pointer => Ok(64),
            other => bail!("arithmetic on {other:?} is not modelled"),
        }
    }
}
