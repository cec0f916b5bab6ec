//! A faulty line: what arrives of the frames that are sent.

use rand::Rng;
use rand::seq::IndexedRandom as _;

use crate::stream::StreamStep;

/// Returns what arrives of a frame with one fault: a byte has another bit, is lost or is added, or only the frame's
/// beginning or end arrives. `choose` chooses a number below its argument: the position of the fault, the fault, and the
/// wrong bit or the added byte.
///
/// # Panics
/// Panics if the frame is empty.
pub fn broken(frame: &[u8], mut choose: impl FnMut(usize) -> usize) -> Vec<u8> {
    let mut bytes = frame.to_vec();
    let at = choose(bytes.len());
    match choose(6) {
        0 => drop(bytes.remove(at)),
        1 => bytes.insert(at, choose(256).to_le_bytes()[0]),
        2 => bytes.truncate(at),
        3 => drop(bytes.drain(..at)),
        _ => bytes[at] ^= 1 << choose(8),
    }
    bytes
}

/// Returns the bytes that arrive on a faulty line. All frames arrive intact. Before some of them, there is a broken copy
/// or noise. The noise contains many bytes of the frames. After the frames, there is another broken copy.
pub fn faulty(frames: &[Vec<u8>], random: &mut impl Rng) -> Vec<u8> {
    let mut bytes = Vec::new();
    for frame in frames {
        match random.random_range(0..3) {
            0 => bytes.extend(broken(frame, |count| random.random_range(0..count))),
            1 => {
                for _ in 0..random.random_range(1..30) {
                    bytes.push(match random.random_range(0..3) {
                        0 => random.random(),
                        1 => frame[random.random_range(0..frame.len().min(4))],
                        _ => frame[random.random_range(0..frame.len())],
                    });
                }
            }
            _ => {}
        }
        bytes.extend(frame);
    }
    if let Some(frame) = frames.choose(random) {
        bytes.extend(broken(frame, |count| random.random_range(0..count)));
    }
    bytes
}

/// Cuts the bytes into slices: of one byte each, of up to 40 bytes, or of any length.
pub fn cut(bytes: &[u8], random: &mut impl Rng) -> Vec<StreamStep> {
    let most = [1, 40, 40, bytes.len()][random.random_range(0..4)];
    let (mut rest, mut slices) = (bytes, Vec::new());
    while !rest.is_empty() {
        let (slice, behind) = rest.split_at(random.random_range(1..=rest.len().min(most)));
        slices.push(StreamStep::Slice(slice.to_vec()));
        rest = behind;
    }
    slices
}
