//! Measures the receivers on the emulated Cortex-M4: how much each receiver adds to the size of a program, and how many
//! cycles the receiver takes for a byte.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

use nrf52840_emulator::{Board, CYCLES_PER_SECOND, Image};
use object::{Object, ObjectSection};

/// Symbols of panics. Every panic calls a function of `core::panicking`, which calls the program's handler.
const PANICS: [&str; 2] = ["core::panicking", "rust_begin_unwind"];

/// Symbols whose size is not counted: functions that almost every program contains.
const COMMON: [&str; 3] = ["memcpy", "memclr", "memset"];

/// The number of bytes in the instruction that calls a function.
const CALL: u32 = 4;

/// The program of `on-chip` with one contender, and its sizes.
pub(crate) struct Program {
    features: String,
    elf: Vec<u8>,
    text: u64,
    rodata: u64,
    pub(crate) can_panic: bool,
}

/// Instructions and cycles.
#[derive(Clone, Copy, Default)]
pub(crate) struct Cost {
    pub(crate) instructions: u64,
    pub(crate) cycles: u64,
}

impl Cost {
    fn since(board: &Board, earlier: Self) -> Self {
        Self {
            instructions: board.instructions() - earlier.instructions,
            cycles: board.now() - earlier.cycles,
        }
    }
}

/// The result of running a program on a stream.
pub(crate) struct Run {
    pub(crate) state: u32,
    pub(crate) frames: u32,
    /// The cost of all bytes except the skipped bytes. Each byte is passed in a call of its own. The byte's cost is
    /// counted from the first instruction of the called function to the return.
    pub(crate) all: Cost,
    /// The number of cycles that the most expensive byte takes.
    pub(crate) costliest: u64,
}

impl Program {
    /// Builds the program with these features.
    pub(crate) fn build(features: &str) -> Result<Self, Box<dyn Error>> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("on-chip");
        let status = Command::new(env!("CARGO"))
            .args(["build", "--quiet", "--release", "--locked", "--features"])
            .arg(features)
            .current_dir(&folder)
            // If these variables are set, they are meant for the benchmark. The program is built for another target.
            .env_remove("RUSTFLAGS")
            .env_remove("CARGO_TARGET_DIR")
            .status()?;
        if !status.success() {
            return Err(format!("{features}: the program does not build: see above").into());
        }
        let release = folder.join("target/thumbv7em-none-eabihf/release");
        let elf = fs::read(release.join("framelock-rivals-on-chip"))?;
        let file = object::File::parse(&*elf)?;
        let section = |name| file.section_by_name(name).map_or(0, |found| found.size());
        let image = Image::parse(&elf)?;
        let can_panic = image
            .symbols()
            .iter()
            .any(|symbol| PANICS.iter().any(|name| symbol.name.contains(name)));
        let common: BTreeMap<u32, u32> = image
            .symbols()
            .iter()
            .filter(|symbol| COMMON.iter().any(|name| symbol.name.contains(name)))
            .map(|symbol| (symbol.address, symbol.size))
            .collect();
        Ok(Self {
            features: features.to_owned(),
            text: section(".text") - u64::from(common.values().sum::<u32>()),
            rodata: section(".rodata"),
            can_panic,
            elf,
        })
    }

    /// Returns the sizes of this program's code and constants, minus the sizes of the other program's code and
    /// constants.
    pub(crate) fn more_than(&self, nothing: &Self) -> [u64; 2] {
        [
            self.text - nothing.text,
            self.rodata.saturating_sub(nothing.rodata),
        ]
    }

    /// Runs the program on a stream. Does not count the cost of the first `skip` bytes.
    pub(crate) fn take(&self, stream: &[u8], skip: usize) -> Result<Run, Box<dyn Error>> {
        let image = Image::parse(&self.elf)?;
        let mut symbols = image.symbols().iter().filter(|symbol| {
            symbol.name.contains("rivals_on_chip::Receiver") && symbol.name.ends_with("::take")
        });
        let function = symbols.next().ok_or("no function takes a byte")?.address;
        let address = |name| image.symbol(name).map(|symbol| symbol.address);
        let [begin, end, bytes] = [address("begin")?, address("end")?, address("STREAM")?];
        let [length, room] = [address("LENGTH")?, image.symbol("STREAM")?.size];
        let count = u32::try_from(stream.len())?;
        if count > room {
            return Err(format!("{}: a stream of {count} bytes", self.features).into());
        }

        let mut board = Board::new(image)?;
        let limit = 10 * CYCLES_PER_SECOND;
        if !board.run(limit, |board| board.pc() == begin)? {
            return Err(format!("{}: the program does not reach `begin`", self.features).into());
        }
        board.patch(bytes, stream)?;
        board.patch(length, &count.to_le_bytes())?;
        let (mut all, mut costliest, mut bytes_taken) = (Cost::default(), 0, 0);
        // The return address of the current call, and the cost of the run up to this call.
        let mut call: Option<(u32, Cost)> = None;
        let mut before = 0;
        let is_over = board.run(limit, |board| {
            match call {
                None if board.pc() == function => {
                    call = Some((before + CALL, Cost::since(board, Cost::default())));
                }
                Some((behind, entered)) if board.pc() == behind => {
                    let cost = Cost::since(board, entered);
                    if bytes_taken >= skip {
                        all.instructions += cost.instructions;
                        all.cycles += cost.cycles;
                        costliest = costliest.max(cost.cycles);
                    }
                    bytes_taken += 1;
                    call = None;
                }
                _ => {}
            }
            before = board.pc();
            before == end
        })?;
        if !is_over || bytes_taken != stream.len() {
            return Err(format!(
                "{}: the program does not reach `end`, or panics",
                self.features
            )
            .into());
        }
        Ok(Run {
            state: board.word("STATE")?,
            frames: board.word("FRAMES")?,
            all,
            costliest,
        })
    }
}
