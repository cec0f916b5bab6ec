//! Writes a harness and every function that it reaches as one C program for CBMC, statement by statement. A statement
//! that is not modelled is an error. Only statements that do not affect the result are left out.

mod calls;
mod function;
mod order;
mod statements;
mod writer;

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use anyhow::{Context as _, Result, bail};

use crate::c_file::{CFile, file_of};
use crate::harness::Harness;
use crate::llvm::{Constant, Module, Type};
use writer::FunctionWriter;

/// LLVM's integer operations in C.
const PRELUDE: &str = include_str!("llvm.h");
/// The assertion at the end of the harness. It must fail, because a harness whose end is never
/// reached proves nothing.
pub(crate) const END: &str = "end of harness";
/// The prefix of a cover's name. A cover's assertion must fail, too.
pub(crate) const COVER: &str = "cover: ";
/// The prefix of a note before input values. The note names the values' type and source position.
pub(crate) const INPUT: &str = "input: ";

/// Returns the C program that runs the harness. If the harness calls C functions, the program begins with the file that
/// contains them.
pub(crate) fn program(module: &Module, harness: &Harness, files: &[CFile]) -> Result<String> {
    let mut program = Program {
        module,
        functions: BTreeMap::new(),
        pending: Vec::new(),
        constants: BTreeMap::new(),
        integers: BTreeSet::from([1, 8, 16, 32, 64, 128]),
        structures: Vec::new(),
        calls_c: false,
    };
    let main = program.function_name(&harness.symbol);
    let mut prototypes = String::new();
    let mut bodies = String::new();
    while let Some(next) = program.pending.pop() {
        let name = readable(&next);
        let written = FunctionWriter::write(&mut program, &next);
        let (head, body) = written.with_context(|| format!("in {name}"))?;
        writeln!(prototypes, "{head};")?;
        writeln!(bodies, "/* {name} */\n{head} {{\n{body}}}\n")?;
    }
    let declarations = program.declarations()?;
    let c = if program.calls_c {
        file_of(harness, files)?.text(false)
    } else {
        ""
    };
    Ok(format!(
        "{c}{declarations}{prototypes}\n{bodies}\
         int main(void) {{\n  {main}();\n  __CPROVER_assert(0, \"{END}\");\n}}\n"
    ))
}

/// Returns a function's name as its author wrote it.
pub(crate) fn readable(symbol: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(symbol))
}

/// The state of the translation: the parts of the C program that the translated functions need. The maps contain the C
/// names of all functions and constants reached so far.
struct Program<'a> {
    module: &'a Module,
    functions: BTreeMap<String, String>,
    pending: Vec<String>,
    constants: BTreeMap<String, (String, Constant)>,
    integers: BTreeSet<u32>,
    structures: Vec<Type>,
    /// Whether the harness calls functions of C.
    calls_c: bool,
}

