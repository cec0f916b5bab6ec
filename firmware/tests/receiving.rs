//! Checks that the firmware commits the reference's setpoints for every stream.

use crate::firmware::{Firmware, GAP, PAUSE, RESTART, Reference, frame, frames, reference, sample};
use framelock_proofs::reference::{Bin, BinCrc8, Lecture, NaiveFormat as _};
use nrf52840_emulator::MILLISECOND;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

const FIRST: [u8; 7] = [0x41, 0x42, 0x00, 0x7F, 0xC8, 0x4A, 0x0D];
const SECOND: [u8; 12] = [
    0x41, 0x42, 0x00, 0x4A, 0x0D, 0x41, 0x42, 0x00, 0x82, 0xC4, 0x4A, 0x0D,
];

#[test]
fn the_lectures_first_example_is_in_force_with_its_last_byte_and_not_before() {
    for image in ["default", "megabaud", "lecture", "small"] {
        let mut firmware = Firmware::booted(image);
        firmware.send_and_wait(&FIRST[..6], PAUSE);
        assert!(firmware.commits().is_empty(), "{image}");
        firmware.send_and_wait(&FIRST[6..], PAUSE);
        assert_eq!(firmware.commits(), [[0x7F, 0xC8, 0x4A]], "{image}");
    }
}

#[test]
fn the_lectures_second_example_is_saved_by_the_receiver_and_lost_by_the_lectures_machine() {
    let mut receiver = Firmware::booted("default");
    receiver.send_and_wait(&SECOND, PAUSE);
    assert_eq!(receiver.commits(), [[0x82, 0xC4, 0x4A]]);

    let mut lecture = Firmware::booted("lecture");
    lecture.send_and_wait(&SECOND, PAUSE);
    assert!(lecture.commits().is_empty());
}

/// For each bit of a frame, the stream has a frame with this bit inverted, and then an intact frame. The stream ends
/// with a frame of BIN, which has no checksum.
#[test]
fn the_image_for_bin_crc8_takes_frames_whose_checksum_is_right_and_no_others() {
    let sealed = |[pitch, roll, yaw]: [u8; 3]| {
        let frame = |crc| [b'A', b'B', 0, pitch, roll, yaw, crc, b'\r'];
        let mut frames = (0..=u8::MAX).map(frame);
        let whole = |frame: &[u8; 8]| BinCrc8::fails_at(frame).is_none();
        frames.find(whole).unwrap()
    };
    let mut stream = Vec::new();
    for (place, bit) in (0..8).flat_map(|place| (0..8).map(move |bit| (place, bit))) {
        let mut broken = sealed([place, bit, 0x55]);
        broken[usize::from(place)] ^= 1 << bit;
        stream.extend(broken);
        stream.extend(sealed([bit, place, 0xAA]));
    }
    stream.extend(frame([1, 2, 3]));
    let expected = reference::<BinCrc8>(&stream);
    assert_eq!(expected.len(), 64);
    let mut firmware = Firmware::booted("bin-crc8");
    firmware.send_and_wait(&stream, PAUSE);
    assert_eq!(firmware.commits(), expected);
}

/// Returns streams that differ from three frames in at most one byte. For each index, one stream lacks the byte at this
/// index. For each index and each byte value, one stream has this value at the index, and another stream has a byte of
/// this value inserted before the index.
fn faulty_streams() -> Vec<Vec<u8>> {
    let whole: Vec<u8> = [[0x7F, 0xC8, 0x4A], [0x41, 0x42, 0x0D], [0x0D, 0x41, 0x42]]
        .into_iter()
        .flat_map(frame)
        .collect();
    let mut streams = Vec::new();
    for place in 0..whole.len() {
        let mut lost = whole.clone();
        lost.remove(place);
        streams.push(lost);
        for byte in 0..=u8::MAX {
            let mut substituted = whole.clone();
            substituted[place] = byte;
            streams.push(substituted);
            let mut inserted = whole.clone();
            inserted.insert(place, byte);
            streams.push(inserted);
        }
    }
    streams
}

fn every_fault_is_as_in_the_reference(image: &str, reference: Reference, step: usize) {
    let mut firmware = Firmware::booted(image);
    for stream in sample(&faulty_streams(), step) {
        firmware.send_and_wait(stream, GAP);
        let expected = reference(stream);
        assert_eq!(firmware.commits(), expected, "{image}: {stream:02x?}");
    }
    assert_eq!(firmware.losses(), (0, 0));
}

/// The faults are a [`sample`].
#[test]
fn a_loss_a_substitution_or_an_insertion_is_as_in_the_reference() {
    every_fault_is_as_in_the_reference("megabaud", reference::<Bin>, 20);
    every_fault_is_as_in_the_reference("default", reference::<Bin>, 31);
    every_fault_is_as_in_the_reference("lecture", reference::<Lecture>, 31);
}

#[test]
fn nothing_of_a_flood_at_1_mbaud_is_lost() {
    let mut firmware = Firmware::booted("megabaud");
    let (sent, bytes) = frames(2_000);
    firmware.send_and_wait(&bytes, 3 * MILLISECOND);
    assert_eq!(firmware.commits(), sent);
    assert_eq!(firmware.losses(), (0, 0));
    assert_eq!(firmware.counter("bytes"), 14_000);
    assert_eq!(firmware.counter("frames"), 2_000);
}

/// Returns pieces of a stream. Each piece has frames, parts of frames and noise. The pause after each piece
/// is shorter than a gap.
fn random_stream(seed: u64, pieces: usize) -> Vec<(Vec<u8>, u64)> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..pieces)
        .map(|_| {
            let mut piece = Vec::new();
            for _ in 0..random.random_range(1..40) {
                match random.random_range(0..10) {
                    0..5 => piece.extend(frame(random.random())),
                    5 => piece.extend(&frame(random.random())[..random.random_range(0..7)]),
                    6 => piece.push(random.random()),
                    7 => piece.push(b"AB\r"[random.random_range(0..3)]),
                    8 => piece.extend(b"AB\r"),
                    _ => piece.extend(b"ABAB"),
                }
            }
            (piece, random.random_range(0..800) * 64)
        })
        .collect()
}

#[test]
fn a_long_random_stream_is_as_in_the_reference_to_the_last_byte() {
    for (image, reference, seed) in [
        ("megabaud", reference::<Bin> as Reference, 1),
        ("default", reference::<Bin>, 2),
        ("lecture", reference::<Lecture>, 3),
    ] {
        let mut firmware = Firmware::booted(image);
        let mut whole = Vec::new();
        for (piece, pause) in random_stream(seed, 300) {
            firmware.send_and_wait(&piece, pause);
            whole.extend(piece);
        }
        firmware.run_for(3 * MILLISECOND);
        let expected = reference(&whole);
        assert!(expected.len() > 500, "{} frames", expected.len());
        assert!(7 * expected.len() < whole.len(), "nothing is discarded");
        assert_eq!(firmware.commits(), expected, "seed {seed}");
        assert_eq!(firmware.counter("bytes") as usize, whole.len());
        firmware.assert_every_byte_has_one_place(image);
        assert_eq!(firmware.losses(), (0, 0));
    }
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
