//! Tests the formats against frames of other projects, and against the laws.
#![allow(clippy::indexing_slicing, reason = "a panic is a failed test")]

mod contradictions;
mod dependency;
mod ends;
mod examined;
mod laws;
mod limits;
mod others;
mod own_format;
mod packet;

use framelock::{BufferedReceiver, EncodeInto, Format};
use framelock_formats::layout::{CheckedLayout, KnownMessage, Layout};

/// Receives a stream and calls `see` with each message.
fn receive<F: Format, const N: usize>(
    format: F,
    stream: &[u8],
    mut see: impl FnMut(F::Message<'_>),
) {
    let mut receiver = BufferedReceiver::<F, [u8; N]>::new(format);
    for &byte in stream {
        if let Some(frame) = receiver.push(byte) {
            see(frame.message());
        }
    }
}

/// HEARTBEAT and ATTITUDE of the dialect `common`, and a message with the longest possible payload.
const DIALECT: &[KnownMessage] = &[
    KnownMessage::with_extra(0, 50, 9),
    KnownMessage::with_extra(30, 39, 28),
    KnownMessage::with_extra(0x01_02_03, 7, 255),
];

/// Returns the frame of a message.
fn frame<F: EncodeInto>(format: &F, message: F::Message<'_>) -> Vec<u8> {
    let mut buffer = [0xA5; 1100];
    let frame = format.encode_into(message, &mut buffer);
    frame.expect("it is encoded").to_vec()
}

fn built<'a>(layout: &Layout<'a>) -> CheckedLayout<'a> {
    layout.check().expect("its parts agree")
}
