//! Proves that functions of the formats do not panic: checksums, sealing, decoding and encoding.

use framelock::any_format::{any_up_to, part};
use framelock::{Classification, Encode, EncodeInto, FixedFormat, Format};

use super::any_layout::{Parts, any_checksum, any_number, patterns};
use crate::any_of::AnyOf;
use crate::crsf::{self, Crsf};
use crate::gnss::{self, Gnss};
use crate::ibus::Ibus;
use crate::layout::{
    Algorithm, CheckedLayout, Checksum, Crc, KnownMessage, Layout, Length, LengthField, Patterns,
    Table, index,
};
use crate::mavlink::{self, Mavlink1, Mavlink2};
use crate::motion::{BIN, BIN_CRC8, SixAxes, SixAxesBigEndian};
use crate::nmea::{self, Nmea};
use crate::rtcm::{self, Rtcm};
use crate::sbus::{self, Sbus};
use crate::ubx::{self, Ubx};

/// Returns an arbitrary prefix of the bytes, of up to `N` bytes.
fn any_bytes<const N: usize>(bytes: &[u8; N]) -> &[u8] {
    part(bytes, 0, kani::any_where(|&count| count <= N))
}

fn any_extra() -> Option<u8> {
    kani::any::<bool>().then(kani::any)
}

/// Checks three bytes with an arbitrary checksum of one algorithm, because checksums of all algorithms are checked in the
/// same way. [`in_computing_sums`] and [`in_a_crc`] cover the computation of the other algorithms.
#[kani::proof]
#[kani::unwind(5)]
fn in_checking_a_checksum() {
    let bytes: [u8; 3] = kani::any();
    let sum = Checksum {
        algorithm: Algorithm::Sum,
        ..any_checksum()
    };
    let is_right = sum.is_right(&bytes, kani::any(), any_extra());
    kani::cover!(is_right, "right");
}

/// Writes a checksum of one algorithm, for the same reason as [`in_checking_a_checksum`].
#[kani::proof]
#[kani::unwind(9)]
fn in_writing_a_checksum() {
    let mut bytes: [u8; 3] = kani::any();
    let sum = Checksum {
        algorithm: Algorithm::Sum,
        ..any_checksum()
    };
    kani::cover!(sum.write(&mut bytes, kani::any(), any_extra()), "written");
}

/// Computes an arbitrary checksum of up to three bytes with each algorithm except CRCs.
#[kani::proof]
#[kani::unwind(5)]
fn in_computing_sums() {
    let bytes: [u8; 3] = kani::any();
    let compute = |algorithm| {
        let sum = Checksum {
            algorithm,
            ..any_checksum()
        };
        sum.of(any_bytes(&bytes), any_extra())
    };
    let _ = (compute(Algorithm::Sum), compute(Algorithm::CarrySum));
    let _ = (compute(Algorithm::SumWords), compute(Algorithm::Xor));
    let _ = compute(Algorithm::XorWords);
    kani::cover!(compute(Algorithm::Fletcher) == 0xFFFF, "any sum");
}

/// Computes a CRC bit by bit, MAVLink's CRC in steps of four bytes, and a CRC with a table.
#[kani::proof]
#[kani::unwind(22)]
fn in_a_crc() {
    if let Algorithm::Crc(crc) = any_checksum().algorithm {
        let _ = crc.result(crc.update(crc.start(), &kani::any::<[u8; 1]>()));
        let mavlink = Crc {
            width: 16,
            polynomial: 0x1021,
            reflected_in: true,
            ..crc
        };
        let _ = mavlink.result(mavlink.update(kani::any(), &kani::any::<[u8; 6]>()));
        let table = Table::Words(&[0; 256]);
        let _ = Crc { table, ..crc }.update(kani::any(), &kani::any::<[u8; 2]>());
        kani::cover!(crc.reflected_in, "either");
    }
}

