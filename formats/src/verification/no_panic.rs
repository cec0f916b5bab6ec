//! Proves that no function of the formats panics.

use framelock::any_format::part;
use framelock::{FixedFormat, Format};

use super::any_layout::{Parts, any_checksum, any_number, patterns};
use crate::crsf::Crsf;
use crate::ibus::Ibus;
use crate::layout::{
    Algorithm, Checksum, Crc, KnownMessage, Layout, Length, LengthField, Patterns, Table,
};
use crate::mavlink::{Mavlink1, Mavlink2};
use crate::motion::{SixAxes, SixAxesBigEndian};
use crate::nmea::Nmea;
use crate::rtcm::Rtcm;
use crate::sbus::Sbus;
use crate::ubx::Ubx;

/// Returns an arbitrary prefix of the bytes, of up to `N` bytes.
fn any_bytes<const N: usize>(bytes: &[u8; N]) -> &[u8] {
    part(bytes, 0, kani::any_where(|&count| count <= N))
}

/// Calls a function once for each algorithm except a CRC, with an arbitrary checksum of this algorithm. A single call
/// with an arbitrary one of these five algorithms would be too much for the prover.
fn for_each_sum(mut of: impl FnMut(Checksum<'static>)) {
    let mut of = |algorithm| {
        of(Checksum {
            algorithm,
            ..any_checksum()
        });
    };
    of(Algorithm::Sum);
    of(Algorithm::InvertedSum);
    of(Algorithm::NegatedSum);
    of(Algorithm::Xor);
    of(Algorithm::Fletcher);
}

fn any_extra() -> Option<u8> {
    kani::any::<bool>().then(kani::any)
}

#[kani::proof]
#[kani::unwind(5)]
fn in_checking() {
    let bytes: [u8; 3] = kani::any();
    for_each_sum(|sum| {
        kani::cover!(sum.is_right(&bytes, kani::any(), any_extra()), "right");
    });
}

/// Writes a checksum of one algorithm, because checksums of all algorithms are written in the same way. [`in_checking`]
/// and [`in_a_crc`] cover the computation of the other algorithms.
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

/// Computes a CRC bit by bit, MAVLink's CRC in steps of four bytes, and a CRC with tables in steps of sixteen, four and
/// one bytes.
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
        let table = Table::Sixteens(&[[0; 256]; 16]);
        let _ = Crc { table, ..crc }.update(kani::any(), &kani::any::<[u8; 21]>());
        kani::cover!(crc.reflected_in, "either");
    }
}

/// Seals `N` bytes as a frame of an arbitrary layout that has neither a length field nor a checksum.
/// [`in_writing_a_length`] and [`in_writing_a_checksum`] cover these two parts. A length field may overwrite the sync, so
/// the sync may be missing here.
/// [`super::laws`] covers the classification of the bytes, which `seal` performs too.
fn in_sealing<const N: usize>() {
    let (mut bytes, ends, other) = kani::any::<([u8; N], [[u8; 1]; 2], [u8; 2])>();
    let parts = Parts::<1, 1>::any();
    let layout = Layout {
        sync: if kani::any() {
            patterns(&ends)
        } else {
            Patterns::NONE
        },
        length: Length::Fixed,
        terminator: patterns(&ends),
        other_terminators: &[&other],
        ..parts.layout()
    };
    let before = bytes;
    layout.write(&mut bytes);
    kani::cover!(bytes.last() != before.last(), "written to the last byte");
}

#[kani::proof]
#[kani::unwind(5)]
fn in_sealing_one_byte() {
    in_sealing::<1>();
}

#[kani::proof]
#[kani::unwind(5)]
fn in_sealing_two_bytes() {
    in_sealing::<2>();
}

#[kani::proof]
#[kani::unwind(5)]
fn in_sealing_three_bytes() {
    in_sealing::<3>();
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
