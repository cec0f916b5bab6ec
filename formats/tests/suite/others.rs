//! Checks the formats against independent crates. Each side must decode the other side's frames to the same values.

use framelock::{Encode as _, EncodeInto, Receiver};
use framelock_formats::layout::{Algorithm, Checksum, Crc, Table};
use framelock_formats::{
    crsf::{Crsf, Message as CrsfMessage},
    ibus::Ibus,
    mavlink::{self, Mavlink1, Mavlink2},
    motion::SixAxes,
    rtcm::{self, Rtcm},
    sbus::{self, Sbus},
    ubx::{self, Ubx},
};
use mavlink_core::error::ParserError;
use mavlink_core::{MAVLinkV1MessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkVersion};
use proptest::prelude::*;
use sha2::Digest as _;
use ublox::proto23::{PacketRef, Proto23};
use ublox::{ParserBuilder, UbxPacket, UbxPacketRequest};

use crate::laws::signed;
use crate::{DIALECT, frame, receive, receive_one};

fn channels() -> impl Strategy<Value = [u16; 16]> {
    prop::array::uniform16(0_u16..2048)
}

/// A CRC of 24 bits. Its polynomial is intended for sixteen bits.
const OF_24_BITS: crc::Algorithm<u32> = crc::Algorithm {
    width: 24,
    poly: 0x1021,
    init: 0,
    refin: true,
    refout: true,
    xorout: 0,
    check: 0,
    residue: 0,
};

