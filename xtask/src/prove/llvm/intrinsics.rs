//! Calls: of the program's own functions, of LLVM's built-in ones, of the stand-in for Kani's
//! library, and of what panics.

use std::fmt::Write as _;

use anyhow::{Context as _, Result, bail};

use super::emit::plain;
use super::function::FunctionWriter;
use super::instruction::width;
use super::ir::{Call, Type, Value};
use super::panics;

/// What the bytes of an input are for stands in an output of this name before them.
pub(crate) const INPUT: &str = "input";

impl FunctionWriter<'_, '_> {
    pub(super) fn call(&mut self, call: &Call) -> Result<()> {
        let module = self.writer.module;
        let alias = module.aliases.get(&call.function);
        let function = alias.unwrap_or(&call.function);
        if module.functions.contains_key(function) || module.unreadable.contains_key(function) {
            let written = self.values(&call.arguments)?.join(", ");
            let name = self.writer.function_name(function);
            return match &call.to {
                Some(to) => {
                    let text = format!("  {} = {name}({written});", self.name(to)?);
                    self.line(&text)
                }
                None => self.line(&format!("  {name}({written});")),
            };
        }
        if let Some(built_in) = function.strip_prefix("llvm.") {
            return self.built_in(built_in, call);
        }
        if module.never_return.contains(function) {
            let said = plain(&panics::describe(module, self.function, call));
            return self.line(&format!(
                "  __CPROVER_assert(0, \"{said}\"); __CPROVER_assume(0);"
            ));
        }
        if function == "memcmp" || function == "bcmp" {
            return self.compare_bytes(call);
        }
        self.stand_in(call)
    }

    fn values(&mut self, arguments: &[(Type, Value)]) -> Result<Vec<String>> {
        let arguments = arguments.iter();
        arguments.map(|(of, value)| self.value(of, value)).collect()
    }

    /// The imports that `proofs/stand-in` lists.
    fn stand_in(&mut self, call: &Call) -> Result<()> {
        let values = self.values(&call.arguments)?;
        let function = call.function.as_str();
        if let Some(place) = function.strip_prefix("cover:") {
            let [condition] = values.as_slice() else {
                bail!("a cover has one condition");
            };
            return self.line(&format!(
                "  __CPROVER_assert(!{condition}, \"cover: {}\");",
                plain(place)
            ));
        }
        match (function, values.as_slice()) {
            ("assume", [condition]) => self.line(&format!("  __CPROVER_assume({condition});")),
            ("input", _) => {
                let what = self.input_place(&call.arguments).unwrap_or_default();
                self.line(&format!(
                    "  __CPROVER_output(\"{INPUT}: {}\", 0);",
                    plain(&what)
                ))
            }
            (any, []) if any.starts_with("any_") => {
                let of = self.writer.type_name(&call.result)?;
                let to = self.name(call.used()?)?;
                let text = format!("  {to} = nondet_{of}(); __CPROVER_input(\"{any}\", {to});");
                self.line(&text)
            }
            _ => bail!("the function {function} is neither defined nor modelled"),
        }
    }

    /// `type at file:line`
    fn input_place(&self, arguments: &[(Type, Value)]) -> Option<String> {
        let text = |place: usize| {
            let (Value::Global(name), Value::Integer(length)) =
                (&arguments.get(place)?.1, &arguments.get(place + 1)?.1)
            else {
                return None;
            };
            let bytes = &self.writer.module.constants.get(name)?.bytes;
            let bytes = bytes.get(..usize::try_from(*length).ok()?)?;
            Some(String::from_utf8_lossy(bytes))
        };
        let Value::Integer(line) = arguments.get(4)?.1 else {
            return None;
        };
        Some(format!("{} at {}:{line}", text(0)?, text(2)?))
    }

