//! The firmware's ELF: what goes into flash, and the symbols.

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
}

impl Image {
    /// Reads an ELF for a 32-bit little-endian machine.
    ///
    /// # Errors
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
        let symbols = symbols.collect();
        Ok(Self { segments, symbols })
    }

    /// An image of machine code as it is, from address 0 on.
    #[must_use]
    pub fn of_code(code: Vec<u8>, symbols: Vec<Symbol>) -> Self {
        let segments = vec![(0, code)];
        Self { segments, symbols }
    }

    /// The symbol of that name: the whole name, or its end behind a `::`.
    ///
    /// # Errors
    /// If there is none, or more than one at different addresses.
    pub fn symbol(&self, name: &str) -> Result<&Symbol> {
        let tail = format!("::{name}");
        let whole = self.symbols.iter().filter(|symbol| symbol.name == name);
        let ends = self
            .symbols
            .iter()
            .filter(|symbol| symbol.name.ends_with(&tail));
        let mut found: Vec<&Symbol> = whole.collect();
        if found.is_empty() {
            found = ends.collect();
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
        let mut functions = self.symbols.iter().filter(|symbol| symbol.function);
        functions.find(|symbol| (symbol.address..symbol.address + symbol.size).contains(&address))
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
