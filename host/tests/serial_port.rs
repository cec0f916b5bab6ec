//! `framelock decode` at a serial port: a pseudo-terminal, which elsewhere takes no baud rate.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

mod pseudo_terminal;

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, ChildStdout, Command, Stdio};

use assert_cmd::cargo::cargo_bin;
use pseudo_terminal::line;

const FRAME: &[u8; 7] = b"AB\0\x7F\xC8\x4A\r";

struct Session {
    /// The far end of the line, until it is unplugged.
    far_end: Option<File>,
    /// Held open: a pseudo-terminal that nobody has open counts as disconnected.
    _near_end: File,
    port: String,
    child: Child,
    output: BufReader<ChildStdout>,
}

impl Session {
    fn start(arguments: &[&str]) -> Self {
        let (far_end, near_end, port) = line();
        let mut child = Command::new(cargo_bin!("framelock"))
            .args(["decode", &port, "--format=csv"])
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let output = BufReader::new(child.stdout.take().unwrap());
        Self {
            far_end: Some(far_end),
            _near_end: near_end,
            port,
            child,
            output,
        }
    }

    fn send_frame(&mut self) {
        let far_end = self.far_end.as_mut().unwrap();
        far_end.write_all(FRAME).unwrap();
    }

    fn next_line(&mut self) -> String {
        let mut line = String::new();
        self.output.read_line(&mut line).unwrap();
        line
    }

    /// What is left of the outputs, and the exit code.
    fn end(self) -> (String, String, Option<i32>) {
        let Self {
            child, mut output, ..
        } = self;
        let mut rest = String::new();
        output.read_to_string(&mut rest).unwrap();
        let ended = child.wait_with_output().unwrap();
        (
            rest,
            String::from_utf8(ended.stderr).unwrap(),
            ended.status.code(),
        )
    }
}

#[test]
fn setpoints_come_as_the_line_brings_them_until_ctrl_c() {
    let mut session = Session::start(&["--summary", "--baud=57600"]);
    for offset in ["offset", "6", "13", "20"] {
        // Every byte must arrive as it was sent: a terminal would alter some.
        session.send_frame();
        let line = session.next_line();
        assert_eq!(line.split(',').next().unwrap(), offset, "{line}");
    }
    assert_eq!(session.next_line(), "27,127,200,74\n");
    let id = session.child.id().to_string();
    let kill = Command::new("kill").args(["-INT", &id]).status().unwrap();
    assert!(kill.success());
    let (summary, complaint, code) = session.end();
    assert_eq!(code, Some(0), "{complaint}");
    assert!(summary.starts_with("{\"bytes\":28,\"frame_length\":7,\"frames\":4,"));
    assert_eq!(complaint, "");
}

#[test]
fn a_disconnection_is_told_with_its_place() {
    let mut session = Session::start(&[]);
    session.send_frame();
    assert_eq!(session.next_line(), "offset,pitch,roll,yaw\n");
    assert_eq!(session.next_line(), "6,127,200,74\n");
    session.far_end = None;
    let port = session.port.clone();
    let (rest, complaint, code) = session.end();
    assert_eq!(rest, "");
    assert_eq!(code, Some(2));
    assert!(complaint.starts_with(&format!(
        "framelock: cannot read {port} behind byte 7: the serial port is gone"
    )));
}

#[test]
fn a_port_in_use_is_told() {
    let mut session = Session::start(&[]);
    session.send_frame();
    assert_eq!(session.next_line(), "offset,pitch,roll,yaw\n");
    let second = Command::new(cargo_bin!("framelock"))
        .args(["decode", &session.port])
        .stdin(Stdio::null())
        .output()
        .unwrap();
    assert_eq!(second.status.code(), Some(2));
    let complaint = String::from_utf8(second.stderr).unwrap();
    assert!(complaint.contains(&session.port), "{complaint}");
    session.child.kill().unwrap();
    session.end();
}