/// Writes the parts of an arbitrary layout that has neither a length field nor a checksum. [`in_writing_a_length`] and
/// [`in_writing_a_checksum`] cover these two parts. A length field may overwrite the sync, so the sync may be missing
/// here. The layout has no other terminators, either. [`in_asking_a_layout`] covers the search for them. It may find any
/// length from which offsets are counted, so this function also passes an arbitrary length to `write_counted`.
/// [`super::laws`] covers the classification of the bytes, which `seal` performs too. So for arbitrary layouts, only
/// [`in_sealing_and_classifying`] calls `seal` as a whole.
fn in_sealing<const N: usize>() {
    let (mut bytes, ends) = kani::any::<([u8; N], [[u8; 1]; 2])>();
    let parts = Parts::<1, 0>::any();
    let layout = Layout {
        sync: if kani::any() {
            patterns(&ends)
        } else {
            Patterns::NONE
        },
        length: Length::Fixed,
        messages: None,
        terminator: patterns(&ends),
        ..parts.layout()
    };
    let before = bytes;
    layout.write(&mut bytes);
    let is_written = bytes.last() != before.last();
    layout.write_counted(&mut bytes, kani::any());
    kani::cover!(is_written, "written to the last byte");
}

#[kani::proof]
#[kani::unwind(4)]
fn in_sealing_one_byte() {
    in_sealing::<1>();
}

#[kani::proof]
#[kani::unwind(4)]
fn in_sealing_three_bytes() {
    in_sealing::<3>();
}

/// Seals up to three bytes as a frame of an arbitrary layout that has a sync and a terminator, and may have a trailer.
#[kani::proof]
#[kani::unwind(5)]
fn in_sealing_and_classifying() {
    let (mut bytes, ends) = kani::any::<([u8; 3], [[u8; 1]; 2])>();
    let parts = Parts::<0, 0>::any();
    let layout = Layout {
        sync: patterns(&ends),
        length: if kani::any() {
            Length::Fixed
        } else {
            Length::Silence
        },
        messages: None,
        terminator: patterns(&ends),
        ..parts.layout()
    };
    let count = any_up_to(3);
    let is_frame = CheckedLayout(layout).seal(bytes.get_mut(..count).unwrap());
    kani::cover!(is_frame && count == 3, "a frame");
}

/// Writes the length of a frame, and none of its other parts. The frame may be empty.
#[kani::proof]
#[kani::unwind(5)]
fn in_writing_a_length() {
    let mut bytes: [u8; 3] = kani::any();
    let parts = Parts::<0, 0>::any();
    let layout = Layout {
        length: Length::Field(LengthField {
            number: any_number(),
            mask: kani::any(),
            factor: kani::any(),
            plus: kani::any(),
        }),
        trailer: None,
        ..parts.layout()
    };
    let last = bytes[2];
    let count = kani::any_where(|&count| count <= 3);
    layout.write(bytes.get_mut(..count).unwrap());
    kani::cover!(bytes[2] != last, "written to the last byte");
}

/// Decodes arbitrary bytes, which need not be a frame.
fn in_decoding<F: Format, const N: usize>(format: &F) {
    let bytes: [u8; N] = kani::any();
    let bytes = any_bytes(&bytes);
    let _ = format.decode(bytes);
    kani::cover!(bytes.len() == N, "the longest bytes");
}

const MESSAGES: &[KnownMessage] = &[];

#[kani::proof]
#[kani::unwind(35)]
fn in_decoding_sbus_ibus_and_six_axes() {
    in_decoding::<_, 26>(&Sbus);
    let _ = <SixAxes as FixedFormat>::decode(kani::any());
    let _ = <SixAxesBigEndian as FixedFormat>::decode(kani::any());
    in_decoding::<_, 33>(&Ibus);
}

#[kani::proof]
#[kani::unwind(35)]
fn in_decoding_any_lengths() {
    in_decoding::<_, 30>(&Crsf);
    in_decoding::<_, 30>(&Ubx::<30>);
    in_decoding::<_, 30>(&Nmea);
    in_decoding::<_, 30>(&Rtcm);
    in_decoding::<_, 30>(&Mavlink1(MESSAGES));
    in_decoding::<_, 30>(&Mavlink2(MESSAGES));
}

#[kani::proof]
#[kani::unwind(10)]
fn in_decoding_either_layout() {
    in_decoding::<_, 8>(&AnyOf(&[BIN, BIN_CRC8]));
}

/// Decodes `N` bytes, of which the first is given. Returns the length of the sentence, or 0 if the bytes are no sentence.
fn sentence_in_gnss<const N: usize>(first: u8) -> usize {
    let mut bytes: [u8; N] = kani::any();
    bytes[0] = first;
    match Gnss::<30>.decode(&bytes) {
        gnss::Message::Nmea(text) => text.len(),
        _ => 0,
    }
}

