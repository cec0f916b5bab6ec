//! Measures the firmware's memory, cycles and latency, and compares these figures with `firmware/FIGURES.txt`. They are
//! the same in each run.
//!
//! After an intended change, `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated` rewrites the file. The file
//! names the compiler of the images. If another compiler built the images, only the limits are checked.
use std::fmt::Write;
use std::path::Path;

use nrf52840_emulator::{Activation, Board, LineSymbol, MICROSECOND, MILLISECOND};
use object::{Object, ObjectSection};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::firmware::{Firmware, RATES, frame, image, image_file, setpoints};
use crate::image::{MOST_FLASH, Sizes};
use crate::stack::stack;

/// Exception numbers of the two receive handlers: 16 plus the interrupt's number.
const UARTE0: u16 = 16 + 2;
const TIMER2: u16 = 16 + 10;

/// The limit on the cycles of one run of a handler, for any stream.
const MOST_CYCLES: u64 = 800;

/// The figures as text, and the list of those that exceed their limits.
#[derive(Default)]
struct Figures {
    text: String,
    over: Vec<String>,
}

impl Figures {
    /// Adds figures about one subject: their names, values and limits.
    fn add<const N: usize>(&mut self, about: &str, figures: [(&str, u64, Option<u64>); N]) {
        for (name, value, limit) in figures {
            let name = format!("{about}: {name}");
            let limit_text = limit.map_or_else(String::new, |limit| format!("  (at most {limit})"));
            writeln!(self.text, "{name:<58} {value:>7}{limit_text}").unwrap();
            if limit.is_some_and(|limit| value > limit) {
                self.over.push(format!("{name}: {value}{limit_text}"));
            }
        }
    }
}

#[test]
fn the_figures_are_as_written_down() {
    let mut figures = Figures::default();
    sizes(&mut figures);
    steps(&mut figures);
    for (image, baud) in [("default", 115_200), ("megabaud", 1_000_000)] {
        streams(&mut figures, image, baud);
        latency(&mut figures, image, baud);
    }
    rates(&mut figures);
    assert!(
        figures.over.is_empty(),
        "{:#?}\n{}",
        figures.over,
        figures.text
    );

    let compiler = compiler(&image_file("default"));
    let text = format!(
        "The emulator's model, without flash wait states: silicon is slower.\n\
         {compiler}\n\n{}",
        figures.text
    );
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../FIGURES.txt");
    if std::env::var_os("FRAMELOCK_WRITE_FIGURES").is_some() {
        std::fs::write(&file, &text).unwrap();
    }
    let written = std::fs::read_to_string(&file).unwrap_or_default();
    if written.contains(&compiler) {
        let has = |line: &&str| written.lines().any(|known| known == *line);
        let new: Vec<&str> = text.lines().filter(|line| !has(line)).collect();
        assert!(written == text, "not as in FIGURES.txt: {new:#?}");
    }
}

/// Returns the name and the version of the compiler that built an image.
pub(crate) fn compiler(elf: &[u8]) -> String {
    let file = object::File::parse(elf).unwrap();
    let comment = file.section_by_name(".comment").unwrap();
    let comment = String::from_utf8_lossy(comment.data().unwrap()).into_owned();
    let mut parts = comment.split('\0').filter(|part| part.contains("rustc"));
    parts.next().unwrap().to_owned()
}

fn sizes(figures: &mut Figures) {
    for (image, most) in MOST_FLASH {
        if !["default", "small"].contains(&image) {
            continue;
        }
        let sizes = Sizes::of(image);
        let (takes, has) = stack(image);
        let all = [
            ("flash, text and data", sizes.flash(), Some(most)),
            ("text", sizes.text, None),
            ("data", sizes.data, None),
            ("bss", sizes.bss, None),
            ("stack, everything nested", takes.into(), Some(has.into())),
        ];
        figures.add(&format!("image {image}"), all);
    }
}

fn steps(figures: &mut Figures) {
    // A call that does nothing shows the cost of any call: the stack frame, even if it is not needed, and the return.
    let (_, call) = called(figures, "no_step", 1, "a call that does nothing", None);
    for (step, calls, name, [bytes_limit, called_limit, alone_limit]) in [
        ("lecture_step", 28, "the lecture's machine", [100, 36, 22]),
        ("receiver_step", 84, "the receiver", [100, 36, 22]),
    ] {
        let (bytes, worst) = called(figures, step, calls, name, Some(called_limit));
        let alone = (
            "cycles without the call, worst",
            worst - call,
            Some(alone_limit),
        );
        figures.add(name, [alone, ("bytes of a step", bytes, Some(bytes_limit))]);
    }
}

