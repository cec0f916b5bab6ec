//! `framelock decode`: from pipes and files, and on Linux at a serial port.

use std::io::{BufRead, BufReader, Read, Write};

use framelock::{BinCrc8, Format};

use crate::process::{CLEAN, LOSSY, shown, signal, start};

#[test]
fn what_is_received_is_written_in_every_format() {
    let both = [&CLEAN[..], &LOSSY].concat();
    let clean = "{\"offset\":6,\"pitch\":127,\"roll\":200,\"yaw\":74}\n";
    let lossy = "{\"offset\":11,\"pitch\":130,\"roll\":196,\"yaw\":74}\n";
    let header = "offset,pitch,roll,yaw\n";
    let text = "byte          6   pitch 127   roll 200   yaw  74\n";
    let summary = "{\"bytes\":12,\"frame_length\":7,\"frames\":1,\"discarded\":5,\"pending\":0,\
                   \"discarded_by\":{\"no_sync\":4,\"broken_sync\":0,\"header\":0,\
                   \"check\":0,\"terminator\":1,\"line_event\":0},\"resynchronisations\":1}\n";
    for (arguments, stream, expected) in [
        (&[][..], &CLEAN[..], clean),
        (&["--policy=discard"], &CLEAN, clean),
        (&["-"], &LOSSY, lossy),
        (&["--policy=discard"], &LOSSY, ""),
        (
            &["--format=csv"],
            &both,
            &format!("{header}6,127,200,74\n18,130,196,74\n"),
        ),
        (&["--format=text"], &CLEAN, text),
        (&["--format=none"], &both, ""),
        (&[], b"", ""),
        (&["--format=csv"], b"", header),
        (&["--summary"], &LOSSY, &format!("{lossy}{summary}")),
    ] {
        let shown = shown(&[&["decode"], arguments].concat(), stream);
        assert_eq!(shown, expected, "{arguments:?}");
    }
}

#[test]
fn the_summary_counts() {
    // A frame whose payload looks like the beginning of another, joined one byte late.
    let late = &b"AB\0AB\0\r".repeat(5)[1..];
    let late_with_check = &BinCrc8::encode([b'A', b'B', 0].into()).repeat(5)[1..];
    for (argument, stream, [bytes, length, frames]) in [
        ("--policy=rescan", &b""[..], [0, 7, 0]),
        ("--policy=discard", &LOSSY, [12, 7, 0]),
        ("--policy=rescan", late, [34, 7, 4]),
        ("--policy=discard", late, [34, 7, 0]),
        ("--frame=bin-crc8", late_with_check, [39, 8, 4]),
    ] {
        let summary = shown(&["decode", "--format=none", "--summary", argument], stream);
        let expected =
            format!("{{\"bytes\":{bytes},\"frame_length\":{length},\"frames\":{frames},");
        assert!(summary.starts_with(&expected), "{argument}: {summary}");
    }
}

#[test]
fn offsets_count_from_the_beginning_of_the_stream() {
    // Longer than any buffer, and the frames lie across the buffers' ends.
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
fn setpoints_come_out_while_the_stream_goes_on_and_ctrl_c_ends_it_with_the_summary() {
    let mut child = start(&["decode", "--summary"]);
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

#[cfg(target_os = "linux")]
mod at_a_serial_port {
    use std::fs::File;
    use std::io::{BufRead, BufReader, Read, Write};
    use std::process::{Child, ChildStdout};

    use crate::process::{CLEAN, complaint, feed, signal, start};
    use crate::pseudo_terminal::line;

    /// A decoder that has shown the header and a frame.
    struct Session {
        far_end: File,
        /// Held open: a pseudo-terminal that nobody has open counts as disconnected.
        _near_end: File,
        port: String,
        child: Child,
        output: BufReader<ChildStdout>,
    }

    fn decoding(arguments: &[&str]) -> Session {
        let (far_end, near_end, port) = line();
        let mut child = start(&[&["decode", &port, "--format=csv"], arguments].concat());
        let output = BufReader::new(child.stdout.take().unwrap());
        let mut session = Session {
            far_end,
            _near_end: near_end,
            port,
            child,
            output,
        };
        session.far_end.write_all(&CLEAN).unwrap();
        assert_eq!(session.next_line(), "offset,pitch,roll,yaw\n");
        assert_eq!(session.next_line(), "6,127,200,74\n");
        session
    }

    impl Session {
        fn next_line(&mut self) -> String {
            let mut line = String::new();
            self.output.read_line(&mut line).unwrap();
            line
        }
    }

    #[test]
    fn setpoints_come_as_the_line_brings_them_until_ctrl_c() {
        let mut session = decoding(&["--summary", "--baud=57600"]);
        for offset in [13, 20, 27] {
            // Every byte must arrive as it was sent: a terminal would alter some.
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
    fn a_disconnection_is_told_with_its_place() {
        let mut session = decoding(&[]);
        drop(session.far_end);
        let mut rest = String::new();
        session.output.read_to_string(&mut rest).unwrap();
        assert_eq!(rest, "");
        let told = complaint(session.child.wait_with_output().unwrap());
        let port = session.port;
        let expected =
            format!("framelock: cannot read {port} behind byte 7: the serial port is gone");
        assert!(told.starts_with(&expected), "{told}");
    }

    #[test]
    fn a_port_in_use_is_told() {
        let mut session = decoding(&[]);
        let told = complaint(feed(start(&["decode", &session.port]), b""));
        assert!(told.contains(&session.port), "{told}");
        session.child.kill().unwrap();
        session.child.wait().unwrap();
    }
}
