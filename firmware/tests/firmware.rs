//! Shared code of the tests: a booted board, streams, and their outcomes.

use std::path::PathBuf;

use framelock_proofs::reference::{NaiveFormat, whole_buffer};
use nrf52840_emulator::{
    Assumptions, Board, Image, LineSymbol, MICROSECOND, MILLISECOND, ResetCause,
};
use object::{Object, ObjectSection};

pub(crate) use crate::symbols::{Setpoint, frame};

/// Returns the content of the image's file.
pub(crate) fn image_file(name: &str) -> Vec<u8> {
    let Some(folder) = std::env::var_os("FRAMELOCK_IMAGES").map(PathBuf::from) else {
        panic!("FRAMELOCK_IMAGES is not set; run `cargo xtask verify --only emulated`");
    };
    let file = folder.join(format!("{name}.elf"));
    std::fs::read(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// Returns the image, for inspection.
pub(crate) fn image(name: &str) -> Image {
    Image::parse(&image_file(name)).unwrap()
}

/// The words of UICR that the image `write-uicr` writes: the reset pin twice, and APPROTECT.
pub(crate) const UICR: [(u32, u32); 3] =
    [(0x1000_1200, 18), (0x1000_1204, 18), (0x1000_1208, 0x5A)];
/// The register NVMC.CONFIG. Its value 1 allows writing UICR.
pub(crate) const NVMC_CONFIG: u32 = 0x4001_E504;

/// The offered rates, and their values of BAUDRATE.
pub(crate) const RATES: [(u64, u32); 9] = [
    (9_600, 0x0027_5000),
    (19_200, 0x004E_A000),
    (38_400, 0x009D_0000),
    (57_600, 0x00EB_0000),
    (115_200, 0x01D6_0000),
    (230_400, 0x03B0_0000),
    (250_000, 0x0400_0000),
    (460_800, 0x0740_0000),
    (1_000_000, 0x1000_0000),
];

/// Returns every `step`-th case, beginning with the first. If the variable `FRAMELOCK_ALL_CASES` is set, returns all
/// cases. The nightly stage `random` sets this variable.
pub(crate) fn sample<T>(
    cases: impl IntoIterator<Item = T>,
    step: usize,
) -> impl Iterator<Item = T> {
    let all = std::env::var_os("FRAMELOCK_ALL_CASES").is_some();
    cases.into_iter().step_by(if all { 1 } else { step })
}

/// `udf`, the undefined instruction.
pub(crate) const UNDEFINED: [u8; 2] = [0x00, 0xDE];

/// A board that runs an image, with the data that the tests need to observe it.
pub(crate) struct Firmware {
    /// The board.
    pub(crate) board: Board,
    watch: usize,
    seen: usize,
    counters: Vec<String>,
    /// The assumptions about the chip.
    pub(crate) assumptions: Assumptions,
}

/// Returns the assumptions about the chip: the deviation that the variable `FRAMELOCK_ASSUMPTION` names (see
/// [`Assumptions::each`]), or the default.
fn assumed() -> Assumptions {
    let Ok(name) = std::env::var("FRAMELOCK_ASSUMPTION") else {
        return Assumptions::default();
    };
    Assumptions::named(&name).unwrap_or_else(|| panic!("no assumption {name}"))
}

/// Returns the counters' names from the image's file, in their order in memory.
pub(crate) fn counters(image: &str) -> Vec<String> {
    let elf = image_file(image);
    let file = object::File::parse(&*elf).unwrap();
    let names = file.section_by_name(".counters").unwrap();
    let names = String::from_utf8(names.data().unwrap().to_vec()).unwrap();
    names.split_whitespace().map(str::to_owned).collect()
}

impl Firmware {
    /// Returns firmware at power-on, on a chip whose UICR contains the words [`UICR`]. The sender has the baud rate
    /// that the image expects.
    pub(crate) fn at_power_on(image: &str) -> Self {
        let mut firmware = Self::on_an_erased_chip(image);
        firmware.write_uicr(UICR);
        firmware
    }

    /// Writes words of UICR, as a debugger does.
    pub(crate) fn write_uicr(&mut self, words: impl IntoIterator<Item = (u32, u32)>) {
        self.board.set_register(NVMC_CONFIG, 1).unwrap();
        for (word, value) in words {
            self.board.set_register(word, value).unwrap();
        }
        self.board.set_register(NVMC_CONFIG, 0).unwrap();
    }

    /// Returns firmware at power-on, on a chip with an erased UICR.
    pub(crate) fn on_an_erased_chip(image: &str) -> Self {
        let mut board = Board::new(self::image(image)).unwrap();
        let watch = board.watch("SETPOINT").unwrap();
        if image == "megabaud" {
            board.line(|line| line.set_millibaud(1_000_000_000));
        }
        Self {
            board,
            watch,
            seen: 0,
            counters: counters(image),
            assumptions: Assumptions::default(),
        }
        .assuming(assumed())
    }

    /// Sets the assumptions about the chip.
    pub(crate) fn assuming(mut self, assumptions: Assumptions) -> Self {
        self.assume(|all| *all = assumptions);
        self
    }

    /// Changes the assumptions about the chip from here on.
    pub(crate) fn assume(&mut self, change: impl FnOnce(&mut Assumptions)) {
        change(&mut self.assumptions);
        self.board.assume(self.assumptions);
    }

    /// Returns firmware that has booted. The line is quiet.
    pub(crate) fn booted(image: &str) -> Self {
        let mut firmware = Self::at_power_on(image);
        firmware.run_for(3 * MILLISECOND);
        firmware
    }

    /// Returns firmware that has booted with another baud rate, on a core with this slowness (see
    /// [`Assumptions::slowness`]). `NONE_WAITS_AFTER` keeps the image's value, which is at most the value for this
    /// rate.
    pub(crate) fn booted_at((baud, register): (u64, u32), slowness: u32) -> Self {
        const BAUDRATE: u32 = 0x4000_2524;
        let is_slow = baud <= 115_200;
        let mut firmware = Self::at_power_on(if is_slow { "default" } else { "megabaud" });
        firmware.assume(|all| all.slowness = all.slowness.max(slowness));
        // The firmware writes this register before it switches the UARTE on.
        let usual = firmware.board.register(BAUDRATE).unwrap();
        while firmware.board.register(BAUDRATE) == Ok(usual) {
            firmware.run_for(1);
        }
        firmware.board.set_register(BAUDRATE, register).unwrap();
        firmware.board.line(|line| line.set_millibaud(baud * 1_000));
        firmware.run_for(3 * MILLISECOND);
        firmware
    }

    /// Runs the board for this number of cycles.
    pub(crate) fn run_for(&mut self, cycles: u64) {
        self.board.run_for(cycles).unwrap();
    }

    /// Sends bytes, and runs the board until `then` cycles after the last stop bit.
    pub(crate) fn send_and_wait(&mut self, bytes: &[u8], then: u64) {
        let end = self.board.send(bytes);
        self.board.run_until(end + then).unwrap();
    }

    /// Sends symbols, which may be errors, and runs the board until `then` cycles after the last symbol.
    pub(crate) fn send_symbols_and_wait(&mut self, symbols: &[LineSymbol], then: u64) {
        let end = self.board.send_symbols(symbols);
        self.board.run_until(end + then).unwrap();
    }

    /// Sends one more frame. Asserts that exactly this frame is committed within `then` cycles.
    pub(crate) fn takes_a_frame(&mut self, then: u64, what: &str) {
        self.send_and_wait(&frame([4, 5, 6]), then);
        assert_eq!(self.commits(), [[4, 5, 6]], "{what}");
    }

    /// Overwrites a function's first instruction. Returns the old one.
    pub(crate) fn patch(&mut self, function: &str, code: [u8; 2]) -> [u8; 2] {
        let address = self.board.image().symbol(function).unwrap().address;
        let mut before = [0; 2];
        self.board.memory().read(address, &mut before).unwrap();
        self.board.patch(address, &code).unwrap();
        before
    }

    /// Replaces the first instructions of these handlers with undefined ones, until the chip is reset.
    pub(crate) fn fault_in(&mut self, handlers: &[&str]) {
        self.board.let_faults_be_handled();
        let code: Vec<_> = handlers
            .iter()
            .map(|handler| self.patch(handler, UNDEFINED))
            .collect();
        let resets = self.resets().len();
        while self.resets().len() == resets {
            self.run_for(20);
        }
        for (handler, code) in handlers.iter().zip(code) {
            self.patch(handler, code);
        }
    }

    /// Lets the main loop hang until the watchdog resets the chip.
    pub(crate) fn starve_the_watchdog(&mut self) {
        self.board.stick_main_loop().unwrap();
        self.run_for(260 * MILLISECOND);
    }

    /// Sends a frame every `every` milliseconds, for this number of milliseconds. `demand` returns the setpoint for a
    /// time in milliseconds.
    pub(crate) fn drive(
        &mut self,
        milliseconds: u64,
        every: u64,
        demand: impl Fn(u64) -> Setpoint,
    ) {
        let began = self.board.now();
        for time in (0..milliseconds).step_by(usize::try_from(every).unwrap()) {
            self.board.send(&frame(demand(time)));
            let next = began + (time + every) * MILLISECOND;
            self.board.run_until(next).unwrap();
        }
    }

    /// Returns the causes of all resets, in order.
    pub(crate) fn resets(&mut self) -> Vec<ResetCause> {
        let resets = &self.board.trace().resets;
        resets.iter().map(|reset| reset.cause).collect()
    }

    /// Returns the setpoints committed since the last call, in order.
    pub(crate) fn commits(&mut self) -> Vec<Setpoint> {
        let changes = &self.board.trace().changes;
        let new = changes.get(self.seen..).unwrap_or_default().iter();
        let new = new.filter(|change| change.watch == self.watch);
        let new = new.map(|change| {
            let [setpoint @ .., _sequence] = change.value.to_le_bytes();
            setpoint
        });
        let new = new.collect();
        self.seen = changes.len();
        new
    }

    /// Returns a counter, which the firmware updates every 2 ms.
    pub(crate) fn counter(&self, name: &str) -> u32 {
        let place = self.counters.iter().position(|known| known == name);
        let place = u32::try_from(place.unwrap()).unwrap();
        let symbol = self.board.image().symbol("COUNTERS").unwrap();
        let word = self.board.memory().word(symbol.address + 4 * place);
        word.unwrap()
    }

    /// Returns the number of overruns, and the number of bytes skipped because of errors.
    pub(crate) fn losses(&self) -> (u32, u32) {
        assert_eq!(self.counter("unserved"), 0);
        (self.counter("overrun"), self.counter("skipped"))
    }

    /// Returns which of LED1, LED2 and LED3 are lit.
    pub(crate) fn leds(&self) -> [bool; 3] {
        let [p0, _] = self.board.pins().high;
        [13, 14, 15].map(|pin| p0 >> pin & 1 == 0)
    }

    /// Asserts that every byte is part of a frame, discarded or pending (L2 in `docs/protocol.md`).
    pub(crate) fn assert_every_byte_has_one_place(&self, what: &str) {
        let reasons = [
            "no_sync",
            "broken_sync",
            "checksum_mismatch",
            "wrong_terminator",
            "line_event",
        ];
        let discarded: u32 = reasons.iter().map(|name| self.counter(name)).sum();
        let placed = 7 * self.counter("frames") + discarded + self.counter("pending");
        assert_eq!(self.counter("bytes"), placed, "{what}");
    }
}

/// Returns a sequence of different setpoints.
pub(crate) fn setpoints(count: u32) -> impl Iterator<Item = Setpoint> {
    (0..count).map(|n| {
        let [low, high, ..] = n.to_le_bytes();
        [low.wrapping_mul(7), high, low]
    })
}

/// Returns `count` setpoints, and the bytes of their frames.
pub(crate) fn frames(count: u32) -> (Vec<Setpoint>, Vec<u8>) {
    let sent: Vec<_> = setpoints(count).collect();
    let bytes = sent.iter().copied().flat_map(frame).collect();
    (sent, bytes)
}

/// A function that returns the setpoints that a machine must commit for a stream.
pub(crate) type Reference = fn(&[u8]) -> Vec<Setpoint>;

/// Returns the setpoints that the reference of this format finds in the bytes.
pub(crate) fn reference<F: NaiveFormat>(bytes: &[u8]) -> Vec<Setpoint> {
    let mut commits = Vec::new();
    whole_buffer::<F>(bytes, |found| {
        commits.extend(found.message());
    });
    commits
}

/// Returns whether the commits are a subsequence of the sent setpoints.
pub(crate) fn is_some_of(commits: &[Setpoint], sent: &[Setpoint]) -> bool {
    let mut rest = sent.iter();
    commits.iter().all(|commit| rest.any(|one| one == commit))
}

/// Silence, in cycles, after which the firmware has noticed the gap, and its counters show all bytes.
pub(crate) const GAP: u64 = 8 * MILLISECOND;

/// A time, in cycles, that is long enough for the firmware to notice a lost ENDRX, restart the UARTE, and see a gap.
pub(crate) const RESTART: u64 = 24 * MILLISECOND;

/// A time, in cycles, that is long enough to handle all bytes, but too short for a gap.
pub(crate) const PAUSE: u64 = 600 * MICROSECOND;
