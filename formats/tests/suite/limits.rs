//! Shows limits that no receiver of CRSF frames can overcome: examples of N4 and N5 in `docs/protocol.md`. Also checks
//! how many bytes a call examines.

use std::fs;

use framelock::{BufferedReceiver, LineEvent};
use framelock_formats::crsf::{self, Crsf};

use crate::{examined, frame, receive};

fn crsf(kind: u8, payload: &[u8]) -> Vec<u8> {
    let message = crsf::Message {
        address: 0xC8,
        kind,
        payload,
    };
    frame(&Crsf, message)
}

/// Returns the types of the CRSF messages in a stream.
fn kinds(stream: &[u8]) -> Vec<u8> {
    let mut kinds = Vec::new();
    receive::<_, 64>(Crsf, stream, |message| kinds.push(message.kind));
    kinds
}

/// `C8 3E` may begin a frame of 64 bytes. The four-byte frame that follows is delivered 59 bytes late, or at the next
/// idle gap.
#[test]
fn a_frame_behind_a_false_beginning_is_late() {
    let late_by = |late: usize| [&[0xC8, 0x3E], &crsf(2, &[])[..], &vec![0; late]].concat();
    assert_eq!(kinds(&late_by(58)), []);
    assert_eq!(kinds(&late_by(59)), [2]);

    let mut receiver = BufferedReceiver::<_, [u8; 64]>::new(Crsf);
    receiver.feed(&late_by(0), |_| {
        panic!("it may yet be the frame of 64 bytes")
    });
    let mut found = Vec::new();
    receiver.line_event(LineEvent::Idle, |event| {
        found.extend(event.message().map(|frame| frame.message().kind));
    });
    assert_eq!(found, [2]);
}

/// A false start of four bytes, `C8 04 05` and one more, forms a valid frame with the first two bytes of the true
/// frame. So the true frame is lost.
#[test]
fn a_frame_that_begins_in_a_false_one_whose_check_is_right_is_lost() {
    let sent = crsf(0x16, &[1, 2, 3]);
    let is_false_head = |payload| {
        let stream = [&[0xC8, 4, 5, payload], &sent[..]].concat();
        kinds(&stream) == [5]
    };
    let false_head = (0..=u8::MAX).any(is_false_head);
    assert!(false_head, "one in 256 has a valid CRC");
}

/// If the first byte of a frame is lost, the receiver delivers a frame that the payload contains.
#[test]
fn a_frame_inside_one_whose_beginning_is_lost_is_delivered() {
    let sent = crsf(7, &crsf(9, &[1, 2, 3]));
    assert_eq!(kinds(&sent), [7]);
    assert_eq!(kinds(&sent[1..]), [9]);
}

/// `docs/rivals.md` states the most bytes that a stream of false starts makes a receiver examine. No call examines more
/// bytes than its bound.
#[test]
fn a_call_examines_a_bounded_number_of_bytes() {
    let table = examined::table();
    let page = fs::read_to_string("../docs/rivals.md").expect("the page");
    assert!(
        page.contains(&table),
        "docs/rivals.md has another table than:\n{table}"
    );
}
