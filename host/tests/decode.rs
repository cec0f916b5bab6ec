//! `framelock decode` as its user meets it.
#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::fs::File;
use std::io::{BufReader, Read, Write};
use std::process::{Child, Command, Output, Stdio};

use assert_cmd::cargo::{cargo_bin, cargo_bin_cmd};
use framelock::{Bin, BinCrc8, Discard, Format, Lecture, Parser, Receiver, Setpoint};
use framelock_host::decode::{OutputFormat, Summary, decode as decode_stream};
use framelock_proofs::reference::{self, Event, Policy};
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

/// The lecture's worked examples.
const CLEAN: [u8; 7] = [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
const LOSSY: [u8; 12] = [
    0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D,
];

fn decode(arguments: &[&str], input: &[u8]) -> Output {
    cargo_bin_cmd!("framelock")
        .arg("decode")
        .args(arguments)
        .write_stdin(input)
        .output()
        .unwrap()
}

/// What it writes to standard output; it must succeed, and have nothing to complain of.
fn decoded(arguments: &[&str], input: &[u8]) -> String {
    let output = decode(arguments, input);
    assert!(output.status.success(), "{output:?}");
    assert_eq!(output.stderr, b"");
    String::from_utf8(output.stdout).unwrap()
}

/// What it complains of, in one line; it must fail with 2.
fn complaint(output: Output) -> String {
    assert_eq!(output.status.code(), Some(2), "{output:?}");
    let complaint = String::from_utf8(output.stderr).unwrap();
    assert!(complaint.starts_with("framelock: "), "{complaint}");
    assert_eq!(complaint.lines().count(), 1, "{complaint}");
    complaint
}

/// The subcommand with standard input and output in the test's hands.
fn start(arguments: &[&str]) -> Child {
    Command::new(cargo_bin!("framelock"))
        .arg("decode")
        .args(arguments)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

#[test]
fn the_lectures_first_example() {
    for policy in ["rescan", "discard"] {
        assert_eq!(
            decoded(&["--policy", policy], &CLEAN),
            "{\"offset\":6,\"pitch\":127,\"roll\":200,\"yaw\":74}\n"
        );
    }
}

#[test]
fn the_lectures_second_example() {
    assert_eq!(
        decoded(&["-"], &LOSSY),
        "{\"offset\":11,\"pitch\":130,\"roll\":196,\"yaw\":74}\n"
    );
    assert_eq!(decoded(&["--policy=discard"], &LOSSY), "");
}

#[test]
fn every_format() {
    let stream = [&CLEAN[..], &LOSSY].concat();
    assert_eq!(
        decoded(&["--format=csv"], &stream),
        "offset,pitch,roll,yaw\n6,127,200,74\n18,130,196,74\n"
    );
    assert_eq!(
        decoded(&["--format=text"], &CLEAN),
        "byte          6   pitch 127   roll 200   yaw  74\n"
    );
    assert_eq!(decoded(&["--format=none"], &stream), "");
}

#[test]
fn the_summary_is_one_line_behind_the_setpoints() {
    assert_eq!(
        decoded(&["--summary"], &LOSSY),
        "{\"offset\":11,\"pitch\":130,\"roll\":196,\"yaw\":74}\n\
         {\"bytes\":12,\"frame_length\":7,\"frames\":1,\"discarded\":5,\"pending\":0,\
         \"discarded_by\":{\"no_sync\":4,\"broken_sync\":0,\"check\":0,\"terminator\":1,\
         \"line_event\":0},\"resynchronisations\":1}\n"
    );
    let lecture = decoded(&["--summary", "--policy=discard", "--format=none"], &LOSSY);
    assert!(
        lecture.starts_with(
            "{\"bytes\":12,\"frame_length\":7,\"frames\":0,\"discarded\":12,\"pending\":0,"
        ),
        "{lecture}"
    );
}

#[test]
fn nothing_is_a_stream_too() {
    assert_eq!(decoded(&[], b""), "");
    assert_eq!(decoded(&["--format=csv"], b""), "offset,pitch,roll,yaw\n");
    let summary = decoded(&["--summary"], b"");
    assert!(summary.starts_with("{\"bytes\":0,"), "{summary}");
}

#[test]
fn offsets_count_from_the_beginning_of_the_stream() {
    // Longer than any buffer, and the frames lie across the buffers' ends.
    let frames = 200_000;
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(b"???").unwrap();
    file.write_all(&CLEAN.repeat(frames)).unwrap();
    let rows = decoded(&["--format=csv", file.path().to_str().unwrap()], b"");
    let offsets = rows.lines().skip(1);
    assert_eq!(offsets.clone().count(), frames);
    for (frame, row) in offsets.enumerate() {
        assert_eq!(row, format!("{},127,200,74", 3 + 7 * frame + 6));
    }
}

/// Gives a few bytes at a time, and fails in passing in between.
struct Dribble<'a> {
    rest: &'a [u8],
    random: ChaCha8Rng,
}

impl Read for Dribble<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.random.random_ratio(1, 4) {
            return Err(std::io::ErrorKind::Interrupted.into());
        }
        let count = self.random.random_range(1..=9).min(buffer.len());
        self.rest.read(&mut buffer[..count])
    }
}

