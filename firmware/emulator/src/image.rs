//! The firmware's ELF: what goes into flash, and the symbols.

use std::collections::{BTreeMap, HashMap};

use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};

use crate::error::{Error, Result};
use crate::memory::Memory;

/// A function or a variable.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// The name, demangled, without the hash.
    pub name: String,
    /// Where it begins; of a function without the Thumb bit.
    pub address: u32,
    /// Bytes.
    pub size: u32,
    /// Whether it is code.
    pub function: bool,
}

/// The image as read from an ELF, or from nothing.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// What to load, and where (physical addresses, as a flasher does).
    segments: Vec<(u32, Vec<u8>)>,
    symbols: Vec<Symbol>,
    by_name: HashMap<String, Vec<usize>>,
    functions: BTreeMap<u32, usize>,
}

impl Image {
    /// Reads an ELF for a 32-bit little-endian machine.
    ///
    /// # Errors
    ///
    /// If it is none.
    pub fn parse(elf: &[u8]) -> Result<Self> {
        let unreadable = |error: object::Error| Error::Image(error.to_string());
        let file = ElfFile32::<Endianness>::parse(elf).map_err(unreadable)?;
        let endian = file.endian();
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(endian) == PT_LOAD && header.p_filesz(endian) > 0 {
                let bytes = header.data(endian, elf);
                let bytes = bytes.map_err(|()| Error::Image("a segment is cut off".to_owned()))?;
                segments.push((header.p_paddr(endian), bytes.to_owned()));
            }
        }
        let symbols = file.symbols().filter_map(|symbol| {
            let name = symbol.name().ok().filter(|name| !name.is_empty())?;
            // Mapping symbols ($t, $d) and files are no one's names.
            if name.starts_with('$') || symbol.kind() == SymbolKind::File {
                return None;
            }
            let function = symbol.kind() == SymbolKind::Text;
            let address = u32::try_from(symbol.address()).ok()?;
            Some(Symbol {
                name: format!("{:#}", rustc_demangle::demangle(name)),
                address: if function { address & !1 } else { address },
                size: u32::try_from(symbol.size()).unwrap_or(0),
                function,
            })
        });
        Ok(Self::new(segments, symbols.collect()))
    }

    /// An image of machine code as it is, from address 0 on.
    #[must_use]
    pub fn of_code(code: Vec<u8>, symbols: Vec<Symbol>) -> Self {
        Self::new(vec![(0, code)], symbols)
    }

    fn new(segments: Vec<(u32, Vec<u8>)>, symbols: Vec<Symbol>) -> Self {
        let mut by_name: HashMap<String, Vec<usize>> = HashMap::new();
        let mut functions = BTreeMap::new();
        for (n, symbol) in symbols.iter().enumerate() {
            by_name.entry(symbol.name.clone()).or_default().push(n);
            if symbol.function {
                functions.insert(symbol.address, n);
            }
        }
        Self {
            segments,
            symbols,
            by_name,
            functions,
        }
    }

    /// The symbol of that name: the whole name, or its end behind a `::`.
    ///
    /// # Errors
    ///
    /// If there is none, or more than one at different addresses.
    pub fn symbol(&self, name: &str) -> Result<&Symbol> {
        let whole = self.by_name.get(name).into_iter().flatten();
        let mut found: Vec<&Symbol> = whole.filter_map(|n| self.symbols.get(*n)).collect();
        if found.is_empty() {
            let tail = format!("::{name}");
            found = self
                .symbols
                .iter()
                .filter(|s| s.name.ends_with(&tail))
                .collect();
        }
        found.dedup_by_key(|symbol| symbol.address);
        match found.as_slice() {
            [symbol] => Ok(symbol),
            _ => Err(Error::Symbol {
                name: name.to_owned(),
                found: found.len(),
            }),
        }
    }

    /// All symbols.
    #[must_use]
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// The function that an address lies in.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<&Symbol> {
        let (_, n) = self.functions.range(..=address).next_back()?;
        let symbol = self.symbols.get(*n)?;
        (address - symbol.address < symbol.size.max(1)).then_some(symbol)
    }

    /// For messages: ", in NAME", or nothing.
    pub(crate) fn in_function(&self, address: u32) -> String {
        let function = self.function_at(address);
        function.map_or_else(String::new, |function| format!(", in {}", function.name))
    }

    /// Writes it to flash.
    pub(crate) fn load(&self, memory: &Memory) -> Result<()> {
        for (address, bytes) in &self.segments {
            let outside = || Error::Image(format!("a segment at {address:#010x} is outside flash"));
            memory.write(*address, bytes).ok_or_else(outside)?;
        }
        Ok(())
    }
}
