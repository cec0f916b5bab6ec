#![allow(
    clippy::unwrap_used,
    clippy::indexing_slicing,
    reason = "a panic fails the test"
)]

use std::io::Read;

use framelock::motion::Setpoint;
use framelock_proofs::reference;
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;

use super::*;

/// A reader that returns a few bytes at a time, and sometimes a temporary error.
struct Dribble<'a>(&'a [u8], ChaCha8Rng);

impl Read for Dribble<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.1.random_ratio(1, 4) {
            return Err(io::ErrorKind::Interrupted.into());
        }
        let count = self.1.random_range(1..=9).min(buffer.len());
        self.0.read(&mut buffer[..count])
    }
}

/// Returns noise with many false starts and some frames. The stream may end inside a frame.
fn noise(frame: &Protocol, random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = Vec::new();
    for _ in 0..random.random_range(0..60) {
        if random.random_ratio(1, 3) {
            let bytes: [u8; 3] = std::array::from_fn(|_| *b"AB\r?".choose(random).unwrap());
            stream.extend(frame.encode_setpoint(Setpoint::from(bytes)));
        } else {
            stream.push(*b"AB\r?".choose(random).unwrap());
        }
    }
    stream.truncate(random.random_range(0..=stream.len()));
    stream
}

/// Compares every row, every discarded byte and the summary with the results of the naive reference.
fn agrees<F: reference::NaiveFormat>(name: &str, policy: Policy) {
    let frame = &Protocol::named(name).unwrap();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut frames_in_all = 0;
    for _ in 0..2_000 {
        let stream = noise(frame, &mut random);
        let mut undecided = stream.iter().copied();
        let mut rows = b"offset,pitch,roll,yaw\n".to_vec();
        let (mut setpoints, mut discarded, mut settled) = (vec![], vec![], 0);
        let pending = reference::whole_buffer::<F>(&stream, |found| {
            settled += found.bytes();
            let bytes = undecided.by_ref().take(found.bytes());
            let Some(setpoint) = found.message() else {
                return discarded.extend(bytes);
            };
            let ([pitch, roll, yaw], index) = (setpoint, settled - 1);
            writeln!(rows, "{index},{pitch},{roll},{yaw}").unwrap();
            setpoints.push(Setpoint::from(setpoint));
            bytes.for_each(drop);
        });
        frames_in_all += setpoints.len();

        let mut output = Vec::new();
        let decoder = Decoder::new(frame, policy, OutputFormat::Csv, &mut output).unwrap();
        let decoder = Mutex::new(decoder);
        let input = Input::new("", Dribble(&stream, random.clone()));
        decode(&decoder, input).unwrap();
        let summary = lock(&decoder).summary();
        let expected = Summary {
            bytes: stream.len() as u64,
            frame_length: Some(F::LENGTH),
            frames: setpoints.len() as u64,
            // The end of the stream discards the pending bytes.
            discarded: (discarded.len() + pending) as u64,
            pending: 0,
            ..summary
        };
        assert_eq!(summary, expected, "{stream:?}");
        assert_eq!(summary.discarded_by.total(), summary.discarded);
        assert_eq!(output, rows, "{stream:?}");
    }
    assert!(frames_in_all > 2_000, "{frames_in_all}");
}

#[test]
fn every_machine_agrees_with_the_reference() {
    agrees::<reference::Bin>("bin", Policy::Framelock);
    agrees::<reference::Lecture>("bin", Policy::Lecture);
    agrees::<reference::BinCrc8>("bin-crc8", Policy::Framelock);
}
