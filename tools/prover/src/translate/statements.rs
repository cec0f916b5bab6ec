//! Translates LLVM's statements to C. `llvm.h` contains the integer operations.

use std::fmt::Write as _;

use anyhow::{Context as _, Result, bail, ensure};

use super::PRELUDE;
use super::function::Graph;
use super::writer::{FunctionWriter, Operand};
use crate::llvm::{Cursor, Token, Type};

impl FunctionWriter<'_, '_> {
    /// Writes a statement of the block `block`.
    pub(super) fn statement(
        &mut self,
        tokens: &[Token],
        block: usize,
        graph: &Graph,
    ) -> Result<()> {
        let (to, rest) = match tokens {
            [Token::Local(to), Token::Sign('='), rest @ ..] => (to.as_str(), rest),
            _ => ("", tokens),
        };
        let at = &mut self.cursor(rest);
        at.try_word("tail");
        let Token::Word(operator) = at.next()? else {
            bail!("this is not a statement");
        };
        match operator.as_str() {
            "call" => self.call(at, to),
            "phi" => self.phi(tokens),
            "ret" | "br" | "switch" | "unreachable" => self.end(at, operator, block, graph),
            "store" => self.store(at),
            "load" => self.load(at, to),
            "zext" | "sext" | "trunc" | "ptrtoint" | "inttoptr" | "bitcast" => {
                self.cast(at, operator, to)
            }
            "freeze" => {
                let value = self.operand(at)?;
                self.assign(to, &value.of, &value.text)
            }
            "select" => {
                let condition = self.operand(at)?.text;
                at.sign(',')?;
                let yes = self.operand(at)?;
                at.sign(',')?;
                let no = self.operand(at)?.text;
                self.assign(to, &yes.of, &format!("{condition} ? {} : {no}", yes.text))
            }
            "alloca" => {
                let bytes = at.of_type()?.size();
                let one = matches!(at.rest, [_, Token::Word(align), Token::Number(_)] if align == "align");
                ensure!(one, "an array of unknown length is not modelled");
                self.declare_bytes(to, bytes)
            }
            "getelementptr" => {
                at.skip_attributes();
                let size = at.of_type()?.size();
                at.sign(',')?;
                let address = self.operand(at)?.text;
                at.sign(',')?;
                let Operand { of, text, .. } = self.operand(at)?;
                ensure!(at.rest.is_empty(), "more than one index is not modelled");
                let address = format!("{address} + (s64)(s{}){text} * {size}", of.bits()?);
                self.assign(to, &Type::Pointer, &address)
            }
            "extractvalue" => {
                let whole = self.operand(at)?;
                let (field, part) = field(at, &whole)?;
                self.assign(to, &part, &format!("{}{field}", whole.text))
            }
            "insertvalue" => {
                let whole = self.operand(at)?;
                at.sign(',')?;
                let part = self.operand(at)?.text;
                let (field, _) = field(at, &whole)?;
                let to = self.declare(to, &whole.of)?;
                self.line(&format!("{to} = {}; {to}{field} = {part};", whole.text))
            }
            "icmp" => {
                at.try_word("samesign");
                let Token::Word(predicate) = at.next()? else {
                    bail!("the comparison has no predicate");
                };
                let (_, value) = self.binary(at, &format!("icmp_{predicate}"))?;
                self.assign(to, &Type::Integer(1), &value)
            }
            _ => {
                at.skip_attributes();
                let (of, value) = self.binary(at, operator)?;
                self.assign(to, &of, &value)
            }
        }
    }

    /// Parses `TYPE LEFT, RIGHT`.
    fn binary(&mut self, at: &mut Cursor, name: &str) -> Result<(Type, String)> {
        let name = operation(name)?;
        let left = self.operand(at)?;
        at.sign(',')?;
        let right = self.value(at, left.of.clone())?;
        // CBMC rejects `<` between pointers into different objects, so compare the addresses as numbers.
        let is_order = left.of == Type::Pointer && name.starts_with("llvm_icmp_u");
        let number = if is_order { "(u64)" } else { "" };
        let (bits, left_text, right) = (left.of.bits()?, left.text, right.text);
        let value = format!("{name}({bits}, {number}{left_text}, {number}{right})");
        Ok((left.of, value))
    }

    fn cast(&mut self, at: &mut Cursor, operator: &str, to: &str) -> Result<()> {
        at.skip_attributes();
        let Operand { of, mut text, .. } = self.operand(at)?;
        at.word("to")?;
        let into = at.of_type()?;
        if operator == "sext" {
            text = format!("(s{})(s{}){text}", into.bits()?, of.bits()?);
        }
        self.assign(to, &into, &text)
    }

    /// Writes a load. An integer is loaded byte by byte, least significant first, because CBMC tracks arrays of bytes
    /// best in this form. A volatile or atomic load is not modelled. Parsing it fails, because the word `volatile` or
    /// `atomic` is not a type.
    fn load(&mut self, at: &mut Cursor, to: &str) -> Result<()> {
        let of = at.of_type()?;
        at.sign(',')?;
        let address = self.operand(at)?.text;
        if of == Type::Pointer {
            return self.assign(to, &of, &format!("*(pointer *)({address})"));
        }
        let bits = of.bits()?;
        let wide = if bits > 64 { 128 } else { 64 };
        let bytes: Vec<String> = (0..bits.div_ceil(8))
            .map(|byte| format!("(u{wide})({address})[{byte}] << {}", 8 * byte))
            .collect();
        self.assign(to, &of, &bytes.join(" | "))
    }

    fn store(&mut self, at: &mut Cursor) -> Result<()> {
        let value = self.operand(at)?;
        at.sign(',')?;
        let address = self.operand(at)?.text;
        if value.of == Type::Pointer {
            return self.line(&format!("*(pointer *)({address}) = {};", value.text));
        }
        let bits = value.of.bits()?;
        let wide = if bits > 64 { 128 } else { 64 };
        let mut text = format!("{{ u{wide} whole = {};", value.text);
        for byte in 0..bits.div_ceil(8) {
            write!(text, " ({address})[{byte}] = (u8)(whole >> {});", 8 * byte)?;
        }
        self.line(&(text + " }"))
    }
}

/// Returns the name of an operation in `llvm.h`.
pub(super) fn operation(name: &str) -> Result<String> {
    let written = format!("llvm_{}", name.replace('.', "_"));
    let known = PRELUDE.contains(&format!("#define {written}("));
    ensure!(known, "the operation {name} is not modelled");
    Ok(written)
}

/// Parses `, FIELD`. Returns the field's name in C and its type.
fn field(at: &mut Cursor, whole: &Operand) -> Result<(String, Type)> {
    at.sign(',')?;
    let place = usize::try_from(at.number()?)?;
    let part = match &whole.of {
        Type::Structure { fields, .. } if at.rest.is_empty() => fields.get(place),
        _ => None,
    };
    Ok((
        format!(".f{place}"),
        part.context("there is no such field")?.clone(),
    ))
}
