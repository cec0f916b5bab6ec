//! Reads modules as `rustc --emit=llvm-ir` writes them: whole numbers and addresses, no
//! vectors, no floating point, no unwinding. Anything else is an error that quotes the line.

use std::collections::{HashMap, HashSet};

use anyhow::{Context as _, Error, Result, bail, ensure};

use super::cursor::Cursor;
use super::ir::{Block, Constant, End, Function, Instruction, Module, Type, Value};
use super::lexer::{Token, tokens};

impl Module {
    /// Adds what the text of a module defines. Constants that are private to it get names that no
    /// other module's have.
    pub(crate) fn add(&mut self, text: &str, module_name: &str) -> Result<()> {
        let mut reader = Reader {
            types: HashMap::new(),
            private: private_constants(text),
            module_name,
        };
        let noreturn = noreturn_attributes(text);
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            if line.starts_with("define ") {
                let body: Vec<&str> = lines.by_ref().take_while(|line| *line != "}").collect();
                match reader.function(line, &body) {
                    Ok((name, function)) => {
                        self.functions.insert(name, function);
                    }
                    Err(error) => self.unreadable(line, &error, module_name)?,
                }
            } else if line.starts_with("declare ") {
                if line.split(' ').any(|word| noreturn.contains(word)) {
                    self.never_return.insert(declared_name(line)?);
                }
            } else if line.starts_with('%') {
                let (name, of) = reader.named_type(line).with_context(|| line.to_owned())?;
                reader.types.insert(name, of);
            } else if line.starts_with('@') && line.contains(" alias ") {
                let mut names = tokens(line)?.into_iter().filter_map(Token::into_global);
                if let (Some(alias), Some(function)) = (names.next(), names.next()) {
                    self.aliases.insert(alias, function);
                }
            } else if line.starts_with('@') {
                match reader.constant(line) {
                    Ok((name, constant)) => {
                        self.constants.insert(name, constant);
                    }
                    Err(error) => self.unreadable(line, &error, module_name)?,
                }
            }
        }
        Ok(())
    }

    /// Notes why something cannot be read: an error as soon as a harness reaches it.
    fn unreadable(&mut self, line: &str, error: &Error, module_name: &str) -> Result<()> {
        let why = format!("{module_name}: {error:#}");
        self.unreadable.insert(declared_name(line)?, why);
        Ok(())
    }
}

/// `attributes #7 = { … noreturn … }`: the names, `#7`.
fn noreturn_attributes(text: &str) -> HashSet<&str> {
    text.lines()
        .filter_map(|line| line.strip_prefix("attributes ")?.split_once(" = "))
        .filter(|(_, attributes)| attributes.split(' ').any(|word| word == "noreturn"))
        .map(|(name, _)| name)
        .collect()
}

fn private_constants(text: &str) -> HashSet<String> {
    text.lines()
        .filter(|line| line.starts_with('@') && line.contains(" private "))
        .filter_map(|line| declared_name(line).ok())
        .collect()
}

fn declared_name(line: &str) -> Result<String> {
    tokens(line)?
        .into_iter()
        .find_map(Token::into_global)
        .context("nothing is named")
}

/// What the rest of a module is read with.
pub(super) struct Reader<'a> {
    pub(super) types: HashMap<String, Type>,
    private: HashSet<String>,
    module_name: &'a str,
}

