//! 14d: DLE framing finds the next packet, whatever came before.
//!
//! A whole packet begins with the escape byte and a start code. From any state, the receiver is then [at a
//! beginning](is_at_a_beginning): either the packet has just begun, or these two bytes are the newest content of an
//! earlier packet. The second case occurs if the receiver takes the escape byte for the second one of a pair. From
//! there, the receiver takes the rest of the packet, and delivers the packet. In these harnesses, an earlier packet
//! that contains the whole packet is always too long. Otherwise the earlier packet might be delivered instead.

use super::{Accepting, Dle, Kind, Tsip, fits, receiver_in};
use crate::any_format::any_up_to;
use crate::stuffing::Meaning;
use crate::{Classification, Format, Found, PacketFormat, Stuffing};

const LONGEST: usize = 3;

type Receiver<'b, F> = super::Receiver<'b, F, LONGEST>;

/// A format that is never asked about a packet.
#[derive(Clone, Copy)]
struct Unasked<K>(K);

impl<K: Kind> Format for Unasked<K> {
    const LONGEST: usize = LONGEST;
    type Message<'a> = &'a [u8];

    fn classify(&self, _: &[u8]) -> Classification {
        unreachable!("no packet ends")
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

impl<K: Kind> PacketFormat for Unasked<K> {
    fn stuffing(&self) -> Stuffing {
        K::STUFFING
    }
}

/// Returns whether `code`, the last byte, begins a packet: either immediately, or as soon as the earlier packet that
/// contains it is rejected.
fn is_at_a_beginning<F: PacketFormat>(receiver: &Receiver<'_, F>, code: u8) -> bool {
    let Stuffing::Doubled { escape, start, .. } = receiver.format.stuffing() else {
        return false;
    };
    let (length, buffer) = (receiver.length, &receiver.buffer);
    let has_begun = match start {
        Some(_) => length == 0,
        None => length == 1 && buffer[0] == code,
    };
    let is_inside = length >= 2 && buffer[length - 2] == escape && buffer[length - 1] == code;
    receiver.is_open && receiver.unstuffing.missing == 0 && (has_begun || is_inside)
}

/// From any state, the receiver [is at a beginning](is_at_a_beginning) after the escape byte and a start code. These
/// two bytes deliver nothing, and the format is not asked.
fn packet_begins<K: Kind>(kind: K, code: u8) {
    kani::assume(K::STUFFING.begins_packet(code));
    let from = |is_open, length, missing| {
        let mut buffer = [0; LONGEST];
        let format = Unasked(kind);
        let mut receiver = receiver_in(format, &mut buffer, is_open, length, missing);
        if fits(&receiver) {
            assert!(receiver.push(0x10).is_none() && receiver.push(code).is_none());
            assert!(is_at_a_beginning(&receiver, code));
            kani::cover!(receiver.length > 1, "inside an earlier packet");
        }
    };
    from(false, any_up_to(LONGEST), kani::any());
    from(true, 0, 0);
    from(true, 0, 1);
    from(true, 1, 0);
    from(true, 1, 1);
    from(true, 2, 0);
    from(true, 2, 1);
    from(true, 3, 0);
    from(true, 3, 1);
}

/// From any state at the beginning of a packet of one byte, the receiver takes the rest of the packet, and delivers the
/// packet. If `content` is `None`, the code is the packet's byte.
fn packet_ends<K: Kind>(kind: K, code: u8, content: Option<u8>) {
    let format = Accepting::any(kind);
    kani::assume(format.accepts(&[content.unwrap_or(code)]));
    let from = |before| {
        let mut buffer = [0; LONGEST];
        let receiver = receiver_in(format, &mut buffer, true, before, 0);
        if fits(&receiver) && is_at_a_beginning(&receiver, code) {
            ends_from(receiver, before, code, content);
        }
    };
    from(0);
    from(1);
    from(2);
    from(3);
}

/// The receiver takes the rest of the packet, and delivers the packet. The buffer holds `before` bytes. If an earlier
/// packet is open, they are its bytes, which end with the beginning of this packet.
///
/// The function overwrites parts of the state with equal values, most of them constants. Then the prover need not
/// follow the code for other values.
fn ends_from<K: Kind>(
    mut receiver: Receiver<'_, Accepting<K, LONGEST>>,
    before: usize,
    code: u8,
    content: Option<u8>,
) {
    if before >= 2 {
        receiver.buffer[before - 2] = 0x10;
        receiver.buffer[before - 1] = code;
    }
    if let Some(content) = content {
        // `push` does the same with a byte of content.
        let meaning = receiver.unstuffing.take(K::STUFFING, content);
        assert!(meaning == Meaning::Content(content));
        let whole = receiver.take_content(content, content, &mut |_, _| ());
        assert!(whole.is_none());
        let length = if before == 2 { 3 } else { 1 };
        assert!(receiver.is_open && receiver.length == length && receiver.unstuffing.missing == 0);
        (
            receiver.is_open,
            receiver.length,
            receiver.unstuffing.missing,
        ) = (true, length, 0);
    }
    assert!(receiver.push(0x10).is_none());
    let mut frame_bytes = 0;
    let frame = receiver.push_with(0x03, |one| {
        if let Found::Frame { length, .. } = one {
            frame_bytes = length;
        }
    });
    let frame = frame.unwrap().bytes();
    assert!(frame_bytes == 4 + usize::from(content.is_some()));
    assert!(frame.len() == 1 && frame[0] == content.unwrap_or(code));
    kani::cover!(before > 1, "inside an earlier packet");
}

#[kani::proof]
#[kani::unwind(4)]
fn dle_begins() {
    packet_begins(Dle, 0x02);
}

#[kani::proof]
#[kani::unwind(4)]
fn dle_ends() {
    let content = kani::any();
    kani::assume(content != 0x10 && content != 0x02);
    packet_ends(Dle, 0x02, Some(content));
}

#[kani::proof]
#[kani::unwind(4)]
fn tsip_begins() {
    packet_begins(Tsip, kani::any());
}

#[kani::proof]
#[kani::unwind(4)]
fn tsip_ends() {
    let code = kani::any();
    kani::assume(Tsip::STUFFING.begins_packet(code));
    packet_ends(Tsip, code, None);
}
