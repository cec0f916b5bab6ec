//! Tests of `framelock decode` with pipes and files, and on Linux with a serial port.

use std::io::{BufRead, BufReader, Lines, Write};
use std::process::{ChildStdin, ChildStdout};
use std::time::Duration;

use framelock_description::SHIPPED;
use framelock_limited::Process;
use framelock_receiving::Protocol;
use framelock_simulation::examples;

use crate::process::{CLEAN, described, shown, start, written};

/// A decoder whose input is still open.
struct Decoding<W> {
    input: W,
    child: Process,
    rows: Lines<BufReader<ChildStdout>>,
}

impl<W: Write> Decoding<W> {
    /// Returns the next row, which arrives while the input is still open.
    fn next_row(&mut self) -> String {
        self.rows.next().unwrap().unwrap()
    }

    /// Writes bytes into the input, and returns the row that they complete.
    fn row_of(&mut self, bytes: &[u8]) -> String {
        self.input.write_all(bytes).unwrap();
        self.next_row()
    }
}

/// Starts a decoder that reads from a pipe.
fn piped(arguments: &[&str]) -> Decoding<ChildStdin> {
    let mut child = start(&[&["decode"], arguments].concat());
    Decoding {
        input: child.stdin.take().unwrap(),
        rows: BufReader::new(child.stdout.take().unwrap()).lines(),
        child,
    }
}

#[test]
fn frames_of_a_stream_have_times() {
    let mut decoding = piped(&["--timestamps", "--format=csv"]);
    assert_eq!(decoding.next_row(), "time,offset,pitch,roll,yaw");
    let times = [0, 30].map(|pause| {
        std::thread::sleep(Duration::from_millis(pause));
        let row = decoding.row_of(&CLEAN);
        row.split_once(',').unwrap().0.parse::<f64>().unwrap()
    });
    assert!(times[1] - times[0] > 0.02, "{times:?}");
    assert!(times[1] < 60.0, "{times:?}");
    drop(decoding.input);
    assert!(decoding.child.wait().unwrap().success());
    let object = shown(&["decode", "--timestamps"], CLEAN);
    assert!(object.starts_with("{\"time\":0."), "{object}");
    let columns = shown(&["decode", "--timestamps", "--format=text"], CLEAN);
    let place = " s  byte          6   pitch 127";
    assert!(columns.contains(place), "{columns}");
}

#[test]
fn after_a_pause_whole_frames_that_follow_a_false_start_are_delivered() {
    let mut decoding = piped(&["--frame=ubx", "--idle-gap=20"]);
    let late = b"\xB5\x62\x01\x07\x5C\x00\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38";
    let row = decoding.row_of(late);
    assert!(row.starts_with("{\"offset\":15,"), "{row}");
}

/// Two kinds of frames that begin with the same byte. The first kind is longer.
const KINDS: &str = "
sync = 'AA'
checksum = { name = 'sum', type = 'u8', at = -1 }
[[kinds]]
name = 'long'
length = 6
[[kinds]]
name = 'short'
length = 4
fields = [ { name = 'a', at = 1, type = 'u8' }, { name = 'b', at = 2, type = 'u8' } ]
";

#[test]
fn frames_of_a_later_kind_are_delivered_after_each_pause_and_at_the_end() {
    let (_folder, kinds) = described(KINDS);
    let short = b"\xAA\x01\x02\xAD";
    let mut decoding = piped(&[&kinds, "--idle-gap=20", "--format=csv"]);
    assert_eq!(decoding.next_row(), "offset,length,kind,a,b");
    for offset in [3, 7, 11] {
        assert_eq!(decoding.row_of(short), format!("{offset},4,short,1,2"));
    }
    let at_end = shown(&["decode", &kinds, "--format=csv"], short);
    assert_eq!(at_end, "offset,length,kind,a,b\n3,4,short,1,2\n");
    assert_eq!(written(&["encode", &kinds], at_end), short);
}

/// Requests and responses of Modbus RTU.
const MODBUS: [&[u8]; 4] = [
    b"\x01\x03\x02\x00\x00\x01\x85\xB2",
    b"\x01\x03\x02\x00\x00\xB8\x44",
    b"\x01\x03\x70\x02\x00\x01\x3F\x0A",
    b"\x01\x03\x02\x17\x81\x77\xD4",
];
const REQUEST: &str = "
[[kinds]]
name = 'request'
length = 8
fields = [{ name = 'register', at = 2, type = 'u16be' }]
";
const RESPONSE: &str = "
[[kinds]]
name = 'response'
length_field = { at = 2, type = 'u8', plus = 5 }
longest = 255
fields = [{ name = 'data', at = 3, type = 'bytes' }]
";

