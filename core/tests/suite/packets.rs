//! Tests the receiver of packets: the reasons to discard bytes, long packets, and pauses.

use framelock::{
    Classification, DiscardReason, Format, Found, Line, LineEvent, PacketFormat, PacketReceiver,
    Stuffing,
};

const LONGEST: usize = 600;

/// A format of packets without a check: a stuffing, and a length that each packet must stay below.
#[derive(Clone, Copy)]
pub(crate) struct Any(pub(crate) Stuffing, pub(crate) usize);

impl Format for Any {
    const LONGEST: usize = LONGEST;
    type Message<'a> = &'a [u8];

    fn longest(&self) -> usize {
        self.1
    }

    fn classify(&self, bytes: &[u8]) -> Classification {
        let at_least = self.1;
        if bytes.len() < at_least {
            Classification::Incomplete { at_least }
        } else {
            Classification::Rejected(DiscardReason::TooLong)
        }
    }

    fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
        Classification::Frame(bytes.len())
    }

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

impl PacketFormat for Any {
    fn stuffing(&self) -> Stuffing {
        self.0
    }
}

/// Returns the packets of a stream, and the discarded bytes with their reasons.
fn received(
    stuffing: Stuffing,
    longest: usize,
    bytes: &[u8],
) -> (Vec<Vec<u8>>, Vec<(usize, DiscardReason)>) {
    let mut receiver = PacketReceiver::with_buffer(Any(stuffing, longest), vec![0; longest])
        .expect("the buffer is as long as the packet");
    let (mut packets, mut discarded) = (Vec::new(), Vec::new());
    receiver.feed(bytes, |found| match found {
        Found::Frame { message, .. } => packets.push(message.message().to_vec()),
        Found::Discarded { count, why, .. } => discarded.push((count, why)),
    });
    (packets, discarded)
}

#[test]
fn each_reason_is_given() {
    use DiscardReason::{BadHeader, BrokenStuffing, NoSync, TooLong};
    let slip = |bytes| received(Stuffing::SLIP, 4, bytes);
    // An abort, and a code that may not follow the escape byte.
    assert_eq!(
        slip(b"\xC0a\xDB\xC0b\xC0"),
        (vec![b"b".to_vec()], vec![(3, BrokenStuffing)])
    );
    assert_eq!(slip(b"\xC0a\xDB?\xC0"), (vec![], vec![(4, BrokenStuffing)]));
    assert_eq!(
        slip(b"a\xC0abcde\xC0"),
        (vec![], vec![(1, NoSync), (5, TooLong), (1, NoSync)])
    );
    // A delimiter within a block.
    let cobs = received(Stuffing::Cobs, 9, b"\0\x04ab\0\x02c\0");
    assert_eq!(cobs, (vec![b"c".to_vec()], vec![(4, BrokenStuffing)]));
    let dle = received(
        Stuffing::DLE,
        9,
        b"\x10\x02a\x10\x02\x10\x03\x10\x02b\x10\x04",
    );
    assert_eq!(
        dle,
        (
            vec![],
            vec![(3, BrokenStuffing), (4, BadHeader), (5, BrokenStuffing)]
        )
    );
}

/// Short packets, and packets near the limits of COBS's blocks, make the round trip. They have a zero at the start, in
/// the middle or at the end, or no zero.
#[test]
fn long_packets_make_the_round_trip() {
    let mut buffer = [0; 2 * LONGEST + 4];
    for stuffing in [
        Stuffing::SLIP,
        Stuffing::HDLC,
        Stuffing::Cobs,
        Stuffing::DLE,
    ] {
        for length in (1..10).chain(250..260).chain(505..515) {
            for zero in [0, length / 2, length - 1, length] {
                let packet: Vec<u8> = (0_usize..length)
                    .map(|at| {
                        if at == zero {
                            0
                        } else {
                            at.to_le_bytes()[0] | 1
                        }
                    })
                    .collect();
                let stuffed = stuffing
                    .stuff(&packet, &mut buffer)
                    .expect("the buffer is long");
                assert_eq!(received(stuffing, LONGEST, stuffed), (vec![packet], vec![]));
            }
        }
    }
}

/// Checks the counters of a line whose packets have only a closing delimiter, with pauses between them.
#[test]
fn a_pause_between_packets_costs_nothing() {
    let mut line = Line::new(PacketReceiver::<_, [u8; LONGEST]>::new(Any(
        Stuffing::SLIP,
        LONGEST,
    )));
    line.push(0xC0);
    for _ in 0..3 {
        line.line_event(LineEvent::Idle, |_| unreachable!());
        line.feed(b"abc\xC0", |found| assert!(found.decoded().is_some()));
    }
    let counters = line.counters();
    assert_eq!(
        (counters.frames, counters.frame_bytes, line.pending()),
        (3, 12, 1)
    );
    assert_eq!(counters.discarded.total(), 0);
    line.line_event(LineEvent::Framing, |_| ());
    line.feed(b"abc\xC0", |found| assert!(found.decoded().is_none()));
    assert_eq!((counters_of(&line), line.pending()), ((1, 3), 1));
}

/// Returns the bytes discarded at line events and outside packets.
fn counters_of<P>(line: &Line<P>) -> (u32, u32) {
    let discarded = &line.counters().discarded;
    (discarded.line_event, discarded.no_sync)
}
