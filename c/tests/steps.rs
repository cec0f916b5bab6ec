//! Programs that turn bytes into text (`programs/steps.h`), on this computer or on the emulated
//! chip.

use std::fs;
use std::path::{Path, PathBuf};

use nrf52840_emulator::{Board, CYCLES_PER_SECOND, Image};
use tempfile::TempDir;

use crate::compiler::{C, compile, program, run};
use crate::receiving::assert_same;
use crate::{guide, layouts};

pub(crate) struct Program {
    /// The code that a page shows.
    pub(crate) page: Option<&'static str>,
    /// The rest of the program, in the tests' folder.
    pub(crate) source: &'static str,
    pub(crate) options: &'static [&'static str],
    pub(crate) steps: Vec<u8>,
    pub(crate) expected: String,
}

impl Program {
    /// Asserts that the program has the expected output on this computer.
    pub(crate) fn check_here(&self) {
        let folder = TempDir::new().unwrap();
        let sources = self.sources(folder.path(), "steps_here.c");
        let sources: Vec<&Path> = sources.iter().map(|path| &**path).collect();
        let compiler = [&C[..], self.options].concat();
        assert_same(&run(&compiler, &sources, &self.steps), &self.expected);
    }

    /// Asserts that the program has the expected output on the emulated chip.
    fn check_on_chip(&self, library: &Path) {
        let folder = TempDir::new().unwrap();
        let sources = self.sources(folder.path(), "steps_on_chip.c");
        let sources: Vec<&Path> = sources.iter().map(|path| &**path).collect();
        let script = program("chip.ld");
        let compiler = [&ARM[..], self.options].concat();
        let links = [
            "-nostdlib",
            "-Wl,--gc-sections,-znoexecstack",
            "-T",
            script.to_str().unwrap(),
        ];
        let file = folder.path().join("program.elf");
        let install = "on Debian: apt-get install gcc-arm-none-eabi";
        compile(&compiler, &sources, library, &links, &file, install);
        assert_same(
            &said_by_chip(&fs::read(file).unwrap(), &self.steps),
            &self.expected,
        );
    }

    fn sources(&self, folder: &Path, start: &str) -> Vec<PathBuf> {
        let mut sources = [self.source, "say.c", start].map(program).to_vec();
        if let Some(page) = self.page {
            sources.push(folder.join("page.c"));
            fs::write(folder.join("page.c"), page).unwrap();
        }
        sources
    }
}

/// Debian's compiler for a Cortex-M4 with `-mfloat-abi=hard`.
const ARM: [&str; 9] = [
    "arm-none-eabi-gcc",
    "-mcpu=cortex-m4",
    "-mfloat-abi=hard",
    "-mfpu=fpv4-sp-d16",
    "-ffreestanding",
    "-Os",
    "-std=c99",
    "-Wpedantic",
    "-Wconversion",
];

#[test]
#[ignore = "cargo xtask verify --only emulated has the library for the chip, and runs this"]
fn a_chip_does_what_this_computer_does() {
    let library = std::env::var_os("FRAMELOCK_C_ON_CHIP").expect("cargo xtask says where it is");
    let programs = guide::programs(200)
        .into_iter()
        .chain(layouts::programs(80));
    for program in programs {
        program.check_on_chip(library.as_ref());
    }
}

fn said_by_chip(elf: &[u8], steps: &[u8]) -> String {
    let image = Image::parse(elf).unwrap();
    let symbol = |name| image.symbol(name).unwrap().clone();
    let [begin, end] = ["begin", "end"].map(|name| symbol(name).address);
    let [given, length, said] = ["STEPS", "LENGTH", "SAID"].map(symbol);
    let count = u32::try_from(steps.len()).unwrap();
    assert!(count <= given.size, "{count} bytes of steps");
    let mut board = Board::new(image).unwrap();
    let limit = 60 * CYCLES_PER_SECOND;
    assert!(
        board.run(limit, |board| board.pc() == begin).unwrap(),
        "it begins"
    );
    board.patch(given.address, steps).unwrap();
    board.patch(length.address, &count.to_le_bytes()).unwrap();
    assert!(
        board.run(limit, |board| board.pc() == end).unwrap(),
        "it ends"
    );
    assert_eq!(board.word("IS_RECEIVING").unwrap(), 1);
    let count = board.word("SAID_LENGTH").unwrap();
    assert!(count <= said.size, "{count} bytes are said");
    let mut text = vec![0; usize::try_from(count).unwrap()];
    board.memory().read(said.address, &mut text).unwrap();
    String::from_utf8(text).unwrap()
}