proptest! {
    #[test]
    fn sbus(channels in channels(), [a, b, frame_lost, failsafe]: [bool; 4]) {
        let message = sbus::Message { channels, digital: [a, b], frame_lost, failsafe };
        let packet = uf_sbus::SbusPacket {
            channels, channel_17: a, channel_18: b, failsafe, frame_lost,
        };
        let mut theirs = [0; 25];
        uf_sbus::encode_packet(&mut theirs, &packet);
        prop_assert_eq!(theirs.to_vec(), frame(&Sbus, message));
        receive_one::<_, 25>(Sbus, &theirs, |received| assert_eq!(received, message));

        let other = sbus_rs::SbusPacket::from_array(&theirs).expect("a packet");
        prop_assert_eq!(other.channels, channels);
        let flags = other.flags;
        let flags = [flags.d1, flags.d2, flags.frame_lost, flags.failsafe];
        prop_assert_eq!(flags, [a, b, frame_lost, failsafe]);
    }

    #[test]
    fn ibus(channels in prop::array::uniform18(0_u16..0x1000)) {
        let frame = frame(&Ibus, channels);
        let bytes = frame.first_chunk().expect("32 bytes");
        let theirs = parse_rc_ibus::IbusPacket::try_from_bytes(bytes).expect("a packet");
        let lower = theirs.get_all_channels().map(|number| number & 0x0FFF);
        prop_assert_eq!(&lower[..], &channels[..14]);
        receive_one::<_, 32>(Ibus, &frame, |received| assert_eq!(received, channels));
    }

    #[test]
    fn crcs_with_and_without_tables(bytes in prop::collection::vec(any::<u8>(), 0..=40)) {
        let of_sixteen_bits = |polynomial, reflected| {
            Crc { initial: 0xFFFF, reflected_in: reflected, reflected_out: reflected, ..Crc::new(16, polynomial) }
        };
        let of_32_bits = Crc { initial: u32::MAX, xor_out: u32::MAX, ..Crc::new(32, 0x04C1_1DB7) };
        let of_24_bits = Crc { reflected_in: true, reflected_out: true, ..Crc::new(24, 0x1021) };
        let expected = |theirs| crc::Crc::<u16>::new(theirs).checksum(&bytes).into();
        for (crc, expected) in [
            (of_sixteen_bits(0x1021, true), expected(&crc::CRC_16_MCRF4XX)),
            (of_sixteen_bits(0x8005, true), expected(&crc::CRC_16_MODBUS)),
            (of_sixteen_bits(0x1021, false), expected(&crc::CRC_16_IBM_3740)),
            (of_24_bits, crc::Crc::<u32>::new(&OF_24_BITS).checksum(&bytes)),
            (of_32_bits, crc::Crc::<u32>::new(&crc::CRC_32_BZIP2).checksum(&bytes)),
        ] {
            let words = crc.table_of_words();
            for table in [Table::None, Table::Words(&words)] {
                let algorithm = Algorithm::Crc(Crc { table, ..crc });
                let checksum = Checksum { algorithm, ..Checksum::at_the_end(4) };
                prop_assert_eq!(checksum.of(&bytes, None), expected);
            }
        }
    }

    #[test]
    fn crcs_of_eight_bits(bytes in prop::collection::vec(any::<u8>(), 0..=40), extra in any::<u8>()) {
        let all = [&bytes[..], &[extra]].concat();
        for (polynomial, reflected, theirs) in [
            (0x31, false, &crc::CRC_8_NRSC_5),
            (0x07, true, &crc::CRC_8_ROHC),
        ] {
            let crc = Crc { initial: 0xFF, reflected_in: reflected, reflected_out: reflected, ..Crc::new(8, polynomial) };
            let (narrow, words) = (crc.table_of_bytes(), crc.table_of_words());
            let expected = crc::Crc::<u8>::new(theirs);
            for table in [Table::None, Table::Bytes(&narrow), Table::Words(&words)] {
                let algorithm = Algorithm::Crc(Crc { table, ..crc });
                let checksum = Checksum { algorithm, ..Checksum::at_the_end(1) };
                prop_assert_eq!(checksum.of(&bytes, None), expected.checksum(&bytes).into());
                prop_assert_eq!(checksum.of(&bytes, Some(extra)), expected.checksum(&all).into());
            }
        }
    }

    #[test]
    fn crsf(kind: u8, payload in prop::collection::vec(any::<u8>(), 0..=60)) {
        let sent = CrsfMessage { address: 0xEC, kind, payload: &payload };
        let frame = frame(&Crsf, sent);
        let crc = crc::Crc::<u8>::new(&crc::CRC_8_DVB_S2);
        prop_assert_eq!(crc.checksum(&frame[2..frame.len() - 1]), frame[frame.len() - 1]);

        let mut input = &frame[..];
        let mut parser = uf_crsf::CrsfParser::new();
        let theirs = parser.next_raw_packet(&mut input).expect("a packet").expect("a whole one");
        prop_assert_eq!((theirs.dst_addr(), theirs.raw_packet_type()), (0xEC, kind));
        prop_assert_eq!(theirs.payload(), &payload[..]);

        receive_one::<_, 64>(Crsf, &frame, |message| {
            assert_eq!(message, sent);
        });
    }

    #[test]
    fn crsf_channels(channels in channels()) {
        let packet = crsf::Packet::RcChannels(crsf::RcChannels(channels));
        let theirs = packet.into_raw(crsf::PacketAddress::Controller);
        let mut other = [0; 64];
        let packet = uf_crsf::packets::RcChannelsPacked(channels);
        let address = uf_crsf::PacketAddress::FlightController;
        let length = uf_crsf::write_packet_to_buffer(&mut other, address, &packet).expect("there is room");
        prop_assert_eq!(theirs.data(), &other[..length]);
        receive_one::<_, 64>(Crsf, theirs.data(), |message| {
            assert_eq!(message.channels(), Some(channels));
        });
        // Some senders append bytes, which receivers ignore. Without all channels, a frame has no known meaning.
        let payload = [&other[3..length - 1], &[0xFF; 3]].concat();
        for used in 0..=payload.len() {
            let message = CrsfMessage { address: 0xC8, kind: 0x16, payload: &payload[..used] };
            prop_assert_eq!(message.channels(), (used >= 22).then_some(channels), "{}", used);
        }
    }

    /// The crate `ublox` knows no messages of this class, so it returns the payload undecoded.
    #[test]
    fn ubx(id: u8, payload in prop::collection::vec(any::<u8>(), 0..=240)) {
        let sent = ubx::Message { class: 0x7F, id, payload: &payload };
        let frame = frame(&Ubx::<248>, sent);
        let mut parser = ParserBuilder::new().with_protocol::<Proto23>().with_vec_buffer();
        let mut packets = parser.consume_ubx(&frame);
        let Some(Ok(UbxPacket::Proto23(PacketRef::Unknown(theirs)))) = packets.next() else {
            panic!("no packet in {frame:02X?}");
        };
        prop_assert_eq!((theirs.class, theirs.msg_id, theirs.payload), (0x7F, id, &payload[..]));

        receive_one::<_, 248>(Ubx::<248>, &frame, |message| {
            assert_eq!(message, sent);
        });
    }

    #[test]
    fn ubx_by_ublox(class: u8, id: u8) {
        let theirs = UbxPacketRequest::request_for_unknown(class, id).into_packet_bytes();
        receive_one::<_, 8>(Ubx::<8>, &theirs, |message| {
            assert_eq!(message, ubx::Message { class, id, payload: &[] });
        });
    }

    #[test]
    fn mavlink2(
        [sequence, system, component]: [u8; 3],
        is_signed: bool,
        payload in prop::collection::vec(any::<u8>(), 1..=255),
    ) {
        let id = 0x01_02_03;
        let sent = mavlink::Message {
            sequence, system, component, id, payload: &payload, signature: None,
        };
        let mut frame = frame(&Mavlink2(DIALECT), sent);
        if is_signed {
            frame = signed(&frame);
        }
        let mut raw = [0; 283];
        raw[..frame.len()].copy_from_slice(&frame);
        let theirs = MAVLinkV2MessageRaw::from_bytes_unparsed(raw);
        prop_assert!(theirs.has_valid_crc_with_extra_crc(7));
        prop_assert_eq!(theirs.raw_bytes(), &frame[..]);
        prop_assert_eq!((theirs.sequence(), theirs.system_id()), (sequence, system.into()));
        prop_assert_eq!((theirs.component_id(), theirs.message_id()), (component, id));

        receive_one::<_, 280>(Mavlink2(DIALECT), &frame, |message| {
            let signature = message.signature;
            let payload = theirs.payload();
            assert_eq!(message, mavlink::Message { payload, signature, ..sent });
            assert_eq!(signature.is_some(), is_signed);
            if let Some(signature) = signature {
                assert_eq!(signature.link, theirs.signature_link_id());
                assert_eq!(signature.timestamp, theirs.signature_timestamp());
                assert_eq!(signature.value, theirs.signature_value());
                let mut value = [0; 6];
                theirs.calculate_signature(b"secret", &mut value);
                let signed = [b"secret", signature.signed].concat();
                assert_eq!(sha2::Sha256::digest(signed)[..6], value);
                assert_eq!([signature.signed, &signature.value].concat(), frame);
            }
        });
    }
}

