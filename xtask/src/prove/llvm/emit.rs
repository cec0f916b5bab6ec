//! Writes a harness, and everything it reaches, as one C program.

use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::fmt::Write as _;

use anyhow::{Context as _, Result, bail};

use super::function::FunctionWriter;
use super::ir::{Function, Module, Type};

/// The assertion that must fail: a harness whose end is never reached proves nothing.
pub(crate) const END_OF_HARNESS: &str = "end of harness";

/// The C program that runs the harness named `name`.
pub(crate) fn program(module: &Module, name: &str) -> Result<String> {
    let mut writer = Writer {
        module,
        functions: HashMap::new(),
        pending: Vec::new(),
        constants: BTreeMap::new(),
        integers: BTreeSet::from([1, 8, 16, 32, 64, 128]),
        structures: Vec::new(),
    };
    let harness = writer.function_name(name);
    let mut bodies = String::new();
    let mut prototypes = String::new();
    while let Some(next) = writer.pending.pop() {
        let function = module.functions.get(&next).with_context(|| {
            let why = module
                .unreadable
                .get(&next)
                .map_or("it is not defined", String::as_str);
            format!("the function {next} cannot be modelled: {why}")
        })?;
        let head = writer.head(&next, function)?;
        writeln!(prototypes, "{head};")?;
        let body = FunctionWriter::new(&mut writer, function).body()?;
        writeln!(bodies, "/* {} */\n{head} {{\n{body}}}\n", plain(&next))?;
    }
    let declarations = writer.declarations()?;
    Ok(format!(
        "{declarations}{prototypes}\n{bodies}\
         int main(void) {{\n  {harness}();\n  __CPROVER_assert(0, \"{END_OF_HARNESS}\");\n}}\n"
    ))
}

/// Text for a C comment or string.
pub(super) fn plain(text: &str) -> String {
    text.replace("*/", "* /")
        .replace('\\', "\\\\")
        .replace('"', "'")
        .replace('\n', " ")
}

/// What the whole program needs.
pub(super) struct Writer<'a> {
    pub(super) module: &'a Module,
    functions: HashMap<String, String>,
    pending: Vec<String>,
    constants: BTreeMap<String, String>,
    integers: BTreeSet<u32>,
    structures: Vec<Type>,
}

impl Writer<'_> {
    /// What the defined function is called in C; it will be written.
    pub(super) fn function_name(&mut self, name: &str) -> String {
        if let Some(known) = self.functions.get(name) {
            return known.clone();
        }
        let new = format!("f{}", self.functions.len());
        self.functions.insert(name.to_owned(), new.clone());
        self.pending.push(name.to_owned());
        new
    }

    fn head(&mut self, name: &str, function: &Function) -> Result<String> {
        let mut parameters = Vec::new();
        for (place, (of, _)) in function.parameters.iter().enumerate() {
            parameters.push(format!("{} p{place}", self.type_name(of)?));
        }
        if parameters.is_empty() {
            parameters.push("void".to_owned());
        }
        let result = self.type_name(&function.result)?;
        let name = self.function_name(name);
        Ok(format!("static {result} {name}({})", parameters.join(", ")))
    }

    pub(super) fn type_name(&mut self, of: &Type) -> Result<String> {
        Ok(match of {
            Type::Void => "void".to_owned(),
            Type::Pointer => "pointer".to_owned(),
            Type::Integer(bits) => {
                self.integers.insert(*bits);
                format!("u{bits}")
            }
            Type::Structure(..) | Type::Array(..) => {
                let known = self.structures.iter().position(|other| other == of);
                let place = if let Some(place) = known {
                    place
                } else {
                    // Its parts' names first, for C wants them declared before.
                    for part in parts(of) {
                        self.type_name(part)?;
                    }
                    self.structures.push(of.clone());
                    self.structures.len() - 1
                };
                format!("t{place}")
            }
        })
    }

    pub(super) fn constant(&mut self, name: &str) -> Result<String> {
        if !self.module.constants.contains_key(name) {
            let why = self
                .module
                .unreadable
                .get(name)
                .map_or("it is not defined", String::as_str);
            bail!("the constant {name} cannot be modelled: {why}");
        }
        let new = format!("c{}", self.constants.len());
        Ok(self.constants.entry(name.to_owned()).or_insert(new).clone())
    }

    /// Types and constants, and for each type a function that gives any value of it.
    fn declarations(&mut self) -> Result<String> {
        let mut text =
            String::from("typedef unsigned char *pointer;\npointer nondet_pointer(void);\n");
        for bits in &self.integers {
            let (unsigned, signed) = match bits {
                8 => ("unsigned char".to_owned(), "signed char".to_owned()),
                16 => ("unsigned short".to_owned(), "short".to_owned()),
                32 => ("unsigned int".to_owned(), "int".to_owned()),
                64 => ("unsigned long long".to_owned(), "long long".to_owned()),
                128 => ("unsigned __int128".to_owned(), "__int128".to_owned()),
                _ => (
                    format!("unsigned __CPROVER_bitvector[{bits}]"),
                    format!("signed __CPROVER_bitvector[{bits}]"),
                ),
            };
            writeln!(
                text,
                "typedef {unsigned} u{bits}; typedef {signed} s{bits};"
            )?;
            writeln!(text, "u{bits} nondet_u{bits}(void);")?;
        }
        for (place, of) in self.structures.clone().iter().enumerate() {
            write!(text, "typedef struct {{")?;
            for (field, part) in parts(of).into_iter().enumerate() {
                write!(text, " {} f{field};", self.type_name(part)?)?;
            }
            writeln!(text, " }} t{place}; t{place} nondet_t{place}(void);")?;
        }
        for (name, written) in &self.constants {
            let bytes = &self.module.constants[name].bytes;
            let list: Vec<String> = bytes.iter().map(u8::to_string).collect();
            let length = bytes.len().max(1);
            let list = list.join(",");
            writeln!(text, "static const u8 {written}[{length}] = {{{list}}};")?;
        }
        Ok(text)
    }
}

/// The types of the parts of a structure or array.
fn parts(of: &Type) -> Vec<&Type> {
    match of {
        Type::Structure(fields, _) => fields.iter().collect(),
        Type::Array(length, of) => (0..*length).map(|_| &**of).collect(),
        _ => Vec::new(),
    }
}