#[test]
fn modbus_is_delivered_after_each_pause_whatever_the_order_of_the_kinds() {
    let common = "sync = '01 03'\nchecksum = { name = 'CRC-16/MODBUS', type = 'u16le', at = -2 }";
    let expected = [
        "8,request,512,",
        "7,response,,x0000",
        "8,request,28674,",
        "7,response,,x1781",
    ];
    for kinds in [[REQUEST, RESPONSE], [RESPONSE, REQUEST]] {
        let (_folder, frame) = described(&[common, kinds[0], kinds[1]].concat());
        let mut decoding = piped(&[&frame, "--idle-gap=20", "--format=csv"]);
        let header = decoding.next_row();
        let columns = |row: &str| {
            let cells: Vec<&str> = row.split(',').collect();
            let place = |name: &str| header.split(',').position(|own| own == name).unwrap();
            ["length", "kind", "register", "data"]
                .map(|name| cells[place(name)])
                .join(",")
        };
        let rows = MODBUS.map(|bytes| columns(&decoding.row_of(bytes)));
        assert_eq!(rows, expected);
    }
    let mut decoding = piped(&["--frame=modbus-rtu", "--idle-gap=20", "--format=csv"]);
    assert_eq!(decoding.next_row(), "offset,length,address,function,data");
    let rows = MODBUS.map(|bytes| decoding.row_of(bytes));
    let expected = [
        "7,8,1,3,x02000001",
        "14,7,1,3,x020000",
        "22,8,1,3,x70020001",
        "29,7,1,3,x021781",
    ];
    assert_eq!(rows, expected);
}

/// The second frame begins with a wrong byte. Without the pause, the decoder would find frames that begin at a wrong
/// byte, as `tests/cases/ends.md` shows.
#[test]
fn a_pause_ends_the_false_frames_of_sbus() {
    let frame = b"\x0F\x04\x0F\xC8\x6C\x11\xC4\x0A\xF0\xB1\x62\xE2\xE0\x03\x1F\xF8\xC0\x07\x3E\xF0\x81\x0F\x7C\x00\x00";
    let mut decoding = piped(&["--frame=sbus", "--idle-gap=4", "--format=csv"]);
    decoding.next_row();
    let row = decoding.row_of(&[&frame[..], &[0x1F], &frame[1..]].concat());
    assert!(row.starts_with("24,25,1796,"), "{row}");
    std::thread::sleep(Duration::from_millis(200));
    for offset in [74, 99] {
        let row = decoding.row_of(frame);
        assert!(row.starts_with(&format!("{offset},25,1796,")), "{row}");
    }
}

#[test]
fn frames_of_each_shipped_description_are_delivered_without_a_hint() {
    for (name, _) in SHIPPED {
        let protocol = Protocol::named(name).unwrap();
        let description = &protocol.description;
        // These bytes come without pauses and breaks, so skip formats whose frames end with a pause or a break.
        if description.ending_event().is_some() {
            continue;
        }
        let frames = examples(description, 7).take(300);
        let frames = frames.map(|frame| description.sent(&frame).unwrap());
        let frames: Vec<Vec<u8>> = frames.collect();
        let arguments = ["decode", "--frame", name, "--format=none", "--summary=-"];
        let summary = shown(&arguments, frames.concat());
        assert!(summary.contains("\"discarded\":0,"), "{name}: {summary}");
    }
}

#[cfg(target_os = "linux")]
mod at_a_serial_port {
    use std::fs::{self, File};
    use std::io::{BufRead, BufReader, Write};
    use std::os::unix::fs::symlink;

    use rustix::termios::{ControlModes, tcgetattr};

    use super::Decoding;
    use crate::process::{CLEAN, complaint, feed, signal, start};
    use crate::pseudo_terminal::{line, read_exactly};

    /// Starts a decoder at a port. The decoder has already printed the header and a frame. Also returns the port's near
    /// end and the port's name. The test must keep the near end open, because the pseudo-terminal would otherwise count
    /// as disconnected.
    fn decoding(arguments: &[&str]) -> (Decoding<File>, File, String) {
        let (far_end, near_end, port) = line();
        let mut child = start(&[&["decode", &port, "--format=csv"], arguments].concat());
        let mut decoding = Decoding {
            input: far_end,
            rows: BufReader::new(child.stdout.take().unwrap()).lines(),
            child,
        };
        assert_eq!(decoding.row_of(&CLEAN), "offset,pitch,roll,yaw");
        assert_eq!(decoding.next_row(), "6,127,200,74");
        (decoding, near_end, port)
    }

