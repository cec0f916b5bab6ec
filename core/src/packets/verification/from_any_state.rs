//! 14d: DLE framing finds the next packet, whatever came before.

use super::{Accepting, Dle, Kind, Tsip, any_receiver};
use crate::Found;

const LONGEST: usize = 4;

/// A whole packet is delivered with its last byte, unless a delivered packet ends inside it, or begins earlier and ends
/// with it.
fn packet_is_found<K: Kind>(kind: K, packet: &[u8], received: &[u8]) {
    let format = Accepting::<K, LONGEST>::any(kind);
    kani::assume(format.accepts(packet));
    let mut receiver = any_receiver::<_, LONGEST>(format);
    let mut frames = 0;
    let (mut is_found, mut is_earlier) = (false, false);
    let mut at = 0;
    while at < received.len() {
        let mut length = 0;
        let frame = receiver.push_with(received[at], |one| {
            if let Found::Frame { length: bytes, .. } = one {
                length = bytes;
            }
        });
        if let Some(frame) = frame {
            frames += 1;
            is_found = at + 1 == received.len() && length == received.len();
            is_earlier = length > at + 1;
            if is_found {
                assert!(frame.bytes().len() == packet.len());
                let mut place = 0;
                while place < packet.len() {
                    assert!(frame.bytes()[place] == packet[place]);
                    place += 1;
                }
            }
        }
        at += 1;
    }
    assert!(frames == 1 && is_found != is_earlier);
    kani::cover!(is_earlier, "an earlier packet contains bytes of the packet");
    kani::cover!(is_found, "the packet itself");
}

#[kani::proof]
#[kani::unwind(7)]
fn of_dle() {
    let content = kani::any();
    kani::assume(content != 0x10);
    packet_is_found(Dle, &[content], &[0x10, 0x02, content, 0x10, 0x03]);
}

#[kani::proof]
#[kani::unwind(7)]
fn of_tsip() {
    let content = kani::any();
    kani::assume(Tsip::STUFFING.begins_packet(content));
    packet_is_found(Tsip, &[content], &[0x10, content, 0x10, 0x03]);
}
