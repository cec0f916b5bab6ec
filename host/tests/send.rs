//! `framelock send` as its user meets it: over pipes and serial lines.
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

mod pseudo_terminal;
mod sender;

use std::fmt::Write as _;
use std::io::{Read, Write as _};

use assert_cmd::cargo::cargo_bin_cmd;
use framelock::{Bin, BinCrc8, Receiver};
use pseudo_terminal::{line, read_exactly};
use sender::{PARK, complaint, received, send, sent, signal, start};

/// Every setpoint that there is on one axis or another, FF, CR and the sync bytes among them.
fn profile() -> Vec<[u8; 3]> {
    (0..=255)
        .map(|demand| [demand, 255 - demand, 0x41])
        .collect()
}

fn csv(setpoints: &[[u8; 3]], time: impl Fn(usize) -> String) -> String {
    let mut rows = String::new();
    for (row, [pitch, roll, yaw]) in setpoints.iter().enumerate() {
        writeln!(rows, "{}{pitch},{roll},{yaw}", time(row)).unwrap();
    }
    rows
}

#[test]
fn a_profile_arrives_as_it_is_and_then_the_axes_park() {
    let rows = csv(&profile(), |_| String::new());
    let (setpoints, told) = sent(&["--profile=-", "--rate=2000"], &rows);
    assert_eq!(setpoints[..256], profile());
    // A straight line of a second, and five times park itself.
    let park = &setpoints[256..];
    assert_eq!(park.len(), 2005);
    assert!(
        park.windows(2)
            .all(|pair| pair[0][0] >= pair[1][0] && pair[0][1] <= pair[1][1])
    );
    assert_eq!(park[1999..], [PARK; 6]);
    assert!(told.contains(": 256, and 2005 to park"), "{told}");
    assert!(told.contains("ms late"), "{told}");
}

#[test]
fn a_profile_with_times_is_sent_at_these_or_held_at_a_rate() {
    let rows = "time,yaw,pitch,roll\n1.00,3,1,2\n1.02,6,4,5\n1.02,7,7,7\n1.05,9,7,8\n";
    let arguments = ["--profile=-", "--no-park"];
    let (setpoints, told) = sent(&arguments, rows);
    assert_eq!(setpoints, [[1, 2, 3], [4, 5, 6], [7, 7, 7], [7, 8, 9]]);
    assert!(told.contains(": 4, and 0 to park"), "{told}");
    let held = [&arguments[..], &["--rate=100"]].concat();
    let [first, second, third] = [[1, 2, 3], [7, 7, 7], [7, 8, 9]];
    assert_eq!(
        sent(&held, rows).0,
        [first, first, second, second, second, third]
    );
    // The same without a header, and as JSON lines.
    let rows = "0,1,2,3\n0.02,7,7,7\n5e-2,7,8,9\n";
    assert_eq!(
        sent(&held, rows).0,
        [first, first, second, second, second, third]
    );
    let rows = "{\"time\":0,\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"time\":0.01,\"pitch\":7,\"roll\":8,\"yaw\":9}\n";
    assert_eq!(sent(&arguments, rows).0, [first, third]);
}

#[test]
fn a_mistake_in_a_profile_is_told_before_anything_is_sent() {
    for (rows, told) in [
        ("", "standard input: no setpoint in it"),
        ("pitch,roll,yaw\n", "no setpoint in it"),
        ("1,2,3\n4,5,256\n", "line 2: column 3 (yaw): \"256\""),
        (
            "0,1,2,3\n-1,1,2,3\n",
            "line 2: column 1 (time): \"-1\" is not a number of seconds",
        ),
        ("0,1,2,3\nNaN,1,2,3\n", "line 2: column 1 (time): \"NaN\""),
        (
            "1,1,2,3\n0.5,1,2,3\n",
            "line 2: the time 0.5 is before that of the row above, 1",
        ),
        (
            "time,pitch,roll,yaw,time\n",
            "line 1: the header names time twice",
        ),
        (
            "{\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"time\":1,\"pitch\":1,\"roll\":2,\"yaw\":3}\n",
            "line 2: a time, but the rows above have none",
        ),
        (
            "{\"time\":1,\"pitch\":1,\"roll\":2,\"yaw\":3}\n{\"pitch\":1,\"roll\":2,\"yaw\":3}\n",
            "line 2: no time, but the rows above have one",
        ),
        (
            "{\"time\":-1,\"pitch\":1,\"roll\":2,\"yaw\":3}\n",
            "line 1: field time: -1 is not a number of seconds",
        ),
    ] {
        let complaint = complaint(&["--profile=-"], rows);
        assert!(complaint.contains(told), "{rows}: {complaint}");
    }
    assert!(complaint(&["--profile=no/such/file"], "").contains("no/such/file"));
}

