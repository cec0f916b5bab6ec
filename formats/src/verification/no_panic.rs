//! Nothing panics.

use framelock::Format;

use super::any_layout::{Parts, any_checksum};
use crate::layout::{Algorithm, Checksum, Crc, Message, Table};
use crate::{Crsf, Ibus, Mavlink1, Mavlink2, Nmea, Rtcm, Sbus, SixAxes, Ubx};

/// Up to `N` bytes.
fn any_bytes<const N: usize>(bytes: &[u8; N]) -> &[u8] {
    &bytes[..kani::any_where(|&count| count <= N)]
}

/// Any bytes are written over by any layout, whatever its checksum, and judged by it.
#[kani::proof]
#[kani::unwind(5)]
fn in_sealing() {
    let mut bytes: [u8; 3] = kani::any();
    let parts = Parts::<1, 1, 1>::any();
    let layout = parts.layout(kani::any::<bool>().then(|| Checksum {
        algorithm: Algorithm::Xor,
        ..any_checksum()
    }));
    let count = kani::any_where(|&count| count <= 3);
    let is_frame = layout.seal(&mut bytes[..count]);
    kani::cover!(is_frame && count == 3);
}

#[kani::proof]
#[kani::unwind(9)]
fn in_checking() {
    let mut bytes: [u8; 3] = kani::any();
    let checksum = any_checksum();
    kani::assume(!matches!(checksum.algorithm, Algorithm::Crc(_)));
    let extra = kani::any::<bool>().then(kani::any);
    let is_written = checksum.write(&mut bytes, extra);
    let is_right = checksum.is_right(&bytes, extra);
    kani::cover!(is_written && is_right);
}

/// Bit by bit; and four bytes at once, with MAVLink's.
#[kani::proof]
#[kani::unwind(9)]
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
    }
}

fn any_table<'a>(bytes: &'a [u8; 256], halves: &'a [u16; 256], words: &'a [u32; 256]) -> Table<'a> {
    match kani::any::<u8>() {
        0 => Table::Bytes(bytes),
        1 => Table::Halves(halves),
        _ => Table::Words(words),
    }
}

#[kani::proof]
#[kani::unwind(258)]
fn in_tables_of_a_crc() {
    let crc = Crc {
        width: kani::any(),
        reflected_in: kani::any(),
        reflected_out: kani::any(),
        ..Crc::ZERO
    };
    let tables = ([0xA5; 256], [0xA55A; 256], [0xA55A_A55A; 256]);
    let crc = Crc {
        table: any_table(&tables.0, &tables.1, &tables.2),
        ..crc
    };
    let _ = crc.result(crc.update(crc.start(), &kani::any::<[u8; 2]>()));
}

/// Bytes that are no frame among them.
fn in_decoding<F: Format, const N: usize>(format: &F) {
    let bytes: [u8; N] = kani::any();
    let _ = format.decode(any_bytes(&bytes));
}

const MESSAGES: &[Message] = &[];

#[kani::proof]
#[kani::unwind(35)]
fn in_decoding_fixed_lengths() {
    in_decoding::<_, 26>(&Sbus);
    in_decoding::<_, 33>(&Ibus);
    let _ = <SixAxes as framelock::FixedFormat>::decode(kani::any());
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
