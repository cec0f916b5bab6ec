//! The firmware's figures, which repeat exactly: compared with `firmware/FIGURES.txt`.
//!
//! After a change that is meant, `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated`
//! writes them anew. With another compiler than the one that made them, only the limits count.
use std::fmt::Write;
use std::path::Path;

use nrf52840_emulator::{Activation, Board, MICROSECOND, MILLISECOND};
use object::{Object, ObjectSection};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::firmware::{Firmware, frame, image, image_file, setpoints};
use crate::image::{MOST_FLASH, Sizes};

/// Exception numbers of the two handlers that receive: 16 and the interrupt's.
const UARTE0: u16 = 16 + 2;
const TIMER2: u16 = 16 + 10;

/// A figure may not be above its limit, if it has one.
#[derive(Default)]
struct Figures {
    text: String,
    over: Vec<String>,
}

impl Figures {
    fn add(&mut self, name: &str, value: u64, limit: Option<u64>) {
        let limit_text = limit.map_or_else(String::new, |limit| format!("  (at most {limit})"));
        writeln!(self.text, "{name:<58} {value:>7}{limit_text}").unwrap();
        if limit.is_some_and(|limit| value > limit) {
            self.over.push(format!("{name}: {value}{limit_text}"));
        }
    }
}

#[test]
fn the_figures_are_as_written_down() {
    let mut figures = Figures::default();
    sizes(&mut figures);
    steps(&mut figures);
    for (image, baud) in [("default", 115_200), ("megabaud", 1_000_000)] {
        flood(&mut figures, image, baud);
        noise(&mut figures, image, baud);
        latency(&mut figures, image, baud);
    }
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

fn compiler(elf: &[u8]) -> String {
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
        let flash = format!("image {image}: flash, text and data");
        figures.add(&flash, sizes.flash(), Some(most));
        figures.add(&format!("image {image}: text"), sizes.text, None);
        figures.add(&format!("image {image}: data"), sizes.data, None);
        figures.add(&format!("image {image}: bss"), sizes.bss, None);
    }
}

fn steps(figures: &mut Figures) {
    // What any call costs: a frame, whether it is needed or not, and the way back.
    let (_, call) = called(figures, "no_step", 1, "a call that does nothing", None);
    for (step, calls, name, [bytes_limit, called_limit, alone_limit]) in [
        ("lecture_step", 28, "the lecture's machine", [100, 36, 22]),
        ("receiver_step", 84, "the receiver", [100, 36, 22]),
    ] {
        let (bytes, worst) = called(figures, step, calls, name, Some(called_limit));
        figures.add(
            &format!("{name}: cycles without the call, worst"),
            worst - call,
            Some(alone_limit),
        );
        figures.add(
            &format!("{name}: bytes of a step"),
            bytes,
            Some(bytes_limit),
        );
    }
}

/// Bytes of a function, and the worst of its first `calls` calls in cycles: from the call, which is
/// three, to behind the return.
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
    figures.add(
        &format!("{name}: cycles of a called push, best"),
        best,
        None,
    );
    figures.add(
        &format!("{name}: cycles of a called push, worst"),
        worst,
        limit,
    );
    (symbol.size.into(), worst)
}

/// Runs of the handlers that receive.
fn receptions(firmware: &mut Firmware) -> Vec<Activation> {
    let runs = firmware.board.trace().activations.iter().copied();
    runs.filter(|run| [UARTE0, TIMER2].contains(&run.exception))
        .collect()
}

/// A thousand frames back to back.
fn flood(figures: &mut Figures, image: &str, baud: u64) {
    let mut firmware = Firmware::booted(image);
    let (began, slept) = (firmware.board.now(), firmware.board.slept());
    let booted = receptions(&mut firmware).len();
    let bytes: Vec<u8> = setpoints(1_000).flat_map(frame).collect();
    firmware.send_and_wait(&bytes, MICROSECOND * 300);
    let receptions = receptions(&mut firmware);
    let instructions: u64 = receptions[booted..]
        .iter()
        .map(|run| run.instructions)
        .sum();
    let worst = receptions.iter().map(|run| run.instructions).max().unwrap();
    let worst_cycles = receptions.iter().map(|run| run.cycles).max().unwrap();
    let time = firmware.board.now() - began;
    let busy = time - (firmware.board.slept() - slept);
    assert_eq!(firmware.commits().len(), 1_000);
    let limit = (baud == 1_000_000).then_some(120);
    figures.add(
        &format!("{baud} baud: handlers' instructions a byte, tenths"),
        instructions * 10 / 7_000,
        limit,
    );
    figures.add(
        &format!("{baud} baud: handlers' instructions a frame"),
        instructions / 1_000,
        None,
    );
    figures.add(
        &format!("{baud} baud: worst handler, instructions"),
        worst,
        None,
    );
    figures.add(
        &format!("{baud} baud: worst handler, cycles"),
        worst_cycles,
        None,
    );
    figures.add(
        &format!("{baud} baud: processor's share, per mille, all counted"),
        busy * 1_000 / time,
        None,
    );
}

/// Bytes at random, back to back: what a floating line or another protocol brings.
fn noise(figures: &mut Figures, image: &str, baud: u64) {
    let mut firmware = Firmware::booted(image);
    let random = ChaCha8Rng::seed_from_u64(1);
    let bytes: Vec<u8> = random.random_iter().take(7_000).collect();
    firmware.send_and_wait(&bytes, 3 * MILLISECOND);
    let receptions = receptions(&mut firmware);
    let instructions: u64 = receptions.iter().map(|run| run.instructions).sum();
    let worst_cycles = receptions.iter().map(|run| run.cycles).max().unwrap();
    let received = u64::from(firmware.counter("bytes"));
    figures.add(
        &format!("{baud} baud, noise: handlers' instructions a byte, tenths"),
        instructions * 10 / received,
        None,
    );
    figures.add(
        &format!("{baud} baud, noise: worst handler, cycles"),
        worst_cycles,
        None,
    );
}

/// Single frames: from the end of the last stop bit.
fn latency(figures: &mut Figures, image: &str, baud: u64) {
    let mut firmware = Firmware::booted(image);
    let setpoint = firmware.board.watch("SETPOINT").unwrap();
    let mut to_setpoint = 0;
    for n in 0..200_u8 {
        let pitch = 100 + n % 50;
        let end = firmware.board.send(&frame([pitch, 1, 2]));
        std::mem::take(firmware.board.trace());
        firmware
            .board
            .run_until(end + 10 * MILLISECOND + u64::from(n) * 37)
            .unwrap();
        let changes = &firmware.board.trace().changes;
        let mut committed = changes.iter().filter(|change| change.watch == setpoint);
        to_setpoint = to_setpoint.max(committed.next_back().unwrap().at - end);
    }
    figures.add(
        &format!("{baud} baud: last stop bit to commit, us, worst"),
        to_setpoint / MICROSECOND,
        None,
    );
}