impl Reader<'_> {
    /// The name of a constant or function, made unique if it is this module's own.
    pub(super) fn global(&self, name: String) -> String {
        if self.private.contains(&name) {
            format!("{} of {}", name, self.module_name)
        } else {
            name
        }
    }

    /// `%name = type { … }`
    fn named_type(&self, line: &str) -> Result<(String, Type)> {
        let tokens = tokens(line)?;
        let mut at = Cursor::new(&tokens, self);
        let name = at.local()?;
        at.sign('=')?;
        at.word("type")?;
        Ok((name, at.of_type()?))
    }

    /// `@name = private unnamed_addr constant TYPE VALUE, align 1`
    fn constant(&self, line: &str) -> Result<(String, Constant)> {
        let tokens = tokens(line)?;
        let mut at = Cursor::new(&tokens, self);
        let name = at.global()?;
        at.sign('=')?;
        at.skip_attributes();
        let of = at.of_type()?;
        let value = at.value(&of)?;
        let mut constant = Constant::default();
        lay_out(&of, &value, &mut constant)?;
        Ok((name, constant))
    }

    /// A definition: its header, and the lines up to the one that closes it.
    fn function(&self, header: &str, lines: &[&str]) -> Result<(String, Function)> {
        let tokens = tokens(header)?;
        let mut at = Cursor::new(&tokens, self);
        at.word("define")?;
        at.skip_attributes();
        let result = at.of_type()?;
        let name = at.global()?;
        at.sign('(')?;
        let mut parameters = Vec::new();
        while !at.try_sign(')') {
            let of = at.of_type()?;
            at.skip_attributes();
            parameters.push((of, at.local()?));
            at.try_sign(',');
        }
        let blocks = self.blocks(lines).with_context(|| name.clone())?;
        Ok((
            name,
            Function {
                result,
                parameters,
                blocks,
            },
        ))
    }

    fn blocks(&self, lines: &[&str]) -> Result<Vec<Block>> {
        let mut lines = lines.iter();
        let mut blocks = Vec::new();
        let mut label = None;
        let mut instructions = Vec::new();
        while let Some(line) = lines.next() {
            if line.trim().is_empty() || line.starts_with(';') {
                continue;
            }
            if !line.starts_with(' ') {
                label = Some(label_of(line)?);
                continue;
            }
            let mut statement = (*line).to_owned();
            if line.trim_start().starts_with("switch ") {
                while !statement.trim_end().ends_with(']') {
                    let more = lines.next().context("a switch without end")?;
                    statement.push('\n');
                    statement.push_str(more.split(", !").next().unwrap_or(more));
                }
            }
            let tokens = tokens(&statement).with_context(|| statement.clone())?;
            let mut at = Cursor::new(&tokens, self);
            match at.statement().with_context(|| statement.clone())? {
                Statement::Instruction(instruction) => instructions.push(instruction),
                Statement::End(end) => blocks.push(Block {
                    label: label.take().unwrap_or_else(|| "entry".to_owned()),
                    instructions: std::mem::take(&mut instructions),
                    end,
                }),
                Statement::Nothing => {}
            }
        }
        ensure!(instructions.is_empty(), "the last block has no end");
        Ok(blocks)
    }
}

/// One line of a function.
pub(super) enum Statement {
    Instruction(Instruction),
    End(End),
    /// It says something to the compiler only.
    Nothing,
}

/// `name:` or `"name":`, and a comment.
fn label_of(line: &str) -> Result<String> {
    if let Some(quoted) = line.strip_prefix('"') {
        let (name, _) = quoted.split_once("\":").context("no label")?;
        return Ok(name.to_owned());
    }
    let (name, _) = line.split_once(':').context("no label")?;
    Ok(name.to_owned())
}

/// Appends the bytes of a constant.
fn lay_out(of: &Type, value: &Value, constant: &mut Constant) -> Result<()> {
    let start = constant.bytes.len();
    match value {
        Value::Global(name) => {
            constant.addresses.insert(start, name.clone());
        }
        Value::Integer(number) => {
            let bytes = usize::try_from(of.size())?;
            constant
                .bytes
                .extend(number.to_le_bytes().iter().take(bytes));
        }
        Value::Bytes(bytes) => constant.bytes.extend(bytes),
        Value::Aggregate(parts) => {
            for (place, (part, value)) in parts.iter().enumerate() {
                let offset = usize::try_from(of.offset(place))?;
                constant.bytes.resize(start + offset, 0);
                lay_out(part, value, constant)?;
            }
        }
        Value::Zero | Value::Undefined | Value::Address(_) => {}
        Value::Local(_) | Value::Offset(..) => bail!("not a constant that is modelled"),
    }
    let end = start + usize::try_from(of.size())?;
    constant.bytes.resize(end, 0);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_is_laid_out_with_its_addresses() {
        let mut module = Module::default();
        let text = "@a = private constant [3 x i8] c\"ab\\0A\", align 1\n\
                    @b = constant { i8, i32, ptr } { i8 7, i32 258, ptr @a }, align 8\n";
        module.add(text, "m").expect("it is a module");
        assert_eq!(module.constants["a of m"].bytes, b"ab\n");
        let b = &module.constants["b"];
        assert_eq!(b.bytes, [7, 0, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(b.addresses[&8], "a of m");
    }

    #[test]
    fn what_is_not_modelled_is_an_error_where_it_is_reached() {
        let text = "define void @f(ptr %p) {\n  store float 1.0, ptr %p\n  ret void\n}\n";
        let mut module = Module::default();
        module.add(text, "m").expect("it is a module");
        assert!(module.unreadable["f"].contains("store float"), "{module:?}");
        let error = super::super::program(&module, "f").expect_err("it cannot be modelled");
        assert!(format!("{error:#}").contains("store float"), "{error:#}");
    }
}