    #[test]
    fn setpoints_are_written_as_they_arrive_until_ctrl_c() {
        let (mut decoding, _near_end, _) = decoding(&["--summary=-", "--baud=57600"]);
        for offset in [13, 20, 27] {
            // Every byte must arrive unchanged, although a terminal would alter some bytes.
            assert_eq!(decoding.row_of(&CLEAN), format!("{offset},127,200,74"));
        }
        signal(&mut decoding.child, "-INT");
        let summary = decoding.next_row();
        assert!(summary.starts_with("{\"bytes\":28,\"frame_length\":7,\"frames\":4,"));
        let ended = decoding.child.wait_with_output().unwrap();
        assert_eq!((ended.status.code(), ended.stderr), (Some(0), vec![]));
    }

    #[test]
    fn the_bytes_are_recorded_as_they_arrive_and_no_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("capture.bin");
        let option = format!("--record={}", file.display());
        let (mut decoding, _near_end, _) = decoding(&[&option]);
        let more = [&b"noise"[..], &CLEAN].concat();
        assert_eq!(decoding.row_of(&more), "18,127,200,74");
        let expected = [&CLEAN[..], &more].concat();
        assert_eq!(fs::read(&file).unwrap(), expected);
        let error = complaint(feed(start(&["decode", &option]), &CLEAN));
        assert!(error.contains("name a file that does not exist"), "{error}");
        assert_eq!(fs::read(&file).unwrap(), expected);
    }

    /// A pseudo-terminal has no parity bit, but it stores whether the parity is odd.
    #[test]
    fn the_port_is_set_as_the_options_say() {
        let (stop_bits, odd) = (ControlModes::CSTOPB, ControlModes::PARODD);
        for (options, modes) in [
            (&[][..], ControlModes::empty()),
            (&["--stop-bits=2"], stop_bits),
            (&["--parity=odd", "--stop-bits=2"], stop_bits | odd),
            (&["--parity=even"], ControlModes::empty()),
        ] {
            let (_decoding, near_end, _) = decoding(options);
            let settings = tcgetattr(&near_end).unwrap();
            assert_eq!(
                settings.control_modes & (stop_bits | odd),
                modes,
                "{options:?}"
            );
        }
    }

    #[test]
    fn a_disconnection_is_reported_with_its_offset() {
        let (mut decoding, _near_end, port) = decoding(&[]);
        drop(decoding.input);
        assert!(decoding.rows.next().is_none());
        let error = complaint(decoding.child.wait_with_output().unwrap());
        let expected =
            format!("framelock: cannot read {port} after byte 7: the serial port is gone");
        assert!(error.starts_with(&expected), "{error}");
    }

    #[test]
    fn the_option_wait_waits_for_a_port_that_does_not_exist_yet() {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().join("port");
        let path = name.to_str().unwrap();
        let (mut far_end, _near_end, port) = line();
        for arguments in [
            &["decode", path, "--wait", "--format=csv"][..],
            &["send", path, "--wait", "--motion=step", "--rate=1000"],
        ] {
            let mut child = start(arguments);
            let mut messages = BufReader::new(child.stderr.take().unwrap()).lines();
            let waiting = messages.next().unwrap().unwrap();
            assert!(
                waiting.contains(&format!("waiting for {path}; ")),
                "{waiting}"
            );
            symlink(&port, &name).unwrap();
            if arguments[0] == "send" {
                read_exactly(&mut far_end, &mut [0; 7]);
            } else {
                let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
                assert_eq!(rows.next().unwrap().unwrap(), "offset,pitch,roll,yaw");
                far_end.write_all(&CLEAN).unwrap();
                assert_eq!(rows.next().unwrap().unwrap(), "6,127,200,74");
            }
            child.kill().unwrap();
            child.wait().unwrap();
            fs::remove_file(&name).unwrap();
        }
    }

    #[test]
    fn a_port_in_use_is_an_error() {
        let (_decoding, _near_end, port) = decoding(&[]);
        let error = complaint(feed(start(&["decode", &port]), b""));
        assert!(
            error.contains(&port) && error.contains("`framelock ports` lists"),
            "{error}"
        );
    }
}
