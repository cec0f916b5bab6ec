//! The functions, constants and types that modules of LLVM define, by name.

use std::collections::{BTreeMap, HashMap, HashSet};

use anyhow::{Context as _, Result, bail, ensure};

use super::parser::Cursor;
use super::token::{Token, tokens};

/// The definitions of all modules. Functions and constants are kept as text, and are parsed only if a harness reaches
/// them. So an unmodelled function is an error only if a harness reaches it.
#[derive(Debug, Default)]
pub(crate) struct Module {
    /// The tokens of each named type.
    pub(crate) types: HashMap<String, Vec<Token>>,
    pub(crate) functions: BTreeMap<String, Function>,
    constants: HashMap<String, String>,
    /// The number of modules added.
    modules: usize,
    /// Functions that are only declared and never return. All of them panic.
    never_return: HashSet<String>,
}

#[derive(Debug)]
pub(crate) struct Function {
    header: String,
    lines: Vec<String>,
}

/// A sequence of statements whose only jump is at its end.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) label: String,
    /// The statements. The last statement determines the next block.
    pub(crate) statements: Vec<Statement>,
}

#[derive(Debug)]
pub(crate) struct Statement {
    pub(crate) line: String,
    pub(crate) tokens: Vec<Token>,
}

/// Constant data: its bytes, and the positions at which an address replaces the bytes.
#[derive(Debug, Default, Clone)]
pub(crate) struct Constant {
    pub(crate) bytes: Vec<u8>,
    pub(crate) addresses: BTreeMap<usize, String>,
}

impl Module {
    /// Adds the definitions in this text.
    pub(crate) fn add(&mut self, text: &str) -> Result<()> {
        // The numbers of vtables begin anew in every module, so make the names unique.
        self.modules += 1;
        let text = &text.replace("@vtable.", &format!("@vtable.{}.", self.modules));
        let noreturn = noreturn_attributes(text);
        let mut lines = text.lines();
        while let Some(line) = lines.next() {
            if line.starts_with("define ") {
                let lines = lines.by_ref().take_while(|line| *line != "}");
                let function = Function {
                    header: line.to_owned(),
                    lines: lines.map(str::to_owned).collect(),
                };
                self.functions.insert(declared_name(line)?, function);
            } else if line.starts_with("declare ") {
                if line.split(' ').any(|word| noreturn.contains(word)) {
                    self.never_return.insert(declared_name(line)?);
                }
            } else if line.starts_with('%') {
                self.add_type(line)?;
            } else if line.starts_with('@') {
                let other = self.constants.insert(declared_name(line)?, line.to_owned());
                let same = other.is_none_or(|other| other == line);
                ensure!(
                    same,
                    "{line}: another module has a different constant of this name"
                );
            }
        }
        Ok(())
    }

    /// Adds the type in a line `%name = type …`.
    fn add_type(&mut self, line: &str) -> Result<()> {
        let tokens = tokens(line)?;
        let [Token::Local(name), _, _, of @ ..] = tokens.as_slice() else {
            bail!("{line}: this is not `%name = type …`");
        };
        let other = self.types.insert(name.clone(), of.to_vec());
        ensure!(
            other.is_none_or(|other| other == of),
            "{line}: another module has a different type of this name"
        );
        Ok(())
    }

    pub(crate) fn panics(&self, function: &str) -> bool {
        self.never_return.contains(function)
    }

    /// Returns the constant in a line `@name = ATTRIBUTES constant TYPE VALUE, align 1`, or `None`
    /// if no constant has this name.
    pub(crate) fn constant(&self, name: &str) -> Result<Option<Constant>> {
        let Some(line) = self.constants.get(name) else {
            return Ok(None);
        };
        let tokens = tokens(line)?;
        let keyword = tokens.iter().position(|token| token.is_word("constant"));
        let keyword = keyword.with_context(|| format!("{line}: only constants are modelled"))?;
        let mut at = Cursor::new(tokens.get(keyword + 1..).unwrap_or_default(), &self.types);
        let mut constant = Constant::default();
        let read = constant.append(&mut at);
        read.with_context(|| line.to_owned())?;
        Ok(Some(constant))
    }
}

impl Function {
    pub(crate) fn header(&self) -> Result<Vec<Token>> {
        tokens(&self.header)
    }

