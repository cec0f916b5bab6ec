//! What real lines carry: long frames, damage, ends in the middle, text that a terminal would act on. Nothing of it is
//! lost without a word.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;

use crate::process::{complaint, run, shown, start, text, written};

/// A UBX frame of class 2 with so many bytes of payload.
fn ubx(payload: usize) -> Vec<u8> {
    let payload = "B5".repeat(payload);
    written(
        &["encode", "--frame=ubx"],
        format!("class,id,payload\n2,21,{payload}\n"),
    )
}

/// A description in a file, and the option that names it.
fn described(description: &str) -> (tempfile::TempDir, PathBuf, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    fs::write(&path, description).unwrap();
    let option = format!("--frame={}", path.display());
    (folder, path, option)
}

#[test]
fn lines_of_text_end_with_their_end_alone() {
    let (_folder, _, frame) = described(
        "terminator = '0D 0A'\nlongest = 40\nfields = [{ name = 'line', at = 0, type = 'text' }]\n",
    );
    let lines = "1.5;2\r\n\r\n#3\r\n";
    let rows = shown(&["decode", &frame, "--format=csv"], lines);
    assert_eq!(rows, "offset,length,line\n6,7,1.5;2\n8,2,\n12,4,#3\n");
    assert_eq!(written(&["encode", &frame], rows), lines.as_bytes());
}

/// RXM-RAWX with 40 measurements has 1 336 bytes; frames of 2 252 have been seen.
#[test]
fn long_frames_are_received_and_too_long_ones_named() {
    let both = [ubx(1328), ubx(2244)].concat();
    let rows = shown(&["decode", "--frame=ubx", "--format=csv"], &both);
    let lengths: Vec<&str> = rows
        .lines()
        .skip(1)
        .filter_map(|row| row.split(',').nth(1))
        .collect();
    assert_eq!(lengths, ["1336", "2252"]);

    let (_folder, path, frame) = described("any_of = ['ubx']");
    let shorter = shown(&["decode", "--frame=ubx", "--describe"], "")
        .replace("longest = 4096", "longest = 1240");
    fs::write(&path, shorter).unwrap();
    let stream = [ubx(8), both].concat();
    let output = run(&["decode", &frame, "--summary=-", "--format=none"], &stream);
    assert!(text(output.stdout).contains("\"frames\":1,\"frame_bytes\":16,"));
    let hint = text(output.stderr);
    let expected = "framelock: 3588 of 3604 bytes went by behind headers which tell more bytes than longest, 1240: \
                    raise longest in the description, if they are frames";
    assert!(
        hint.starts_with(expected) && hint.lines().count() == 1,
        "{hint}"
    );
}

#[test]
fn headers_that_are_refused_are_counted_by_why_and_the_key_is_named() {
    // Messages of number 9, which this description does not know; and states that are none.
    let (_folder, _, frame) = described(
        "sync = '24'\nlength = 4\nfields = [{ name = 'a', at = 1, type = 'u8', value = [1, 2] },
         { name = 'b', at = 2, type = 'u8', value = 7 }]",
    );
    for (stream, counter, key) in [
        (
            [0x24, 9, 7, 0],
            "\"unknown_message\":100,",
            "add them to messages, or to the field's value",
        ),
        ([0x24, 1, 8, 0], "\"terminator\":100,", ""),
    ] {
        let output = run(&["decode", &frame, "--summary=-"], stream.repeat(100));
        let (summary, hint) = (text(output.stdout), text(output.stderr));
        assert!(summary.contains(counter), "{summary}");
        assert!(
            hint.contains(key) && hint.is_empty() == key.is_empty(),
            "{hint}"
        );
    }
    let told = complaint(run(
        &["encode", "--frame=mavlink2"],
        "compatible_flags,sequence,system,component,message,payload,signature\n0,0,1,1,99999,00,\n",
    ));
    assert!(
        told.contains("line 2: message 99999: there is no such message"),
        "{told}"
    );
}

#[test]
fn at_the_end_of_a_stream_whole_frames_behind_a_false_beginning_come_out() {
    let stream = b"\xB5\x62\x01\x07\x5C\x00\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38";
    let rows = shown(&["decode", "--frame=ubx", "--summary=-"], stream);
    assert!(
        rows.starts_with(
            "{\"offset\":15,\"length\":10,\"class\":5,\"id\":1,\"payload\":\"0601\"}\n"
        ),
        "{rows}"
    );
    assert!(rows.contains("\"discarded\":6,\"pending\":0,"), "{rows}");
}

