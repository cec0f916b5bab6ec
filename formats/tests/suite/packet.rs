//! Tests the formats of packets with frames that other authors have published.

use framelock::{PacketFormat, PacketReceiver, Stuffing};
use framelock_formats::check_laws;
use framelock_formats::packet::{Cobs, Hdlc, Slip};

/// Returns the packets of a stream.
fn received<F>(format: F, bytes: &[u8]) -> Vec<Vec<u8>>
where
    F: PacketFormat + for<'a> framelock::Format<Message<'a> = &'a [u8]> + 'static,
{
    let mut receiver = PacketReceiver::with_buffer(format, [0; 300]).expect("long enough");
    let mut packets = Vec::new();
    receiver.feed(bytes, |found| {
        packets.extend(found.decoded().map(<[u8]>::to_vec));
    });
    packets
}

/// Examples of Cheshire and Baker's article about COBS, as Wikipedia prints them, with a delimiter before each.
#[test]
fn cobs_as_published() {
    let to_254: Vec<u8> = (1..=0xFE).collect();
    let to_255: Vec<u8> = (1..=0xFF).collect();
    let examples: [(&[u8], Vec<u8>); 8] = [
        (&[0], vec![1, 1]),
        (&[0, 0], vec![1, 1, 1]),
        (&[0, 0x11, 0], vec![1, 2, 0x11, 1]),
        (&[0x11, 0x22, 0, 0x33], vec![3, 0x11, 0x22, 2, 0x33]),
        (&[0x11, 0x22, 0x33, 0x44], vec![5, 0x11, 0x22, 0x33, 0x44]),
        (&[0x11, 0, 0, 0], vec![2, 0x11, 1, 1, 1]),
        (&to_254, [&[0xFF], to_254.as_slice()].concat()),
        (&to_255, [&[0xFF], to_254.as_slice(), &[2, 0xFF]].concat()),
    ];
    for (packet, between) in examples {
        let stuffed = [&[0], between.as_slice(), &[0]].concat();
        let mut buffer = [0; 300];
        assert_eq!(
            Stuffing::Cobs.stuff(packet, &mut buffer),
            Some(stuffed.as_slice())
        );
        assert_eq!(received(Cobs::<256>, &stuffed), [packet]);
    }
}

/// The catalogue of CRCs gives 906E for `123456789`. A sender may also escape bytes that need no escape, here the `9`.
#[test]
fn hdlc_as_published() {
    assert_eq!(Hdlc::<9>::crc(b"123456789"), [0x6E, 0x90]);
    let frame = b"\x7E123456789\x6E\x90\x7E12345678\x7D\x19\x6E\x90\x7E123456788\x6E\x90\x7E";
    assert_eq!(received(Hdlc::<9>, frame), [b"123456789", b"123456789"]);
    assert!(received(Hdlc::<8>, frame).is_empty());
}

/// The command 0, and data that consist of both special bytes.
#[test]
fn kiss() {
    let frame = b"\xC0\x00\xDB\xDC\xDB\xDD\xC0";
    assert_eq!(received(Slip::<3>, frame), [[0x00, 0xC0, 0xDB]]);
}

#[test]
fn the_laws_hold() {
    let mut bytes: Vec<u8> = b"any packets and 123456789\x6E\x90".to_vec();
    check_laws(&Slip::<5>, &mut bytes).expect("SLIP keeps the laws");
    check_laws(&Cobs::<1>, &mut bytes).expect("COBS keeps the laws");
    check_laws(&Hdlc::<9>, &mut bytes).expect("HDLC keeps the laws");
}
