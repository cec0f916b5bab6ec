//! Checks the files for Renode in `firmware/renode` without Renode: the image, the symbols, the counters' names and the
//! registers that these files name exist.

use std::path::Path;

use nrf52840_emulator::Board;

use crate::firmware::{counters, image, image_file};

const PLATFORM: &str = include_str!("../renode/framelock.repl");
const SCRIPT: &str = include_str!("../renode/framelock.resc");
const COMMANDS: &str = include_str!("../renode/framelock.py");
const ROBOT: &str = include_str!("../renode/framelock.robot");

/// Returns the texts that follow each occurrence of `before`, up to the character `end`.
fn each_after<'t>(text: &'t str, before: &str, end: char) -> Vec<&'t str> {
    let rests = text.split(before).skip(1);
    rests.map(|rest| rest.split(end).next().unwrap()).collect()
}

#[test]
fn symbols_exist() {
    let names = each_after(COMMANDS, "GetSymbolAddress(\"", '"');
    assert_eq!(names, ["COUNTERS", "SETPOINT", "_SEGGER_RTT"]);
    for name in names {
        let image = image("default");
        let symbol = image.symbol(name).unwrap();
        assert!(symbol.address >= 0x2000_0000, "{name} is not in RAM");
    }
}

/// The commands search the image's file for the names of the first counters. The first match must be in the section
/// that has the names of all counters.
#[test]
fn the_first_match_is_the_list_of_counters() {
    let [wanted] = *each_after(COMMANDS, "text.index(\"", '"') else {
        panic!("one search");
    };
    let file = image_file("default");
    let at = file
        .windows(wanted.len())
        .position(|bytes| bytes == wanted.as_bytes())
        .unwrap();
    let is_of_name = |byte: &&u8| matches!(byte, b'a'..=b'z' | b'_' | b' ');
    let names: Vec<u8> = file[at..].iter().take_while(is_of_name).copied().collect();
    let names = String::from_utf8(names).unwrap();
    let counters = counters("default").join(" ");
    assert_eq!(names.trim(), counters);
}

/// The script loads the image from the path to which `cargo build --release` in `firmware` writes.
#[test]
fn paths_exist() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../renode");
    assert_eq!(
        each_after(SCRIPT, "$elf?=$ORIGIN/", '\n'),
        ["../target/thumbv7em-none-eabihf/release/framelock-firmware"]
    );
    assert!(folder.join("../src/main.rs").exists());
    for name in each_after(SCRIPT, "$ORIGIN/framelock", '\n') {
        assert!(folder.join(format!("framelock{name}")).exists(), "{name}");
    }
    assert_eq!(each_after(ROBOT, "${CURDIR}/", '\n'), ["framelock.resc"]);
}

/// The peripherals' registers that the commands and the tests write exist on the emulated chip.
#[test]
fn registers_exist() {
    let mut board = Board::new(image("default")).unwrap();
    assert!(COMMANDS.contains("WriteDoubleWord(0x40002124, 1)"));
    board.set_register(0x4000_2124, 1).unwrap();
    assert!(ROBOT.contains("WriteDoubleWord 0x40008004 1"));
    board.set_register(0x4000_8004, 1).unwrap();
}

/// These peripherals of the platform have the same addresses as on the emulated chip. The emulator's error at an access
/// to a missing register names the peripheral.
#[test]
fn peripherals_have_their_addresses() {
    let mut board = Board::new(image("default")).unwrap();
    for (name, base, own_name) in [
        ("clock", 0x4000_0000, "CLOCK/POWER"),
        ("uart0", 0x4000_2000, "UARTE0"),
        ("timer0", 0x4000_8000, "TIMER0"),
        ("timer2", 0x4000_A000, "TIMER2"),
        ("wdt", 0x4001_0000, "WDT"),
        ("pwm0", 0x4001_C000, "PWM0"),
        ("nvmc", 0x4001_E000, "NVMC"),
    ] {
        let line = PLATFORM.split(&format!("\n{name}: ")).nth(1).unwrap();
        let place = &line[..line.find("size").unwrap_or(200).min(120)];
        assert!(
            place.contains(&format!("sysbus <0x{base:X}"))
                || place.contains(&format!("@ sysbus 0x{base:X}")),
            "{name}: {place}"
        );
        // No peripheral of the chip has a register at this offset.
        let error = board.register(base + 0xFF8).unwrap_err().to_string();
        assert!(error.contains(own_name), "{name}: {error}");
    }
}
