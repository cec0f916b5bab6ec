//! The protocols: their frames, their hostile streams, and the receivers for them.

use crc::{CRC_8_DVB_S2, CRC_16_MCRF4XX, Crc};
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8, Setpoint};
use framelock::{Encode, EncodeInto};
use framelock_formats::mavlink::Mavlink2;
use framelock_formats::motion::{self, SixAxes};
use framelock_formats::{crsf::Crsf, ibus::Ibus, sbus::Sbus, ubx::Ubx};
use framelock_rivals_adapters::mavlink2::{MESSAGES, MavlinkCore};
use framelock_rivals_adapters::{self as adapters, UBX_LONGEST};
use ublox::UbxPacket;
use ublox::proto23::PacketRef;

use crate::contender::{Combinator, Entry, Framelock, RegularExpression, buffered, fixed};
use crate::streams::Payload;

/// A protocol's frames.
pub(crate) struct Protocol {
    pub(crate) name: &'static str,
    /// The feature of `on-chip` that selects framelock's receiver.
    pub(crate) feature: &'static str,
    /// The index of the length byte, or of the second byte if the protocol has no length byte.
    pub(crate) length_at: usize,
    /// The bytes from which the payloads of the sync-dense stream are drawn: bytes of syncs, headers and terminators.
    pub(crate) sync_dense: &'static [u8],
    /// The bytes that each hostile stream repeats.
    pub(crate) hostile: &'static [&'static [u8]],
    /// Makes a frame. Uses framelock only for formats that no other crate implements.
    pub(crate) frame: fn(&mut Payload) -> Vec<u8>,
    /// Extracts from a frame the key that identifies this frame in the comparison. The key is a part of the frame that
    /// every receiver returns to its user.
    pub(crate) key: fn(&[u8]) -> Vec<u8>,
    /// framelock's receiver, then the others.
    pub(crate) contenders: fn() -> Vec<Entry>,
}

