//! Writes a function's blocks as C, with jumps between them.

use std::collections::HashMap;
use std::fmt::Write as _;

use anyhow::{Context as _, Result, bail};

use super::emit::{Writer, plain};
use super::ir::{Block, Call, End, Function, Instruction, Type, Value};
use super::order::{Item, Order, order};
use super::panics::describe;

/// Writes one function.
pub(super) struct FunctionWriter<'w, 'a> {
    pub(super) writer: &'w mut Writer<'a>,
    pub(super) function: &'a Function,
    names: HashMap<&'a str, String>,
    blocks: HashMap<&'a str, usize>,
    declared: String,
    pub(super) text: String,
}

impl<'w, 'a> FunctionWriter<'w, 'a> {
    pub(super) fn new(writer: &'w mut Writer<'a>, function: &'a Function) -> Self {
        let parameters = function.parameters.iter().enumerate();
        Self {
            writer,
            function,
            names: parameters
                .map(|(place, (_, name))| (name.as_str(), format!("p{place}")))
                .collect(),
            blocks: function.block_places(),
            declared: String::new(),
            text: String::new(),
        }
    }

    pub(super) fn body(mut self) -> Result<String> {
        let order = order(self.function);
        let function = self.function;
        // Every name is declared before any is used: a loop's values come from further down.
        for item in &order.items {
            if let Item::Block(index) = item {
                for instruction in &function.blocks[*index].instructions {
                    self.declare(instruction)?;
                }
            }
        }
        for item in &order.items {
            match *item {
                Item::Block(index) => {
                    let block = &function.blocks[index];
                    writeln!(self.text, "block{index}:;")?;
                    for instruction in &block.instructions {
                        self.instruction(instruction)
                            .with_context(|| format!("{instruction:?}"))?;
                    }
                    self.end(index, block, &order)?;
                }
                Item::Repeat(head) => writeln!(self.text, "repeat{head}: goto block{head};")?,
            }
        }
        Ok(format!("{}{}", self.declared, self.text))
    }

    fn declare(&mut self, instruction: &'a Instruction) -> Result<()> {
        let (to, of) = match instruction {
            Instruction::Binary { to, of, .. }
            | Instruction::Select { to, of, .. }
            | Instruction::Phi { to, of, .. }
            | Instruction::Insert { to, of, .. }
            | Instruction::Load { to, of, .. } => (to, of.clone()),
            Instruction::Cast { to, into, .. } => (to, into.clone()),
            Instruction::Compare { to, .. } => (to, Type::Integer(1)),
            Instruction::Offset { to, .. } => (to, Type::Pointer),
            Instruction::Extract { to, of, field, .. } => {
                (to, of.part(*field).context("no such field")?.clone())
            }
            Instruction::Call(Call {
                to: Some(to),
                result,
                ..
            }) => (to, result.clone()),
            Instruction::Allocate { to, bytes } => {
                let name = format!("a{}", self.names.len());
                writeln!(self.declared, "  u8 {name}[{}];", (*bytes).max(1))?;
                self.names.insert(to, name);
                return Ok(());
            }
            Instruction::Call(Call { to: None, .. }) | Instruction::Store { .. } => return Ok(()),
        };
        let name = format!("v{}", self.names.len());
        let of = self.writer.type_name(&of)?;
        writeln!(self.declared, "  {of} {name};")?;
        if matches!(instruction, Instruction::Phi { .. }) {
            writeln!(self.declared, "  {of} {name}_next;")?;
        }
        self.names.insert(to, name);
        Ok(())
    }

    pub(super) fn name(&self, local: &str) -> Result<&str> {
        let name = self.names.get(local).map(String::as_str);
        name.with_context(|| format!("%{local} is used and not defined"))
    }

    pub(super) fn value(&mut self, of: &Type, value: &Value) -> Result<String> {
        Ok(match value {
            Value::Local(name) => self.name(name)?.to_owned(),
            Value::Global(name) => format!("((pointer){})", self.writer.constant(name)?),
            Value::Integer(number) => self.integer(of, *number)?,
            Value::Undefined => format!("nondet_{}()", self.writer.type_name(of)?),
            Value::Zero => match of {
                Type::Pointer => "((pointer)0)".to_owned(),
                Type::Integer(_) => self.integer(of, 0)?,
                _ => format!("(({}){{0}})", self.writer.type_name(of)?),
            },
            Value::Aggregate(parts) => {
                let mut written = Vec::new();
                for (part, value) in parts {
                    written.push(self.value(part, value)?);
                }
                let name = self.writer.type_name(of)?;
                format!("(({name}){{{}}})", written.join(", "))
            }
            Value::Offset(address, bytes) => {
                let address = self.value(&Type::Pointer, address)?;
                format!("({address} + {bytes})")
            }
            Value::Address(number) => format!("((pointer)(u64){number}ull)"),
            Value::Bytes(_) => bail!("a string that is no constant"),
        })
    }

