use std::fmt;

use object::{Object, ObjectSection, SectionFlags, elf};

/// Bytes by section, summed up as the `size` program does.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Sizes {
    /// Code and constants.
    pub text: u64,
    /// Variables with an initial value other than 0: that value lies in flash too.
    pub data: u64,
    /// Variables that begin as 0, and those without a beginning.
    pub bss: u64,
}

impl Sizes {
    /// Of the ELF with these bytes.
    ///
    /// # Errors
    /// If it is none.
    pub fn of(elf: &[u8]) -> object::Result<Self> {
        let mut sizes = Self::default();
        for section in object::File::parse(elf)?.sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else {
                continue;
            };
            if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
                continue;
            }
            let writable = sh_flags & u64::from(elf::SHF_WRITE) != 0;
            let kind = match (writable, section.file_range()) {
                (false, _) => &mut sizes.text,
                (true, Some(_)) => &mut sizes.data,
                (true, None) => &mut sizes.bss,
            };
            *kind += section.size();
        }
        Ok(sizes)
    }

    /// What is flashed: code, constants, and the initial values of variables.
    #[must_use]
    pub fn flash(&self) -> u64 {
        self.text + self.data
    }
}

impl fmt::Display for Sizes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "text {} data {} bss {}, {} bytes of flash",
            self.text,
            self.data,
            self.bss,
            self.flash()
        )
    }
}
