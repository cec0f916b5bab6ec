//! What the images show without being run: their sizes, and that the one without a log has no way
//! to panic.

use object::{Object, ObjectSection, SectionFlags, elf};

use crate::firmware::{image, image_file};

/// What each image may take of the flash, in bytes.
pub(crate) const MOST_FLASH: [(&str, u64); 5] = [
    ("default", 8 * 1024),
    ("megabaud", 8 * 1024),
    ("lecture", 8 * 1024),
    ("small", 5_632),
    ("bin-crc8", 8 * 1024),
];

/// Bytes by section, summed up as the `size` program does.
#[derive(Default)]
pub(crate) struct Sizes {
    /// Code and constants.
    pub(crate) text: u64,
    /// Variables with an initial value other than 0: that value lies in flash too.
    pub(crate) data: u64,
    /// Variables that begin as 0, and those without a beginning.
    pub(crate) bss: u64,
}

impl Sizes {
    pub(crate) fn of(image: &str) -> Self {
        let elf = image_file(image);
        let mut sizes = Self::default();
        for section in object::File::parse(&*elf).unwrap().sections() {
            let SectionFlags::Elf { sh_flags } = section.flags() else {
                continue;
            };
            if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
                continue;
            }
            let is_writable = sh_flags & u64::from(elf::SHF_WRITE) != 0;
            let sum = match (is_writable, section.file_range()) {
                (false, _) => &mut sizes.text,
                (true, Some(_)) => &mut sizes.data,
                (true, None) => &mut sizes.bss,
            };
            *sum += section.size();
        }
        sizes
    }

    /// What is flashed: code, constants, and the initial values of variables.
    pub(crate) fn flash(&self) -> u64 {
        self.text + self.data
    }
}

#[test]
fn every_image_fits() {
    for (image, most) in MOST_FLASH {
        let flash = Sizes::of(image).flash();
        assert!(flash <= most, "{image}: {flash} bytes of flash, not {most}");
    }
}

/// Every panic goes through functions of `core::panicking`, which are never inlined all together, to
/// the program's own handler. An image with neither has no way to panic. The log's library can panic,
/// so this is asked of the image without a log; the receive handlers are the same in all of them.
#[test]
fn nothing_can_panic() {
    let image = image("small");
    let names: Vec<&str> = image.symbols().iter().map(|symbol| &*symbol.name).collect();
    assert!(names.contains(&"UARTE0_UART0"), "it has symbols");
    let panics = ["core::panicking", "rust_begin_unwind"];
    let found: Vec<_> = names
        .iter()
        .filter(|name| panics.iter().any(|panic| name.contains(panic)))
        .collect();
    assert!(found.is_empty(), "{found:#?}");
}
