//! The firmware's figures, which repeat exactly: compared with `firmware/FIGURES.txt`.
//!
//! After a change that is meant, `FRAMELOCK_WRITE_FIGURES=1 cargo xtask verify --only emulated`
//! writes them anew. With another compiler than the one that made them, only the limits count.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

use std::fmt::Write;
use std::path::Path;

use framelock_emulator::{Board, Image, MICROSECOND, MILLISECOND};
use framelock_firmware_inspect::Sizes;
use framelock_firmware_tests::{Firmware, frame, image_file, setpoints};
use object::{Object, ObjectSection};

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
        assert_eq!(written, text, "now: {text}");
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
    for (image, limit) in [("default", 16 * 1024), ("small", 6_656)] {
        let sizes = Sizes::of(&image_file(image)).unwrap();
        figures.add(
            &format!("image {image}: flash, text and data"),
            sizes.flash(),
            Some(limit),
        );
        figures.add(&format!("image {image}: text"), sizes.text, None);
        figures.add(&format!("image {image}: data"), sizes.data, None);
        figures.add(&format!("image {image}: bss"), sizes.bss, None);
    }
}

fn steps(figures: &mut Figures) {
    // What any call costs: a frame, whether it is needed or not, and the way back.
    let (_, call) = called(figures, "no_step", 1, "a call that does nothing", None);
    for (step, calls, name, [bytes_limit, called_limit, alone_limit]) in [
        (
            "lecture_step",
            28,
            "the lecture's machine (Discard)",
            [100, 36, 23],
        ),
        ("receiver_step", 84, "the receiver (Rescan)", [100, 34, 26]),
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
    let mut board = Board::new(Image::parse(&image_file("parser-steps")).unwrap()).unwrap();
    let symbol = board.image().symbol(function).unwrap().clone();
    let mut cycles: Vec<u64> = Vec::new();
    for _ in 0..calls {
        assert!(
            board.run_to(symbol.address, MILLISECOND).unwrap(),
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

/// A thousand frames back to back.
fn flood(figures: &mut Figures, image: &str, baud: u64) {
    let mut firmware = Firmware::booted(image);
    let totals = |firmware: &Firmware| {
        let handlers = firmware.board.handlers();
        let both = [UARTE0, TIMER2].map(|n| handlers.get(&n).copied().unwrap_or_default());
        let worst = both
            .map(|totals| totals.worst_instructions)
            .into_iter()
            .max();
        let worst_cycles = both.map(|totals| totals.worst_cycles).into_iter().max();
        (
            both.iter().map(|totals| totals.instructions).sum::<u64>(),
            worst.unwrap(),
            worst_cycles.unwrap(),
        )
    };
    let (before, ..) = totals(&firmware);
    let (began, slept) = (firmware.board.now(), firmware.board.slept());
    let bytes: Vec<u8> = setpoints(1_000).flat_map(frame).collect();
    firmware.send_and_wait(&bytes, MICROSECOND * 300);
    let (after, worst, worst_cycles) = totals(&firmware);
    let time = firmware.board.now() - began;
    let busy = time - (firmware.board.slept() - slept);
    assert_eq!(firmware.commits().len(), 1_000);
    let limit = (baud == 1_000_000).then_some(100);
    figures.add(
        &format!("{baud} baud: handlers' instructions a byte, tenths"),
        (after - before) * 10 / 7_000,
        limit,
    );
    figures.add(
        &format!("{baud} baud: handlers' instructions a frame"),
        (after - before) / 1_000,
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

/// Single frames: from the end of the last stop bit.
fn latency(figures: &mut Figures, image: &str, baud: u64) {
    let mut firmware = Firmware::booted(image);
    let in_force = firmware.board.watch("SETPOINT").unwrap();
    let widths = firmware.board.watch("WIDTHS").unwrap();
    let (mut to_setpoint, mut to_pulse) = (0, 0);
    for n in 0..200_u8 {
        let pitch = 100 + n % 50;
        let end = firmware.board.send(&frame([pitch, 1, 2]));
        let seen = firmware.board.changes(widths).len();
        firmware
            .board
            .run_until(end + 10 * MILLISECOND + u64::from(n) * 37)
            .unwrap();
        let at = firmware.board.changes(in_force).last().unwrap().at;
        to_setpoint = to_setpoint.max(at - end);
        // Live, the output is the demand at once; before that it moves at its own rate.
        if n > 150
            && let Some(change) = firmware.board.changes(widths).get(seen)
        {
            to_pulse = to_pulse.max(change.at - end);
        }
    }
    let microseconds = |cycles: u64| cycles / MICROSECOND;
    figures.add(
        &format!("{baud} baud: last stop bit to setpoint in force, us, worst"),
        microseconds(to_setpoint),
        None,
    );
    figures.add(
        &format!("{baud} baud: last stop bit to PWM's new values, us, worst"),
        microseconds(to_pulse),
        None,
    );
}
