//! Tests of `framelock decode` with pipes and files, and on Linux with a serial port.

use std::io::{BufRead, BufReader, Read, Write};
use std::time::{Duration, Instant, SystemTime};

use crate::process::{CLEAN, complaint, described, run, shown, signal, start, written};

#[test]
fn frames_of_a_stream_have_times_and_frames_of_a_file_have_none() {
    let mut child = start(&["decode", "--timestamps", "--format=csv"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    let began = Instant::now();
    let mut times = Vec::new();
    for pause in [0, 30] {
        std::thread::sleep(Duration::from_millis(pause));
        input.write_all(&CLEAN).unwrap();
        let mut row = rows.next().unwrap().unwrap();
        if row == "time,offset,pitch,roll,yaw" {
            row = rows.next().unwrap().unwrap();
        }
        let (time, _) = row.split_once(',').unwrap();
        times.push(time.parse::<f64>().unwrap());
    }
    drop(input);
    assert!(child.wait().unwrap().success());
    assert!(times[1] - times[0] > 0.02, "{times:?}");
    assert!(times[1] - times[0] <= began.elapsed().as_secs_f64());
    // With `--timestamps=unix`, the other formats contain the time since 1970.
    let object = shown(&["decode", "--timestamps=unix"], CLEAN);
    let seconds = object.strip_prefix("{\"time\":").unwrap();
    let (seconds, _) = seconds.split_once(',').unwrap();
    let since = SystemTime::UNIX_EPOCH.elapsed().unwrap().as_secs_f64();
    assert!((seconds.parse::<f64>().unwrap() - since).abs() < 60.0);
    let columns = shown(&["decode", "--timestamps", "--format=text"], CLEAN);
    assert!(
        columns.contains(" s  byte          6   pitch 127"),
        "{columns}"
    );

    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(&CLEAN).unwrap();
    let name = file.path().to_str().unwrap();
    let told = complaint(run(&["decode", "--timestamps", name], ""));
    assert!(
        told.contains("does not record when its bytes arrived"),
        "{told}"
    );
}

#[test]
fn if_only_other_kinds_of_frames_arrive_a_line_says_so() {
    let ack = b"\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38";
    let only = |names| {
        let output = run(&["decode", "--frame=ubx", "--only", names], ack);
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    assert_eq!(
        only("NAV-PVT,ACK-NAK"),
        "framelock: frames of ubx: 1, but none of them is NAV-PVT or ACK-NAK\n"
    );
    assert_eq!(only("ACK-ACK"), "");
}

#[test]
fn offsets_count_from_the_beginning_of_the_stream() {
    // The stream is longer than any buffer, and frames cross the ends of buffers.
    let frames = 200_000;
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(b"???").unwrap();
    file.write_all(&CLEAN.repeat(frames)).unwrap();
    let rows = shown(
        &["decode", "--format=csv", file.path().to_str().unwrap()],
        b"",
    );
    let offsets = rows.lines().skip(1);
    assert_eq!(offsets.clone().count(), frames);
    for (frame, row) in offsets.enumerate() {
        assert_eq!(row, format!("{},127,200,74", 3 + 7 * frame + 6));
    }
}

#[test]
#[cfg(unix)]
fn setpoints_are_written_before_the_stream_ends_and_ctrl_c_writes_the_summary() {
    let mut child = start(&["decode", "--summary=-"]);
    let mut input = child.stdin.take().unwrap();
    let mut output = BufReader::new(child.stdout.take().unwrap());
    for offset in [6, 13, 20] {
        input.write_all(&CLEAN).unwrap();
        let mut line = String::new();
        output.read_line(&mut line).unwrap();
        let expected = format!("{{\"offset\":{offset},\"pitch\":127,\"roll\":200,\"yaw\":74}}\n");
        assert_eq!(line, expected);
    }
    signal(&child, "-INT");
    let mut summary = String::new();
    output.read_to_string(&mut summary).unwrap();
    assert!(summary.starts_with("{\"bytes\":21,"), "{summary}");
    assert_eq!(summary.lines().count(), 1);
    assert_eq!(child.wait().unwrap().code(), Some(0));
    drop(input);
}

#[test]
fn after_a_pause_whole_frames_that_follow_a_false_start_are_delivered() {
    let mut child = start(&["decode", "--frame=ubx", "--idle-gap=20"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    input
        .write_all(b"\xB5\x62\x01\x07\x5C\x00\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38")
        .unwrap();
    // The rows arrive while the input is still open.
    assert!(rows.next().unwrap().unwrap().starts_with("{\"offset\":15,"));
    drop(input);
    assert!(child.wait().unwrap().success());
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
    let mut child = start(&["decode", &kinds, "--idle-gap=20", "--format=csv"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    for offset in [3, 7, 11] {
        input.write_all(b"\xAA\x01\x02\xAD").unwrap();
        // The row arrives while the input is still open.
        let mut row = rows.next().unwrap().unwrap();
        if row == "offset,length,kind,a,b" {
            row = rows.next().unwrap().unwrap();
        }
        assert_eq!(row, format!("{offset},4,short,1,2"));
    }
    drop(input);
    assert!(child.wait().unwrap().success());
    let at_end = shown(&["decode", &kinds, "--format=csv"], b"\xAA\x01\x02\xAD");
    assert_eq!(at_end, "offset,length,kind,a,b\n3,4,short,1,2\n");
    let made = written(&["encode", &kinds], at_end);
    assert_eq!(made, b"\xAA\x01\x02\xAD");
}

#[cfg(target_os = "linux")]
mod at_a_serial_port {
    use std::fs::{self, File};
    use std::io::{BufRead, BufReader, Read, Write};
    use std::os::unix::fs::symlink;
    use std::process::ChildStdout;

    use framelock_limited::Process;
    use rustix::io::ioctl_fionread;
    use rustix::termios::{ControlModes, tcgetattr};

    use crate::process::{CLEAN, complaint, feed, signal, start};
    use crate::pseudo_terminal::{line, read_exactly};

    /// A decoder that has already printed the header and a frame.
    struct Decoding {
        far_end: File,
        /// The test keeps this end open, because the pseudo-terminal would otherwise count as disconnected.
        near_end: File,
        port: String,
        child: Process,
        output: BufReader<ChildStdout>,
    }

    fn decoding(arguments: &[&str]) -> Decoding {
        let (far_end, near_end, port) = line();
        let mut child = start(&[&["decode", &port, "--format=csv"], arguments].concat());
        let output = BufReader::new(child.stdout.take().unwrap());
        let mut session = Decoding {
            far_end,
            near_end,
            port,
            child,
            output,
        };
        session.far_end.write_all(&CLEAN).unwrap();
        assert_eq!(session.next_line(), "offset,pitch,roll,yaw\n");
        assert_eq!(session.next_line(), "6,127,200,74\n");
        session
    }

    impl Decoding {
        fn next_line(&mut self) -> String {
            let mut line = String::new();
            self.output.read_line(&mut line).unwrap();
            line
        }
    }

    #[test]
    fn setpoints_are_written_as_they_arrive_until_ctrl_c() {
        let mut session = decoding(&["--summary=-", "--baud=57600"]);
        for offset in [13, 20, 27] {
            // Every byte must arrive unchanged, although a terminal would alter some bytes.
            session.far_end.write_all(&CLEAN).unwrap();
            assert_eq!(session.next_line(), format!("{offset},127,200,74\n"));
        }
        signal(&session.child, "-INT");
        let summary = session.next_line();
        assert!(summary.starts_with("{\"bytes\":28,\"frame_length\":7,\"frames\":4,"));
        let ended = session.child.wait_with_output().unwrap();
        assert_eq!((ended.status.code(), ended.stderr), (Some(0), vec![]));
    }

    #[test]
    fn the_bytes_are_recorded_as_they_arrive_and_no_file_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("capture.bin");
        let option = format!("--record={}", file.display());
        let mut session = decoding(&[&option]);
        session.far_end.write_all(b"noise").unwrap();
        session.far_end.write_all(&CLEAN).unwrap();
        assert_eq!(session.next_line(), "18,127,200,74\n");
        let expected = [&CLEAN[..], b"noise", &CLEAN].concat();
        assert_eq!(fs::read(&file).unwrap(), expected);
        signal(&session.child, "-INT");
        session.child.wait().unwrap();
        let told = complaint(feed(start(&["decode", &option]), &CLEAN));
        assert!(told.contains("name a file that does not exist"), "{told}");
        assert_eq!(fs::read(&file).unwrap(), expected);
    }

    /// A pseudo-terminal has no parity bit, but it stores the parity setting.
    #[test]
    fn the_port_is_set_as_the_options_say() {
        for (options, modes) in [
            (&[][..], ControlModes::empty()),
            (&["--stop-bits=2"], ControlModes::CSTOPB),
            (
                &["--parity=odd", "--stop-bits=2"],
                ControlModes::CSTOPB | ControlModes::PARODD,
            ),
            (&["--parity=even"], ControlModes::empty()),
        ] {
            let mut session = decoding(options);
            let settings = tcgetattr(&session.near_end).unwrap();
            let all = ControlModes::CSTOPB | ControlModes::PARODD;
            assert_eq!(settings.control_modes & all, modes, "{options:?}");
            session.child.kill().unwrap();
            session.child.wait().unwrap();
        }
    }

    #[test]
    fn a_disconnection_is_reported_with_its_offset() {
        let mut session = decoding(&[]);
        drop(session.far_end);
        let mut rest = String::new();
        session.output.read_to_string(&mut rest).unwrap();
        assert_eq!(rest, "");
        let told = complaint(session.child.wait_with_output().unwrap());
        let port = session.port;
        let expected =
            format!("framelock: cannot read {port} after byte 7: the serial port is gone");
        assert!(told.starts_with(&expected), "{told}");
    }

    #[test]
    fn a_port_that_comes_back_is_read_again_and_no_frame_reaches_across_the_gap() {
        let folder = tempfile::tempdir().unwrap();
        let name = folder.path().join("port");
        let [
            (mut far_end, near_end, port),
            (mut second, _near_end, second_port),
        ] = [line(), line()];
        symlink(port, &name).unwrap();
        let path = name.to_str().unwrap();
        let mut child = start(&["decode", path, "--format=csv", "--reconnect"]);
        let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
        let mut told = BufReader::new(child.stderr.take().unwrap()).lines();
        far_end.write_all(&CLEAN).unwrap();
        far_end.write_all(&CLEAN[..4]).unwrap();
        assert_eq!(rows.next().unwrap().unwrap(), "offset,pitch,roll,yaw");
        assert_eq!(rows.next().unwrap().unwrap(), "6,127,200,74");
        fs::remove_file(&name).unwrap();
        // Bytes that were not read yet are lost with the line.
        while ioctl_fionread(&near_end).unwrap() > 0 {
            std::thread::yield_now();
        }
        drop((far_end, near_end));
        let gone = told.next().unwrap().unwrap();
        let expected = format!("UTC: cannot read {path} after byte 11: the serial port is gone");
        assert!(gone.contains(&expected), "{gone}");
        symlink(second_port, &name).unwrap();
        let back = told.next().unwrap().unwrap();
        assert!(back.ends_with("UTC: the port is back"), "{back}");
        // The second half of the interrupted frame must not complete the frame.
        second.write_all(&CLEAN[4..]).unwrap();
        second.write_all(&CLEAN).unwrap();
        assert_eq!(rows.next().unwrap().unwrap(), "20,127,200,74");
        child.kill().unwrap();
        child.wait().unwrap();
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
            let mut told = BufReader::new(child.stderr.take().unwrap()).lines();
            let waiting = told.next().unwrap().unwrap();
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
        let mut session = decoding(&[]);
        let told = complaint(feed(start(&["decode", &session.port]), b""));
        assert!(
            told.contains(&session.port) && told.contains("`framelock ports` lists"),
            "{told}"
        );
        session.child.kill().unwrap();
        session.child.wait().unwrap();
    }
}
