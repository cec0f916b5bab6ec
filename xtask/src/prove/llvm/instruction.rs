//! A statement of C for each instruction.

use std::fmt::Write as _;

use anyhow::{Result, bail};

use super::function::FunctionWriter;
use super::ir::{Instruction, Type, Value};

impl<'a> FunctionWriter<'_, 'a> {
    #[expect(clippy::too_many_lines, reason = "an arm for each instruction")]
    pub(super) fn instruction(&mut self, instruction: &'a Instruction) -> Result<()> {
        match instruction {
            Instruction::Binary {
                to,
                operator,
                of,
                left,
                right,
            } => {
                let bits = width(of)?;
                let (left, right) = (self.value(of, left)?, self.value(of, right)?);
                let value = match operator.as_str() {
                    "add" => format!("{left} + {right}"),
                    "sub" => format!("{left} - {right}"),
                    // Wide enough that C does not take it for a product of signed numbers.
                    "mul" if bits < 32 => format!("(u32){left} * (u32){right}"),
                    "mul" => format!("{left} * {right}"),
                    "udiv" => format!("{left} / {right}"),
                    "urem" => format!("{left} % {right}"),
                    "sdiv" => format!("(s{bits}){left} / (s{bits}){right}"),
                    "srem" => format!("(s{bits}){left} % (s{bits}){right}"),
                    "shl" if bits < 32 => format!("(u32){left} << {right}"),
                    "shl" => format!("{left} << {right}"),
                    "lshr" => format!("{left} >> {right}"),
                    "ashr" => format!("(s{bits}){left} >> {right}"),
                    "and" => format!("{left} & {right}"),
                    "or" => format!("{left} | {right}"),
                    "xor" => format!("{left} ^ {right}"),
                    other => bail!("the operator {other} is not modelled"),
                };
                self.assign(to, of, &value)
            }
            Instruction::Compare {
                to,
                predicate,
                of,
                left,
                right,
            } => {
                let (left, right) = (self.value(of, left)?, self.value(of, right)?);
                let (sign, order) = match predicate.as_str() {
                    "eq" => ('u', "=="),
                    "ne" => ('u', "!="),
                    other => match (other.split_at(1), &other[1..]) {
                        (("s", _), "lt") => ('s', "<"),
                        (("s", _), "le") => ('s', "<="),
                        (("s", _), "gt") => ('s', ">"),
                        (("s", _), "ge") => ('s', ">="),
                        (("u", _), "lt") => ('u', "<"),
                        (("u", _), "le") => ('u', "<="),
                        (("u", _), "gt") => ('u', ">"),
                        (("u", _), "ge") => ('u', ">="),
                        _ => bail!("the comparison {other} is not modelled"),
                    },
                };
                let value = if *of == Type::Pointer {
                    format!("{left} {order} {right}")
                } else {
                    let bits = width(of)?;
                    format!("({sign}{bits}){left} {order} ({sign}{bits}){right}")
                };
                self.assign(to, &Type::Integer(1), &value)
            }
            Instruction::Cast {
                to,
                operator,
                from,
                value,
                into,
            } => {
                let value = self.value(from, value)?;
                let value = match operator.as_str() {
                    "sext" => format!("(s{}){value}", width(from)?),
                    _ => value,
                };
                if operator == "sext" {
                    let wide = format!("(s{})({value})", width(into)?);
                    return self.assign(to, into, &wide);
                }
                self.assign(to, into, &value)
            }
            Instruction::Select {
                to,
                condition,
                of,
                yes,
                no,
            } => {
                let condition = self.value(&Type::Integer(1), condition)?;
                let (yes, no) = (self.value(of, yes)?, self.value(of, no)?);
                let to = self.name(to)?;
                let text = format!("  {to} = {condition} ? {yes} : {no};");
                self.line(&text)
            }
            Instruction::Phi { to, .. } => {
                let to = self.name(to)?;
                let text = format!("  {to} = {to}_next;");
                self.line(&text)
            }
            Instruction::Load { to, of, address } => self.load(to, of, address),
            Instruction::Store { of, value, address } => self.store(of, value, address),
            Instruction::Allocate { .. } => Ok(()),
            Instruction::Offset { to, address, steps } => {
                let mut sum = self.value(&Type::Pointer, address)?;
                for (of, index, size) in steps {
                    let bits = width(of)?;
                    let index = self.value(of, index)?;
                    write!(sum, " + (s64)(s{bits}){index} * {size}")?;
                }
                self.assign(to, &Type::Pointer, &sum)
            }
            Instruction::Extract {
                to,
                of,
                value,
                field,
            } => {
                let value = self.value(of, value)?;
                let to = self.name(to)?;
                let text = format!("  {to} = {value}.f{field};");
                self.line(&text)
            }
            Instruction::Insert {
                to,
                of,
                value,
                part,
                field,
            } => {
                let value = self.value(of, value)?;
                let part = self.value(&part.0, &part.1)?;
                let to = self.name(to)?;
                let text = format!("  {to} = {value}; {to}.f{field} = {part};");
                self.line(&text)
            }
            Instruction::Call(call) => self.call(call),
        }
    }

    pub(super) fn line(&mut self, text: &str) -> Result<()> {
        writeln!(self.text, "{text}")?;
        Ok(())
    }

    /// Gives the name that value, cut to its type.
    pub(super) fn assign(&mut self, to: &str, of: &Type, value: &str) -> Result<()> {
        let of = self.writer.type_name(of)?;
        let to = self.name(to)?;
        let text = format!("  {to} = ({of})({value});");
        self.line(&text)
    }

    /// Byte by byte, lowest first: what CBMC follows best in an array of bytes.
    fn load(&mut self, to: &str, of: &Type, address: &Value) -> Result<()> {
        let address = self.value(&Type::Pointer, address)?;
        if *of == Type::Pointer {
            return self.assign(to, of, &format!("*(pointer *)({address})"));
        }
        let bits = width(of)?;
        let wide = if bits > 64 { 128 } else { 64 };
        let bytes: Vec<String> = (0..bits.div_ceil(8))
            .map(|byte| format!("(u{wide})({address})[{byte}] << {}", 8 * byte))
            .collect();
        self.assign(to, of, &bytes.join(" | "))
    }

    fn store(&mut self, of: &Type, value: &Value, address: &Value) -> Result<()> {
        let value = self.value(of, value)?;
        let address = self.value(&Type::Pointer, address)?;
        if *of == Type::Pointer {
            return self.line(&format!("  *(pointer *)({address}) = {value};"));
        }
        let bits = width(of)?;
        let wide = if bits > 64 { 128 } else { 64 };
        let mut text = format!("  {{ u{wide} whole = {value};");
        for byte in 0..bits.div_ceil(8) {
            write!(text, " ({address})[{byte}] = (u8)(whole >> {});", 8 * byte)?;
        }
        text.push_str(" }");
        self.line(&text)
    }
}

/// The bits of an integer.
pub(super) fn width(of: &Type) -> Result<u32> {
    match of {
        Type::Integer(bits) => Ok(*bits),
        other => bail!("arithmetic on {other:?} is not modelled"),
    }
}
