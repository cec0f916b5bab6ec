//! Frames by description: what is built in, files, and every command that takes them.

use std::fs;

use framelock_fuzz_oracles::LINES;

use crate::process::{complaint, run, shown, text, written};

/// A file that describes frames, in a folder that is to be kept, as an option.
pub(crate) fn described(text: &str) -> (tempfile::TempDir, String) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("my.toml");
    fs::write(&path, text).unwrap();
    let frame = format!("--frame={}", path.display());
    (folder, frame)
}

/// Bytes in hex.
fn bytes(hex: &str) -> Vec<u8> {
    let digits: Vec<u8> = hex
        .bytes()
        .filter(|byte| !byte.is_ascii_whitespace())
        .collect();
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16).unwrap();
    digits.chunks(2).map(byte).collect()
}

/// Frames that others have made or published, and what decode says of them.
const RECORDINGS: [(&str, &str, &str); 12] = [
    // Packed by sbus-rs 0.1.3: 172, 992, 1811, then 1000, 1100, ... 2200; failsafe and channel 17.
    (
        "sbus",
        "0F AC 00 DF C4 D1 C7 44 58 52 14 AF DC 05 32 A9 11 CE 76 E8 FF 1F 00 09 00",
        r#"{"offset":24,"length":25,"channel":[172,992,1811,1000,1100,1200,1300,1400,1500,1600,1700,1800,1900,2000,2047,0],"channel17":1,"channel18":0,"frame_lost":0,"failsafe":1,"end":0}"#,
    ),
    // As published in many places for an FS-iA6B.
    (
        "ibus",
        "20 40 DB 05 DC 05 54 05 DC 05 E8 03 D0 07 D2 05 E8 03 DC 05 DC 05 DC 05 DC 05 DC 05 DC 05 DA F3",
        r#"{"offset":31,"length":32,"channel":[1499,1500,1364,1500,1000,2000,1490,1000,1500,1500,1500,1500,1500,1500],"upper":[0,0,0,0,0,0,0,0,0,0,0,0,0,0]}"#,
    ),
    // Link statistics, made by crsf 2.0.1.
    (
        "crsf",
        "C8 0C 14 10 13 63 97 01 02 03 08 58 94 FC",
        r#"{"offset":13,"length":14,"address":200,"type":20,"payload":"10136397010203085894"}"#,
    ),
    // ACK-ACK of CFG-MSG, from u-blox's own examples.
    (
        "ubx",
        "B5 62 05 01 02 00 06 01 0F 38",
        r#"{"offset":9,"length":10,"class":5,"id":1,"payload":"0601"}"#,
    ),
    // HEARTBEAT and ATTITUDE, made by pymavlink 2.4.50.
    (
        "mavlink2",
        "FD 09 00 00 00 01 01 00 00 00 00 00 01 00 02 03 51 04 03 58 9F",
        r#"{"offset":20,"length":21,"compatible_flags":0,"sequence":0,"system":1,"component":1,"message":0,"payload":"000001000203510403"}"#,
    ),
    (
        "mavlink2",
        "FD 10 00 00 07 01 01 1E 00 00 E8 03 00 00 00 00 00 3F 00 00 80 BE 00 00 80 3F DA D5",
        r#"{"offset":27,"length":28,"compatible_flags":0,"sequence":7,"system":1,"component":1,"message":30,"payload":"E80300000000003F000080BE0000803F"}"#,
    ),
    // Channels, from Betaflight's tests: the address is that of all devices.
    (
        "crsf",
        "00 18 16 BD 08 9F F4 AE F7 BD EF 7D EF FB AD FD 45 2B 5A 01 00 00 00 00 00 6C",
        r#"{"offset":25,"length":26,"address":0,"type":22,"payload":"BD089FF4AEF7BDEF7DEFFBADFD452B5A010000000000"}"#,
    ),
    // The same HEARTBEAT as MAVLink 1, among MAVLink 2.
    (
        "mavlink",
        "FE 09 00 01 01 00 00 00 01 00 02 03 51 04 03 C2 5C",
        r#"{"offset":16,"length":17,"kind":"mavlink1","sequence":0,"system":1,"component":1,"message":0,"payload":"000001000203510403"}"#,
    ),
    // Message 1005, the example of the standard.
    (
        "rtcm",
        "D3 00 13 3E D7 D3 02 02 98 0E DE EF 34 B4 BD 62 AC 09 41 98 6F 33 36 0B 98",
        r#"{"offset":24,"length":25,"payload":"3ED7D30202980EDEEF34B4BD62AC0941986F33"}"#,
    ),
    // From u-blox's protocol description; an ACK behind it is UBX.
    (
        "gnss",
        "24 47 50 47 47 41 2C 30 39 32 37 32 35 2E 30 30 2C 34 37 31 37 2E 31 31 33 39 39 2C 4E 2C 30 30 38 33 33 \
         2E 39 31 35 39 30 2C 45 2C 31 2C 30 38 2C 31 2E 30 31 2C 34 39 39 2E 36 2C 4D 2C 34 38 2E 30 2C 4D 2C 2C \
         2A 35 42 0D 0A",
        r#"{"offset":74,"length":75,"kind":"nmea","start":"$","sentence":"GPGGA,092725.00,4717.11399,N,00833.91590,E,1,08,1.01,499.6,M,48.0,M,,"}"#,
    ),
    (
        "gnss",
        "B5 62 05 01 02 00 06 01 0F 38",
        r#"{"offset":9,"length":10,"kind":"ubx","class":5,"id":1,"payload":"0601"}"#,
    ),
    (
        "six-axes",
        "FF FF 00 00 00 40 00 80 40 9C FF FF 0D 00 0A 0D",
        r#"{"offset":15,"length":16,"axis":[0,16384,32768,40000,65535,13]}"#,
    ),
];

