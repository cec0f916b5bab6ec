//! Tests the receiver of packets against the naive definition, on a faulty line.

use framelock::{LineEvent, Stuffing};
use framelock_oracles::{
    AnyPackets, Occurred, PacketCheck, Packets, Purpose, Seed, Stream, StreamStep, broken, cut,
    packets,
};
use rand::Rng;
use rand::seq::IndexedRandom as _;

/// The ways of stuffing, by name.
const STUFFINGS: [(&str, Stuffing); 6] = [
    ("SLIP", Stuffing::SLIP),
    ("HDLC", Stuffing::HDLC),
    ("COBS", Stuffing::Cobs),
    ("DLE", Stuffing::DLE),
    ("TSIP", TSIP),
    ("break", Stuffing::Break),
];

const TSIP: Stuffing = Stuffing::Doubled {
    escape: 0x10,
    start: None,
    end: 0x03,
};

/// Returns a packet that the format accepts, if there is one. Many bytes of short packets are special to some way of
/// stuffing.
fn packet(format: &Packets, random: &mut impl Rng) -> Vec<u8> {
    let special = [
        0xC0, 0xDB, 0xDC, 0xDD, 0x7E, 0x7D, 0x5E, 0x5D, 0, 1, 2, 3, 0x10, 0x10,
    ];
    // Long packets without a zero have blocks of 254 bytes in COBS.
    let is_long = format.most > 300 && random.random_range(0..4) == 0;
    let length = if is_long {
        random.random_range(253..260)
    } else {
        random.random_range(1..=format.most.min(12))
    };
    let mut packet: Vec<u8> = (0..length)
        .map(|_| match random.random_range(0..2) {
            0 if !is_long => *special.choose(random).expect("not empty"),
            _ => random.random_range(1..=255),
        })
        .collect();
    if format.check != PacketCheck::None {
        packet.push(0);
        if format.check == PacketCheck::LengthAndXor {
            packet.insert(0, 0);
            packet.truncate(format.most.clamp(2, 128));
            packet[0] = u8::try_from(packet.len() - 1).expect("at most 128 bytes");
        }
        packet.truncate(format.most);
        let last = packet.len() - 1;
        packet[last] = 0;
        packet[last] = packet.iter().fold(0, |sum, byte| sum ^ byte);
    }
    packet
}

/// Returns the bytes and line events that arrive if a few packets are sent. Some packets lack the delimiter before or
/// after them, and some are broken. Line events come between some of the slices.
fn received(format: &Packets, random: &mut impl Rng, occurred: &mut Occurred) -> Stream {
    let mut steps = Vec::new();
    for _ in 0..random.random_range(1..6) {
        let packet = packet(format, random);
        let mut buffer = vec![0; 2 * packet.len() + 4];
        let Some(stuffed) = format.stuffing.stuff(&packet, &mut buffer) else {
            occurred.count("not encoded", 1u8);
            continue;
        };
        let mut bytes = stuffed.to_vec();
        let has_delimiters = !matches!(format.stuffing, Stuffing::Doubled { .. } | Stuffing::Break);
        match random.random_range(0..6) {
            0 | 1 if has_delimiters => {
                bytes.remove(0);
                occurred.count("closing delimiter only", 1u8);
            }
            2 if has_delimiters => {
                bytes.pop();
                occurred.count("opening delimiter only", 1u8);
            }
            3 => bytes = broken(&bytes, |count| random.random_range(0..count)),
            _ => {}
        }
        steps.extend(cut(&bytes, random));
        if format.stuffing == Stuffing::Break && random.random_range(0..4) > 0 {
            steps.push(StreamStep::Event(LineEvent::Break));
        }
        if random.random_range(0..4) == 0 {
            let events = [
                LineEvent::Framing,
                LineEvent::Parity,
                LineEvent::Overrun,
                LineEvent::Break,
                LineEvent::Idle,
                LineEvent::Idle,
            ];
            let event = *events.choose(random).expect("not empty");
            let at = steps.len().saturating_sub(random.random_range(0..2));
            steps.insert(at, StreamStep::Event(event));
        }
    }
    Stream(steps)
}

/// On a faulty line, the receiver delivers exactly the packets of the naive definition. With each way of stuffing,
/// packets are delivered and others are rejected.
#[test]
fn packets_of_a_faulty_line_are_those_of_the_definition() {
    let mut all = Occurred::NOTHING;
    for (name, stuffing) in STUFFINGS {
        for check in [
            PacketCheck::None,
            PacketCheck::Xor,
            PacketCheck::LengthAndXor,
        ] {
            let mut occurred = Occurred::NOTHING;
            for trial in 0..1_000 {
                let mut random = Seed { seed: 1, trial }.random(Purpose::Sender);
                let most = *[1, 2, 5, 20, 400].choose(&mut random).expect("not empty");
                let format = Packets {
                    stuffing,
                    check,
                    most,
                };
                let stream = received(&format, &mut random, &mut all);
                let counters = packets(&AnyPackets { format, stream }, &mut all);
                occurred.count("frame", counters.frames);
                occurred.count("resynchronisation", counters.resynchronisations);
                all.count(name, counters.frames);
            }
            assert!(
                occurred.rarer_than(20).is_empty(),
                "{name} {check:?} {occurred:?}"
            );
        }
    }
    assert_eq!(
        all.rarer_than(20),
        [
            "broken sync",
            "special bytes are equal",
            "unknown message",
            "wrong terminator"
        ],
        "{all:?}"
    );
}

/// If a delimiter cuts a frame that has a length field, the frame's bytes count as broken stuffing, not as a line
/// event.
#[test]
fn a_frame_that_a_delimiter_cuts_is_counted() {
    let format = Packets {
        stuffing: Stuffing::HDLC,
        check: PacketCheck::LengthAndXor,
        most: 9,
    };
    let stream = Stream(vec![StreamStep::Slice(
        b"\x7E\x03ab\x7E\x02\x05\x07".to_vec(),
    )]);
    let counters = packets(&AnyPackets { format, stream }, &mut Occurred::default());
    assert_eq!(
        (counters.frames, counters.discarded.broken_stuffing),
        (1, 4)
    );
}