impl Program<'_> {
    /// Returns the function's C name, and ensures that the function will be written.
    fn function_name(&mut self, name: &str) -> String {
        if let Some(known) = self.functions.get(name) {
            return known.clone();
        }
        let new = format!("f{}", self.functions.len());
        self.functions.insert(name.to_owned(), new.clone());
        self.pending.push(name.to_owned());
        new
    }

    /// Returns the constant's C name, and ensures that the constant and all constants to which it points will be
    /// declared.
    fn constant_name(&mut self, name: &str) -> Result<String> {
        if let Some((known, _)) = self.constants.get(name) {
            return Ok(known.clone());
        }
        let constant = if self.module.functions.contains_key(name) {
            // The address of a function. Calls through function pointers are not modelled.
            Constant::default()
        } else {
            let constant = self.module.constant(name)?;
            constant.with_context(|| format!("no constant @{name}"))?
        };
        let new = format!("c{}", self.constants.len());
        let targets: Vec<String> = constant.addresses.values().cloned().collect();
        self.constants
            .insert(name.to_owned(), (new.clone(), constant));
        for target in targets {
            if self.constant_name(&target).is_err() {
                // This constant is not modelled, so it has an arbitrary value.
                let unknown = format!("c{}", self.constants.len());
                let unknown = (unknown, Constant::default());
                self.constants.insert(target, unknown);
            }
        }
        Ok(new)
    }

    fn type_name(&mut self, of: &Type) -> Result<String> {
        Ok(match of {
            Type::Void => "void".to_owned(),
            Type::Pointer => "pointer".to_owned(),
            Type::Integer(bits) => {
                self.integers.insert(*bits);
                format!("u{bits}")
            }
            Type::Structure { fields, .. } => {
                // Declare the fields first, because C requires declarations before use.
                for field in fields {
                    self.type_name(field)?;
                }
                let known = self.structures.iter().position(|other| other == of);
                let place = known.unwrap_or_else(|| {
                    self.structures.push(of.clone());
                    self.structures.len() - 1
                });
                format!("t{place}")
            }
            Type::Array(..) => bail!("an array as a value is not modelled"),
        })
    }

    /// Returns the declarations of types and constants. For each type there is also a function that returns an
    /// arbitrary value.
    fn declarations(&mut self) -> Result<String> {
        let mut structures = String::new();
        for (place, of) in self.structures.clone().iter().enumerate() {
            let Type::Structure { fields, .. } = of else {
                continue;
            };
            write!(structures, "typedef struct {{")?;
            for (place, field) in fields.iter().enumerate() {
                write!(structures, " {} f{place};", self.type_name(field)?)?;
            }
            writeln!(structures, " }} t{place}; t{place} nondet_t{place}(void);")?;
        }
        let mut text =
            format!("{PRELUDE}\ntypedef unsigned char *pointer; pointer nondet_pointer(void);\n");
        for bits in &self.integers {
            // Use C's own integer types where they exist, because CBMC handles arrays of `char` best.
            let of = match bits {
                8 => "char".to_owned(),
                16 => "short".to_owned(),
                32 => "int".to_owned(),
                64 => "long long".to_owned(),
                128 => "__int128".to_owned(),
                _ => format!("__CPROVER_bitvector[{bits}]"),
            };
            let wide = (*bits).max(32);
            writeln!(
                text,
                "typedef unsigned {of} u{bits}; typedef signed {of} s{bits}; \
                 u{bits} nondet_u{bits}(void);\n#define w{bits} u{wide}"
            )?;
        }
        text.push_str(&structures);
        let (mut declared, mut defined) = (String::new(), String::new());
        for (name, constant) in self.constants.values() {
            let Constant { bytes, addresses } = constant;
            if bytes.is_empty() {
                // CBMC must assume an arbitrary value for this constant.
                writeln!(declared, "extern const u8 {name}[1];")?;
            } else if addresses.is_empty() {
                let (list, length) = (list(bytes), bytes.len());
                writeln!(declared, "static const u8 {name}[{length}] = {{{list}}};")?;
            } else {
                let (fields, values) = self.parts(constant)?;
                writeln!(
                    declared,
                    "struct __attribute__((packed)) s{name} {{{fields} }}; static const struct s{name} {name};"
                )?;
                writeln!(
                    defined,
                    "static const struct s{name} {name} = {{{values} }};"
                )?;
            }
        }
        Ok(text + &declared + &defined)
    }

    /// Returns the fields of a C structure for this constant, and the values of these fields. The fields are bytes and
    /// addresses.
    fn parts(&self, constant: &Constant) -> Result<(String, String)> {
        let (mut fields, mut values) = (String::new(), String::new());
        let mut from = 0;
        let ends = constant.addresses.iter().map(|(at, to)| (*at, Some(to)));
        for (at, to) in ends.chain([(constant.bytes.len(), None)]) {
            let bytes = constant.bytes.get(from..at).unwrap_or_default();
            if !bytes.is_empty() {
                write!(fields, " u8 b{from}[{}];", bytes.len())?;
                write!(values, " {{{}}},", list(bytes))?;
            }
            if let Some(to) = to {
                let (name, _) = self.constants.get(to).context("an unknown address")?;
                write!(fields, " pointer p{at};")?;
                write!(values, " (pointer)&{name},")?;
                from = at + 8;
            }
        }
        Ok((fields, values))
    }
}

/// Returns bytes as an initialiser.
fn list(bytes: &[u8]) -> String {
    let list: Vec<String> = bytes.iter().map(u8::to_string).collect();
    list.join(",")
}
