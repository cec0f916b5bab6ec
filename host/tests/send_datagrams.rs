//! `framelock send --udp` as its user meets it, over the loopback network.
#![cfg(target_os = "linux")]
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

mod sender;

use std::io::{BufRead, BufReader, Read};
use std::net::{SocketAddr, UdpSocket};
use std::process::Child;

use framelock::{Bin, Receiver};
use sender::{PARK, complaint, received, signal, start};

/// A sender that listens, where it does, and what else it tells.
fn listening(arguments: &[&str]) -> (Child, SocketAddr, BufReader<impl Read>) {
    let udp = ["-", "--udp=127.0.0.1:0", "--rate=1000"];
    let mut child = start(&[&udp[..], arguments].concat());
    let mut told = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    told.read_line(&mut line).unwrap();
    let address = line.trim_end().rsplit(' ').next().unwrap();
    (child, address.parse().unwrap(), told)
}

#[test]
fn datagrams_of_every_form_arrive_as_frames() {
    let (mut child, address, mut told) = listening(&["--stale-after=3600000", "--park-seconds=0"]);
    let mut output = child.stdout.take().unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let mut bytes = Vec::new();
    for (datagram, expected) in [
        (&b"\x01\x02\x03"[..], [1, 2, 3]),
        (b"127,200,74\n", [127, 200, 74]),
        (b"not a setpoint", [127, 200, 74]),
        (b"AB\0\x0D\x41\x42\r", [0x0D, 0x41, 0x42]),
    ] {
        socket.send_to(datagram, address).unwrap();
        // The frame before may come a few times more.
        loop {
            let mut frame = [0; 7];
            output.read_exact(&mut frame).unwrap();
            bytes.extend_from_slice(&frame);
            if frame[3..6] == expected {
                break;
            }
        }
    }
    signal(&child, "-INT");
    output.read_to_end(&mut bytes).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    let mut setpoints = received::<Receiver<Bin>>(&bytes);
    assert_eq!(setpoints[setpoints.len() - 5..], [PARK; 5]);
    setpoints.dedup();
    assert_eq!(
        setpoints,
        [[1, 2, 3], [127, 200, 74], [0x0D, 0x41, 0x42], PARK]
    );
    let mut report = String::new();
    told.read_to_string(&mut report).unwrap();
    assert!(report.contains("a bad datagram from 127.0.0.1"), "{report}");
    assert!(
        report.contains("\"not a setpoint\" is not three numbers"),
        "{report}"
    );
    assert!(
        report.contains("datagrams heard: 4, bad ones among them: 1"),
        "{report}"
    );
}

#[test]
fn nothing_is_sent_before_the_first_datagram_or_of_a_stale_one() {
    let (child, _, _told) = listening(&["--seconds=0.05", "--no-park"]);
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0));
    assert_eq!(ended.stdout, b"");
}

#[test]
fn an_address_in_use_is_told() {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let address = socket.local_addr().unwrap().to_string();
    let told = complaint(&["--udp", &address], "");
    assert!(
        told.contains(&format!("cannot listen for datagrams at {address}")),
        "{told}"
    );
}
