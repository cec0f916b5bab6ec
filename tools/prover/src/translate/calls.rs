//! Translates calls of functions: the program's own functions, LLVM's intrinsics, the functions of the stand-in for
//! Kani's library, functions in C, and functions that panic.

use std::collections::HashMap;
use std::fmt::Write as _;

use anyhow::{Result, bail, ensure};

use super::statements::operation;
use super::writer::{FunctionWriter, Operand};
use super::{COVER, END, INPUT, readable};
use crate::llvm::{Cursor, Module, Token, Type};

/// The prefix of functions that are written in C.
const FOREIGN: &str = "c_";

struct Call<'a> {
    result: Type,
    function: &'a str,
    arguments: Vec<Operand<'a>>,
}

impl FunctionWriter<'_, '_> {
    /// Parses `ATTRIBUTES TYPE @function(TYPE ATTRIBUTES VALUE, …)`.
    fn read_call<'a>(&mut self, at: &mut Cursor<'a>) -> Result<Call<'a>> {
        at.skip_attributes();
        let result = at.of_type()?;
        let function = at.global()?;
        at.sign('(')?;
        let mut arguments = Vec::new();
        while !at.try_sign(')') {
            arguments.push(self.operand(at)?);
            at.try_sign(',');
        }
        Ok(Call {
            result,
            function,
            arguments,
        })
    }

    pub(super) fn call(&mut self, at: &mut Cursor, to: &str) -> Result<()> {
        let call = self.read_call(at)?;
        if let Some(name) = call.function.strip_prefix("llvm.") {
            return self.built_in(name, &call, to);
        }
        if self.module().functions.contains_key(call.function) {
            let name = self.program.function_name(call.function);
            let value = format!("{name}({})", call.values().join(", "));
            return match call.result {
                Type::Void => self.line(&format!("{value};")),
                _ => self.assign(to, &call.result, &value),
            };
        }
        if self.module().panics(call.function) {
            let says = message(&call, &HashMap::new(), self.module());
            return self.fails(&says);
        }
        self.stand_in(&call, to)
    }

    /// Returns the message of a call that panics. `given` contains the known values of the call's arguments.
    pub(super) fn panic_message(
        &mut self,
        statement: &[Token],
        given: &HashMap<&str, &Token>,
    ) -> Result<String> {
        let mut at = self.cursor(statement);
        while !at.next()?.is_word("call") {}
        let call = self.read_call(&mut at)?;
        Ok(message(&call, given, self.module()))
    }

    /// Writes a call of a function that the stand-in declares, or of a C function: `memcmp`, `bcmp` or `c_…`.
    fn stand_in(&mut self, call: &Call, to: &str) -> Result<()> {
        match (call.function, call.arguments.as_slice()) {
            ("input", _) => {
                let what = message(call, &HashMap::new(), self.module());
                self.line(&format!("__CPROVER_output(\"{INPUT}{what}\", 0);"))
            }
            ("assume", [condition]) => self.line(&format!("__CPROVER_assume({});", condition.text)),
            ("cover", [condition]) => {
                // Each cover has a function of its own, which calls `cover` and whose name identifies the cover.
                let (hit, place) = (&condition.text, readable(self.symbol));
                self.line(&format!("__CPROVER_assert(!{hit}, \"{COVER}{place}\");"))
            }
            (any, []) if any.starts_with("any_") => {
                let value = format!("nondet_{}()", self.program.type_name(&call.result)?);
                self.assign(to, &call.result, &value)?;
                let to = self.name(to);
                self.line(&format!("__CPROVER_input(\"{any}\", {to});"))
            }
            ("memcmp" | "bcmp", [left, right, length]) => {
                // The first index at which the regions differ decides whether the result is -1 or 1. If the regions are
                // equal, the result is 0.
                let mut text = "0".to_owned();
                for byte in (0..length.number()?).rev() {
                    let left = format!("({})[{byte}]", left.text);
                    let right = format!("({})[{byte}]", right.text);
                    text = format!("{left} != {right} ? ({left} < {right} ? -1 : 1) : ({text})");
                }
                self.assign(to, &call.result, &text)
            }
            (name, _) if name.starts_with(FOREIGN) => {
                self.program.calls_c = true;
                let value = format!("{name}({})", call.values().join(", "));
                match call.result {
                    Type::Void => self.line(&format!("{value};")),
                    _ => self.assign(to, &call.result, &value),
                }
            }
            (other, _) => bail!("{} is not modelled", readable(other)),
        }
    }

    /// Writes a call of one of LLVM's functions. `name` is the function's name without `llvm.`.
    fn built_in(&mut self, name: &str, call: &Call, to: &str) -> Result<()> {
        match (name, call.arguments.as_slice()) {
            ("assume", [condition, ..]) => self.line(&format!(
                "__CPROVER_assert({}, \"an assumption of the compiler\");",
                condition.text
            )),
            ("memcpy.p0.p0.i64" | "memmove.p0.p0.i64", [to, from, length, _]) => {
                let Ok(length) = length.number() else {
                    // If the length is not a constant, copy byte by byte in a loop. This is correct only if the regions
                    // do not overlap, as `memcpy` guarantees. The harness's bound on loops limits this loop, too.
                    ensure!(
                        name.starts_with("memcpy"),
                        "memmove: the length is not known"
                    );
                    let (to, from, length) = (&to.text, &from.text, &length.text);
                    return self.line(&format!(
                        "for (u64 i = 0; i < {length}; i++) ({to})[i] = ({from})[i];"
                    ));
                };
                // Read all bytes before writing any, because the memory regions may overlap.
                let (mut read, mut write) = (String::new(), String::new());
                for byte in 0..length {
                    write!(read, " u8 m{byte} = ({})[{byte}];", from.text)?;
                    write!(write, " ({})[{byte}] = m{byte};", to.text)?;
                }
                self.line(&format!("{{{read}{write} }}"))
            }
            ("memset.p0.i64", [to, value, length, _]) => {
                for byte in 0..length.number()? {
                    self.line(&format!("({})[{byte}] = {};", to.text, value.text))?;
                }
                Ok(())
            }
            (name, [first, ..]) => {
                // The last part of the intrinsic's name is the type.
                let name = name.rsplit_once('.').map_or(name, |(name, _)| name);
                let bits = first.of.bits()?;
                let operation = operation(name)?;
                let mut value = format!("{operation}({bits}, {})", call.values().join(", "));
                if name.ends_with(".with.overflow") {
                    ensure!(bits <= 64, "overflow of {bits} bits is not modelled");
                    value = format!("({}){value}", self.program.type_name(&call.result)?);
                }
                self.assign(to, &call.result, &value)
            }
            _ => bail!("LLVM's function {name} is not modelled"),
        }
    }
}

