//! Runs generated receivers on an emulated Cortex-M4 and on simavr's AVRs. Compares the digests of these receivers with
//! those of the Rust receivers, and measures sizes and cycles.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use framelock_description::{SHIPPED, shipped};
use framelock_generate::CrcTable;
use nrf52840_emulator::{Board, CYCLES_PER_SECOND, Image};
use tempfile::TempDir;

use crate::compilers::{AVR, AVR_2560, Compiler, M0, M4, beside, succeeds};
use crate::descriptions::other;
use crate::difference::Case;

/// Builds `program` with a receiver for the emulated nRF52840.
fn build_for_m4(case: &Case, program: &str, folder: &Path) -> Vec<u8> {
    case.write(folder);
    let output = folder.join("program.elf");
    let script = format!("-T{}", beside("chip.ld").display());
    let options = [
        "-I.",
        "-DON_CHIP",
        "-Os",
        "-nostdlib",
        "-ffunction-sections",
        "-Wl,--gc-sections,-znoexecstack",
        &script,
    ];
    M4.compile(&beside(program), &options, &output);
    fs::read(output).unwrap()
}

/// Runs a board up to `begin`, and writes the steps into its memory. Returns the board, and the addresses of `end`,
/// `take_byte` and `taken`.
fn board_with(elf: &[u8], steps: &[u8]) -> (Board, [u32; 3]) {
    let image = Image::parse(elf).unwrap();
    let address = |name| image.symbol(name).map_or(0, |symbol| symbol.address);
    let [begin, end, given, length] = ["begin", "end", "STEPS", "LENGTH"].map(address);
    let marks = [end, address("take_byte"), address("taken")];
    let mut board = Board::new(image).unwrap();
    assert!(board.run(LIMIT, |board| board.pc() == begin).unwrap());
    board.patch(given, steps).unwrap();
    let count = u32::try_from(steps.len()).unwrap();
    board.patch(length, &count.to_le_bytes()).unwrap();
    (board, marks)
}

const LIMIT: u64 = 60 * CYCLES_PER_SECOND;

/// Runs `program` with a receiver on simavr. Returns the numbers that the program prints for the steps.
fn on_avr(
    case: &Case,
    program: &str,
    steps: &[u8],
    compiler: &Compiler,
    options: &[&str],
) -> Vec<u32> {
    let folder = TempDir::new().unwrap();
    case.write(folder.path());
    let numbers: Vec<String> = steps.iter().map(u8::to_string).collect();
    let numbers = numbers.join(",\n");
    let text = format!("static const uint8_t STEPS[] PROGMEM = {{\n{numbers}\n}};\n");
    fs::write(folder.path().join("steps.h"), text).unwrap();
    let output = folder.path().join("program.elf");
    let options = [&["-I.", "-DON_CHIP", "-Os"], options].concat();
    compiler.compile(&beside(program), &options, &output);
    let (_, chip) = compiler.command.split_once("-mmcu=").unwrap();
    let mut simavr = Command::new("simavr");
    simavr.args(["-m", chip, "-f", "16000000"]).arg(output);
    let said = succeeds(&mut simavr, &[], "simavr");
    // The simulator colours the output of the UART, and shows the end of a line as a dot.
    let is_digit = |c: char| c.is_ascii_digit() || ('a'..='f').contains(&c);
    let words = said.split(|c: char| !c.is_ascii_alphanumeric());
    let words = words.map(|word| word.strip_prefix("32m").unwrap_or(word));
    let numbers = words.filter(|word| word.len() == 8 && word.chars().all(is_digit));
    numbers
        .map(|word| u32::from_str_radix(word, 16).unwrap())
        .collect()
}

/// The minimum number of received bytes in a stream.
const BYTES: usize = 4_000;

#[test]
fn receivers_on_an_emulated_cortex_m4_do_the_same() {
    check_on_m4(BYTES);
}

#[test]
fn receivers_on_avrs_do_the_same() {
    check_on_avr(BYTES);
}

/// The stream for the AVR is shorter, because it lies in flash, at two bytes for each received byte.
#[test]
#[ignore = "cargo xtask verify --only generated runs it"]
fn so_do_those_with_long_streams() {
    check_on_m4(50_000);
    check_on_avr(8_000);
}

fn check_on_m4(bytes: usize) {
    let shipped = SHIPPED
        .iter()
        .filter(|(name, _)| !["ubx", "gnss", "dsmr-p1"].contains(name));
    for (name, text) in shipped.copied().chain([other("short_ubx")]) {
        let case = Case::new(name, text, CrcTable::Nibbles, bytes);
        let folder = TempDir::new().unwrap();
        let elf = build_for_m4(&case, "difference.c", folder.path());
        let (mut board, [end, ..]) = board_with(&elf, &case.encoded_steps());
        assert!(board.run(LIMIT, |board| board.pc() == end).unwrap());
        assert_eq!(board.word("SAID").unwrap(), case.outcome().1, "{name}");
    }
}