#[test]
fn what_others_have_made_is_decoded_and_encoded_again() {
    for (frame, recording, expected) in RECORDINGS {
        let arguments = |command| vec![command, "--frame", frame];
        let stream = bytes(recording);
        assert_eq!(
            shown(&arguments("decode"), &stream),
            format!("{expected}\n")
        );
        // Anything in front, one byte wrong in a second one, and a third.
        let mut wrong = stream.clone();
        *wrong.last_mut().unwrap() ^= 0x55;
        let noisy = [&b"noise"[..], &stream, &wrong, &stream].concat();
        let csv = shown(
            &[arguments("decode"), vec!["--format=csv"]].concat(),
            &noisy,
        );
        assert_eq!(csv.lines().count(), 3, "{frame}: {csv}");
        let encoded = written(&arguments("encode"), &csv);
        assert!(encoded == stream.repeat(2), "{frame}: {encoded:02X?}");
        let json = shown(&arguments("decode"), &noisy);
        assert!(written(&arguments("encode"), json) == stream.repeat(2));
    }
}

#[test]
fn the_summary_says_where_every_byte_has_gone() {
    let stream = [
        &b"no"[..],
        &bytes("C8 01 C8 02 14 00 C8 0C 14 10 13 63 97 01 02 03 08 58 94 FC C8"),
    ];
    let summary = shown(
        &["decode", "--frame=crsf", "--format=none", "--summary=-"],
        stream.concat(),
    );
    assert_eq!(
        summary,
        "{\"bytes\":23,\"frames\":1,\"frame_bytes\":14,\"discarded\":9,\"pending\":0,\"discarded_by\":\
         {\"no_sync\":5,\"broken_sync\":0,\"header\":1,\"too_long\":1,\"unknown_message\":0,\"check\":1,\"terminator\":0,\"line_event\":1},\
         \"resynchronisations\":1}\n"
    );
}

/// Frames that are whole, but of which a fixed field or the kind is another, and the reason.
#[test]
fn what_always_is_the_same_is_checked() {
    for (frame, recording, reason) in [
        (
            "sbus",
            format!("0F {} 10 00", "00".repeat(22)),
            "terminator",
        ),
        (
            "mavlink2",
            "FD 00 02 00 00 01 01 00 00 00 00 00".into(),
            "header",
        ),
        (
            "mavlink2",
            "FD 00 00 00 00 01 01 FF FF FF 00 00".into(),
            "unknown message",
        ),
        ("crsf", "C8 3F".into(), "too long"),
        // The digits of a checksum are read in capitals or not, and must be right.
        (
            "nmea",
            framelock_description::hex::glued(b"$GPTXT,01,01,02,ok*09\r\n"),
            "check",
        ),
    ] {
        let rows = shown(&["trace", "--frame", frame, &recording], "");
        let expected = format!("discarded {} from offset 0: {reason}\n", &recording[..2]);
        assert!(rows.contains(&expected), "{rows}");
    }
}

