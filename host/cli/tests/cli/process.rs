//! Runs `framelock` as a process.

use std::fs;
use std::process::{Command, Output, Stdio};

use framelock::motion::Setpoint;
use framelock::{Line, Parser};
use framelock_limited::{Process, RunToEnd as _};

/// The lecture's first example.
pub(crate) const CLEAN: [u8; 7] = [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];

/// Returns the program, with pipes as its standard streams.
pub(crate) fn framelock(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_framelock"));
    command
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Starts the program. The program is killed at the time limit, or when the returned value is dropped.
pub(crate) fn start(arguments: &[&str]) -> Process {
    Process::start(&mut framelock(arguments)).unwrap()
}

/// Writes the input to the process, and waits for its end.
pub(crate) fn feed(child: Process, input: &[u8]) -> Output {
    child.feed(input).unwrap()
}

pub(crate) fn run(arguments: &[&str], input: impl AsRef<[u8]>) -> Output {
    feed(start(arguments), input.as_ref())
}

/// Runs the program, which must succeed without messages, and returns its standard output.
pub(crate) fn written(arguments: &[&str], input: impl AsRef<[u8]>) -> Vec<u8> {
    let output = run(arguments, input);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {output:?}");
    assert_eq!(text(output.stderr), "", "{arguments:?}");
    output.stdout
}

/// Does the same as [`written`], and returns the output as text.
pub(crate) fn shown(arguments: &[&str], input: impl AsRef<[u8]>) -> String {
    text(written(arguments, input))
}

/// Returns the error message of a process, which must fail with exit code 2.
pub(crate) fn complaint(output: Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    text(output.stderr)
}

pub(crate) fn text(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap()
}

/// Sends the process a signal, such as `-INT`, unless it has ended.
pub(crate) fn signal(child: &mut Process, name: &str) {
    let id = child.id().to_string();
    let kill = Command::new("kill")
        .args([name, &id])
        .run_to_end(b"")
        .unwrap();
    assert!(kill.status.success() || child.try_wait().unwrap().is_some());
}

/// Returns the setpoints of a stream in which every byte must be part of a frame.
pub(crate) fn received(
    parser: impl for<'a> Parser<Message<'a> = Setpoint> + 'static,
    bytes: impl AsRef<[u8]>,
) -> Vec<[u8; 3]> {
    let mut setpoints = Vec::new();
    let mut line = Line::new(parser);
    line.feed(bytes.as_ref(), |found| {
        setpoints.extend(found.message().map(<[u8; 3]>::from));
    });
    assert_eq!(line.counters().discarded.total(), 0);
    assert_eq!(line.pending(), 0);
    setpoints
}

/// Writes a description into a file. Returns the file's folder, which is deleted when the caller drops it, and the
/// option `--frame` for the file.
pub(crate) fn described(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    fs::write(&path, text).unwrap();
    let frame = format!("--frame={}", path.display());
    (folder, frame)
}