    /// `name` is the function's, without `llvm.`.
    fn built_in(&mut self, name: &str, call: &Call) -> Result<()> {
        let Call {
            result, arguments, ..
        } = call;
        let values = self.values(arguments)?;
        let base = name.split_once(".i").map_or(name, |(base, _)| base);
        let to = match (base, values.as_slice()) {
            ("assume", [condition, ..]) => {
                return self.line(&format!(
                    "  __CPROVER_assert({condition}, \"what the compiler assumes\");"
                ));
            }
            ("memcpy.p0.p0" | "memmove.p0.p0", [to, from, ..]) => {
                return self.copy_bytes(to, from, &arguments[2].1);
            }
            ("memset.p0", [to, byte, ..]) => return self.set_bytes(to, byte, &arguments[2].1),
            ("trap", _) => {
                return self.line("  __CPROVER_assert(0, \"trap\"); __CPROVER_assume(0);");
            }
            _ => call.used()?,
        };
        if base.ends_with(".with.overflow") {
            let [(of, _), _] = arguments.as_slice() else {
                bail!("two operands");
            };
            return self.with_overflow(to, result, base, width(of)?, &values);
        }
        let bits = width(result)?;
        let value = match (base, values.as_slice()) {
            ("umin", [a, b]) => format!("{a} < {b} ? {a} : {b}"),
            ("umax", [a, b]) => format!("{a} > {b} ? {a} : {b}"),
            ("smin", [a, b]) => format!("(s{bits}){a} < (s{bits}){b} ? {a} : {b}"),
            ("smax", [a, b]) => format!("(s{bits}){a} > (s{bits}){b} ? {a} : {b}"),
            ("abs", [a, _]) => format!("(s{bits}){a} < 0 ? -{a} : {a}"),
            ("usub.sat", [a, b]) => format!("{a} > {b} ? {a} - {b} : 0"),
            ("uadd.sat", [a, b]) => format!("(u{bits})({a} + {b}) < {a} ? (u{bits})-1 : {a} + {b}"),
            ("expect", [a, _]) => a.clone(),
            ("bswap", [a]) => swapped(a, bits),
            ("ctpop", [a]) => counted(bits, |bit| format!("((u32)({a} >> {bit}) & 1)")),
            // So many of the lowest, or highest, bits are 0 as there are places up to which all are.
            ("cttz", [a, _]) => counted(bits, |bit| format!("((u{bits})({a} << {bit}) == 0)")),
            ("ctlz", [a, _]) => counted(bits, |bit| format!("((u{bits})({a} >> {bit}) == 0)")),
            ("fshl", [a, b, by]) => {
                format!(
                    "{by} % {bits} == 0 ? {a} : {a} << {by} % {bits} | {b} >> {bits} - {by} % {bits}"
                )
            }
            ("fshr", [a, b, by]) => {
                format!(
                    "{by} % {bits} == 0 ? {b} : {a} << {bits} - {by} % {bits} | {b} >> {by} % {bits}"
                )
            }
            _ => bail!("LLVM's function {name} is not modelled"),
        };
        self.assign(to, result, &value)
    }

    fn with_overflow(
        &mut self,
        to: &str,
        result: &Type,
        operation: &str,
        bits: u32,
        values: &[String],
    ) -> Result<()> {
        let [left, right] = values else {
            bail!("two operands");
        };
        if bits > 64 {
            bail!("overflow of {bits} bits is not modelled");
        }
        let sign = if operation.starts_with('s') { 's' } else { 'u' };
        let operator = match operation.get(1..4) {
            Some("add") => '+',
            Some("sub") => '-',
            Some("mul") => '*',
            _ => bail!("{operation} is not modelled"),
        };
        self.writer.type_name(result)?;
        let wide = |value: &str| format!("({sign}128)({sign}{bits}){value}");
        let to = self.name(to)?;
        let text = format!(
            "  {{ {sign}128 exact = {} {operator} {}; {to}.f0 = (u{bits})exact; \
             {to}.f1 = (u1)(exact != ({sign}128)({sign}{bits})exact); }}",
            wide(left),
            wide(right)
        );
        self.line(&text)
    }

    /// All are read before any is written, so the places may overlap.
    fn copy_bytes(&mut self, to: &str, from: &str, length: &Value) -> Result<()> {
        let length = constant_length(length)?;
        let mut text = "  {".to_owned();
        for byte in 0..length {
            write!(text, " u8 m{byte} = ({from})[{byte}];")?;
        }
        for byte in 0..length {
            write!(text, " ({to})[{byte}] = m{byte};")?;
        }
        text.push_str(" }");
        self.line(&text)
    }

    fn set_bytes(&mut self, to: &str, value: &str, length: &Value) -> Result<()> {
        let mut text = "  {".to_owned();
        for byte in 0..constant_length(length)? {
            write!(text, " ({to})[{byte}] = {value};")?;
        }
        text.push_str(" }");
        self.line(&text)
    }

    /// Whether bytes differ, and in which order the first that do are.
    fn compare_bytes(&mut self, call: &Call) -> Result<()> {
        let [left, right, _] = self
            .values(&call.arguments)?
            .try_into()
            .ok()
            .context("three")?;
        let length = constant_length(&call.arguments[2].1)?;
        let mut text = "0".to_owned();
        for byte in (0..length).rev() {
            text = format!(
                "({left})[{byte}] != ({right})[{byte}] ? \
                 (({left})[{byte}] < ({right})[{byte}] ? -1 : 1) : ({text})"
            );
        }
        self.assign(call.used()?, &Type::Integer(32), &text)
    }
}

impl Call {
    /// The name of its result.
    fn used(&self) -> Result<&str> {
        self.to.as_deref().context("the value is not used")
    }
}

fn constant_length(length: &Value) -> Result<i128> {
    match length {
        Value::Integer(length) => Ok(*length),
        _ => bail!("a length that is not known in advance is not modelled"),
    }
}

/// The bytes of an integer in the opposite order.
fn swapped(value: &str, bits: u32) -> String {
    let bytes: Vec<String> = (0..bits / 8)
        .map(|byte| {
            format!(
                "(u{bits})(u8)({value} >> {}) << {}",
                8 * byte,
                bits - 8 - 8 * byte
            )
        })
        .collect();
    bytes.join(" | ")
}

/// For how many bits it is 1.
fn counted(bits: u32, one: impl Fn(u32) -> String) -> String {
    let ones: Vec<String> = (0..bits).map(one).collect();
    ones.join(" + ")
}