impl Call<'_> {
    fn values(&self) -> Vec<String> {
        let arguments = self.arguments.iter();
        arguments.map(|argument| argument.text.clone()).collect()
    }
}

/// Returns a message for a call that panics, or for a call of `input`, escaped for a C string. The message begins with
/// the call's text argument (an address and a length), or with the name of the called function if there is no text. If
/// the arguments contain a source position, the message ends with this position.
fn message(call: &Call, given: &HashMap<&str, &Token>, module: &Module) -> String {
    let mut says = readable(call.function);
    let mut place = String::new();
    let token = |operand: &Operand| match operand.token {
        Token::Local(name) => given.get(name.as_str()).copied().cloned(),
        token => Some(token.clone()),
    };
    for (argument, value) in call.arguments.iter().enumerate() {
        let Some(Token::Global(name)) = token(value) else {
            continue;
        };
        if let Some(found) = location(module, &name) {
            place = format!(" at {found}");
        } else if let Some(next) = call.arguments.get(argument + 1)
            && let Some(Token::Number(number)) = token(next)
            && let Some(length) = text_length(&next.of, number)
            && let Some(found) = text(module, &name, length)
        {
            says = found;
        }
    }
    // The harness's goals are recognised by their beginning, so no other message may begin like a goal.
    if [COVER, END].iter().any(|goal| says.starts_with(goal)) {
        says.insert_str(0, "text: ");
    }
    format!("{says}{place}").replace(['"', '\\', '\n'], "'")
}

/// Returns the length of a text from the argument after its address. In `fmt::Arguments` without arguments, this
/// argument is a pointer with the value `2 * length + 1`.
fn text_length(of: &Type, number: i128) -> Option<i128> {
    match of {
        Type::Pointer => (number > 1 && number % 2 == 1).then_some(number / 2),
        _ => Some(number),
    }
}

/// Returns the first bytes of a constant as text.
fn text(module: &Module, name: &str, length: i128) -> Option<String> {
    let bytes = module.constant(name).ok()??.bytes;
    let text = bytes.get(..usize::try_from(length).ok()?)?;
    String::from_utf8(text.to_vec()).ok()
}

/// Reads a `core::panic::Location`: the address and length of the file's name, the line and the
/// column.
fn location(module: &Module, name: &str) -> Option<String> {
    let constant = module.constant(name).ok()??;
    if constant.bytes.len() != 24 {
        return None;
    }
    let number = |at: usize| {
        let bytes = constant.bytes.get(at..)?.first_chunk()?;
        Some(u32::from_le_bytes(*bytes))
    };
    let file = constant.addresses.get(&0)?;
    let file = text(module, file, number(8)?.into())?;
    Some(format!("{file}:{}:{}", number(16)?, number(20)?))
}