/// Compares the counters first, because they show how the receivers differ, and then the digest.
fn check_on_avr(bytes: usize) {
    for (name, text) in SHIPPED.iter().copied().chain([other("short_ubx")]) {
        // The `ATmega328P` has 2 KiB of RAM, and the `ATmega2560` has 8 KiB. Some receivers need a smaller buffer.
        let (compiler, options) = match name {
            "ubx" => (&AVR_2560, &["-DUBX_ROOM=UBX_LONGEST"][..]),
            "gnss" => (&AVR_2560, &["-DGNSS_ROOM=GNSS_LONGEST"][..]),
            "dsmr-p1" => (&AVR_2560, &["-DDSMR_P1_ROOM=DSMR_P1_LONGEST"][..]),
            "rtcm" => (&AVR, &["-DRTCM_ROOM=RTCM_LONGEST"][..]),
            "vedirect" => (&AVR, &["-DVEDIRECT_ROOM=VEDIRECT_LONGEST"][..]),
            // With other optimisations, the compiler uses `sbiw r24, 13` for the trailer's 13 bytes, directly after a
            // `sbrc` or `cpse`, which may skip it. simavr 1.6 mistakes this `sbiw` for an instruction of two words, and
            // skips the next one, too.
            "mavlink2" => (&AVR, &["-O3"][..]),
            _ => (&AVR, &[][..]),
        };
        let case = Case::new(name, text, CrcTable::Nibbles, bytes);
        let said = on_avr(
            &case,
            "difference.c",
            &case.encoded_steps(),
            compiler,
            options,
        );
        let (counters, digest) = case.outcome();
        assert_eq!(
            said[..counters.len()],
            counters,
            "{name}: the counters differ"
        );
        assert_eq!(
            said[counters.len()..],
            [digest],
            "{name}: the frames differ"
        );
    }
}

/// Returns three sizes in bytes: the flash and the RAM that a receiver takes, and an upper bound on the stack that its
/// functions use. `parts` are the compiler's options, each of which adds some of the receiver's functions.
fn size(case: &Case, compiler: &Compiler, parts: &[&str]) -> [usize; 3] {
    let folder = TempDir::new().unwrap();
    case.write(folder.path());
    let object = folder.path().join("size.o");
    let options = [&["-I.", "-Os", "-c", "-fstack-usage"], parts].concat();
    compiler.compile(&beside("size.c"), &options, &object);
    let (name, _) = compiler.command.split_once("gcc ").unwrap();
    let sections = succeeds(
        Command::new(format!("{name}size")).arg("-A").arg(object),
        &[],
        compiler.package,
    );
    let bytes = |is_counted: fn(&str) -> bool| -> usize {
        let rows = sections
            .lines()
            .map(|row| row.split_whitespace().collect::<Vec<_>>());
        let rows = rows.filter(|row| row.len() == 3 && is_counted(row[0]));
        rows.map(|row| row[1].parse::<usize>().unwrap()).sum()
    };
    let is_flash = |name: &str| {
        let mut sections = [".text", ".rodata", ".progmem"].iter();
        sections.any(|section| name.starts_with(section))
    };
    // No function calls itself, so no chain of calls needs more stack than all functions together.
    let frames = fs::read_to_string(folder.path().join("size.su")).unwrap();
    let frames = frames.lines().map(|line| line.split('\t').nth(1).unwrap());
    let stack = frames.map(|bytes| bytes.parse::<usize>().unwrap()).sum();
    [bytes(is_flash), bytes(|name| name == ".size"), stack]
}

/// Returns the average and the greatest number of cycles that `push` takes for a byte.
fn cycles_on_m4(case: &Case, stream: &[u8]) -> [u64; 2] {
    let folder = TempDir::new().unwrap();
    let elf = build_for_m4(case, "cycles.c", folder.path());
    let (mut board, [end, take_byte, taken]) = board_with(&elf, stream);
    let (mut all, mut most, mut count) = (0, 0, 0);
    let mut before = None;
    let is_over = board.run(LIMIT, |board| {
        if board.pc() == take_byte {
            before = Some(board.now());
        } else if board.pc() == taken
            && let Some(before) = before.take()
        {
            let cycles = board.now() - before;
            (all, most, count) = (all + cycles, most.max(cycles), count + 1);
        }
        board.pc() == end
    });
    assert!(is_over.unwrap());
    assert_eq!(count, stream.len() as u64);
    [all / count, most]
}