pub(crate) const PROTOCOLS: [Protocol; 10] = [
    crate::packets::COBS,
    crate::packets::SLIP,
    Protocol {
        name: "SBUS",
        feature: "sbus",
        length_at: 1,
        sync_dense: &[0x0F, 0, 0x0F, 0],
        hostile: &[b"\x0F", b"\x0F\x55"],
        // Sixteen channels of eleven bits fill the payload.
        frame: |payload| [&[0x0F][..], &payload.bytes(22), &[0, 0]].concat(),
        key: |frame| little_endian(sbus_channels(&frame[1..23])),
        contenders: || {
            vec![
                buffered::<50, _>(Sbus, |message| little_endian(message.channels)),
                Entry::rival::<adapters::UfSbus>("uf-sbus", |packet| {
                    little_endian(packet.channels)
                }),
                Entry::rival::<adapters::SbusRs>("sbus-rs", |packet| {
                    little_endian(packet.channels)
                }),
                Entry::rival::<adapters::Sbus>("sbus", |packet| {
                    little_endian(private_channels(&packet))
                }),
            ]
        },
    },
    Protocol {
        name: "iBUS",
        feature: "ibus",
        length_at: 1,
        sync_dense: &[0x20, 0x40],
        hostile: &[b"\x20\x40", b"\x20", b"\x20\x20\x40"],
        frame: ibus_frame,
        key: |frame| frame[2..30].to_vec(),
        contenders: || {
            vec![
                buffered::<64, _>(Ibus, |channels| {
                    let frame = Ibus.encode_into(channels, &mut [0; 32]).map(<[u8]>::to_vec);
                    frame.expect("it fits")[2..30].to_vec()
                }),
                Entry::rival::<adapters::Textbook>("parse_rc_ibus", |packet| {
                    little_endian(packet.get_all_channels())
                }),
            ]
        },
    },
    Protocol {
        name: "CRSF",
        feature: "crsf",
        length_at: 1,
        sync_dense: &[0xC8, 0xC8, 24, 12, 0x16, 62],
        hostile: &[b"\xC8\x3C", b"\xC8\x3E", b"\xC8\x3E\xC8", b"\xC8"],
        frame: crsf_frame,
        key: crsf_inside,
        contenders: || {
            vec![
                buffered::<128, _>(Crsf, |message| [&[message.kind], message.payload].concat()),
                Entry::rival::<adapters::UfCrsf>("uf-crsf", |raw| crsf_inside(raw.as_slice())),
                Entry::rival::<adapters::Crsf>("crsf", |raw| crsf_inside(raw.data())),
            ]
        },
    },
    Protocol {
        name: "UBX",
        feature: "ubx",
        length_at: 4,
        sync_dense: &[0xB5, 0x62, 0xB5, 0x62, 1, 7, 28, 0, 0],
        hostile: &[
            b"\xB5\x62\x00",
            b"\xB5\x62\x01\x07\x62\x00",
            b"\xB5\x62",
            b"\xB5",
        ],
        frame: ubx_frame,
        key: |frame| [&frame[2..4], &frame[6..frame.len() - 2]].concat(),
        contenders: || {
            vec![
                buffered::<{ 2 * UBX_LONGEST }, _>(Ubx::<UBX_LONGEST>, |message| {
                    [&[message.class, message.id], message.payload].concat()
                }),
                Entry::rival::<adapters::Ublox>("ublox", |packet| match packet {
                    UbxPacket::Proto23(PacketRef::Unknown(packet)) => {
                        [&[packet.class, packet.msg_id], packet.payload].concat()
                    }
                    UbxPacket::Proto23(_) => Vec::new(),
                }),
            ]
        },
    },
    Protocol {
        name: "MAVLink 2",
        feature: "mavlink2",
        length_at: 1,
        sync_dense: &[0xFD, 0xFD, 28, 0, 0, 1, 30],
        hostile: &[
            b"\xFD\xFF\0\0\0\0\0\x83\0\0",
            b"\xFD\xFF\x01\0\0\0\0\x83\0\0",
            // Two interleaved series of false starts. The length byte of a false start in one series is the message
            // byte of a false start in the other series.
            b"\xFD\x83\0\0\xFD\xFF\0\x83\0\0",
            b"\xFD",
        ],
        frame: mavlink2_frame,
        key: |frame| frame[10..frame.len() - 2].to_vec(),
        contenders: || {
            vec![
                buffered::<560, _>(Mavlink2(MESSAGES), |message| message.payload.to_vec()),
                Entry::rival::<MavlinkCore<64>>("mavlink-core", |message| {
                    message.payload().to_vec()
                }),
            ]
        },
    },
    Protocol {
        name: "six axes",
        feature: "six-axes",
        length_at: 1,
        sync_dense: &[0xFF, b'\n', b'\r'],
        hostile: &[b"\xFF", b"\xFF\xFF0123456789AB\n\n", b"\xFF\xFF\n\r"],
        frame: |payload| [b"\xFF\xFF", &payload.bytes(12)[..], b"\n\r"].concat(),
        key: |frame| frame[2..14].to_vec(),
        contenders: || vec![fixed::<SixAxes>(&[motion::SIX_AXES], little_endian)],
    },
    Protocol {
        name: "BIN",
        feature: "bin",
        length_at: 1,
        sync_dense: b"AB\r",
        hostile: &[b"A", b"AB", b"AB01234"],
        frame: |payload| [b"AB\0", &payload.bytes(3)[..], b"\r"].concat(),
        key: |frame| frame[3..6].to_vec(),
        contenders: || {
            vec![
                fixed::<Bin>(&[motion::BIN], setpoint),
                Entry::on_pc::<Framelock<Lecture>>("the lecture's machine", setpoint),
                Entry::on_pc::<RegularExpression>("regex", <[u8]>::to_vec),
                Entry::on_pc::<Combinator>("winnow", <[u8]>::to_vec),
            ]
        },
    },
    Protocol {
        name: "BIN-CRC8",
        feature: "bin-crc8",
        length_at: 1,
        sync_dense: b"AB\r",
        // In the last stream, every fourth byte ends a frame in which only the checksum is wrong.
        hostile: &[b"A", b"AB", b"AB012345", b"AB0\r"],
        frame: |payload| {
            let setpoint: [u8; 3] = payload.bytes(3).try_into().expect("three bytes");
            BinCrc8::encode(setpoint.into()).to_vec()
        },
        key: |frame| frame[3..6].to_vec(),
        contenders: || vec![fixed::<BinCrc8>(&[motion::BIN_CRC8], setpoint)],
    },
];

fn setpoint(Setpoint { pitch, roll, yaw }: Setpoint) -> Vec<u8> {
    vec![pitch, roll, yaw]
}

