//! Tests that a recording with times decodes as the live stream did.

use std::fs;
use std::io::Write;
use std::time::Duration;

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::process::{run, start, text};

/// A frame of UBX, the beginning of this frame, a false start that hides the frame after it until a pause, and noise.
const PIECES: [&[u8]; 4] = [
    b"\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38",
    b"\xB5\x62\x05\x01\x02\x00",
    b"\xB5\x62\x01\x07\x5C\x00\xB5\x62\x05\x01\x02\x00\x06\x01\x0F\x38",
    b"noise",
];

/// Some pauses are shorter than `--idle-gap`, some are about as long, and some are longer.
#[test]
fn a_recording_with_times_decodes_as_the_live_stream_did() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(67);
    let (mut frames, mut events, mut counts) = (0, 0, Vec::new());
    for number in 0..4 {
        let file = folder.path().join(format!("{number}.hex"));
        let file = file.to_str().unwrap();
        let options = ["decode", "--frame=ubx", "--idle-gap=10", "--summary=-"];
        let mut child = start(&[&options[..], &["--timestamps", "--record", file]].concat());
        let mut input = child.stdin.take().unwrap();
        for _ in 0..25 {
            input
                .write_all(PIECES.choose(&mut random).unwrap())
                .unwrap();
            std::thread::sleep(Duration::from_micros(random.random_range(0..20_000)));
        }
        drop(input);
        let live = text(child.wait_with_output().unwrap().stdout);
        let again = run(&[&options[..], &[file]].concat(), "");
        assert_eq!(text(again.stdout), live);
        frames += live.matches("{\"time\":").count();
        events += usize::from(!live.contains("\"line_event\":0"));
        counts.push(fs::read_to_string(file).unwrap().lines().count());
    }
    assert!(frames > 20 && events == 4, "{frames} {events}");
    assert!(counts.iter().all(|lines| *lines > 10), "{counts:?}");
}