/// HEARTBEAT, encoded by `mavlink_core`.
struct Heartbeat([u8; 9]);

impl mavlink_core::Message for Heartbeat {
    fn message_id(&self) -> u32 {
        0
    }

    fn extra_crc(_: u32) -> u8 {
        50
    }

    fn ser(&self, _: MavlinkVersion, payload: &mut [u8]) -> usize {
        payload[..9].copy_from_slice(&self.0);
        mavlink_core::utils::remove_trailing_zeroes(&payload[..9])
    }

    fn message_name(&self) -> &'static str {
        "HEARTBEAT"
    }

    fn target_system_id(&self) -> Option<u8> {
        None
    }

    fn target_component_id(&self) -> Option<u8> {
        None
    }

    fn target_system_id_mut(&mut self) -> Option<&mut u8> {
        None
    }

    fn target_component_id_mut(&mut self) -> Option<&mut u8> {
        None
    }

    fn parse(_: MavlinkVersion, _: u32, _: &[u8]) -> Result<Self, ParserError> {
        unreachable!("it is only sent")
    }

    fn message_id_from_name(_: &str) -> Option<u32> {
        None
    }

    fn default_message_from_id(_: u32) -> Option<Self> {
        None
    }
}

proptest! {
    /// Both encoders leave out trailing zeros in the same way.
    #[test]
    fn mavlink2_by_mavlink_core(payload: [u8; 9], zeros in 0..=9_usize, sequence: u8) {
        let mut payload = payload;
        payload[9 - zeros..].fill(0);
        let mut theirs = MAVLinkV2MessageRaw::new();
        let header = MavHeader { system_id: 1, component_id: 2, sequence };
        theirs.serialize_message(header, &Heartbeat(payload));
        let sent = mavlink::Message {
            sequence, system: 1, component: 2, id: 0, payload: &payload, signature: None,
        };
        prop_assert_eq!(theirs.raw_bytes(), frame(&Mavlink2(DIALECT), sent));
        receive_one::<_, 280>(Mavlink2(DIALECT), theirs.raw_bytes(), |message| {
            assert_eq!(message, mavlink::Message { payload: theirs.payload(), ..sent });
        });
    }
}

