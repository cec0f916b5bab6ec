//! Checks the formats against frames that other projects made or read, in `frames.txt`, and the CRCs against a
//! catalogue.

use framelock::{Encode as _, EncodeInto, Receiver};
use framelock_formats::layout::{Algorithm, Checksum, Crc, Table};
use framelock_formats::{
    crsf::{Crsf, Message as CrsfMessage},
    ibus::Ibus,
    mavlink::{self, Mavlink1, Mavlink2},
    modbus::ModbusRtu,
    motion::SixAxes,
    nmea::Nmea,
    rtcm::{self, Rtcm},
    sbus::{self, Sbus},
    ubx::{self, Ubx},
};
use proptest::prelude::*;

use crate::{DIALECT, frame, receive};

/// Returns the messages in a frame as text, and the frames that encode them.
fn received<F, const N: usize>(
    format: F,
    bytes: &[u8],
    text: impl Fn(F::Message<'_>) -> String,
) -> (Vec<String>, Vec<Vec<u8>>)
where
    F: EncodeInto + Copy,
    for<'a> F::Message<'a>: Copy,
{
    let (mut messages, mut frames) = (Vec::new(), Vec::new());
    receive::<F, N>(format, bytes, |message| {
        messages.push(text(message));
        frames.push(frame(&format, message));
    });
    (messages, frames)
}

/// Each line has a format, a frame, and the message in it, or `none`.
#[test]
fn frames_of_other_projects() {
    let (_, lines) = include_str!("../frames.txt")
        .split_once("\n\n")
        .expect("frames");
    for line in lines.lines() {
        let mut words = line.splitn(4, ' ');
        let [name, hex, arrow, expected] = [(); 4].map(|()| words.next().expect("four parts"));
        let byte = |at| u8::from_str_radix(&hex[at..at + 2], 16).expect("hexadecimal digits");
        let bytes: Vec<u8> = (0..hex.len()).step_by(2).map(byte).collect();
        let (messages, frames) = match name {
            "SBUS" => received::<_, 25>(Sbus, &bytes, |it| format!("{it:?}")),
            "iBUS" => received::<_, 32>(Ibus, &bytes, |it| format!("{it:?}")),
            "CRSF" => received::<_, 64>(Crsf, &bytes, |it| format!("{it:?} {:?}", it.channels())),
            "UBX" => received::<_, 248>(Ubx::<248>, &bytes, |it| format!("{it:?}")),
            "NMEA" => received::<_, 515>(Nmea, &bytes, |it| it.escape_ascii().to_string()),
            "MAVLink1" => received::<_, 263>(Mavlink1(DIALECT), &bytes, |it| format!("{it:?}")),
            "MAVLink2" => received::<_, 280>(Mavlink2(DIALECT), &bytes, |it| format!("{it:?}")),
            _ => received::<_, 1029>(Rtcm, &bytes, |it| format!("{it:?} {:?}", it.number())),
        };
        let expected: Vec<&str> = [expected].into_iter().filter(|it| *it != "none").collect();
        assert_eq!(messages, expected, "{line}");
        assert!(arrow == "->" || frames == [bytes], "{line}");
    }
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
}

/// Each format refuses to encode the messages that its documentation names, and only these.
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
        (254, |message: &[u8]| is_encoded(&ModbusRtu, message)),
        (509, |sentence: &[u8]| {
            let sentence: Vec<u8> = sentence.iter().map(|_| b'A').collect();
            is_encoded(&Nmea, &sentence)
        }),
    ] as [(usize, fn(&[u8]) -> bool); 6]
    {
        assert!(encodes(&payload[..most]), "{most}");
        assert!(!encodes(&payload[..=most]), "{most} and one more");
    }
    for wrong in ["a$b", "a!b", "a\nb", "a\r", "é"] {
        assert!(!is_encoded(&Nmea, wrong.as_bytes()), "{wrong:?}");
    }
    for (length, is_accepted) in [(0, false), (1, false), (2, true)] {
        assert_eq!(
            is_encoded(&ModbusRtu, &payload[..length]),
            is_accepted,
            "{length}"
        );
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

/// Only the last bytes 00, 04, 14, 24 and 34 are accepted, and only if the unused flags are zero.
#[test]
fn sbus_with_each_last_byte() {
    for (flags, last) in
        (0..=u8::MAX)
            .map(|byte| (0, byte))
            .chain([(0x0F, 0), (0x10, 0), (0x80, 0)])
    {
        let mut frame = frame(&Sbus, sbus::Message::default());
        [frame[23], frame[24]] = [flags, last];
        let mut received = 0;
        receive::<_, 25>(Sbus, &frame, |_| received += 1);
        let is_right = flags < 0x10 && [0x00, 0x04, 0x14, 0x24, 0x34].contains(&last);
        assert_eq!(received, u8::from(is_right), "{flags:02X} {last:02X}");
    }
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
