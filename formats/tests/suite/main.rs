//! The formats against other crates' encoders and decoders, the laws, and the reference.
#![allow(clippy::indexing_slicing, reason = "a panic is a failed test")]

mod against_reference;
mod laws;
mod limits;
mod others;

use framelock::{BufferedReceiver, Format};
use framelock_formats::Mavlink2Entry;

/// What the format finds in a stream: calls `see` with each message.
fn receive<F: Format, const N: usize>(
    format: F,
    stream: &[u8],
    mut see: impl FnMut(F::Message<'_>),
) {
    let mut receiver = BufferedReceiver::<F, N>::new(format);
    for &byte in stream {
        receiver.push(byte).into_iter().for_each(&mut see);
    }
}

/// HEARTBEAT and ATTITUDE of the dialect `common`, and one with the longest payload.
fn dialect(id: u32) -> Option<Mavlink2Entry> {
    let (crc_extra, longest) = match id {
        0 => (50, 9),
        30 => (39, 28),
        0x01_02_03 => (7, 255),
        _ => return None,
    };
    Some(Mavlink2Entry { crc_extra, longest })
}

/// A frame made by one of the encoders.
fn frame(encode: impl FnOnce(&mut [u8]) -> Option<usize>) -> Vec<u8> {
    let mut frame = [0xA5; 300];
    let length = encode(&mut frame).expect("there is room");
    frame[..length].to_vec()
}