/// The bytes begin with the first byte of a sync, or with 0. The 0 stands for all other bytes, because only the
/// comparison with the syncs examines the first byte. For each protocol, one call has too few bytes for a frame, and
/// one call has enough.
#[kani::proof]
#[kani::unwind(32)]
fn in_decoding_gnss() {
    let _ = Gnss::<30>.decode(&[]);
    let _ = (sentence_in_gnss::<3>(b'$'), sentence_in_gnss::<30>(b'!'));
    let _ = (sentence_in_gnss::<7>(0xB5), sentence_in_gnss::<30>(0xB5));
    let _ = (sentence_in_gnss::<5>(0xD3), sentence_in_gnss::<30>(0xD3));
    let _ = sentence_in_gnss::<30>(0);
    kani::cover!(sentence_in_gnss::<30>(b'$') == 24, "a sentence");
}

/// Calls functions of an arbitrary layout that no harness above calls directly.
#[kani::proof]
#[kani::unwind(5)]
fn in_asking_a_layout() {
    let (bytes, ends, other) = kani::any::<([u8; 3], [[u8; 1]; 2], [u8; 2])>();
    let parts = Parts::<1, 1>::any();
    let layout = Layout {
        terminator: patterns(&ends),
        other_terminators: [Patterns::NONE, Patterns::one(&other)],
        ..parts.layout()
    };
    let bytes = any_bytes(&bytes);
    let _ = (layout.header(), layout.longest_without_trailer());
    let _ = (
        index(kani::any(), kani::any()),
        CheckedLayout(layout).starts(kani::any()),
    );
    let _ = layout.trailer.map(|trailer| trailer.bytes_after(bytes));
    let _ = any_checksum().encoded_bytes();
    let length = layout.counted_length(bytes);
    kani::cover!(length + 1 == bytes.len(), "another terminator");
}

/// Calls the functions of messages that compute a value from the payload.
#[kani::proof]
#[kani::unwind(32)]
fn in_fields_of_messages() {
    let bytes: [u8; 30] = kani::any();
    let payload = any_bytes(&bytes);
    let message = crsf::Message {
        address: kani::any(),
        kind: kani::any(),
        payload,
    };
    kani::cover!(message.channels().is_some(), "channels");
    kani::cover!(rtcm::Message { payload }.number().is_some(), "a number");
}

/// Encodes a message whose frame has `length` bytes into a buffer of this length, and into a buffer that is one byte too
/// short. The bytes in the buffer before the call do not matter, because `write` overwrites each byte of the frame before
/// it reads the byte. All lengths in these harnesses are constants, because a prover needs much more time for arbitrary
/// lengths. Returns true if the message has a frame.
fn in_encoding<'m, F>(format: &F, message: F::Message<'m>, length: usize) -> bool
where
    F: EncodeInto<Message<'m>: Copy>,
{
    let mut into = [0; 32];
    let short = &mut into[..length - 1];
    assert!(format.encode_into(message, short).is_err());
    format
        .encode_into(message, &mut into[..length])
        .is_ok_and(|frame| frame.len() == length)
}

#[kani::proof]
#[kani::unwind(27)]
fn in_encoding_sbus() {
    let message = sbus::Message {
        channels: kani::any(),
        digital: kani::any(),
        frame_lost: kani::any(),
        failsafe: kani::any(),
    };
    kani::cover!(in_encoding(&Sbus, message, 25), "a frame");
}

#[kani::proof]
#[kani::unwind(34)]
fn in_encoding_ibus() {
    kani::cover!(in_encoding(&Ibus, kani::any(), 32), "a frame");
}

#[kani::proof]
#[kani::unwind(18)]
fn in_encoding_six_axes() {
    let axes = kani::any();
    let frame = SixAxes::encode(axes);
    kani::cover!(frame != SixAxesBigEndian::encode(axes), "another order");
}