fn little_endian<const N: usize>(numbers: [u16; N]) -> Vec<u8> {
    numbers.into_iter().flat_map(u16::to_le_bytes).collect()
}

/// Unpacks the channels bit by bit. The first channel has the lowest bits.
fn sbus_channels(bytes: &[u8]) -> [u16; 16] {
    let bit = |place: usize| u16::from(bytes[place / 8] >> (place % 8) & 1);
    std::array::from_fn(|channel| {
        (0..11)
            .map(|place| bit(channel * 11 + place) << place)
            .sum()
    })
}

/// Returns the channels, which the crate `sbus` shows only in its debug output.
fn private_channels(packet: &sbus::SBusPacket) -> [u16; 16] {
    let text = format!("{packet:?}");
    let list = text.split(['[', ']']).nth(1).expect("a list");
    let numbers = list.split(", ").map(|text| text.parse().expect("a number"));
    let channels: Vec<u16> = numbers.collect();
    channels.try_into().expect("sixteen")
}

fn ibus_frame(payload: &mut Payload) -> Vec<u8> {
    let mut frame = [&[0x20, 0x40][..], &payload.bytes(28)].concat();
    // The upper bits of the last two numbers belong to no channel.
    for place in [27, 29] {
        frame[place] &= 0x0F;
    }
    let sum = frame
        .iter()
        .fold(0xFFFF_u16, |sum, &byte| sum - u16::from(byte));
    frame.extend(sum.to_le_bytes());
    frame
}

/// Makes a frame of a random kind: channels, link statistics, GPS, battery, attitude, or a parameter entry. The longest
/// parameter entry fills the longest frame.
#[rustfmt::skip]
fn crsf_frame(payload: &mut Payload) -> Vec<u8> {
    let (kind, length) = payload.one_of(&[
        (0x16, 22), (0x16, 22), (0x16, 22), (0x14, 10), (0x02, 15), (0x08, 8), (0x1E, 6), (0x2B, 37), (0x2B, 60),
    ]);
    let mut checked = vec![kind];
    checked.extend(payload.bytes(length));
    let check = Crc::<u8>::new(&CRC_8_DVB_S2).checksum(&checked);
    let behind = u8::try_from(checked.len() + 1).expect("at most 62");
    [&[0xC8, behind], &checked[..], &[check]].concat()
}

/// Returns the kind and the payload.
fn crsf_inside(frame: &[u8]) -> Vec<u8> {
    frame[2..frame.len() - 1].to_vec()
}

/// Makes a frame with the length of a NAV message (PVT, SOL, POSLLH, STATUS, CLOCK, VELNED) or of an acknowledgement.
#[rustfmt::skip]
fn ubx_frame(payload: &mut Payload) -> Vec<u8> {
    let (id, length) = payload.one_of(&[
        (0x07, 92), (0x06, 52), (0x02, 28), (0x03, 16), (0x22, 20), (0x12, 36), (0x01, 2),
    ]);
    let mut frame = vec![0xB5, 0x62, 0x01, id, length, 0];
    frame.extend(payload.bytes(length.into()));
    let (mut a, mut b) = (0_u8, 0_u8);
    for byte in &frame[2..] {
        a = a.wrapping_add(*byte);
        b = b.wrapping_add(a);
    }
    frame.extend([a, b]);
    frame
}

/// Makes a frame of any known message except the longest one, ENCAPSULATED_DATA.
fn mavlink2_frame(payload: &mut Payload) -> Vec<u8> {
    let sent: Vec<_> = MESSAGES
        .iter()
        .filter(|message| message.longest_payload < 255)
        .collect();
    let message = payload.one_of(&sent);
    let length = u8::try_from(message.longest_payload).expect("at most 54");
    let id = u8::try_from(message.number).expect("at most 253");
    let contents = payload.bytes(length.into());
    let mut frame = vec![0xFD, length, 0, 0, contents[1], 1, 1, id, 0, 0];
    frame.extend(contents);
    let crc = Crc::<u16>::new(&CRC_16_MCRF4XX);
    let mut digest = crc.digest();
    digest.update(&frame[1..]);
    digest.update(&[message.extra.expect("each message has an extra byte")]);
    frame.extend(digest.finalize().to_le_bytes());
    frame
}