/// Noise that is full of beginnings of frames, some frames, and an end anywhere.
fn noise<F: Format<Message = Setpoint, Frame: AsRef<[u8]>>>(random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = Vec::new();
    for _ in 0..random.random_range(0..40) {
        if random.random_ratio(1, 3) {
            let bytes: [u8; 3] = std::array::from_fn(|_| *b"AB\r?".choose(random).unwrap());
            stream.extend_from_slice(F::encode(Setpoint::from(bytes)).as_ref());
        } else {
            stream.push(*b"AB\r?".choose(random).unwrap());
        }
    }
    stream.truncate(random.random_range(0..=stream.len()));
    stream
}

/// Against the reference: every row, and where every byte went.
fn agrees<P, F, R>(policy: Policy)
where
    P: Parser<Message = Setpoint> + Default,
    F: Format<Message = Setpoint, Frame: AsRef<[u8]>>,
    R: reference::Format,
{
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut frames_in_all = 0;
    for _ in 0..2_000 {
        let stream = noise::<F>(&mut random);
        let (mut rows, mut frames, mut discarded) = (Vec::new(), 0, 0);
        let pending = reference::whole_buffer::<R>(&stream, policy, |event| match event {
            Event::Dropped { count, .. } => discarded += count as u64,
            Event::Frame { index, setpoint } => {
                let [pitch, roll, yaw] = setpoint;
                frames += 1;
                writeln!(
                    rows,
                    r#"{{"offset":{index},"pitch":{pitch},"roll":{roll},"yaw":{yaw}}}"#
                )
                .unwrap();
            }
        });
        let dribble = Dribble {
            rest: &stream,
            random: random.clone(),
        };
        let mut output = Vec::new();
        let summary = decode_stream::<P, _, _>(
            &mut BufReader::with_capacity(random.random_range(1..20), dribble),
            &mut output,
            OutputFormat::Jsonl,
        )
        .unwrap();
        assert_eq!(output, rows, "{stream:?}");
        let expected = Summary {
            bytes: stream.len() as u64,
            frame_length: R::LENGTH as u64,
            frames,
            discarded,
            pending: pending as u64,
            ..summary
        };
        assert_eq!(summary, expected, "{stream:?}");
        assert_eq!(
            summary.bytes,
            summary.frame_length * frames + discarded + summary.pending
        );
        assert_eq!(summary.discarded_by.total(), discarded);
        let mut silent = Vec::new();
        let uncounted = decode_stream::<P, _, _>(&mut &stream[..], &mut silent, OutputFormat::None);
        assert_eq!((uncounted.unwrap(), silent), (summary, Vec::new()));
        frames_in_all += frames;
    }
    assert!(frames_in_all > 2_000, "{frames_in_all}");
}

#[test]
fn every_policy_and_frame_agrees_with_the_reference() {
    agrees::<Receiver<Bin>, Bin, reference::Bin>(Policy::Rescan);
    agrees::<Lecture, Bin, reference::Bin>(Policy::Discard);
    agrees::<Receiver<BinCrc8>, BinCrc8, reference::BinCrc8>(Policy::Rescan);
    agrees::<Receiver<BinCrc8, Discard>, BinCrc8, reference::BinCrc8>(Policy::Discard);
}

