//! What the tests of the firmware's images share: a booted board, streams, and what came of them.
//!
//! The images are built by `cargo xtask verify --only emulated`, which says where they are in the
//! variable `FRAMELOCK_IMAGES`. Without it the tests fail; they are never skipped.

use std::path::PathBuf;

use framelock_emulator::{Board, Image, LogTable, MICROSECOND, MILLISECOND};
use framelock_proofs::reference::{Bin, Event, Policy, whole_buffer};

/// Pitch, roll, yaw.
pub type Setpoint = [u8; 3];

/// The image's file.
///
/// # Panics
/// If nobody said where the images are.
#[must_use]
pub fn image_file(name: &str) -> Vec<u8> {
    let Some(folder) = std::env::var_os("FRAMELOCK_IMAGES").map(PathBuf::from) else {
        panic!(
            "FRAMELOCK_IMAGES is not set: run these tests by `cargo xtask verify --only emulated`"
        );
    };
    let file = folder.join(format!("{name}.elf"));
    match std::fs::read(&file) {
        Ok(bytes) => bytes,
        Err(error) => panic!("{}: {error}", file.display()),
    }
}

/// A board that runs an image, and what is watched on it.
pub struct Firmware {
    /// The board.
    pub board: Board,
    watch: usize,
    seen: usize,
}

/// The counters by name, in the order in which the firmware shows them.
const COUNTERS: [&str; 16] = [
    "bytes",
    "frames",
    "no_sync",
    "broken_sync",
    "check",
    "terminator",
    "line_event",
    "resynchronisations",
    "framing",
    "parity",
    "overrun",
    "line_break",
    "idle",
    "pending",
    "late",
    "skipped",
];

impl Firmware {
    /// At power-on; the sender has the baud rate that the image expects.
    ///
    /// # Panics
    /// If there is no such image, or it cannot be loaded.
    #[must_use]
    pub fn at_power_on(image: &str) -> Self {
        let file = image_file(image);
        let image_read = Image::parse(&file).expect("it is an ELF");
        let mut board = Board::new(image_read).expect("it fits the flash");
        let watch = board.watch("SETPOINT").expect("the image has it");
        if image == "megabaud" {
            board.line(|line| line.set_millibaud(1_000_000_000));
        }
        Self {
            board,
            watch,
            seen: 0,
        }
    }

    /// Booted, and quiet.
    #[must_use]
    pub fn booted(image: &str) -> Self {
        let mut firmware = Self::at_power_on(image);
        firmware.run_for(3 * MILLISECOND);
        firmware
    }

    /// Lets time pass, in cycles.
    ///
    /// # Panics
    /// If the firmware does what no firmware should.
    pub fn run_for(&mut self, cycles: u64) {
        self.board.run_for(cycles).expect("the firmware runs");
    }

    /// Sends, and lets so many cycles pass behind the last stop bit.
    ///
    /// # Panics
    /// If the firmware does what no firmware should.
    pub fn send_and_wait(&mut self, bytes: &[u8], then: u64) {
        let end = self.board.send(bytes);
        self.board.run_until(end + then).expect("the firmware runs");
    }

    /// The setpoints put in force since last asked, in order.
    pub fn commits(&mut self) -> Vec<Setpoint> {
        let changes = self.board.changes(self.watch);
        let new = changes.get(self.seen..).unwrap_or_default();
        self.seen = changes.len();
        new.iter()
            .map(|change| {
                let [setpoint @ .., _sequence] = change.value.to_le_bytes();
                setpoint
            })
            .collect()
    }

    /// A counter as the firmware shows it; it does so every 2 ms.
    ///
    /// # Panics
    /// If there is no such counter.
    #[must_use]
    pub fn counter(&self, name: &str) -> u32 {
        let place = COUNTERS.iter().position(|known| *known == name);
        let place = u32::try_from(place.expect("a counter's name")).expect("few");
        let symbol = self.board.image().symbol("COUNTERS").expect("shown");
        let word = self.board.memory().word(symbol.address + 4 * place);
        word.expect("in RAM")
    }

    /// What was lost because nobody looked at it in time: late handlers and bytes skipped.
    #[must_use]
    pub fn losses(&self) -> (u32, u32) {
        (self.counter("late"), self.counter("skipped"))
    }

    /// Whether each of LED1, LED2, LED3 is lit.
    #[must_use]
    pub fn leds(&self) -> [bool; 3] {
        let [p0, _] = self.board.pins().high;
        [13, 14, 15].map(|pin| p0 >> pin & 1 == 0)
    }

    /// The log since last asked.
    ///
    /// # Panics
    /// If the image's texts cannot be read.
    pub fn log(&mut self, image: &str) -> Vec<String> {
        let table = LogTable::parse(&image_file(image)).expect("it has texts");
        let bytes = self.board.take_rtt(0);
        table.decoder().lines(&bytes)
    }
}

/// The frame.
#[must_use]
pub fn frame([pitch, roll, yaw]: Setpoint) -> [u8; 7] {
    [b'A', b'B', 0, pitch, roll, yaw, b'\r']
}

/// Setpoints that follow each other and differ.
pub fn setpoints(count: u32) -> impl Iterator<Item = Setpoint> {
    (0..count).map(|n| {
        let [low, high, ..] = n.to_le_bytes();
        [low.wrapping_mul(7), high, low]
    })
}

/// What the reference commits.
#[must_use]
pub fn reference(bytes: &[u8], policy: Policy) -> Vec<Setpoint> {
    let mut commits = Vec::new();
    whole_buffer::<Bin>(bytes, policy, |event| {
        if let Event::Frame { setpoint, .. } = event {
            commits.push(setpoint);
        }
    });
    commits
}

/// Long enough for a gap to end what was sent before it, and for the counters to show it.
pub const GAP: u64 = 8 * MILLISECOND;

/// Long enough for the bytes to be looked at, too short for a gap.
pub const PAUSE: u64 = 600 * MICROSECOND;
