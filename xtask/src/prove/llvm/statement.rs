//! Reads the statements of a function from tokens.

use anyhow::{Context as _, Result, bail};

use super::cursor::Cursor;
use super::ir::{Call, End, Instruction, Type, Value};
use super::lexer::Token;
use super::parse::Statement;

/// Operators of two operands of one type.
const BINARY: [&str; 13] = [
    "add", "sub", "mul", "udiv", "sdiv", "urem", "srem", "shl", "lshr", "ashr", "and", "or", "xor",
];
const CASTS: [&str; 6] = ["zext", "sext", "trunc", "ptrtoint", "inttoptr", "bitcast"];

impl Cursor<'_> {
    /// One line of a function.
    pub(super) fn statement(&mut self) -> Result<Statement> {
        if let [Token::Local(name), Token::Sign('='), rest @ ..] = self.rest {
            self.rest = rest;
            return self.instruction(Some(name.clone()));
        }
        self.instruction(None)
    }

    #[expect(clippy::too_many_lines, reason = "an arm for each instruction")]
    fn instruction(&mut self, to: Option<String>) -> Result<Statement> {
        let Token::Word(operator) = self.next()? else {
            bail!("no instruction");
        };
        let operator = operator.as_str();
        if matches!(operator, "tail" | "musttail" | "notail") {
            return self.instruction(to);
        }
        if operator == "call" {
            return self.call(to);
        }
        let Some(to) = to else {
            return self.without_result(operator);
        };
        Ok(Statement::Instruction(match operator {
            _ if BINARY.contains(&operator) => {
                self.skip_attributes();
                let of = self.of_type()?;
                let left = self.value(&of)?;
                self.sign(',')?;
                let right = self.value(&of)?;
                let operator = operator.to_owned();
                Instruction::Binary {
                    to,
                    operator,
                    of,
                    left,
                    right,
                }
            }
            _ if CASTS.contains(&operator) => {
                self.skip_attributes();
                let (from, value) = self.typed_value()?;
                self.word("to")?;
                let into = self.of_type()?;
                let operator = operator.to_owned();
                Instruction::Cast {
                    to,
                    operator,
                    from,
                    value,
                    into,
                }
            }
            "freeze" => {
                let (from, value) = self.typed_value()?;
                let operator = operator.to_owned();
                Instruction::Cast {
                    to,
                    operator,
                    into: from.clone(),
                    from,
                    value,
                }
            }
            "icmp" => {
                if self.is_word("samesign") {
                    self.word("samesign")?;
                }
                let Token::Word(predicate) = self.next()? else {
                    bail!("no predicate");
                };
                let of = self.of_type()?;
                let left = self.value(&of)?;
                self.sign(',')?;
                let right = self.value(&of)?;
                let predicate = predicate.clone();
                Instruction::Compare {
                    to,
                    predicate,
                    of,
                    left,
                    right,
                }
            }
            "select" => {
                let (_, condition) = self.typed_value()?;
                self.sign(',')?;
                let (of, yes) = self.typed_value()?;
                self.sign(',')?;
                let (_, no) = self.typed_value()?;
                Instruction::Select {
                    to,
                    condition,
                    of,
                    yes,
                    no,
                }
            }
            "phi" => {
                let of = self.of_type()?;
                let mut incoming = Vec::new();
                while self.try_sign('[') {
                    let value = self.value(&of)?;
                    self.sign(',')?;
                    incoming.push((value, self.local()?));
                    self.sign(']')?;
                    if !self.try_sign(',') || !self.is_sign('[') {
                        break;
                    }
                }
                Instruction::Phi { to, of, incoming }
            }
            "load" => {
                self.skip_attributes();
                let of = self.of_type()?;
                self.sign(',')?;
                let (_, address) = self.typed_value()?;
                Instruction::Load { to, of, address }
            }
            "alloca" => {
                let of = self.of_type()?;
                Instruction::Allocate {
                    to,
                    bytes: of.size(),
                }
            }
            "getelementptr" => self.offset(to)?,
            "extractvalue" => {
                let (of, value) = self.typed_value()?;
                self.sign(',')?;
                let field = self.index()?;
                Instruction::Extract {
                    to,
                    of,
                    value,
                    field,
                }
            }
            "insertvalue" => {
                let (of, value) = self.typed_value()?;
                self.sign(',')?;
                let part = self.typed_value()?;
                self.sign(',')?;
                let field = self.index()?;
                Instruction::Insert {
                    to,
                    of,
                    value,
                    part,
                    field,
                }
            }
            other => bail!("the instruction {other} is not modelled"),
        }))
    }

    fn without_result(&mut self, operator: &str) -> Result<Statement> {
        Ok(Statement::End(match operator {
            "store" => {
                self.skip_attributes();
                let (of, value) = self.typed_value()?;
                self.sign(',')?;
                let (_, address) = self.typed_value()?;
                return Ok(Statement::Instruction(Instruction::Store {
                    of,
                    value,
                    address,
                }));
            }
            "ret" if self.is_word("void") => End::Return(None),
            "ret" => End::Return(Some(self.typed_value()?)),
            "br" if self.is_word("label") => End::Jump(self.label()?),
            "br" => {
                let (_, condition) = self.typed_value()?;
                self.sign(',')?;
                let yes = self.label()?;
                self.sign(',')?;
                let no = self.label()?;
                End::Branch { condition, yes, no }
            }
            "switch" => {
                let (of, value) = self.typed_value()?;
                self.sign(',')?;
                let otherwise = self.label()?;
                self.sign('[')?;
                let mut cases = Vec::new();
                while !self.try_sign(']') {
                    self.of_type()?;
                    let case = match self.value(&of)? {
                        Value::Integer(case) => case,
                        other => bail!("a case that is no number: {other:?}"),
                    };
                    self.sign(',')?;
                    cases.push((case, self.label()?));
                }
                End::Switch {
                    of,
                    value,
                    cases,
                    otherwise,
                }
            }
            "unreachable" => End::Unreachable,
            other => bail!("the instruction {other} is not modelled"),
        }))
    }

    /// `getelementptr inbounds nuw TYPE, ptr ADDRESS, i64 INDEX, …`
    fn offset(&mut self, to: String) -> Result<Instruction> {
        self.skip_attributes();
        let mut of = self.of_type()?;
        self.sign(',')?;
        let (_, address) = self.typed_value()?;
        let mut steps = Vec::new();
        while self.try_sign(',') {
            if !matches!(self.rest.first(), Some(Token::Word(_))) {
                break;
            }
            let (index_type, index) = self.typed_value()?;
            if steps.is_empty() {
                let size = of.size();
                steps.push((index_type, index, size));
                continue;
            }
            let place = match index {
                Value::Integer(place) => usize::try_from(place)?,
                _ if matches!(of, Type::Array(..)) => 0,
                other => bail!("a field that is no number: {other:?}"),
            };
            let part = of.part(place).context("no such part")?.clone();
            if matches!(of, Type::Array(..)) {
                steps.push((index_type, index, part.size()));
            } else {
                let offset = Value::Integer(i128::from(of.offset(place)));
                steps.push((index_type, offset, 1));
            }
            of = part;
        }
        Ok(Instruction::Offset { to, address, steps })
    }

    fn call(&mut self, to: Option<String>) -> Result<Statement> {
        self.skip_attributes();
        let result = self.of_type()?;
        let Token::Global(name) = self.next()? else {
            bail!("a call of no function by name is not modelled");
        };
        let function = self.reader.global(name.clone());
        self.sign('(')?;
        let says_nothing = ["llvm.lifetime.", "llvm.experimental.noalias.", "llvm.dbg."];
        if says_nothing.iter().any(|name| function.starts_with(name)) {
            return Ok(Statement::Nothing);
        }
        let arguments = self.typed_values()?;
        Ok(Statement::Instruction(Instruction::Call(Call {
            to,
            result,
            function,
            arguments,
        })))
    }
}
