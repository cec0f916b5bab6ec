//! Tests of `framelock send` as a process, over pipes, serial lines and the loopback network.

use std::io::{BufRead, BufReader, Read};
use std::net::UdpSocket;

use framelock::Receiver;
use framelock::motion::Bin;

use crate::process::{complaint, feed, run, signal, start, text};
use crate::pseudo_terminal::{line, read_exactly};

/// The default park setpoint.
const PARK: [u8; 3] = [128, 128, 128];

fn received(bytes: impl AsRef<[u8]>) -> Vec<[u8; 3]> {
    crate::process::received(Receiver::<Bin>::new(), bytes)
}

/// Runs `framelock send -`, which must succeed, and returns the setpoints and the messages.
fn sent(arguments: &[&str], input: &str) -> (Vec<[u8; 3]>, String) {
    let output = run(&[&["send", "-"], arguments].concat(), input);
    let message = text(output.stderr);
    assert!(output.status.success(), "{message}");
    (received(output.stdout), message)
}

/// Returns a profile in which pitch and roll take every value, including FF, CR and the sync bytes.
fn profile() -> Vec<[u8; 3]> {
    (0..=255)
        .map(|demand| [demand, 255 - demand, 0x41])
        .collect()
}

fn csv(setpoints: &[[u8; 3]]) -> String {
    let row = |[pitch, roll, yaw]: &[u8; 3]| format!("{pitch},{roll},{yaw}\n");
    setpoints.iter().map(row).collect::<Vec<_>>().concat()
}

#[test]
fn a_profile_arrives_unchanged_and_then_the_axes_park() {
    let rows = csv(&profile());
    let (setpoints, message) = sent(&["--profile=-", "--rate=2000"], &rows);
    assert_eq!(setpoints[..256], profile());
    // Parking moves the axes in a straight line for one second, then repeats the park setpoint five times.
    let park = &setpoints[256..];
    assert_eq!(park.len(), 2005);
    let approaches = |pair: &[[u8; 3]]| pair[0][0] >= pair[1][0] && pair[0][1] <= pair[1][1];
    assert!(park.windows(2).all(approaches));
    assert_eq!(park[1999..], [PARK; 6]);
    assert!(message.contains(": 256, and 2005 to park"), "{message}");
    assert!(message.contains("ms late"), "{message}");
}

#[test]
fn ctrl_c_and_termination_park_first() {
    for name in ["-INT", "-TERM"] {
        let mut child = start(&["send", "-", "--motion=step", "--rate=100"]);
        let mut output = child.stdout.take().unwrap();
        let mut bytes = vec![0; 70];
        output.read_exact(&mut bytes).unwrap();
        signal(&mut child, name);
        output.read_to_end(&mut bytes).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(0), "{name}");
        let setpoints = received(bytes);
        let motion = setpoints.len() - 105;
        assert_eq!(setpoints[..motion], vec![[228; 3]; motion]);
        assert_eq!(setpoints[motion + 49], [178; 3]);
        assert_eq!(setpoints[motion + 99..], [PARK; 6]);
    }
}

#[test]
fn a_second_ctrl_c_does_not_wait_for_the_parking() {
    let mut child = start(&["send", "-", "--motion=step", "--rate=1"]);
    let mut output = child.stdout.take().unwrap();
    output.read_exact(&mut [0; 7]).unwrap();
    // The handler takes one signal at a time, so two pending signals may count as one.
    loop {
        signal(&mut child, "-INT");
        if let Some(status) = child.try_wait().unwrap() {
            assert_eq!(status.code(), Some(130));
            break;
        }
    }
}

#[test]
fn every_byte_arrives_at_the_other_end_of_a_serial_line() {
    let (mut far_end, _near_end, port) = line();
    let options = ["--no-park", "--baud=1000000", "--rate=10000"];
    let child = start(&[&["send", &port, "--profile=-"], &options[..]].concat());
    let ended = std::thread::spawn(move || feed(child, csv(&profile()).as_bytes()));
    let mut bytes = vec![0; 7 * 256];
    read_exactly(&mut far_end, &mut bytes);
    assert_eq!(received(bytes), profile());
    let ended = ended.join().unwrap();
    let message = text(ended.stderr);
    assert_eq!(ended.status.code(), Some(0), "{message}");
    assert!(message.contains(&format!("sent to {port}")), "{message}");
}

