//! The firmware's ELF: the contents of flash, and the symbols.

use object::elf::PT_LOAD;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};

use crate::memory::Memory;
use crate::{Error, Result};

/// A function, a variable or a label.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// The name, demangled, without the hash.
    pub name: String,
    /// The first address; for a function, without the Thumb bit.
    pub address: u32,
    /// The size in bytes.
    pub size: u32,
    /// Whether the symbol is a function.
    pub function: bool,
}

/// A firmware image, read from an ELF or created from machine code.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// The bytes to load, and their physical addresses, as for a flash programmer.
    segments: Vec<(u32, Vec<u8>)>,
    symbols: Vec<Symbol>,
    /// The ELF, which contains the log's texts.
    pub(crate) elf: Vec<u8>,
}

impl Image {
    /// Reads an ELF for a 32-bit machine.
    ///
    /// # Errors
    /// Returns an error if the bytes are not such an ELF.
    pub fn parse(elf: &[u8]) -> Result<Self> {
        let unreadable = |error: object::Error| Error(error.to_string());
        let file = ElfFile32::<Endianness>::parse(elf).map_err(unreadable)?;
        let endian = file.endian();
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            if header.p_type(endian) == PT_LOAD && header.p_filesz(endian) > 0 {
                let bytes = header.data(endian, elf);
                let bytes = bytes.map_err(|()| Error("a segment is cut off".to_owned()))?;
                segments.push((header.p_paddr(endian), bytes.to_owned()));
            }
        }
        let symbols = file.symbols().filter_map(|symbol| {
            let name = symbol.name().ok().filter(|name| !name.is_empty())?;
            // Mapping symbols ($t, $d) and files do not name functions or variables.
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
        Ok(Self {
            segments,
            symbols: symbols.collect(),
            elf: elf.to_owned(),
        })
    }

    /// Creates an image from machine code that begins at address 0.
    #[must_use]
    pub fn of_code(code: Vec<u8>, symbols: Vec<Symbol>) -> Self {
        Self {
            segments: vec![(0, code)],
            symbols,
            elf: Vec::new(),
        }
    }

    /// Returns the symbol whose entire name is `name`. If there is none, returns the symbol whose name ends with `name`
    /// after a `::`.
    ///
    /// # Errors
    /// Returns an error if there is no such symbol, or if there are several at different addresses.
    pub fn symbol(&self, name: &str) -> Result<&Symbol> {
        let tail = format!("::{name}");
        let all = self.symbols.iter();
        let mut found: Vec<&Symbol> = all
            .filter(|symbol| symbol.name == name || symbol.name.ends_with(&tail))
            .collect();
        if found.iter().any(|symbol| symbol.name == name) {
            found.retain(|symbol| symbol.name == name);
        }
        found.dedup_by_key(|symbol| symbol.address);
        let count = found.len();
        let missing = || {
            Error(format!(
                "the image has {count} symbols named `{name}`, not one"
            ))
        };
        found.pop().filter(|_| count == 1).ok_or_else(missing)
    }

    /// Returns all symbols.
    #[must_use]
    pub fn symbols(&self) -> &[Symbol] {
        &self.symbols
    }

    /// Returns the function that contains an address.
    #[must_use]
    pub fn function_at(&self, address: u32) -> Option<&Symbol> {
        let mut functions = self.symbols.iter().filter(|symbol| symbol.function);
        functions.find(|symbol| (symbol.address..symbol.address + symbol.size).contains(&address))
    }

    /// Writes the segments to memory, each at its address.
    pub(crate) fn load(&self, memory: &Memory) -> Result<()> {
        for (address, bytes) in &self.segments {
            let outside = || Error(format!("a segment at {address:#010x} is outside flash"));
            memory.write(*address, bytes).ok_or_else(outside)?;
        }
        Ok(())
    }
}