/// Adds the cycles of the fastest and the slowest of a function's first `calls` calls. Returns the function's size in
/// bytes, and the slowest call's cycles. The cycles include the call instruction, which takes three, and the return.
fn called(
    figures: &mut Figures,
    function: &str,
    calls: u32,
    name: &str,
    limit: Option<u64>,
) -> (u64, u64) {
    let mut board = Board::new(image("parser-steps")).unwrap();
    let symbol = board.image().symbol(function).unwrap().clone();
    let mut cycles: Vec<u64> = Vec::new();
    for _ in 0..calls {
        assert!(
            board
                .run(board.now() + MILLISECOND, |board| board.pc()
                    == symbol.address)
                .unwrap(),
            "{function} is called"
        );
        let entered = board.now();
        let inside = symbol.address..symbol.address + symbol.size;
        let returned = board.run(entered + MILLISECOND, |board| !inside.contains(&board.pc()));
        assert!(returned.unwrap());
        cycles.push(board.now() - entered + 3);
    }
    let (best, worst) = (*cycles.iter().min().unwrap(), *cycles.iter().max().unwrap());
    let best = ("cycles of a called push, best", best, None);
    figures.add(
        name,
        [best, ("cycles of a called push, worst", worst, limit)],
    );
    (symbol.size.into(), worst)
}

/// Returns the runs of the receive handlers.
fn receptions(firmware: &mut Firmware) -> Vec<Activation> {
    let runs = firmware.board.trace().activations.iter().copied();
    runs.filter(|run| [UARTE0, TIMER2].contains(&run.exception))
        .collect()
}

/// The cost of receiving a stream.
struct Cost {
    /// Cycles of all runs of the handlers.
    cycles: u64,
    worst: u64,
    /// Share of the processor's time, per mille.
    share: u64,
    commits: usize,
    overruns: u32,
}

fn cost(firmware: &mut Firmware, symbols: &[LineSymbol]) -> Cost {
    let (began, slept) = (firmware.board.now(), firmware.board.slept());
    let before = receptions(firmware).len();
    let end = firmware.board.send_symbols(symbols);
    firmware.board.run_until(end).unwrap();
    let time = firmware.board.now() - began;
    let busy = time - (firmware.board.slept() - slept);
    firmware.run_for(8 * MILLISECOND);
    let runs = &receptions(firmware)[before..];
    Cost {
        cycles: runs.iter().map(|run| run.cycles).sum(),
        worst: runs.iter().map(|run| run.cycles).max().unwrap(),
        share: busy * 1_000 / time,
        commits: firmware.commits().len(),
        overruns: firmware.counter("overrun"),
    }
}

fn clean(frames: u32) -> Vec<LineSymbol> {
    let bytes = setpoints(frames).flat_map(frame);
    bytes.map(LineSymbol::Byte).collect()
}

/// Returns random bytes back to back, as if a sender used another protocol.
fn noise(count: usize) -> Vec<LineSymbol> {
    let random = ChaCha8Rng::seed_from_u64(1);
    let bytes = random.random_iter::<u8>().take(count);
    bytes.map(LineSymbol::Byte).collect()
}

/// Adds the cost of receiving each stream with this image, at the image's baud rate.
fn streams(figures: &mut Figures, image: &str, baud: u64) {
    let most_share = (baud == 115_200).then_some(60);
    let worst: Vec<_> = b"ABAAAAA"
        .repeat(300)
        .into_iter()
        .map(LineSymbol::Byte)
        .collect();
    let mut clean_cycles = 0;
    for (name, stream, limit) in [
        ("clean frames", clean(300), most_share),
        ("noise", noise(2_100), most_share),
        ("ABAAAAA", worst, None),
        (
            "bad stop bits",
            vec![LineSymbol::BadStop(0x55); 2_100],
            None,
        ),
        ("breaks", vec![LineSymbol::Break(12); 2_100], None),
    ] {
        let mut firmware = Firmware::booted(image);
        let cost = cost(&mut firmware, &stream);
        assert_eq!(cost.overruns, 0, "{name}");
        if name == "clean frames" {
            assert_eq!(cost.commits, 300);
            clean_cycles = cost.cycles;
        }
        let per_byte = cost.cycles * 10 / stream.len() as u64;
        let name = format!("{baud} baud, {name}");
        let all = [
            ("handlers' cycles a byte, tenths", per_byte, None),
            ("worst handler, cycles", cost.worst, Some(MOST_CYCLES)),
            ("processor, per mille", cost.share, limit),
        ];
        figures.add(&name, all);
        if name.ends_with("noise") {
            let ratio = cost.cycles * 100 / clean_cycles;
            figures.add(
                &name,
                [("a byte, per cent of a clean one", ratio, Some(150))],
            );
        }
    }
}