#[test]
fn a_file_describes_frames_in_every_format() {
    let (_folder, frame) = described(LINES);
    let stream = b"#1a, \"b\"\r\n#2#\r\n#";
    for (arguments, expected) in [
        (
            &["decode"][..],
            "{\"offset\":9,\"length\":10,\"number\":49,\"note\":\"a, \\\"b\\\"\"}\n\
             {\"offset\":14,\"length\":5,\"number\":50,\"note\":\"#\"}\n",
        ),
        (
            &["decode", "--format=csv"],
            "offset,length,number,note\n9,10,49,\"a, \"\"b\"\"\"\n14,5,50,#\n",
        ),
        (
            &["decode", "--format=text"],
            "byte          9   length  10   number  49   note a, \"b\"\n\
             byte         14   length   5   number  50   note   #\n",
        ),
        (&["decode", "--describe"], LINES),
    ] {
        let arguments = [arguments, &[&frame]].concat();
        assert_eq!(shown(&arguments, stream), expected, "{arguments:?}");
    }
    let rows = shown(&["decode", "--format=csv", &frame], stream);
    assert_eq!(written(&["encode", &frame], rows), stream[..15]);
    let two_lines = "{\"number\":1,\"note\":\"a\"}\n{\"number\":2,\"note\":\"a\\r\\nb\"}\n";
    let told = complaint(run(&["encode", &frame], two_lines));
    assert!(
        told.contains("line 2: there is no frame of 8 bytes with these values"),
        "{told}"
    );
}

#[test]
fn trace_shows_what_is_pending_the_frames_and_why_bytes_are_discarded() {
    let stream = [
        "trace",
        "--frame=ubx",
        "B5 B5 62 05 01 02 00 06 01 0F 38 61",
    ];
    let rows = shown(&stream, "");
    let expected = "\
offset  byte    pending  what happened
     0  B5            1
     1  B5            1  discarded B5 from offset 0: broken sync
     2  62 'b'        2
     3  05            3
     4  01            4
     5  02            5
     6  00            6
     7  06            7
     8  01            8
     9  0F            9
    10  38 '8'        0  frame from offset 1:   length  10   class   5   id   1   payload 0601
    11  61 'a'        0  discarded 61 from offset 11: no sync

12 bytes = 10 in 1 frames + 2 discarded + 0 pending
";
    assert_eq!(rows, expected);
    let rows = shown(&[&stream[..], &["--format=jsonl"]].concat(), "");
    let rows: Vec<&str> = rows.lines().collect();
    assert_eq!(
        rows[1],
        "{\"offset\":1,\"byte\":181,\"policy\":\"framelock\",\"pending\":1,\"what\":[{\"discarded\":1,\"from\":0,\
         \"bytes\":\"B5\",\"why\":\"broken sync\"}]}"
    );
    assert_eq!(
        rows[10],
        "{\"offset\":10,\"byte\":56,\"policy\":\"framelock\",\"pending\":0,\"what\":[{\"offset\":10,\"length\":10,\
         \"class\":5,\"id\":1,\"payload\":\"0601\"}]}"
    );
    // One byte may decide several things: each has a row.
    let several = shown(&["trace", "--frame=crsf", "C8 04 C8 02 14 0F"], "");
    assert!(
        several.contains("\n                         discarded C8"),
        "{several}"
    );
}

#[test]
fn send_takes_rows_and_its_faults_any_frame() {
    let rows = "class,id,payload\n5,1,0601\n5,0,0601\n";
    let arguments = ["send", "-", "--frame=ubx", "--profile=-", "--rate=1000"];
    let output = run(&arguments, rows);
    let told = text(output.stderr);
    assert!(
        output.status.success() && told.contains(": 2, and 0 to park"),
        "{told}"
    );
    assert!(output.stdout == written(&["encode", "--frame=ubx"], rows));
    let doubled = run(&[&arguments[..], &["--duplicate=1"]].concat(), rows).stdout;
    assert_eq!(doubled.len(), 2 * output.stdout.len());
}

#[test]
fn what_only_setpoints_have_is_told_and_mistakes_in_files_have_a_place() {
    let (_folder, my) = described("sync = '24'\nlength = 4\nlenght = 5\n");
    for (arguments, told) in [
        (
            &["decode", "--frame=sbsu"][..],
            "the frames are bin, bin-crc8, sbus, ibus, crsf, ubx, nmea, rtcm, gnss, mavlink, mavlink1, mavlink2, six-axes",
        ),
        (&["decode", &my], "my.toml:3:1: unknown field `lenght`"),
        (
            &["decode", "--frame=sbus", "--policy=lecture"],
            "knows --frame bin and no other",
        ),
        (
            &["trace", "--frame=sbus", "--policy=lecture", "00"],
            "knows --frame bin and no other",
        ),
        (
            &[
                "send",
                "-",
                "--frame=ibus",
                "--motion=step",
                "--seconds=0.1",
            ],
            "give its fields by --profile",
        ),
        (
            &[
                "send",
                "-",
                "--frame=ibus",
                "--udp=127.0.0.1:0",
                "--seconds=0.1",
            ],
            "give its fields by --profile",
        ),
        (
            &["encode", "--frame=ubx"],
            "line 1: class 300 is not a whole number from 0 to 255",
        ),
    ] {
        let complaint = complaint(run(arguments, "300,1,00\n"));
        assert!(complaint.contains(told), "{arguments:?}: {complaint}");
    }
}