#[test]
fn after_a_pause_whole_frames_behind_a_false_beginning_come_out() {
    let mut child = start(&["decode", "--frame=ubx", "--idle-gap=20"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    input
        .write_all(b"\xB5\x62\x01\x07\x5C\x00\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38")
        .unwrap();
    // The input is still open.
    assert!(rows.next().unwrap().unwrap().starts_with("{\"offset\":15,"));
    drop(input);
    assert!(child.wait().unwrap().success());
    let file = tempfile::NamedTempFile::new().unwrap();
    let told = complaint(run(
        &["decode", "--idle-gap=20", file.path().to_str().unwrap()],
        "",
    ));
    assert!(
        told.contains("--idle-gap") && told.contains("does not say when its bytes came"),
        "{told}"
    );
}

/// SBUS2 ends frames with 04, 14, 24 and 34; the upper channels of iBUS are in the upper bits of others.
#[test]
fn variants_of_radio_receivers_are_received() {
    let mut stream = Vec::new();
    for end in [0x00, 0x04, 0x14, 0x24, 0x34, 0x44] {
        stream.extend([&[0x0F][..], &[0x11; 22], &[0, end]].concat());
    }
    let rows = shown(&["decode", "--frame=sbus", "--format=csv"], &stream);
    let ends: Vec<&str> = rows
        .lines()
        .skip(1)
        .filter_map(|row| row.rsplit(',').next())
        .collect();
    assert_eq!(ends, ["0", "4", "20", "36", "52"]);
    assert_eq!(written(&["encode", "--frame=sbus"], &rows), stream[..125]);

    let upper = "0,0,14,0,5,0,0,0,0,0,0,0,0,0";
    let (channels, columns) = (vec!["1500"; 14].join(","), |name: &str| {
        (1..=14)
            .map(|number| format!("{name}{number}"))
            .collect::<Vec<_>>()
            .join(",")
    });
    let row = format!(
        "{},{}\n{channels},{upper}\n",
        columns("channel"),
        columns("upper")
    );
    let frame = written(&["encode", "--frame=ibus"], row);
    assert_eq!(frame[6..8], (1500_u16 + 0xE000).to_le_bytes());
    let row = shown(&["decode", "--frame=ibus", "--format=csv"], &frame);
    assert!(
        row.ends_with(&format!("\n31,32,{channels},{upper}\n")),
        "{row}"
    );
}

/// The addresses of a flight controller, of all, of a handset, a receiver and a transmitter module.
#[test]
fn crsf_from_every_device_keeps_its_address() {
    let addresses = [200, 0, 234, 236, 238];
    let rows = addresses
        .map(|address| format!("{address},20,0102\n"))
        .concat();
    let stream = written(
        &["encode", "--frame=crsf"],
        format!("address,type,payload\n{rows}"),
    );
    let received = shown(&["decode", "--frame=crsf", "--format=csv"], &stream);
    let received: Vec<&str> = received
        .lines()
        .skip(1)
        .filter_map(|row| row.split(',').nth(2))
        .collect();
    assert_eq!(received, addresses.map(|address| address.to_string()));
    let told = complaint(run(&["encode", "--frame=crsf"], "1,20,0102\n"));
    assert!(
        told.contains("address cannot be that: the description says what stands in its place"),
        "{told}"
    );
}

#[test]
fn signed_frames_of_mavlink_come_with_their_signature() {
    let rows = "{\"compatible_flags\":0,\"sequence\":7,\"system\":1,\"component\":1,\"message\":193,\"payload\":\"0102\",\
                \"signature\":\"00112233445566778899AABBCC\"}\n";
    let stream = written(&["encode", "--frame=mavlink2"], rows);
    assert_eq!((stream.len(), stream[2]), (27, 1));
    let again = shown(&["decode", "--frame=mavlink2"], &stream);
    assert_eq!(again.replace("\"offset\":26,\"length\":27,", ""), rows);
    assert_eq!(written(&["encode", "--frame=mavlink2"], again), stream);
}

#[test]
fn what_a_terminal_would_act_on_is_escaped_in_every_format_and_comes_back() {
    let (_folder, _, frame) = described(
        "sync = '24'\nterminator = '0A'\nlongest = 40\nfields = [{ name = 'note', at = 1, type = 'text' }]\n",
    );
    let stream = b"$\x1B]0;owned\x07\\ \xFF\x7F\xC2\x9B2J\n";
    let escaped = r"\x1B]0;owned\x07\\ \xFF\x7F\xC2\x9B2J";
    for arguments in [
        &["decode", "--format=jsonl"][..],
        &["decode", "--format=csv"],
        &["decode", "--format=text"],
        &["trace"],
        &["trace", "--format=jsonl"],
    ] {
        let rows = shown(&[arguments, &[&frame]].concat(), stream);
        assert!(
            !rows.chars().any(|c| c.is_control() && c != '\n'),
            "{rows:?}"
        );
        let is_json = arguments.contains(&"--format=jsonl");
        let expected = if is_json {
            escaped.replace('\\', r"\\")
        } else {
            escaped.to_owned()
        };
        assert!(rows.contains(&expected), "{rows}");
        if arguments[0] == "decode" && arguments[1] != "--format=text" {
            assert_eq!(written(&["encode", &frame], rows), stream);
        }
    }
    let told = complaint(run(&["decode", "--input=hex"], "41 \x1B[2J\n"));
    assert!(
        told.contains(r"word 2, '\x1B[2J', has '\x1B'") && !told.contains('\x1B'),
        "{told}"
    );
    let told = complaint(run(&["decode", "--input=hex"], "1".repeat(3_000_001)));
    assert!(told.len() < 300, "{}", told.len());
    let told = complaint(run(&["encode"], "1,2,\x1B[2J\n"));
    assert!(
        told.contains(r#"yaw "\x1B[2J" is not"#) && !told.contains('\x1B'),
        "{told}"
    );
}

#[test]
#[cfg(unix)]
fn a_description_without_end_is_an_error() {
    let told = complaint(run(&["decode", "--frame=/dev/zero"], ""));
    assert!(
        told.contains("/dev/zero is longer than 1048576 bytes"),
        "{told}"
    );
}

/// Two frames in one read have the same time, and the line takes a while for them.
#[test]
#[cfg(target_os = "linux")]
fn a_recording_with_equal_times_is_sent() {
    let frames = written(&["encode"], "1,2,3\n4,5,6\n7,8,9\n");
    let rows = shown(&["decode", "--timestamps", "--format=csv"], &frames);
    let times: Vec<&str> = rows
        .lines()
        .skip(1)
        .filter_map(|row| row.split(',').next())
        .collect();
    assert!(
        times.len() == 3 && times.iter().all(|time| *time == times[0]),
        "{rows}"
    );
    let (mut far_end, _near_end, port) = crate::pseudo_terminal::line();
    let child = start(&["send", &port, "--profile=-", "--no-park"]);
    let sent = std::thread::spawn(move || crate::process::feed(child, rows.as_bytes()));
    let mut bytes = vec![0; frames.len()];
    crate::pseudo_terminal::read_exactly(&mut far_end, &mut bytes);
    let sent = sent.join().unwrap();
    assert!(sent.status.success(), "{sent:?}");
    assert_eq!(bytes, frames);
}

/// 40 frames a second of 130 bytes go over 115 200 baud, however long UBX frames may be.
#[test]
#[cfg(target_os = "linux")]
fn a_line_carries_the_frames_that_there_are() {
    let rows = format!(
        "class,id,payload\n{}",
        format!("1,7,{}\n", "00".repeat(122)).repeat(4)
    );
    let frames = written(&["encode", "--frame=ubx"], &rows);
    let (mut far_end, _near_end, port) = crate::pseudo_terminal::line();
    let child = start(&[
        "send",
        &port,
        "--frame=ubx",
        "--profile=-",
        "--rate=40",
        "--baud=115200",
    ]);
    let sent = std::thread::spawn(move || crate::process::feed(child, rows.as_bytes()));
    let mut bytes = vec![0; frames.len()];
    crate::pseudo_terminal::read_exactly(&mut far_end, &mut bytes);
    let sent = sent.join().unwrap();
    assert!(sent.status.success(), "{sent:?}");
    assert_eq!(bytes, frames);
}