/// Returns the costs of clean frames if the handlers are held off for this number of cycles, beginning at each of eight
/// points in a byte. The FIFO holds five bytes. If `at_start_bit` is true, an overrun comes at the start bit of the
/// byte that finds no room.
fn held_off(rate: (u64, u32), length: u64, at_start_bit: bool) -> impl Iterator<Item = Cost> {
    let byte = 640_000_000 / rate.0;
    (0..8).map(move |phase| {
        let mut firmware = Firmware::booted_at(rate, 100);
        firmware.assume(|all| (all.fifo, all.overrun_at_start_bit) = (5, at_start_bit));
        let from = firmware.board.now() + 16 * byte + phase * byte / 8;
        firmware.board.hold_off(from, length);
        cost(&mut firmware, &clean(6))
    })
}

/// Returns the longest hold-off of the handlers, in microseconds, that loses no byte. The result is at most a 32nd of a
/// byte time too short.
fn hold_off(rate: (u64, u32)) -> u64 {
    let byte = 640_000_000 / rate.0;
    let (mut lossless, mut lossy) = (byte, 9 * byte);
    while lossy - lossless > byte / 32 {
        let middle = lossless.midpoint(lossy);
        if held_off(rate, middle, false).all(|cost| cost.overruns == 0) {
            lossless = middle;
        } else {
            lossy = middle;
        }
    }
    lossless / MICROSECOND
}

/// Checks that the reception keeps up at each offered rate, with clean frames and with noise, on a core that
/// takes 1.5 times as many cycles as the model. Adds the figures.
fn rates(figures: &mut Figures) {
    for rate in RATES {
        let [clean, noise] = [clean(100), noise(700)].map(|stream| {
            let slow = cost(&mut Firmware::booted_at(rate, 150), &stream);
            assert_eq!(slow.overruns, 0, "{} baud must not be offered", rate.0);
            cost(&mut Firmware::booted_at(rate, 100), &stream).share
        });
        let hold_off = hold_off(rate);
        assert!(rate.0 > 115_200 || hold_off >= 500, "{hold_off} us");
        // `firmware/README.md` promises that delays of this length lose no byte, even if an overrun comes at a start
        // bit.
        let promised = match rate.0 {
            115_200 => 430,
            1_000_000 => 45,
            _ => 0,
        };
        let mut costs = held_off(rate, promised * MICROSECOND, true);
        assert!(costs.all(|cost| cost.overruns == 0 && cost.commits == 6));
        let all = [
            ("processor, clean, per mille", clean, None),
            ("processor, noise, per mille", noise, None),
            ("hold-off without loss, us", hold_off, None),
        ];
        figures.add(&format!("offered, {} baud", rate.0), all);
    }
}

/// Adds the worst latency of single frames: the time from the middle of the last stop bit to the commit. The UARTE
/// samples a stop bit in its middle.
fn latency(figures: &mut Figures, image: &str, baud: u64) {
    let mut firmware = Firmware::booted(image);
    let setpoint = firmware.board.watch("SETPOINT").unwrap();
    let mut to_setpoint = 0;
    // The ends of the frames are spread over the 2 ms between two ticks of the main loop.
    for n in 0..1_200_u32 {
        let [pitch, ..] = n.to_le_bytes();
        let end = firmware.board.send(&frame([pitch, 1, 2]));
        std::mem::take(firmware.board.trace());
        firmware
            .board
            .run_until(end + 4 * MILLISECOND + u64::from(n) * 107)
            .unwrap();
        let changes = &firmware.board.trace().changes;
        let mut committed = changes.iter().filter(|change| change.watch == setpoint);
        // The UARTE receives the byte in the middle of its stop bit.
        let heard = end - 32_000_000 / baud;
        to_setpoint = to_setpoint.max(committed.next_back().unwrap().at - heard);
    }
    let name = "middle of the last stop bit to commit, us, worst";
    figures.add(
        &format!("{baud} baud"),
        [(name, to_setpoint / MICROSECOND, None)],
    );
}
