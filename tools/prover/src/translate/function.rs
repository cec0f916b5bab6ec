//! Writes the blocks of a function, and the jumps between them.

use std::collections::HashMap;
use std::fmt::Write as _;

use anyhow::{Context as _, Result};

use super::Program;
use super::order::{Item, Order, order};
use super::writer::{FunctionWriter, Operand};
use crate::llvm::{Block, Cursor, Token, Type};

/// A phi of LLVM: a value that depends on the block from which the jump came.
struct Phi<'a> {
    to: &'a str,
    of: Type,
    /// The values, by the labels of the blocks from which the jump can come.
    incoming: Vec<(&'a str, Operand<'a>)>,
}

impl<'a> Phi<'a> {
    /// Returns the value after a jump from this block.
    fn from(&self, block: &Block) -> Result<&Operand<'a>> {
        let mut incoming = self.incoming.iter();
        let found = incoming.find(|(label, _)| *label == block.label);
        let (_, value) = found.context("no value from this block")?;
        Ok(value)
    }
}

/// The blocks of a function, and the order in which they are written.
pub(super) struct Graph<'a> {
    blocks: &'a [Block],
    places: HashMap<&'a str, usize>,
    order: Order,
}

impl<'a> Graph<'a> {
    fn new(blocks: &'a [Block]) -> Result<Self> {
        let labels = blocks.iter().map(|block| block.label.as_str());
        let places: HashMap<&str, usize> = labels.zip(0..).collect();
        let mut jumps = Vec::new();
        for (from, block) in blocks.iter().enumerate() {
            for to in block.successors() {
                jumps.push((from, *places.get(to).context("a jump to no block")?));
            }
        }
        Ok(Self {
            blocks,
            order: order(blocks.len(), &jumps),
            places,
        })
    }

    fn block(&self, label: &str) -> Result<(usize, &'a Block)> {
        let place = self.places.get(label).context("a jump to no block")?;
        Ok((*place, self.at(*place)?))
    }

    fn at(&self, place: usize) -> Result<&'a Block> {
        self.blocks.get(place).context("no such block")
    }
}

impl<'p, 'm> FunctionWriter<'p, 'm> {
    /// Returns the head and the body of the function in C.
    pub(super) fn write(program: &'p mut Program<'m>, symbol: &'p str) -> Result<(String, String)> {
        let function = program.module.functions.get(symbol);
        let function = function.context("the function is not defined")?;
        let mut writer = Self::new(program, symbol);
        let head = writer.head(&function.header()?)?;
        let blocks = function.blocks()?;
        let graph = Graph::new(&blocks)?;
        for item in &graph.order.items {
            match *item {
                Item::Block(place) => {
                    writeln!(writer.text, "block{place}:;")?;
                    for statement in &graph.at(place)?.statements {
                        writer
                            .statement(&statement.tokens, place, &graph)
                            .with_context(|| statement.line.clone())?;
                    }
                }
                Item::Repeat(head) => writeln!(writer.text, "repeat{head}: goto block{head};")?,
            }
        }
        Ok((head, writer.declared + &writer.text))
    }

    /// Parses the parts of `define ATTRIBUTES TYPE @name(TYPE ATTRIBUTES %parameter, …)`. Returns
    /// the head in C.
    fn head(&mut self, header: &[Token]) -> Result<String> {
        let mut at = self.cursor(header);
        at.word("define")?;
        at.skip_attributes();
        let result = self.program.type_name(&at.of_type()?)?;
        let name = self.program.function_name(at.global()?);
        at.sign('(')?;
        let mut parameters = Vec::new();
        while !at.try_sign(')') {
            let parameter = self.operand(&mut at)?;
            let of = self.program.type_name(&parameter.of)?;
            parameters.push(format!("{of} {}", parameter.text));
            at.try_sign(',');
        }
        Ok(format!("static {result} {name}({})", parameters.join(", ")))
    }