#[test]
fn motions_are_what_they_are_called() {
    let arguments = |motion| {
        let motion = ["--motion", motion, "--period=0.04", "--seconds=0.04"];
        [&motion[..], &["--rate=100", "--no-park", "--amplitude=50"]].concat()
    };
    let step = sent(&[&arguments("step")[..], &["--axes=roll,yaw"]].concat(), "").0;
    assert_eq!(
        step,
        [
            [128, 178, 178],
            [128, 178, 178],
            [128, 78, 78],
            [128, 78, 78]
        ]
    );
    let eight = sent(&arguments("figure-of-eight"), "").0;
    assert_eq!(
        eight,
        [
            [128, 128, 128],
            [128, 178, 128],
            [128, 128, 128],
            [128, 78, 128]
        ]
    );
    // A quarter of a turn in each frame.
    let sweep = [&arguments("sine-sweep")[..], &["--from=25", "--to=25"]].concat();
    assert_eq!(sent(&sweep, "").0, [[128; 3], [178; 3], [128; 3], [78; 3]]);
}

#[test]
fn frames_may_have_a_checksum() {
    let output = send(&["--profile=-", "--frame=bin-crc8", "--no-park"], "1,2,3\n");
    assert_eq!(received::<Receiver<BinCrc8>>(&output.stdout), [[1, 2, 3]]);
}

#[test]
fn faults_are_made_as_the_seed_says_and_counted() {
    let rows = csv(&profile(), |_| String::new());
    let faulty = |more: &[&str]| {
        let arguments = ["--profile=-", "--rate=20000", "--no-park", "--flip=0.01"];
        let faults = ["--drop=0.01", "--duplicate=0.01", "--insert=0.01"];
        let output = send(&[&arguments[..], &faults, more].concat(), &rows);
        assert!(output.status.success());
        (output.stdout, String::from_utf8(output.stderr).unwrap())
    };
    let (bytes, told) = faulty(&[]);
    let told = told.lines().find(|line| line.contains("seed 1")).unwrap();
    let numbers: Vec<usize> = told
        .split(|c: char| !c.is_ascii_digit())
        .filter_map(|number| number.parse().ok())
        .collect();
    let &[1, all, dropped, flipped, twice, inserted] = &numbers[..] else {
        panic!("{told}");
    };
    assert_eq!(all, 7 * 256);
    assert_eq!(bytes.len(), all - dropped + twice + inserted);
    assert!(dropped > 0 && flipped > 0 && twice > 0 && inserted > 0);
    assert_eq!(faulty(&[]).0, bytes);
    assert_ne!(faulty(&["--seed=2"]).0, bytes);
}

#[test]
fn ctrl_c_and_termination_park_first() {
    for name in ["-INT", "-TERM"] {
        let motion = ["-", "--motion=step", "--rate=1000", "--park=10,20,30"];
        let mut child = start(&[&motion[..], &["--park-seconds=0.1"]].concat());
        let mut output = child.stdout.take().unwrap();
        let mut bytes = vec![0; 70];
        output.read_exact(&mut bytes).unwrap();
        signal(&child, name);
        output.read_to_end(&mut bytes).unwrap();
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(0), "{name}");
        let setpoints = received::<Receiver<Bin>>(&bytes);
        let motion = setpoints.len() - 105;
        assert_eq!(setpoints[..motion], vec![[228; 3]; motion]);
        // The first tenth of the way, and the end of it.
        assert_eq!(setpoints[motion + 9], [206, 207, 208]);
        assert_eq!(setpoints[motion + 99..], [[10, 20, 30]; 6]);
    }
}

#[test]
fn a_second_ctrl_c_does_not_wait_for_the_parking() {
    let mut child = start(&["-", "--motion=step", "--park-seconds=3600"]);
    let mut output = child.stdout.take().unwrap();
    output.read_exact(&mut [0; 7]).unwrap();
    // The handler takes one signal at a time: two that are pending may count as one.
    loop {
        signal(&child, "-INT");
        if let Some(status) = child.try_wait().unwrap() {
            assert_eq!(status.code(), Some(130));
            break;
        }
    }
}

