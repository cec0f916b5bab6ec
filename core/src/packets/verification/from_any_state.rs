//! 14d: DLE framing finds the next packet, whatever came before.
//!
//! A whole packet begins with the escape byte and a start code. From any state, the receiver is then [at a
//! beginning](is_at_a_beginning): either the packet has just begun, or an earlier packet ends with the same two bytes,
//! because the parity of the escape bytes was lost. From there, the receiver takes the rest of the packet, and delivers
//! the packet. In these harnesses, an earlier packet that contains the whole packet is always too long. Otherwise it might
//! be delivered in its place.

use super::{Accepting, Dle, Kind, Tsip, any_receiver};
use crate::{Found, PacketReceiver, Stuffing};

const LONGEST: usize = 3;

type Receiver<K> = PacketReceiver<Accepting<K, LONGEST>, [u8; LONGEST]>;

/// Returns whether a packet begins with this code here, or would begin here if the packet that has begun earlier is
/// rejected.
fn is_at_a_beginning<K: Kind>(receiver: &Receiver<K>, code: u8) -> bool {
    let Stuffing::Doubled { escape, start, .. } = K::STUFFING else {
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
/// two bytes deliver nothing.
fn packet_begins<K: Kind>(kind: K, code: u8) {
    let mut receiver: Receiver<K> = any_receiver(Accepting::any(kind));
    kani::assume(K::STUFFING.begins_packet(code));
    assert!(receiver.push(0x10).is_none() && receiver.push(code).is_none());
    assert!(is_at_a_beginning(&receiver, code));
    kani::cover!(receiver.length > 1, "inside an earlier packet");
}

/// From any beginning of a packet with one byte, the rest of the packet delivers it.
fn packet_ends<K: Kind>(kind: K, code: u8, content: u8, rest: &[u8]) {
    let format = Accepting::any(kind);
    kani::assume(format.accepts(&[content]));
    let mut receiver: Receiver<K> = any_receiver(format);
    kani::assume(is_at_a_beginning(&receiver, code));
    let (whole, before) = (4 + usize::from(code != content), receiver.length);
    let mut at = 0;
    while at + 1 < rest.len() {
        assert!(receiver.push(rest[at]).is_none());
        at += 1;
    }
    let mut frame_bytes = 0;
    let frame = receiver.push_with(rest[at], |one| {
        if let Found::Frame { length, .. } = one {
            frame_bytes = length;
        }
    });
    let frame = frame.unwrap().bytes();
    assert!(frame_bytes == whole && frame.len() == 1 && frame[0] == content);
    kani::cover!(before > 1, "inside an earlier packet");
}

#[kani::proof]
#[kani::unwind(5)]
fn dle_begins() {
    packet_begins(Dle, 0x02);
}

#[kani::proof]
#[kani::unwind(5)]
fn dle_ends() {
    let content = kani::any();
    kani::assume(content != 0x10 && content != 0x02);
    packet_ends(Dle, 0x02, content, &[content, 0x10, 0x03]);
}

#[kani::proof]
#[kani::unwind(5)]
fn tsip_begins() {
    packet_begins(Tsip, kani::any());
}

#[kani::proof]
#[kani::unwind(5)]
fn tsip_ends() {
    let code = kani::any();
    kani::assume(Tsip::STUFFING.begins_packet(code));
    packet_ends(Tsip, code, code, &[0x10, 0x03]);
}