fn cycles_on_avr(case: &Case, stream: &[u8]) -> [u64; 2] {
    let said = on_avr(case, "cycles.c", stream, &AVR, &[]);
    [said[0].into(), said[1].into()]
}

/// Compares the tables of `docs/c.md` with measurements. `FRAMELOCK_WRITE_FIGURES=1` writes the tables.
#[test]
fn figures_are_as_the_page_says() {
    let mut sizes = "| | M4 | M0 | ATmega328P | RAM M4, ATmega328P | stack M4, ATmega328P |\n\
                     |---|---:|---:|---:|---:|---:|\n"
        .to_owned();
    let mut cycles =
        "| | M4: clean | worst | most for a byte | ATmega328P: clean | worst | most for a byte |\n\
                      |---|---:|---:|---:|---:|---:|---:|\n"
            .to_owned();
    // The longest sentence, with a wrong checksum. Only its first byte can begin a sentence.
    let long_sentence = [b"$", &[b'A'; 509][..], b"*00\r\n"].concat();
    // Each row has the bytes that the worst stream repeats. The clean stream repeats a frame. The cycles for
    // Modbus RTU are not measured, because `push` never delivers its frames.
    for (name, kind, text, worst) in [
        ("BIN", "bin", shipped("bin").unwrap(), &b"AB"[..]),
        ("CRSF", "crsf", shipped("crsf").unwrap(), &[0xC8, 0x3C]),
        (
            "UBX of up to 106 bytes",
            "ubx",
            other("short_ubx").1,
            &[0xB5, 0x62, 0],
        ),
        ("NMEA", "nmea", shipped("nmea").unwrap(), &long_sentence),
        ("SLIP", "slip", shipped("slip").unwrap(), &[0xC0, b'A']),
        ("COBS", "cobs", shipped("cobs").unwrap(), &[0, 2, b'A']),
        (
            "Modbus RTU",
            "modbus-rtu",
            shipped("modbus-rtu").unwrap(),
            &[],
        ),
    ] {
        let case = Case::new(kind, text, CrcTable::Nibbles, 20_000);
        for (what, parts) in [
            ("`init` and `push`", &[][..]),
            ("and line events, counters", &["-DCOMPLETE"]),
            ("and `encode`", &["-DCOMPLETE", "-DENCODE"]),
        ] {
            let [m4, m0, avr] = [&M4, &M0, &AVR].map(|compiler| size(&case, compiler, parts));
            writeln!(
                sizes,
                "| {name}: {what} | {} | {} | {} | {}, {} | {}, {} |",
                m4[0], m0[0], avr[0], m4[1], avr[1], m4[2], avr[2]
            )
            .unwrap();
            let limit = match (name, parts) {
                ("BIN", ["-DCOMPLETE"]) => 400,
                ("CRSF", ["-DCOMPLETE"]) => 1000,
                _ => usize::MAX,
            };
            assert!(m4[0] <= limit, "{name}: {} bytes", m4[0]);
        }
        if worst.is_empty() {
            continue;
        }
        let frame = case.longest_frame();
        let [clean, worst] = [&*frame, worst].map(|bytes| {
            bytes
                .iter()
                .copied()
                .cycle()
                .take(3000)
                .collect::<Vec<u8>>()
        });
        let mut row = format!("| {name}");
        let on_m4 = [&clean, &worst].map(|stream| cycles_on_m4(&case, stream));
        let on_avr = [&clean, &worst].map(|stream| cycles_on_avr(&case, stream));
        for [clean, worst] in [on_m4, on_avr] {
            let most = clean[1].max(worst[1]);
            write!(row, " | {} | {} | {most}", clean[0], worst[0]).unwrap();
        }
        let most = on_m4[0][1].max(on_m4[1][1]);
        assert!(
            name != "BIN" || most <= 190,
            "a byte of BIN takes {most} cycles"
        );
        writeln!(cycles, "{row} |").unwrap();
    }
    let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/c.md");
    let text = fs::read_to_string(&page).unwrap();
    let mut new_text = text.clone();
    for (name, table) in [("sizes", &sizes), ("cycles", &cycles)] {
        let (begin, end) = (
            format!("<!-- {name} -->\n"),
            format!("<!-- end of {name} -->"),
        );
        let (_, rest) = text.split_once(&begin).unwrap();
        let (old, _) = rest.split_once(&end).unwrap();
        new_text = new_text.replace(
            &format!("{begin}{old}{end}"),
            &format!("{begin}{table}{end}"),
        );
    }
    if std::env::var_os("FRAMELOCK_WRITE_FIGURES").is_some() {
        fs::write(&page, &new_text).unwrap();
    } else {
        assert!(
            text == new_text,
            "docs/c.md has other figures:\n{sizes}\n{cycles}"
        );
    }
}
