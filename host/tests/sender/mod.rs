//! `framelock send`, for tests.
#![allow(dead_code, reason = "not every test needs everything")]

use std::process::{Child, Command, Output, Stdio};

use assert_cmd::cargo::{cargo_bin, cargo_bin_cmd};
use framelock::{Accounting, Bin, Parser, Receiver, Setpoint};

/// Where the axes are sent at the end.
pub(crate) const PARK: [u8; 3] = [128, 128, 128];

/// Sends to standard output until it ends by itself.
pub(crate) fn send(arguments: &[&str], input: &str) -> Output {
    cargo_bin_cmd!("framelock")
        .args(["send", "-"])
        .args(arguments)
        .write_stdin(input)
        .output()
        .unwrap()
}

/// What the receiver makes of the bytes; every one must be part of a frame.
pub(crate) fn received<P>(bytes: &[u8]) -> Vec<[u8; 3]>
where
    P: Parser<Message = Setpoint> + Default,
{
    let mut setpoints = Vec::new();
    let mut line = Accounting::new(P::default());
    line.feed(bytes, |_, setpoint| {
        setpoints.push(<[u8; 3]>::from(setpoint));
    });
    assert_eq!(line.counters().discarded.total(), 0);
    assert_eq!(line.pending(), 0);
    setpoints
}

/// What it sends; it must succeed. And what it tells.
pub(crate) fn sent(arguments: &[&str], input: &str) -> (Vec<[u8; 3]>, String) {
    let output = send(arguments, input);
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{told}");
    (received::<Receiver<Bin>>(&output.stdout), told)
}

/// What it complains of; it must fail with 2 and send nothing.
pub(crate) fn complaint(arguments: &[&str], input: &str) -> String {
    let output = send(arguments, input);
    let told = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{told}");
    assert_eq!(output.stdout, b"");
    told
}

/// One that goes on until it is stopped; its output and what it tells are piped.
pub(crate) fn start(arguments: &[&str]) -> Child {
    Command::new(cargo_bin!("framelock"))
        .arg("send")
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// Sends the process a signal, such as `-INT`.
pub(crate) fn signal(child: &Child, name: &str) {
    let id = child.id().to_string();
    let kill = Command::new("kill").args([name, &id]).status().unwrap();
    assert!(kill.success());
}
