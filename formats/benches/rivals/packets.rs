//! Packets between delimiters: COBS and SLIP.

use std::ops::Range;

use framelock_formats::packet::{Cobs, Slip};
use framelock_rivals_adapters::{self as adapters, PACKET_LONGEST};

use crate::contender::{Entry, Reference, packets};
use crate::figures::{Row, row};
use crate::protocols::Protocol;
use crate::streams::Payload;

/// The number of bytes in a receiver's buffer: the longest packet, and one byte more.
const BUFFER: usize = PACKET_LONGEST + 1;

pub(crate) const COBS: Protocol = Protocol {
    name: "COBS",
    feature: "cobs",
    length_at: 1,
    sync_dense: &[0, 0, 1, 2],
    hostile: &[b"\x00", b"\x00\x02\x55", b"\x01", b"\x00\x03\x55\x55"],
    frame: |payload| cobs::encode_vec_including_sentinels(&packet(payload)),
    key: |frame| without_cobs(inside(frame)).expect("a packet"),
    contenders: || {
        vec![
            packets::<BUFFER, _>(Cobs::<PACKET_LONGEST>, between(0, without_cobs)),
            Entry::rival::<adapters::Cobs>("cobs", <[u8]>::to_vec),
        ]
    },
};

pub(crate) const SLIP: Protocol = Protocol {
    name: "SLIP",
    feature: "slip",
    length_at: 1,
    sync_dense: &[0xC0, 0xDB, 0xDC, 0xDD],
    hostile: &[b"\xC0", b"\xC0\x55", b"\xDB\xDC", b"\xC0\x55\xDB\xDC"],
    frame: |payload| slip(&packet(payload)),
    key: |frame| without_slip(inside(frame)).expect("a packet"),
    contenders: || {
        vec![
            packets::<BUFFER, _>(Slip::<PACKET_LONGEST>, between(0xC0, without_slip)),
            Entry::rival::<adapters::SerialLineIp>("serial-line-ip", <[u8]>::to_vec),
        ]
    },
};

/// Returns a packet of 4 to 60 bytes.
fn packet(payload: &mut Payload) -> Vec<u8> {
    let length = payload.one_of(&[4, 8, 15, 16, 32, 60]);
    payload.bytes(length)
}

/// Returns the bytes between the first and the last byte.
fn inside(frame: &[u8]) -> &[u8] {
    &frame[1..frame.len() - 1]
}

/// Stuffs a packet. Writes a delimiter before and after it.
fn slip(packet: &[u8]) -> Vec<u8> {
    let stuffed = packet.iter().flat_map(|&byte| match byte {
        0xC0 => vec![0xDB, 0xDC],
        0xDB => vec![0xDB, 0xDD],
        _ => vec![byte],
    });
    [0xC0].into_iter().chain(stuffed).chain([0xC0]).collect()
}

fn without_cobs(stuffed: &[u8]) -> Option<Vec<u8>> {
    cobs::decode_vec(stuffed).ok()
}

fn without_slip(stuffed: &[u8]) -> Option<Vec<u8>> {
    let mut packet = Vec::new();
    let mut bytes = stuffed.iter();
    while let Some(&byte) = bytes.next() {
        packet.push(match byte {
            0xDB => match bytes.next()? {
                0xDC => 0xC0,
                0xDD => 0xDB,
                _ => return None,
            },
            _ => byte,
        });
    }
    Some(packet)
}

/// Returns the naive reference: the packets between two delimiters, with both delimiters.
fn between(delimiter: u8, unstuff: fn(&[u8]) -> Option<Vec<u8>>) -> Reference {
    Box::new(move |stream| {
        let is_delimiter = |&place: &usize| stream[place] == delimiter;
        let places: Vec<usize> = (0..stream.len()).filter(is_delimiter).collect();
        let ranges = places.windows(2).map(|pair| pair[0]..pair[1] + 1);
        let is_packet = |range: &Range<usize>| {
            let packet = unstuff(inside(&stream[range.clone()]));
            packet.is_some_and(|packet| (1..=PACKET_LONGEST).contains(&packet.len()))
        };
        ranges.filter(is_packet).collect()
    })
}

/// Returns the table of two more tests. A receiver that is switched on inside a packet should deliver only the next
/// packet; the test tries seven positions. If only one delimiter stands between each two packets, a receiver should
/// deliver all packets.
pub(crate) fn joined() -> Vec<Row> {
    let mut rows = Vec::new();
    let cobs: fn(&[u8]) -> Vec<u8> = cobs::encode_vec_including_sentinels;
    for (protocol, stuff) in [(COBS, cobs), (SLIP, slip)] {
        let next: &[u8] = b"next";
        let packets = [b"1", b"2", b"3", b"4", b"5"];
        let mut shared = stuff(packets[0]);
        packets[1..]
            .iter()
            .for_each(|packet| shared.extend(&stuff(*packet)[1..]));
        for entry in (protocol.contenders)() {
            let keys = |stream: &[u8]| -> Vec<Vec<u8>> {
                let delivered = (entry.deliver)(stream, 1).into_iter();
                delivered.map(|delivered| delivered.key).collect()
            };
            let (mut lost, mut false_packets) = (0, 0);
            for from in 2..=8 {
                let stream = [&stuff(&[1; 8])[from..], &stuff(next)].concat();
                let (right, wrong): (Vec<_>, Vec<_>) =
                    keys(&stream).into_iter().partition(|key| key == next);
                lost += usize::from(right.is_empty());
                false_packets += wrong.len();
            }
            let all = keys(&shared).len();
            rows.push(row![
                "joined",
                protocol.name,
                entry.name,
                lost,
                false_packets,
                all
            ]);
        }
    }
    rows
}