#[test]
fn what_reads_standard_output_may_have_had_enough() {
    let mut child = start(&["-", "--motion=step", "--rate=1000"]);
    drop(child.stdout.take());
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0));
}

#[test]
fn every_byte_arrives_at_the_other_end_of_a_serial_line() {
    let (mut far_end, _near_end, port) = line();
    let mut file = tempfile::NamedTempFile::new().unwrap();
    let rows = csv(&profile(), |row| format!("0.0{row:03},"));
    file.write_all(rows.as_bytes()).unwrap();
    let profile_file = file.path().to_str().unwrap();
    let child = start(&[
        &port,
        "--profile",
        profile_file,
        "--no-park",
        "--baud=1000000",
    ]);
    let mut bytes = vec![0; 7 * 256];
    read_exactly(&mut far_end, &mut bytes);
    assert_eq!(received::<Receiver<Bin>>(&bytes), profile());
    let ended = child.wait_with_output().unwrap();
    let told = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(0), "{told}");
    assert!(told.contains(&format!("sent to {port}")), "{told}");
}

#[test]
fn a_line_that_is_cut_is_told() {
    let (mut far_end, _near_end, port) = line();
    let child = start(&[&port, "--motion=step", "--rate=1000"]);
    read_exactly(&mut far_end, &mut [0; 7]);
    drop(far_end);
    let ended = child.wait_with_output().unwrap();
    let told = String::from_utf8(ended.stderr).unwrap();
    assert_eq!(ended.status.code(), Some(2), "{told}");
    assert!(
        told.contains(&format!("cannot write to {port}: ")),
        "{told}"
    );
    assert!(told.contains("frames sent to"), "{told}");
}

#[test]
fn what_the_line_cannot_carry_is_not_begun() {
    let (_far_end, _near_end, port) = line();
    let complaint = |arguments: &[&str]| {
        let ended = start(&[&[port.as_str()], arguments].concat());
        let ended = ended.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(2));
        String::from_utf8(ended.stderr).unwrap()
    };
    let told = complaint(&["--motion=step", "--rate=200", "--baud=9600"]);
    assert!(
        told.contains("200 frames of 7 bytes in a second need 14000 baud"),
        "{told}"
    );
    assert!(told.contains("lower --rate to 137 at most"), "{told}");
    let told = complaint(&["--motion=step", "--rate=1500", "--frame=bin-crc8"]);
    assert!(
        told.contains("1500 frames of 8 bytes in a second need 120000 baud"),
        "{told}"
    );
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(b"0,1,1,1\n0.02,1,1,1\n0.021,1,1,1\n")
        .unwrap();
    let told = complaint(&["--profile", file.path().to_str().unwrap(), "--baud=9600"]);
    assert!(
        told.contains("setpoints 2 and 3 of the profile are 1 ms apart"),
        "{told}"
    );
    assert!(told.contains("a frame takes 7.29"), "{told}");
}

#[test]
fn impossible_lines_and_options_are_named() {
    for (arguments, told) in [
        (&["-"][..], "--motion <MOTION>|--profile <FILE>|--udp"),
        (&["-", "--motion=step", "--udp=127.0.0.1:0"], "--motion"),
        (&["-", "--motion=step", "--baud=9600"], "--baud"),
        (&["-", "--motion=step", "--drop=2"], "a number from 0 to 1"),
        (
            &["-", "--motion=step", "--park=1,2"],
            "is not three numbers",
        ),
        (&["-", "--motion=step", "--park=1,2,300"], "yaw \"300\""),
        (
            &["-", "--motion=step", "--no-park", "--park=1,2,3"],
            "--no-park",
        ),
        (
            &["/dev/null", "--motion=step"],
            "/dev/null is no serial port",
        ),
        (
            &["no/such/port", "--motion=step"],
            "there is no no/such/port",
        ),
    ] {
        let ended = start(arguments).wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(2));
        let complaint = String::from_utf8(ended.stderr).unwrap();
        assert!(complaint.contains(told), "{arguments:?}: {complaint}");
    }
}

#[test]
fn help_has_examples() {
    let mut command = cargo_bin_cmd!("framelock");
    let output = command.args(["send", "--help"]).output().unwrap();
    let help = String::from_utf8(output.stdout).unwrap();
    assert!(help.contains("Examples:\n  framelock send "));
    assert!(help.contains("A datagram is three bytes"));
}