    /// Returns the blocks, beginning with the function's first block.
    pub(crate) fn blocks(&self) -> Result<Vec<Block>> {
        let mut blocks: Vec<Block> = Vec::new();
        for line in &self.lines {
            // These calls only inform the compiler, and CBMC does not need them.
            if line.contains("@llvm.lifetime.") || line.contains("@llvm.experimental.noalias.") {
                continue;
            }
            let tokens = tokens(line)?;
            let [first, ..] = tokens.as_slice() else {
                continue;
            };
            if !line.starts_with(' ') {
                blocks.push(Block {
                    label: label(first)?,
                    statements: Vec::new(),
                });
                continue;
            }
            let block = blocks.last_mut().context("a statement before any label")?;
            // Each case of a switch is on a line of its own.
            let goes_on = line.starts_with("    ") || *first == Token::Sign(']');
            match block.statements.last_mut() {
                Some(statement) if goes_on => statement.tokens.extend(tokens),
                _ => block.statements.push(Statement {
                    line: line.trim().to_owned(),
                    tokens,
                }),
            }
        }
        Ok(blocks)
    }

    /// Returns the functions and constants that this function names.
    pub(crate) fn names(&self) -> Result<HashSet<String>> {
        let mut names = HashSet::new();
        for line in &self.lines {
            names.extend(tokens(line)?.into_iter().filter_map(global));
        }
        Ok(names)
    }
}

impl Statement {
    /// Returns the function that this statement calls.
    pub(crate) fn callee(&self) -> Option<&str> {
        let call = self.tokens.iter().position(|token| token.is_word("call"))?;
        let mut behind = self.tokens.iter().skip(call);
        behind.find_map(|token| match token {
            Token::Global(name) => Some(name.as_str()),
            _ => None,
        })
    }
}

impl Block {
    /// Returns the blocks that may follow this block.
    pub(crate) fn successors(&self) -> impl Iterator<Item = &str> {
        let last = self.statements.last().map(|last| last.tokens.windows(2));
        last.into_iter().flatten().filter_map(|pair| match pair {
            [word, Token::Local(label)] if word.is_word("label") => Some(label.as_str()),
            _ => None,
        })
    }
}

impl Constant {
    /// Parses a type and a value of this type, and appends the value's bytes. rustc writes any padding explicitly.
    fn append(&mut self, at: &mut Cursor) -> Result<()> {
        let end = self.bytes.len() + usize::try_from(at.of_type()?.size())?;
        match at.next()? {
            Token::Global(name) => {
                self.addresses.insert(self.bytes.len(), name.clone());
            }
            Token::Bytes(bytes) => self.bytes.extend(bytes),
            Token::Word(word) if word == "inttoptr" => {
                at.sign('(')?;
                at.of_type()?;
                let Token::Number(address) = at.next()? else {
                    bail!("an address that is not a number is not modelled");
                };
                self.bytes.extend(u64::try_from(*address)?.to_le_bytes());
                at.word("to")?;
                at.of_type()?;
                at.sign(')')?;
            }
            Token::Word(zero) if ["null", "zeroinitializer", "undef"].contains(&zero.as_str()) => {}
            Token::Sign('<') => {
                at.sign('{')?;
                while !at.try_sign('}') {
                    self.append(at)?;
                    at.try_sign(',');
                }
            }
            other => bail!("the constant {other:?} is not modelled"),
        }
        self.bytes.resize(end, 0);
        Ok(())
    }
}

/// Returns the names, such as `#7`, from lines `attributes #7 = { … noreturn … }`.
fn noreturn_attributes(text: &str) -> HashSet<&str> {
    text.lines()
        .filter_map(|line| line.strip_prefix("attributes ")?.split_once(" = "))
        .filter(|(_, attributes)| attributes.split(' ').any(|word| word == "noreturn"))
        .map(|(name, _)| name)
        .collect()
}

fn declared_name(line: &str) -> Result<String> {
    let name = tokens(line)?.into_iter().find_map(global);
    name.with_context(|| format!("{line}: the line contains no name"))
}

fn global(token: Token) -> Option<String> {
    match token {
        Token::Global(name) => Some(name),
        _ => None,
    }
}

/// Returns the label's name, from the first token of its line. The name may be quoted.
fn label(token: &Token) -> Result<String> {
    Ok(match token {
        Token::Word(name) => name.clone(),
        Token::Number(number) => number.to_string(),
        Token::Bytes(name) => String::from_utf8(name.clone())?,
        other => bail!("{other:?} is not a label"),
    })
}
