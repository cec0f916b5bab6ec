//! 14b: from any state, for any format and any stuffing.

use super::{Kind, Lawless, Receiver, Slip, any_doubled, any_escape, any_pair, any_receiver, fits};
use crate::any_format::any_line_event;
use crate::{Codes, Found, Stuffing};

const LONGEST: usize = 3;

/// After a push, the new byte and each byte that was pending are in one outcome, or still pending. A frame's bytes are
/// unstuffed, so they may be fewer than the bytes that were received for the frame.
fn byte_is_placed(stuffing: Stuffing) {
    let mut buffer = [0; LONGEST];
    let mut receiver = any_receiver(Lawless::<LONGEST>(stuffing), &mut buffer);
    let before = receiver.pending() + 1;
    let (mut placed, mut frame_bytes) = (0, 0);
    let frame = receiver.push_with(kani::any(), |one| {
        assert!(one.bytes() > 0);
        // No outcome follows a frame.
        assert!(frame_bytes == 0);
        if let Found::Frame { length, .. } = one {
            frame_bytes = length;
        }
        placed += one.bytes();
    });
    let frame = frame.map(|frame| frame.bytes().len());
    assert!(frame.is_some() == (frame_bytes > 0));
    assert!(frame.is_none_or(|length| 0 < length && length <= LONGEST));
    assert!(placed + receiver.pending() == before);
    assert!(fits(&receiver));
    kani::cover!(frame == Some(LONGEST), "the longest frame");
    kani::cover!(
        placed > frame_bytes && frame.is_none(),
        "bytes are discarded"
    );
}

/// After a line event, each byte that was pending is in one outcome, or stays pending in a packet without content.
fn event_is_placed(stuffing: Stuffing) {
    let mut buffer = [0; LONGEST];
    let mut receiver = any_receiver(Lawless::<LONGEST>(stuffing), &mut buffer);
    let before = receiver.pending();
    let mut placed = 0;
    receiver.line_event(any_line_event(), |one| {
        placed += one.bytes();
    });
    assert!(placed + receiver.pending() == before);
    assert!(fits(&receiver));
    assert!(receiver.pending() == 0 || receiver.is_open && receiver.length == 0);
    kani::cover!(placed > 0, "bytes are discarded");
}

/// Returns a receiver in the same state, with another buffer.
fn copy<'b, F: Copy>(
    receiver: &Receiver<'_, F, LONGEST>,
    buffer: &'b mut [u8; LONGEST],
) -> Receiver<'b, F, LONGEST> {
    *buffer = *receiver.buffer;
    Receiver {
        format: receiver.format,
        buffer,
        ..*receiver
    }
}

/// `feed` and `next` do what `push` does, with each byte of a slice.
fn slice_is_pushed(kind: impl Kind) {
    let mut buffers = [[0; LONGEST]; 3];
    let [buffer, for_pushed, for_pulled] = &mut buffers;
    let mut fed = any_receiver(super::Accepting::<_, LONGEST>::any(kind), buffer);
    let (mut pushed, mut pulled) = (copy(&fed, for_pushed), copy(&fed, for_pulled));
    let bytes: [u8; 2] = kani::any();
    let mut outcomes = [None; 4];
    let mut count = 0;
    fed.feed(&bytes, |one| {
        outcomes[count] = Some((one.bytes(), one.message().map(|frame| frame.bytes().len())));
        count += 1;
    });
    let mut at = 0;
    let mut frames = 0;
    for byte in bytes {
        let frame = pushed.push_with(byte, |one| {
            let (bytes, _) = outcomes[at].unwrap();
            assert!(bytes == one.bytes());
            at += 1;
        });
        if let Some(frame) = frame {
            let (_, length) = outcomes[at - 1].unwrap();
            assert!(length == Some(frame.bytes().len()));
            frames += 1;
        }
    }
    assert!(at == count && pushed.pending() == fed.pending());
    let mut rest = bytes.as_slice();
    let mut pulls = 0;
    while pulls < 3 && pulled.next(&mut rest).is_some() {
        pulls += 1;
    }
    assert!(pulls == frames && rest.is_empty() && pulled.pending() == fed.pending());
    kani::cover!(frames == 1, "a frame");
}

macro_rules! for_stuffings {
    ($module:ident, $proof:ident) => {
        mod $module {
            use super::*;

            #[kani::proof]
            #[kani::unwind(4)]
            fn of_escape() {
                $proof(any_escape(Codes::Xor(kani::any())));
                $proof(any_escape(any_pair()));
            }

            #[kani::proof]
            #[kani::unwind(4)]
            fn of_cobs() {
                $proof(Stuffing::Cobs);
            }

            #[kani::proof]
            #[kani::unwind(4)]
            fn of_doubled() {
                $proof(any_doubled(kani::any()));
            }

            #[kani::proof]
            #[kani::unwind(4)]
            fn of_break() {
                $proof(Stuffing::Break);
            }
        }
    };
}
for_stuffings!(byte, byte_is_placed);
for_stuffings!(event, event_is_placed);

#[kani::proof]
#[kani::unwind(5)]
fn slice() {
    slice_is_pushed(Slip);
}