#[test]
fn policy_and_frame_are_what_the_arguments_say() {
    // A frame whose payload looks like the beginning of another, joined one byte late.
    let [bin, crc] = [
        b"AB\0AB\0\r".to_vec(),
        BinCrc8::encode([b'A', b'B', 0].into()).to_vec(),
    ];
    for (name, frame) in [("bin", bin), ("bin-crc8", crc)] {
        let arguments = |policy| {
            [
                "--format=none",
                "--summary",
                "--frame",
                name,
                "--policy",
                policy,
            ]
        };
        let stream = &frame.repeat(5)[1..];
        let rescan = decoded(&arguments("rescan"), stream);
        assert!(rescan.contains("\"frames\":4,"), "{name}: {rescan}");
        assert!(rescan.contains(&format!("\"frame_length\":{},", frame.len())));
        let discard = decoded(&arguments("discard"), stream);
        assert!(!discard.contains("\"frames\":4,"), "{name}: {discard}");
    }
}

#[test]
fn setpoints_come_out_while_the_stream_goes_on() {
    let mut child = start(&[]);
    let (mut input, mut output) = (child.stdin.take().unwrap(), child.stdout.take().unwrap());
    for frame in 0..3 {
        input.write_all(&CLEAN).unwrap();
        let expected = format!(
            "{{\"offset\":{},\"pitch\":127,\"roll\":200,\"yaw\":74}}\n",
            7 * frame + 6
        );
        let mut line = vec![0; expected.len()];
        output.read_exact(&mut line).unwrap();
        assert_eq!(String::from_utf8(line).unwrap(), expected);
    }
    drop(input);
    assert!(child.wait().unwrap().success());
}

#[test]
fn a_closed_pipe_ends_it_quietly() {
    for summary in [&[][..], &["--summary"]] {
        let mut child = start(summary);
        drop(child.stdout.take());
        let mut input = child.stdin.take().unwrap();
        // It may have ended before all is written.
        let _ = input.write_all(&CLEAN.repeat(100_000));
        drop(input);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0));
        assert_eq!(output.stderr, b"");
    }
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_stream_that_is_summarised() {
    let mut child = start(&["--summary", "--format=csv"]);
    let mut input = child.stdin.take().unwrap();
    input.write_all(&CLEAN).unwrap();
    let header = "offset,pitch,roll,yaw\n6,127,200,74\n";
    let mut shown = vec![0; header.len()];
    child
        .stdout
        .as_mut()
        .unwrap()
        .read_exact(&mut shown)
        .unwrap();
    let kill = Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status();
    assert!(kill.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let summary = String::from_utf8(output.stdout).unwrap();
    assert!(summary.starts_with("{\"bytes\":7,"), "{summary}");
    drop(input);
}

#[test]
fn what_cannot_be_opened_is_named() {
    let nothing = complaint(decode(&["no/such/file"], b""));
    assert!(nothing.contains("no/such/file"), "{nothing}");
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().to_str().unwrap();
    let directory = complaint(decode(&[folder], b""));
    assert!(directory.contains(folder), "{directory}");
    assert!(directory.contains("serial port"), "{directory}");
}

#[test]
fn a_rate_is_for_serial_ports() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for input in ["-", file.path().to_str().unwrap()] {
        let told = complaint(decode(&["--baud=9600", input], b""));
        assert!(told.contains("--baud"), "{told}");
    }
    // One that is not there is not taken for something else.
    let told = complaint(decode(&["--baud=9600", "/dev/ttyNONE"], b""));
    assert!(told.contains("cannot open /dev/ttyNONE"), "{told}");
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_told() {
    for arguments in [&[][..], &["--summary", "--format=none"]] {
        let full = File::options().write(true).open("/dev/full").unwrap();
        let mut child = Command::new(cargo_bin!("framelock"))
            .arg("decode")
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(full)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        child.stdin.take().unwrap().write_all(&CLEAN).unwrap();
        let told = complaint(child.wait_with_output().unwrap());
        assert!(told.contains("standard output"), "{told}");
    }
}
