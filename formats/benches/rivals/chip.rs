//! The receivers on the emulated Cortex-M4: what they add to a program, and the cycles that a frame takes.

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::Command;

use nrf52840_emulator::{Board, CYCLES_PER_SECOND, Image};
use object::{Object, ObjectSection};

use crate::streams::{Fault, Protocol, Stream};

/// Frames in the stream that the chip takes.
const FRAMES: u16 = 200;

/// The programs of `on-chip/src/bin`, by protocol and contender.
const PROGRAMS: [(&str, &str, &str); 13] = [
    ("CRSF", "framelock", "crsf-framelock"),
    ("CRSF", "uf-crsf", "crsf-uf-crsf"),
    ("CRSF", "crsf", "crsf-crsf"),
    ("UBX", "framelock", "ubx-framelock"),
    ("UBX", "ublox", "ubx-ublox"),
    ("MAVLink 2", "framelock", "mavlink2-framelock"),
    ("MAVLink 2", "mavlink-core", "mavlink2-mavlink-core"),
    ("SBUS", "framelock", "sbus-framelock"),
    ("SBUS", "uf-sbus", "sbus-uf-sbus"),
    ("SBUS", "sbus-rs", "sbus-sbus-rs"),
    ("SBUS", "sbus", "sbus-sbus"),
    ("iBUS", "framelock", "ibus-framelock"),
    ("iBUS", "parse_rc_ibus", "ibus-parse_rc_ibus"),
];

/// Every panic goes through a function of `core::panicking` to the program's own handler.
const PANICS: [&str; 2] = ["core::panicking", "rust_begin_unwind"];

/// What is not counted: functions that hardly any program does without, and the MAVLink dialect, which is the
/// user's.
const COMMON: [&str; 4] = ["memcpy", "memclr", "memset", "rivals_on_chip::message"];

/// A receiver on the chip. What the same program takes without one is taken off.
pub(crate) struct Figures {
    pub(crate) protocol: &'static str,
    pub(crate) contender: &'static str,
    pub(crate) text: u64,
    /// Constants, tables for example.
    pub(crate) rodata: u64,
    /// Bytes of RAM, besides the stack.
    pub(crate) state: u32,
    pub(crate) cycles_a_frame: u64,
    /// The program has a way to panic.
    pub(crate) can_panic: bool,
}

/// Builds the programs, and runs each with its protocol's clean stream.
pub(crate) fn measure(protocols: &[&Protocol]) -> Result<Vec<Figures>, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("on-chip");
    let streams = folder.join("target/streams");
    fs::create_dir_all(&streams)?;
    let mut lengths = BTreeMap::new();
    for protocol in protocols {
        let stream = Stream::new(protocol, Fault::Clean, FRAMES);
        let length = stream.whole.last().map_or(0, |last| last.end);
        let stream = &stream.bytes[..length];
        lengths.insert(protocol.name, length as u64);
        let file = streams.join(protocol.name);
        // An unchanged file is not written, so that cargo need not build again.
        if !fs::read(&file).is_ok_and(|before| before == stream) {
            fs::write(file, stream)?;
        }
    }
    let status = Command::new(env!("CARGO"))
        .args(["build", "--release", "--locked", "--bins"])
        .current_dir(&folder)
        .env("FRAMELOCK_STREAMS", &streams)
        // Cargo sets them for benchmarks; the programs are another target's.
        .env_remove("RUSTFLAGS")
        .env_remove("CARGO_TARGET_DIR")
        .status()?;
    if !status.success() {
        return Err("the programs for the chip do not build: see above".into());
    }
    let programs = folder.join("target/thumbv7em-none-eabihf/release");
    let nothing = Run::of(&programs.join("nothing"))?;
    let mut figures = Vec::new();
    for (protocol, contender, program) in PROGRAMS {
        let run = Run::of(&programs.join(program))?;
        if run.frames != u32::from(FRAMES) {
            return Err(format!("{program}: {} frames of {FRAMES}", run.frames).into());
        }
        // The loop around the receiver: a few cycles for each byte.
        let cycles = run.cycles - nothing.cycles * lengths[protocol] / lengths["CRSF"];
        figures.push(Figures {
            protocol,
            contender,
            text: run.text - nothing.text,
            rodata: run.rodata.saturating_sub(nothing.rodata),
            state: run.state,
            cycles_a_frame: cycles / u64::from(FRAMES),
            can_panic: run.can_panic,
        });
    }
    Ok(figures)
}

/// What a program shows.
struct Run {
    text: u64,
    /// Without the stream.
    rodata: u64,
    state: u32,
    frames: u32,
    cycles: u64,
    can_panic: bool,
}

impl Run {
    fn of(program: &Path) -> Result<Self, Box<dyn Error>> {
        let elf = fs::read(program)?;
        let file = object::File::parse(&*elf)?;
        let section = |name| file.section_by_name(name).map_or(0, |found| found.size());
        let image = Image::parse(&elf)?;
        let address = |name| image.symbol(name).map(|symbol| symbol.address);
        let [begin, end] = [address("begin")?, address("end")?];
        let stream = u64::from(image.symbol("STREAM")?.size);
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
        let text = section(".text") - u64::from(common.values().sum::<u32>());
        let rodata = section(".rodata") - stream;

        let mut board = Board::new(image)?;
        let mut run_to = |address| -> Result<u64, Box<dyn Error>> {
            let limit = board.now() + CYCLES_PER_SECOND;
            if !board.run(limit, |board| board.pc() == address)? {
                return Err(format!("{}: ran for a second", program.display()).into());
            }
            Ok(board.now())
        };
        let first = run_to(begin)?;
        let cycles = run_to(end)? - first;
        Ok(Self {
            text,
            rodata,
            state: board.word("STATE")?,
            frames: board.word("FRAMES")?,
            cycles,
            can_panic,
        })
    }
}