/// Encodes payloads of 0, 1 and 26 bytes. The first byte of the frame is an accepted address or another one.
/// Two addresses are enough, because encoding only compares the address with the syncs.
#[kani::proof]
#[kani::unwind(32)]
fn in_encoding_crsf() {
    let (payload, kind) = kani::any::<([u8; 26], u8)>();
    let is_encoded = |address, payload: &[u8]| {
        let message = crsf::Message {
            address,
            kind,
            payload,
        };
        in_encoding(&Crsf, message, payload.len() + 4)
    };
    is_encoded(crsf::address::RECEIVER, &[]);
    is_encoded(crsf::address::GPS, &[1]);
    let is_encoded = is_encoded(crsf::address::RECEIVER, &payload);
    kani::cover!(is_encoded, "the longest frame");
}

/// Encodes an empty payload, the longest payload, and a payload that is one byte too long.
#[kani::proof]
#[kani::unwind(32)]
fn in_encoding_ubx() {
    let (payload, class, id) = kani::any::<([u8; 23], u8, u8)>();
    let is_encoded = |length| {
        let payload = &payload[..length];
        let message = ubx::Message { class, id, payload };
        in_encoding(&Ubx::<30>, message, length + 8)
    };
    let _ = (is_encoded(0), is_encoded(23));
    kani::cover!(is_encoded(22), "the longest frame");
}

/// Encodes a sentence of one arbitrary byte into a buffer that is too short, and runs the steps of sealing one by one:
/// writes the parts of the frame, and classifies a frame of constants. With an arbitrary byte, the search for the end
/// of the frame would be too much for the prover, because the layout has so many parts.
#[kani::proof]
#[kani::unwind(8)]
fn in_encoding_nmea() {
    let byte = kani::any();
    assert!(Nmea.encode_into(&[byte], &mut [0; 6]).is_err());
    let mut frame = [b'$', byte, b'*', b'h', b'h', b'\r', b'\n'];
    let layout = nmea::LAYOUT.0;
    layout.write(&mut frame);
    let classification = layout.classify_at(b"$A*41\r\n", 0, true);
    assert!(classification == Classification::Frame(7));
    kani::cover!(frame[3] == b'F', "any digit");
}

#[kani::proof]
#[kani::unwind(12)]
fn in_encoding_rtcm() {
    let bytes: [u8; 3] = kani::any();
    let is_encoded = |length| {
        let payload = &bytes[..length];
        in_encoding(&Rtcm, rtcm::Message { payload }, length + 6)
    };
    let _ = (is_encoded(0), is_encoded(1), is_encoded(2));
    kani::cover!(is_encoded(3), "the longest frame");
}

const ONE_MESSAGE: &[KnownMessage] = &[KnownMessage::with_extra(1, 7, 255)];

fn any_mavlink(id: u32, payload: &[u8]) -> mavlink::Message<'_> {
    mavlink::Message {
        sequence: kani::any(),
        system: kani::any(),
        component: kani::any(),
        id,
        payload,
        signature: None,
    }
}

/// Encodes payloads of up to two bytes, an unknown message, and a message whose number is too large for MAVLink 1.
#[kani::proof]
#[kani::unwind(11)]
fn in_encoding_mavlink1() {
    let bytes: [u8; 2] = kani::any();
    let is_encoded = |id, length: usize| {
        let message = any_mavlink(id, &bytes[..length]);
        in_encoding(&Mavlink1(ONE_MESSAGE), message, length + 8)
    };
    let _ = (is_encoded(2, 0), is_encoded(256, 0));
    let _ = (is_encoded(1, 0), is_encoded(1, 1));
    kani::cover!(is_encoded(1, 2), "the longest frame");
}

/// Encodes an empty payload, and payloads of four bytes with and without trailing zeros. Also encodes an unknown message,
/// and a message whose number is too large for MAVLink 2.
#[kani::proof]
#[kani::unwind(11)]
fn in_encoding_mavlink2() {
    let is_encoded = |id, payload: &[u8], kept: usize| {
        let message = any_mavlink(id, payload);
        in_encoding(&Mavlink2(ONE_MESSAGE), message, kept + 12)
    };
    let _ = (is_encoded(2, &[], 0), is_encoded(1 << 24, &[], 0));
    let [a, b, c]: [u8; 3] = kani::any();
    let _ = (is_encoded(1, &[], 0), is_encoded(1, &[a, 0, 0, 0], 1));
    kani::cover!(is_encoded(1, &[a, b, c, 1], 4), "the longest frame");
}