#[test]
fn mavlink2_with_an_unknown_incompatible_flag_is_dropped() {
    let sent = mavlink::Message {
        payload: &[1; 9],
        ..mavlink::Message::default()
    };
    let mut frame = frame(&Mavlink2(DIALECT), sent);
    for (flags, delivered) in [(0, 1), (2, 0), (4, 0), (0x80, 0)] {
        frame[2] = flags;
        let crc = mavlink_core::calculate_crc(&frame[1..19], 50);
        frame[19..].copy_from_slice(&crc.to_le_bytes());
        let mut received = 0;
        receive::<_, 280>(Mavlink2(DIALECT), &frame, |_| received += 1);
        assert_eq!(received, delivered, "flags {flags}");
    }
}

/// CRSF frames of fewer than four bytes are rejected, even if the CRC is correct. In such frames, the CRC covers no
/// bytes.
#[test]
fn crsf_has_no_frame_of_fewer_than_four_bytes() {
    let stream = [0xC8, 0, 0xC8, 1, 0, 0xC8, 0];
    receive::<_, 64>(Crsf, &stream, |_| panic!("delivered"));
}

/// Each format refuses the messages that its documentation names, and only these.
#[test]
fn a_message_without_a_frame_is_not_encoded() {
    fn is_encoded<F: EncodeInto>(format: &F, message: F::Message<'_>) -> bool {
        format.encode_into(message, &mut [0; 2000]).is_ok()
    }
    for address in 0..=u8::MAX {
        let message = CrsfMessage {
            address,
            kind: 0x16,
            payload: &[1],
        };
        let is_accepted = [0xC8, 0x00, 0xEA, 0xEC, 0xEE].contains(&address);
        assert_eq!(is_encoded(&Crsf, message), is_accepted, "{address:#04X}");
    }
    for (id, is_known) in [(0, true), (256, false), (1 << 24, false)] {
        let message = mavlink::Message {
            id,
            payload: &[1],
            ..Default::default()
        };
        assert_eq!(is_encoded(&Mavlink1(DIALECT), message), is_known, "{id}");
        assert_eq!(is_encoded(&Mavlink2(DIALECT), message), is_known, "{id}");
    }
    let payload = [7; 1024];
    for (most, encodes) in [
        (60, |payload: &[u8]| {
            let (address, kind) = (0xC8, 0x16);
            is_encoded(
                &Crsf,
                CrsfMessage {
                    address,
                    kind,
                    payload,
                },
            )
        }),
        (92, |payload: &[u8]| {
            let (class, id) = (1, 7);
            is_encoded(&Ubx::<100>, ubx::Message { class, id, payload })
        }),
        (1023, |payload: &[u8]| {
            is_encoded(&Rtcm, rtcm::Message { payload })
        }),
        (9, |payload: &[u8]| {
            let message = mavlink::Message {
                payload,
                ..Default::default()
            };
            is_encoded(&Mavlink2(DIALECT), message) && is_encoded(&Mavlink1(DIALECT), message)
        }),
    ] as [(usize, fn(&[u8]) -> bool); 4]
    {
        assert!(encodes(&payload[..most]), "{most}");
        assert!(!encodes(&payload[..=most]), "{most} and one more");
    }
    let unknown = mavlink::Message {
        id: 1,
        ..Default::default()
    };
    assert!(!is_encoded(&Mavlink2(DIALECT), unknown) && !is_encoded(&Mavlink1(DIALECT), unknown));
}

#[test]
fn rtcm_numbers_are_the_first_twelve_bits() {
    let payload = [0x43, 0x50, 0xFF];
    let numbers = [0, 1, 2, 3].map(|bytes| {
        let payload = &payload[..bytes];
        rtcm::Message { payload }.number()
    });
    assert_eq!(numbers, [None, None, Some(1077), Some(1077)]);
}

