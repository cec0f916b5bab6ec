//! Tests that inspect the images without running them: the firmware's images are small enough, and the image without
//! a log cannot panic.

use object::{Object, ObjectSection, SectionFlags, elf};

use crate::firmware::{image, image_file};

/// The most flash that each image may take, in bytes.
pub(crate) const MOST_FLASH: [(&str, u64); 6] = [
    ("default", 8 * 1024),
    ("megabaud", 8 * 1024),
    ("lecture", 8 * 1024),
    ("write-uicr", 8 * 1024),
    ("small", 5_632),
    ("bin-crc8", 8 * 1024),
];

/// Bytes by kind of section, as the program `size` counts them.
#[derive(Default)]
pub(crate) struct Sizes {
    /// Code and constants.
    pub(crate) text: u64,
    /// Variables with an initial value other than 0. Their initial values are also in flash.
    pub(crate) data: u64,
    /// Variables that begin as 0, and variables without an initial value.
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

    /// Returns the number of flashed bytes: code, constants, and the initial values of variables.
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

/// Every panic calls functions of `core::panicking`, and then the program's panic handler. The compiler never inlines
/// the functions of `core::panicking` completely. So an image without symbols of these functions and of the handler
/// cannot panic. The log's library can panic, so the test checks the image without a log. The receive handlers do not
/// use the log.
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
