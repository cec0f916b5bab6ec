//! Shows limits that no receiver of these frames can overcome: the examples of N4 and N5 in docs/protocol.md.

use std::cell::Cell;

use framelock::{BufferedReceiver, Classification, Format, LineEvent};
use framelock_formats::crsf::{self, Crsf};
use framelock_formats::rtcm::Rtcm;

use crate::{frame, receive};

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

/// A format that counts the bytes about which it is asked.
#[derive(Clone, Copy)]
struct Counting<'c, F>(F, &'c Cell<usize>);

impl<F: Format> Format for Counting<'_, F> {
    const LONGEST: usize = F::LONGEST;
    type Message<'a> = F::Message<'a>;

    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.1.set(self.1.get() + bytes.len());
        self.0.classify_after(bytes, seen)
    }

    fn starts(&self, byte: u8) -> bool {
        self.0.starts(byte)
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> F::Message<'a> {
        self.0.decode(frame)
    }
}

/// Pushes the stream, all of which remains pending, and then ends it by a line event, or by one call of `poll` after one
/// more byte. Returns the most bytes that one push, the poll, and the line event examine.
fn most_examined<F: Format + Copy, const N: usize>(format: F, stream: &[u8]) -> [usize; 3] {
    let count = Cell::new(0);
    let new = || BufferedReceiver::<_, [u8; N]>::new(Counting(format, &count));
    let (mut receiver, mut ended, mut most) = (new(), new(), 0);
    for &byte in stream {
        count.set(0);
        assert!(receiver.push(byte).is_none());
        most = most.max(count.get());
        assert!(ended.push(byte).is_none());
    }
    count.set(0);
    ended.line_event(LineEvent::Idle, |found| assert!(found.message().is_none()));
    let by_event = count.replace(0);
    assert!(receiver.push(0).is_none());
    most = most.max(count.replace(0));
    assert!(receiver.poll().is_none());
    [most, count.get(), by_event]
}

/// False starts that claim frames, each up to the last byte of the first frame. `docs/costs.md` states the bounds.
#[test]
fn a_call_examines_a_bounded_number_of_bytes() {
    let bounds = |longest: usize| {
        let all = longest * (longest - 1) / 2;
        [longest, all, all]
    };

    // `C8 3E`, `C8 3C` and so on.
    let nested: Vec<u8> = (1..=31).rev().flat_map(|pairs| [0xC8, 2 * pairs]).collect();
    let stream = [&nested[..], &[1]].concat();
    let examined = most_examined::<_, 64>(Crsf, &stream);
    assert_eq!(examined, [64, 991, 960]);
    assert!(
        examined
            .iter()
            .zip(bounds(64))
            .all(|(&most, bound)| most <= bound)
    );

    // `D3 03 FF`, `D3 03 FC` and so on.
    let nested = (1..=341).rev().flat_map(|threes: u16| {
        let [high, low] = (3 * threes).to_be_bytes();
        [0xD3, high, low]
    });
    let stream: Vec<u8> = nested.chain([0; 5]).collect();
    let examined = most_examined::<_, 1029>(Rtcm, &stream);
    assert_eq!(examined, [1029, 176_677, 176_336]);
    assert!(
        examined
            .iter()
            .zip(bounds(1029))
            .all(|(&most, bound)| most <= bound)
    );
}