    fn integer(&mut self, of: &Type, number: i128) -> Result<String> {
        let Type::Integer(bits) = of else {
            bail!("{number} is of the type {of:?}");
        };
        let name = self.writer.type_name(of)?;
        let unsigned = number.cast_unsigned() & (u128::MAX >> (128 - bits));
        let (high, low) = (unsigned >> 64, unsigned & u128::from(u64::MAX));
        Ok(if high == 0 {
            format!("(({name}){low}ull)")
        } else {
            format!("(({name})((u128){high}ull << 64 | {low}ull))")
        })
    }

    fn end(&mut self, index: usize, block: &'a Block, order: &Order) -> Result<()> {
        match &block.end {
            End::Return(None) => writeln!(self.text, "  return;")?,
            End::Return(Some((of, value))) => {
                let value = self.value(of, value)?;
                writeln!(self.text, "  return {value};")?;
            }
            End::Jump(to) => {
                let jump = self.jump(index, to, order)?;
                writeln!(self.text, "  {jump}")?;
            }
            End::Branch { condition, yes, no } => {
                let condition = self.value(&Type::Integer(1), condition)?;
                for (fails, panicking, other) in [("", yes, no), ("!", no, yes)] {
                    if let Some(says) = self.panic_of(panicking) {
                        let jump = self.jump(index, other, order)?;
                        let fails = format!("{fails}{condition}");
                        return self.line(&format!(
                            "  {{ _Bool fails = {fails}; __CPROVER_assert(!fails, \"{says}\"); \
                             __CPROVER_assume(!fails); }} {jump}"
                        ));
                    }
                }
                let (yes, no) = (self.jump(index, yes, order)?, self.jump(index, no, order)?);
                writeln!(self.text, "  if ({condition}) {{ {yes} }} else {{ {no} }}")?;
            }
            End::Switch {
                of,
                value,
                cases,
                otherwise,
            } => {
                let value = self.value(of, value)?;
                for (case, to) in cases {
                    let case = self.integer(of, *case)?;
                    let jump = self.jump(index, to, order)?;
                    writeln!(self.text, "  if ({value} == {case}) {{ {jump} }}")?;
                }
                let jump = self.jump(index, otherwise, order)?;
                writeln!(self.text, "  {jump}")?;
            }
            End::Unreachable => writeln!(
                self.text,
                "  __CPROVER_assert(0, \"what the compiler takes for unreachable\"); \
                 __CPROVER_assume(0);"
            )?,
        }
        Ok(())
    }

    /// What a block says that does nothing but panic. A branch to it is written as an assertion:
    /// the checker goes on with one path then, and not with one for each place that may panic.
    fn panic_of(&self, label: &str) -> Option<String> {
        let block = &self.function.blocks[*self.blocks.get(label)?];
        let mut instructions = block.instructions.iter();
        let call = instructions.find(|other| !matches!(other, Instruction::Phi { .. }))?;
        let Instruction::Call(call) = call else {
            return None;
        };
        let panics = self.writer.module.never_return.contains(&call.function);
        let ends = matches!(block.end, End::Unreachable) && instructions.next().is_none();
        let says = || describe(self.writer.module, self.function, call);
        (panics && ends).then(|| plain(&says()))
    }

    /// Hands the values over that the block `to` takes from this one, and goes there.
    fn jump(&mut self, from: usize, to: &str, order: &Order) -> Result<String> {
        let function = self.function;
        let target = *self
            .blocks
            .get(to)
            .with_context(|| format!("no block {to}"))?;
        let mut text = String::new();
        for instruction in &function.blocks[target].instructions {
            let Instruction::Phi { to, of, incoming } = instruction else {
                break;
            };
            let label = &function.blocks[from].label;
            let (value, _) = incoming
                .iter()
                .find(|(_, before)| self.blocks.get(before.as_str()) == Some(&from))
                .with_context(|| format!("%{to} has no value from {label}"))?;
            let value = self.value(of, value)?;
            write!(text, "{}_next = {value}; ", self.name(to)?)?;
        }
        let kind = if order.repeats.contains(&(from, target)) {
            "repeat"
        } else {
            "block"
        };
        write!(text, "goto {kind}{target};")?;
        Ok(text)
    }
}