    /// Parses `%to = phi TYPE [ VALUE, %label ], …`. Returns `None` for any other statement.
    fn read_phi<'a>(&mut self, tokens: &'a [Token]) -> Result<Option<Phi<'a>>>
    where
        'm: 'a,
    {
        let (to, rest) = match tokens {
            [Token::Local(to), _, word, rest @ ..] if word.is_word("phi") => (to, rest),
            _ => return Ok(None),
        };
        let mut at: Cursor<'a> = self.cursor(rest);
        let of = at.of_type()?;
        let mut incoming = Vec::new();
        while at.try_sign('[') {
            let value = self.value(&mut at, of.clone())?;
            at.sign(',')?;
            incoming.push((at.local()?, value));
            at.sign(']')?;
            at.try_sign(',');
        }
        Ok(Some(Phi { to, of, incoming }))
    }

    /// Assigns the value from the variable `…_next`, in which the jump to this block has stored it.
    pub(super) fn phi(&mut self, tokens: &[Token]) -> Result<()> {
        let phi = self.read_phi(tokens)?.context("this is not a phi")?;
        let name = self.declare(phi.to, &phi.of)?;
        let of = self.program.type_name(&phi.of)?;
        writeln!(self.declared, "  {of} {name}_next;")?;
        self.line(&format!("{name} = {name}_next;"))
    }

    /// Writes the terminator of a block: a return, a branch, a switch, or `unreachable`.
    pub(super) fn end(
        &mut self,
        at: &mut Cursor,
        operator: &str,
        from: usize,
        graph: &Graph,
    ) -> Result<()> {
        if operator == "unreachable" {
            return self.fails("code that the compiler considers unreachable");
        }
        if at.try_word("void") {
            return self.line("return;");
        }
        if at.rest.first().is_some_and(|word| word.is_word("label")) {
            let jump = self.jump(from, at.label()?, graph)?;
            return self.line(&jump);
        }
        let value = self.operand(at)?;
        if operator == "ret" {
            return self.line(&format!("return {};", value.text));
        }
        at.sign(',')?;
        let first = at.label()?;
        if operator == "br" {
            at.sign(',')?;
            return self.branch(&value.text, [first, at.label()?], from, graph);
        }
        at.sign('[')?;
        while !at.try_sign(']') {
            let case = self.operand(at)?.text;
            at.sign(',')?;
            let jump = self.jump(from, at.label()?, graph)?;
            self.line(&format!("if ({} == {case}) {{ {jump} }}", value.text))?;
        }
        let jump = self.jump(from, first, graph)?;
        self.line(&jump)
    }

    /// Writes a branch. A branch to a block that only panics becomes an assertion. Otherwise CBMC would follow an
    /// additional path for each branch that may panic.
    fn branch(
        &mut self,
        condition: &str,
        [yes, no]: [&str; 2],
        from: usize,
        graph: &Graph,
    ) -> Result<()> {
        for (not, panicking, other) in [("!", yes, no), ("", no, yes)] {
            if let Some(says) = self.panic_of(panicking, from, graph)? {
                let jump = self.jump(from, other, graph)?;
                return self.line(&format!(
                    "{{ _Bool holds = {not}{condition}; __CPROVER_assert(holds, \"{says}\"); \
                     __CPROVER_assume(holds); }} {jump}"
                ));
            }
        }
        let (yes, no) = (self.jump(from, yes, graph)?, self.jump(from, no, graph)?);
        self.line(&format!("if ({condition}) {{ {yes} }} else {{ {no} }}"))
    }

    /// If the block only panics, returns the message of this panic when the block is reached from `from`.
    fn panic_of(&mut self, label: &str, from: usize, graph: &Graph) -> Result<Option<String>> {
        let [before @ .., call, end] = graph.block(label)?.1.statements.as_slice() else {
            return Ok(None);
        };
        let panics = call.callee().is_some_and(|name| self.module().panics(name));
        if end.line != "unreachable" || !panics {
            return Ok(None);
        }
        // The call's arguments may depend on the block from which the jump came.
        let mut given = HashMap::new();
        for statement in before {
            let Some(phi) = self.read_phi(&statement.tokens)? else {
                return Ok(None);
            };
            given.insert(phi.to, phi.from(graph.at(from)?)?.token);
        }
        self.panic_message(&call.tokens, &given).map(Some)
    }

    /// Returns C code that jumps to the block `to`. Before the jump, the code stores the values of `to`'s phis for a
    /// jump from the block `from`.
    fn jump(&mut self, from: usize, to: &str, graph: &Graph) -> Result<String> {
        let (target, block) = graph.block(to)?;
        let mut text = String::new();
        for statement in &block.statements {
            let Some(phi) = self.read_phi(&statement.tokens)? else {
                break;
            };
            let value = &phi.from(graph.at(from)?)?.text;
            write!(text, "{}_next = {value}; ", self.name(phi.to))?;
        }
        let repeats = graph.order.repeats.contains(&(from, target));
        let kind = if repeats { "repeat" } else { "block" };
        write!(text, "goto {kind}{target};")?;
        Ok(text)
    }
}