/// SBUS2's last bytes are those of its telemetry slots.
#[test]
fn sbus_with_each_last_byte() {
    for (flags, last) in
        (0..=u8::MAX)
            .map(|byte| (0, byte))
            .chain([(0x0F, 0), (0x10, 0), (0x80, 0)])
    {
        let mut frame = frame(&Sbus, sbus::Message::default());
        [frame[23], frame[24]] = [flags, last];
        let mut parser = uf_sbus::SbusParser::new();
        let theirs = frame.iter().find_map(|&byte| parser.push_byte(byte));
        let mut received = 0;
        receive::<_, 25>(Sbus, &frame, |_| received += 1);
        let is_right = theirs.expect("25 bytes").is_ok();
        assert_eq!(received, u8::from(is_right), "{flags:02X} {last:02X}");
    }
}

#[test]
fn crsf_from_each_device() {
    use uf_crsf::PacketAddress::{
        Broadcast, FlightController, Gps, Handset, Receiver, Transmitter, Usb,
    };
    let packet = uf_crsf::packets::RcChannelsPacked([992; 16]);
    let accepted = [Broadcast, FlightController, Handset, Receiver, Transmitter].map(|it| (it, 1));
    for (address, delivered) in accepted.into_iter().chain([(Gps, 0), (Usb, 0)]) {
        let mut frame = [0; 64];
        let length =
            uf_crsf::write_packet_to_buffer(&mut frame, address, &packet).expect("there is room");
        let mut received = 0;
        receive::<_, 64>(Crsf, &frame[..length], |_| received += 1);
        assert_eq!(received, delivered, "{address:?}");
    }
}

proptest! {
    #[test]
    fn mavlink1([sequence, system, component]: [u8; 3], payload in prop::collection::vec(any::<u8>(), 28)) {
        let sent = mavlink::Message {
            sequence, system, component, id: 30, payload: &payload, signature: None,
        };
        let frame = frame(&Mavlink1(DIALECT), sent);
        let padded = [&frame[..], &[0; 300]].concat();
        let theirs = MAVLinkV1MessageRaw::from_bytes_unparsed(*padded.first_chunk().expect("long enough"));
        prop_assert!(theirs.has_valid_crc_with_extra_crc(39));
        prop_assert_eq!(theirs.raw_bytes(), &frame[..]);
        let numbers = [theirs.sequence(), theirs.system_id(), theirs.component_id(), theirs.message_id()];
        prop_assert_eq!(numbers, [sequence, system, component, 30]);
        prop_assert_eq!(theirs.payload(), &payload[..]);
        receive_one::<_, 263>(Mavlink1(DIALECT), &frame, |message| assert_eq!(message, sent));
    }

    /// The catalogue's name for RTCM's CRC is CRC-24/LTE-A.
    #[test]
    fn rtcm(payload in prop::collection::vec(any::<u8>(), 0..=290)) {
        let sent = rtcm::Message { payload: &payload };
        let frame = frame(&Rtcm, sent);
        let [_, crc @ ..] = crc::Crc::<u32>::new(&crc::CRC_24_LTE_A).checksum(&frame[..frame.len() - 3]).to_be_bytes();
        prop_assert_eq!(&frame[frame.len() - 3..], crc);
        receive_one::<_, 1029>(Rtcm, &frame, |message| assert_eq!(message, sent));
    }
}

/// Message 1005, the example of the standard.
#[test]
fn rtcm_by_the_standard() {
    let frame = b"\xD3\0\x13\x3E\xD7\xD3\x02\x02\x98\x0E\xDE\xEF\x34\xB4\xBD\x62\xAC\x09\x41\x98\x6F\x33\x36\x0B\x98";
    receive_one::<_, 1029>(Rtcm, frame, |message| {
        assert_eq!(
            (message.number(), message.payload),
            (Some(1005), &frame[3..22])
        );
    });
}

/// No other project has this frame, so its bytes are written by hand.
#[test]
fn six_axes() {
    let frame = *b"\xFF\xFF\x01\0\x02\x01\xFF\xFF\0\x80\x0A\x0D\x0D\x0A\x0A\x0D";
    let axes = [1, 0x0102, 0xFFFF, 0x8000, 0x0D0A, 0x0A0D];
    assert_eq!(SixAxes::encode(axes), frame);
    let mut receiver = Receiver::<SixAxes>::new();
    let found = frame.iter().find_map(|&byte| receiver.push(byte));
    assert_eq!(found, Some(axes));
}