#[test]
fn a_line_that_is_cut_is_an_error() {
    let (mut far_end, _near_end, port) = line();
    let child = start(&["send", &port, "--motion=step", "--rate=1000"]);
    read_exactly(&mut far_end, &mut [0; 7]);
    drop(far_end);
    let message = complaint(child.wait_with_output().unwrap());
    assert!(
        message.contains(&format!("cannot write to {port}: ")),
        "{message}"
    );
    assert!(message.contains("frames sent to"), "{message}");
}

#[test]
fn a_transmission_that_the_line_cannot_carry_does_not_start() {
    let (_far_end, _near_end, port) = line();
    for case in "\
        --motion=step --rate=200 --baud=9600 => 200 frames of 7 bytes in a second need 14000 baud
        --motion=step --rate=200 --baud=9600 => lower --rate to 137 at most
        --motion=step --rate=1500 --frame=bin-crc8 => 1500 frames of 8 bytes in a second need 120000
        --motion=step --rate=120 --baud=9600 --parity=even --stop-bits=2 => lower --rate to 114 at most"
        .lines()
    {
        let (arguments, message) = case.split_once(" => ").unwrap();
        let arguments = ["send", &port].into_iter().chain(arguments.split_whitespace());
        let complaint = complaint(run(&arguments.collect::<Vec<_>>(), ""));
        assert!(complaint.contains(message), "{case}: {complaint}");
    }
}

#[test]
fn datagrams_of_every_form_arrive_as_frames() {
    let udp = ["send", "-", "--udp=127.0.0.1:0", "--rate=1000"];
    let mut child = start(&[&udp[..], &["--stale-after=3600000"]].concat());
    let mut message = BufReader::new(child.stderr.take().unwrap());
    let mut listening = String::new();
    message.read_line(&mut listening).unwrap();
    let address = listening.trim_end().rsplit(' ').next().unwrap();
    let mut output = child.stdout.take().unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut bytes = Vec::new();
    for (datagram, expected) in [
        (&b"\x01\x02\x03"[..], [1, 2, 3]),
        (b"127,200,74\n", [127, 200, 74]),
        (b"not a setpoint", [127, 200, 74]),
        (b"\x0D\x41\x42", [0x0D, 0x41, 0x42]),
    ] {
        socket.send_to(datagram, address).unwrap();
        // The previous frame may be repeated a few times.
        loop {
            let mut frame = [0; 7];
            output.read_exact(&mut frame).unwrap();
            bytes.extend_from_slice(&frame);
            if frame[3..6] == expected {
                break;
            }
        }
    }
    signal(&mut child, "-INT");
    output.read_to_end(&mut bytes).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let mut setpoints = received(bytes);
    assert_eq!(setpoints[setpoints.len() - 5..], [PARK; 5]);
    // The setpoints after these three are the way to the park setpoint.
    setpoints.dedup();
    assert_eq!(
        setpoints[..3],
        [[1, 2, 3], [127, 200, 74], [0x0D, 0x41, 0x42]]
    );
    let mut report = String::new();
    message.read_to_string(&mut report).unwrap();
    for message in [
        "a bad datagram from 127.0.0.1",
        "\"not a setpoint\" is not three numbers",
        "datagrams received: 4, of which bad: 1",
    ] {
        assert!(report.contains(message), "{report}");
    }
}

#[test]
fn without_a_datagram_nothing_is_sent_and_an_address_in_use_is_an_error() {
    let udp = ["send", "-", "--rate=1000", "--seconds=0.05", "--no-park"];
    let ended = run(&[&udp[..], &["--udp=127.0.0.1:0"]].concat(), "");
    assert_eq!((ended.status.code(), ended.stdout), (Some(0), vec![]));
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap().to_string();
    let message = complaint(run(&["send", "-", "--udp", &address], ""));
    assert!(
        message.contains(&format!("cannot listen for datagrams at {address}")),
        "{message}"
    );
}
