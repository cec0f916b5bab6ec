//! What the interrupt handlers can call, read from the machine code.

use std::collections::{BTreeMap, HashMap};

use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

use crate::thumb::{Leads, decode};

/// What was found in the handlers, and in all that they call.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct HandlerCalls {
    /// How many functions these are, the handlers among them.
    pub functions: usize,
    /// A way from a handler to a panic, function by function, if there is one; or to a call whose
    /// target the code does not tell, behind which there may be one.
    pub to_panic: Option<Vec<String>>,
}

/// Follows all branches and calls from the handlers in the vector table, exceptions included, and
/// looks for the functions through which every panic goes: those of `core::panicking`, and the
/// program's own panic handler. They are never inlined all together, so where none is reached
/// nothing panics.
///
/// # Errors
/// If it is no ELF, or one without symbols or with a branch that leads to no function.
pub fn why_handlers_may_panic(elf: &[u8]) -> Result<HandlerCalls, String> {
    let program = Program::read(elf)?;
    // Each function that was reached, and the one that it was reached from.
    let mut from: HashMap<u32, Option<u32>> = HashMap::new();
    let mut to_do = Vec::new();
    for handler in program.handlers()? {
        if from.insert(handler, None).is_none() {
            to_do.push(handler);
        }
    }
    while let Some(function) = to_do.pop() {
        if program.is_panic(function) {
            let to_panic = Some(program.way(&from, function));
            return Ok(HandlerCalls {
                functions: from.len(),
                to_panic,
            });
        }
        for leads in program.leaves(function)? {
            let Some(next) = leads else {
                let mut way = program.way(&from, function);
                way.push("a call of an address that is computed".to_owned());
                let to_panic = Some(way);
                return Ok(HandlerCalls {
                    functions: from.len(),
                    to_panic,
                });
            };
            from.entry(next).or_insert_with(|| {
                to_do.push(next);
                Some(function)
            });
        }
    }
    Ok(HandlerCalls {
        functions: from.len(),
        to_panic: None,
    })
}

/// The code, and what is where.
struct Program {
    /// Code and vector table, by address.
    sections: BTreeMap<u32, Vec<u8>>,
    /// Functions by address: their names and sizes.
    functions: BTreeMap<u32, (String, u32)>,
    /// Where code begins (true) and where constants in between do (false).
    code: BTreeMap<u32, bool>,
    /// The two parts of the vector table that hold handlers: addresses and sizes.
    vectors: Vec<(u32, u32)>,
}

impl Program {
    fn read(elf: &[u8]) -> Result<Self, String> {
        let file = object::File::parse(elf).map_err(|error| error.to_string())?;
        let word = |value: u64| u32::try_from(value).map_err(|error| error.to_string());
        let mut program = Self {
            sections: BTreeMap::new(),
            functions: BTreeMap::new(),
            code: BTreeMap::new(),
            vectors: Vec::new(),
        };
        for section in file.sections() {
            if matches!(section.name(), Ok(".vector_table" | ".text")) {
                let bytes = section.data().map_err(|error| error.to_string())?;
                program
                    .sections
                    .insert(word(section.address())?, bytes.to_owned());
            }
        }
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            let (address, size) = (word(symbol.address())?, word(symbol.size())?);
            match name {
                "__EXCEPTIONS" | "__INTERRUPTS" => program.vectors.push((address, size)),
                _ if name.starts_with("$t") => _ = program.code.insert(address, true),
                _ if name.starts_with("$d") => _ = program.code.insert(address, false),
                _ if symbol.kind() == SymbolKind::Text && size > 0 => {
                    program
                        .functions
                        .insert(address & !1, (name.to_owned(), size));
                }
                _ => {}
            }
        }
        Ok(program)
    }

    /// The functions in the vector table, without the reset's.
    fn handlers(&self) -> Result<Vec<u32>, String> {
        if self.vectors.len() != 2 {
            return Err("the symbols __EXCEPTIONS and __INTERRUPTS are not there".to_owned());
        }
        let mut handlers = Vec::new();
        for &(address, size) in &self.vectors {
            for place in (address..address + size).step_by(4) {
                let low = self.halfword(place).zip(self.halfword(place + 2));
                let (low, high) = low.ok_or("the vector table is cut off")?;
                let entry = u32::from(high) << 16 | u32::from(low);
                if entry != 0 {
                    handlers.push(self.function_at(entry & !1)?);
                }
            }
        }
        Ok(handlers)
    }

    /// The functions that this one calls or goes on to; `None` for one that the code does not tell.
    fn leaves(&self, function: u32) -> Result<Vec<Option<u32>>, String> {
        let size = self.functions.get(&function).map_or(0, |(_, size)| *size);
        let inside = function..function + size;
        let mut found = Vec::new();
        let mut at = function;
        while at < inside.end {
            if self
                .code
                .range(..=at)
                .next_back()
                .is_some_and(|(_, code)| !code)
            {
                at += 2;
                continue;
            }
            let first = self.halfword(at).ok_or("a function is cut off")?;
            let (leads, length) = decode(at, first, self.halfword(at + 2).unwrap_or(0));
            match leads {
                Leads::To(target) if !inside.contains(&target) => {
                    found.push(Some(self.function_at(target)?));
                }
                Leads::Anywhere => found.push(None),
                Leads::To(_) | Leads::Nowhere => {}
            }
            at += length;
        }
        Ok(found)
    }

    fn halfword(&self, address: u32) -> Option<u16> {
        let (start, bytes) = self.sections.range(..=address).next_back()?;
        let bytes = bytes.get((address - start) as usize..)?.first_chunk()?;
        Some(u16::from_le_bytes(*bytes))
    }

    fn function_at(&self, address: u32) -> Result<u32, String> {
        let found = self.functions.range(..=address).next_back();
        found
            .filter(|(start, (_, size))| address - *start < *size)
            .map(|(start, _)| *start)
            .ok_or_else(|| format!("there is no function at {address:#010x}"))
    }

    /// By the name, mangled one way or the other.
    fn is_panic(&self, function: u32) -> bool {
        let name = self.functions.get(&function).map_or("", |(name, _)| name);
        name.contains("9panicking") || name.contains("rust_begin_unwind")
    }

    fn way(&self, from: &HashMap<u32, Option<u32>>, to: u32) -> Vec<String> {
        let mut way = Vec::new();
        let mut function = Some(to);
        while let Some(address) = function {
            let name = self.functions.get(&address).map(|(name, _)| name.clone());
            way.push(name.unwrap_or_default());
            function = from.get(&address).copied().flatten();
        }
        way.reverse();
        way
    }
}
