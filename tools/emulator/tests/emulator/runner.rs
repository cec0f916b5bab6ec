//! Tests of the runner's command line, with firmware of a few instructions.

use std::path::PathBuf;
use std::process::{Command, Output, Stdio};

use framelock_limited::{Process, RunToEnd as _};

use crate::boards::*;

/// Returns a minimal ELF with this code at address 0: header, one program header, code.
fn elf(code: &[u8]) -> Vec<u8> {
    let size = u32::try_from(code.len()).unwrap();
    let mut elf = b"\x7FELF\x01\x01\x01".to_vec();
    elf.resize(16, 0);
    // The fields are: executable, Arm, version 1, the entry, program headers after this header, no sections.
    elf.extend([2, 0, 40, 0]);
    for word in [1, 0x101, 52, 0, 0x0500_0000] {
        elf.extend(u32::to_le_bytes(word));
    }
    for half in [52, 32, 1, 40, 0, 0] {
        elf.extend(u16::to_le_bytes(half));
    }
    for word in [1, 84, 0, 0, size, size, 5, 4] {
        elf.extend(u32::to_le_bytes(word));
    }
    elf.extend(code);
    elf
}

const AIRCR: u32 = 0xE000_ED0C;
const RESET_REQUEST: u32 = 0x05FA_0004;

fn emulator(name: &str, image: &[u8], arguments: &[&str]) -> Command {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, image).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_nrf52840-emulator"));
    command.arg("--elf").arg(path).args(arguments);
    command.stdin(Stdio::piped()).stdout(Stdio::piped());
    command
}

fn emulate(name: &str, image: &[u8]) -> Output {
    emulator(name, image, &[]).run_to_end(b"").unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[test]
fn what_the_firmware_does_wrong_fails_the_run() {
    // udf
    let output = emulate("fault.elf", &elf(&program(&[0xDE00], &[0x4770])));
    assert!(!output.status.success());
    let error = text(&output.stderr);
    assert!(error.contains("Error: hardfault") && error.contains("pc 0x00000100"));
}

#[test]
fn a_file_that_is_no_elf_is_refused() {
    let output = emulate("not.elf", b"AB\0\x01\x02\x03\r");
    assert!(!output.status.success());
}

/// Returns an ELF that requests a reset when seven bytes have arrived. After the reset, the program starts again.
fn resets_after_seven_bytes() -> Vec<u8> {
    // ldr r4, =table; 1: ldmia r4!, {r0, r1}; cmp r0, #0; beq 2f; str r1, [r0]; b 1b
    // 2: ldr r0, =ENDRX; 3: ldr r1, [r0]; cmp r1, #0; beq 3b
    // ldr r0, =AIRCR; ldr r1, =RESET_REQUEST; str r1, [r0]; b .; nop; nop; the words
    let code = [
        0x4C07, 0xCC03, 0x2800, 0xD001, 0x6001, 0xE7FA, 0x4805, 0x6801, 0x2900, 0xD0FC, 0x4804,
        0x4905, 0x6001, 0xE7FE, 0xBF00, 0xBF00,
    ];
    let words = [
        [0x130, ENDRX],
        [AIRCR, RESET_REQUEST],
        [PSEL_RXD, 8],
        [BAUDRATE, BAUD_115200],
        [UARTE_ENABLE, 8],
        [RXD_PTR, BUFFER],
        [RXD_MAXCNT, 7],
        [STARTRX, 1],
        [0, 0],
    ];
    #[allow(clippy::cast_possible_truncation, reason = "the two halves")]
    let halves = words
        .as_flattened()
        .iter()
        .flat_map(|w| [*w as u16, (*w >> 16) as u16]);
    let main: Vec<u16> = code.into_iter().chain(halves).collect();
    elf(&program(&main, &[RETURN]))
}

/// The emulator reads standard input as it arrives, so that a sender can feed the board in real time.
#[test]
fn standard_input_is_read_before_it_ends() {
    use std::io::{BufRead, BufReader, Write};

    let image = resets_after_seven_bytes();
    let mut command = emulator("stdin.elf", &image, &["--input", "-"]);
    let mut child = Process::start(&mut command).unwrap();
    let mut input = child.stdin.take().unwrap();
    input.write_all(b"seven b").unwrap();
    let mut line = String::new();
    let mut lines = BufReader::new(child.stdout.take().unwrap());
    lines.read_line(&mut line).unwrap();
    assert!(line.ends_with("reset     Soft\n"), "{line}");
    drop(input);
    assert!(child.wait().unwrap().success(), "it ends with its input");
}

/// The board listens on a pseudo-terminal, whose name is printed first. Bytes that are control
/// characters for a terminal arrive like all others.
#[cfg(unix)]
#[test]
fn it_listens_at_a_pseudo_terminal() {
    use std::io::{BufRead, BufReader, Write};

    let image = resets_after_seven_bytes();
    let mut command = emulator("pty.elf", &image, &["--input", "pty"]);
    let mut child = Process::start(command.stderr(Stdio::piped())).unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap());
    let mut errors = BufReader::new(child.stderr.take().unwrap());
    let name = loop {
        let mut line = String::new();
        assert_ne!(errors.read_line(&mut line).unwrap(), 0, "it ended");
        if let Some(rest) = line.strip_prefix("the board's serial port is ") {
            break rest.split(';').next().unwrap().to_owned();
        }
    };
    // Two writers write one after the other.
    for bytes in [b"AB\x03\x04".as_slice(), b"\x11\x13\r"] {
        let mut port = std::fs::OpenOptions::new().write(true).open(&name).unwrap();
        port.write_all(bytes).unwrap();
    }
    let mut line = String::new();
    lines.read_line(&mut line).unwrap();
    assert!(line.ends_with("reset     Soft\n"), "{line}");
}
