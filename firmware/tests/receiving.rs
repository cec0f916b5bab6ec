//! Checks that five images commit the setpoints of their references, for intact frames, faulty frames and noise.

use crate::firmware::{Firmware, GAP, RESTART, Reference, frame, frames, reference, sample};
use framelock_proofs::reference::{Bin, BinCrc8, Lecture, NaiveFormat as _};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The lecture's examples. The second one contains a frame that the receiver delivers and the lecture's machine loses.
const FIRST: [u8; 7] = [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
const SECOND: [u8; 12] = [
    0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D,
];

/// An image, its reference, the sender's rate in thousandths of the receiver's, and a number n: every n-th faulty
/// stream is tested. The firmware promises to receive at rates that differ by up to two per cent.
const IMAGES: [(&str, Reference, u64, usize); 5] = [
    ("megabaud", reference::<Bin>, 980, 20),
    ("default", reference::<Bin>, 1_020, 31),
    ("lecture", reference::<Lecture>, 980, 31),
    ("small", reference::<Bin>, 1_000, 301),
    ("bin-crc8", reference::<BinCrc8>, 1_020, 301),
];

/// For each image, all streams are sent to one board, with a gap after each. The faulty streams are a [`sample`].
#[test]
fn each_image_commits_the_setpoints_of_its_reference() {
    for (image, reference, rate, step) in IMAGES {
        let mut firmware = Firmware::booted(image);
        let baud = if image == "megabaud" {
            1_000_000
        } else {
            115_200
        };
        firmware.board.line(|line| line.set_millibaud(baud * rate));
        let (flood, random) = (frames(2_000).1, random_stream(step as u64));
        let whole = [FIRST.to_vec(), SECOND.to_vec(), checksums(), flood, random];
        let [mut bytes, mut committed, mut least] = [0; 3];
        let faulty = faulty_streams();
        for stream in whole.iter().chain(sample(&faulty, step)) {
            firmware.send_and_wait(stream, GAP);
            let expected = reference(stream);
            assert_eq!(firmware.commits(), expected, "{image}: {stream:02x?}");
            bytes += stream.len();
            committed += expected.len();
            least =
                least.max(stream.len() - expected.len() * if image == "bin-crc8" { 8 } else { 7 });
        }
        assert!(
            committed > if image == "bin-crc8" { 63 } else { 2_500 },
            "{image}"
        );
        assert!(
            least > 500,
            "{image}: some streams have many bytes in no frame"
        );
        assert_eq!(firmware.losses(), (0, 0));
        assert_eq!(firmware.counter("bytes") as usize, bytes, "{image}");
        assert_eq!(firmware.counter("frames") as usize, committed, "{image}");
        if image != "bin-crc8" {
            firmware.assert_every_byte_has_one_place(image);
        }
    }
    assert_eq!(reference::<Bin>(&SECOND), [[0x82, 0xC4, 0x4A]]);
    assert!(reference::<Lecture>(&SECOND).is_empty());
}

/// Returns a stream with two frames for each bit of a frame of BIN-CRC8: a frame with this bit inverted, and an intact
/// frame.
fn checksums() -> Vec<u8> {
    let sealed = |[pitch, roll, yaw]: [u8; 3]| {
        let frame = |crc| [b'A', b'B', 0, pitch, roll, yaw, crc, b'\r'];
        let mut frames = (0..=u8::MAX).map(frame);
        frames
            .find(|frame| BinCrc8::fails_at(frame).is_none())
            .unwrap()
    };
    let mut stream = Vec::new();
    for (place, bit) in (0..8).flat_map(|place| (0..8).map(move |bit| (place, bit))) {
        let mut broken = sealed([place, bit, 0x55]);
        broken[usize::from(place)] ^= 1 << bit;
        stream.extend(broken);
        stream.extend(sealed([bit, place, 0xAA]));
    }
    stream
}

/// Returns streams that differ from three frames in at most one byte. For each index, one stream lacks the byte at this
/// index. For each index and each byte value, one stream has this value at the index, and another stream has a byte of
/// this value inserted before the index.
fn faulty_streams() -> Vec<Vec<u8>> {
    let setpoints = [[0x7F, 0xC8, 0x4A], [0x41, 0x42, 0x0D], [0x0D, 0x41, 0x42]];
    let whole: Vec<u8> = setpoints.into_iter().flat_map(frame).collect();
    let mut streams = Vec::new();
    for place in 0..whole.len() {
        let with = |range: std::ops::Range<usize>, bytes: &[u8]| {
            let mut stream = whole.clone();
            stream.splice(range, bytes.iter().copied());
            stream
        };
        streams.push(with(place..place + 1, &[]));
        for byte in 0..=u8::MAX {
            streams.push(with(place..place + 1, &[byte]));
            streams.push(with(place..place, &[byte]));
        }
    }
    streams
}

/// Returns a stream of frames, parts of frames and noise.
fn random_stream(seed: u64) -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut stream = Vec::new();
    for _ in 0..6_000 {
        match random.random_range(0..10) {
            0..5 => stream.extend(frame(random.random())),
            5 => stream.extend(&frame(random.random())[..random.random_range(0..7)]),
            6 => stream.push(random.random()),
            7 => stream.push(b"AB\r"[random.random_range(0..3)]),
            8 => stream.extend(b"AB\r"),
            _ => stream.extend(b"ABAB"),
        }
    }
    stream
}

#[test]
fn a_board_that_boots_into_the_middle_of_traffic_soon_has_every_frame() {
    for phase in sample(0..40, 4) {
        let mut firmware = Firmware::at_power_on("default");
        firmware.run_for(phase * 611);
        let (sent, bytes) = frames(400);
        // When the stream begins, the reception has not started yet, so the receiver may miss the start bit of a byte.
        firmware.send_and_wait(&bytes, RESTART);
        let commits = firmware.commits();
        assert!(commits.len() > 380, "phase {phase}: {}", commits.len());
        let last = &sent[sent.len() - commits.len()..];
        assert_eq!(commits, last, "phase {phase}");
    }
}
