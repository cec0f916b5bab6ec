//! 14c: stuffing can be undone.

use super::between_delimiters::{BETWEEN, unstuffed};
use super::{any_doubled, any_escape, any_pair};
use crate::any_format::{any_up_to, part};
use crate::{Codes, Stuffing};

/// The bytes between the delimiters stand for the packet, and contain no delimiter.
fn packet_returns<const MOST: usize, const STUFFED: usize>(stuffing: Stuffing, delimiter: u8) {
    let bytes: [u8; MOST] = kani::any();
    let length = any_up_to(MOST);
    kani::assume(length > 0);
    let mut into = [0; STUFFED];
    let stuffed = stuffing.stuff(part(&bytes, 0, length), &mut into).unwrap();
    let last = stuffed.len() - 1;
    assert!(last <= BETWEEN + 1 && stuffed[0] == delimiter && stuffed[last] == delimiter);
    let between = part(stuffed, 1, last);
    let at = any_up_to(BETWEEN);
    assert!(at >= between.len() || between[at] != delimiter);
    let packet = unstuffed(stuffing, between).unwrap();
    assert!(packet.length == length);
    assert!(at >= length || packet.bytes[at] == bytes[at]);
    kani::cover!(stuffed.len() == STUFFED, "the longest stuffed packet");
}

#[kani::proof]
#[kani::unwind(7)]
fn of_slip() {
    packet_returns::<2, 6>(Stuffing::SLIP, 0xC0);
}

#[kani::proof]
#[kani::unwind(7)]
fn of_cobs() {
    packet_returns::<3, 6>(Stuffing::Cobs, 0);
}

/// 14b: `stuff` does not panic, whatever the special bytes, the packet, and the length of the buffer.
#[kani::proof]
#[kani::unwind(4)]
fn any_stuffing() {
    stuff_returns(Stuffing::Cobs);
    stuff_returns(Stuffing::Break);
    stuff_returns(any_doubled(None));
    stuff_returns(any_doubled(Some(kani::any())));
    stuff_returns(any_escape(Codes::Xor(kani::any())));
    stuff_returns(any_escape(any_pair()));
}

fn stuff_returns(stuffing: Stuffing) {
    // `stuff` does not read the buffer.
    let (bytes, mut into): ([u8; 2], _) = (kani::any(), [0; 8]);
    let packet = part(&bytes, 0, any_up_to(2));
    let into = into.get_mut(..any_up_to(8)).unwrap();
    let stuffed = stuffing.stuff(packet, into);
    kani::cover!(stuffed.is_some(), "a packet");
    kani::cover!(stuffed.is_none(), "no packet");
}
