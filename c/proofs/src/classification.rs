//! Proves that C and Rust classify arbitrary bytes in the same way. The harnesses cover layouts of
//! receivers with a buffer, each up to a stated number of bytes. They compare the reason, the length
//! of a frame, and the number of bytes that the next decision needs. If silence ends the frames, they also compare the
//! classifications before a line event.

use framelock::{Classification, DiscardReason, Format};
use framelock_formats::crsf::Crsf;
use framelock_formats::ibus::Ibus;
use framelock_formats::layout::{Checksum, Layout, Length, LengthField, Patterns};
use framelock_formats::mavlink::{ARDUPILOTMEGA, Mavlink1};
use framelock_formats::modbus::ModbusRtu;
use framelock_formats::nmea::Nmea;
use framelock_formats::rtcm::Rtcm;
use framelock_formats::sbus::Sbus;
use framelock_formats::ubx::Ubx;

/// The layout of `ibus-any.toml`.
#[derive(Clone, Copy)]
struct IbusAny;

/// The layout of `ibus-telemetry.toml`.
#[derive(Clone, Copy)]
struct IbusTelemetry;

/// Returns the checksum rule that iBUS frames of every length share.
const fn ibus_checksum() -> Checksum<'static> {
    Checksum {
        xor_out: 0xFFFF,
        ..Checksum::at_the_end(2)
    }
}

impl Format for IbusAny {
    framelock_formats::classify_by!(
        Layout {
            sync: Patterns::one(&[0x20]),
            longest: 32,
            checksum: Some(ibus_checksum()),
            ..Layout::NONE
        }
        .checked()
    );
    type Message<'a> = ();

    fn decode(&self, _: &[u8]) {}
}

impl Format for IbusTelemetry {
    framelock_formats::classify_by!(
        Layout {
            sync: Patterns::any_byte_of(&[4, 6, 8]),
            length: Length::Field(LengthField::byte(0)),
            longest: 8,
            checksum: Some(ibus_checksum()),
            ..Layout::NONE
        }
        .checked()
    );
    type Message<'a> = ();

    fn decode(&self, _: &[u8]) {}
}

use crate::windows::LINE_EVENTS;

unsafe extern "C" {
    safe fn c_set(place: u8, byte: u8);
    safe fn c_classify(count: u8, seen: u8) -> u8;
    safe fn c_classify_before(count: u8, event: u8) -> u8;
    safe fn c_number() -> u16;
    safe fn c_begins(byte: u8) -> u8;
}

/// Checks the classification of up to `MOST` bytes. If frames have a delimiter, assumes that the
/// first `seen` bytes are incomplete. Without a delimiter, the classification does not depend on
/// `seen`.
fn same<F: Format, const MOST: usize, const HAS_DELIMITER: bool, const IS_SILENT: bool>(
    format: &F,
) {
    let bytes: [u8; MOST] = kani::any();
    let count: u8 = kani::any_where(|&count| count > 0 && usize::from(count) <= MOST);
    let seen: u8 = kani::any_where(|&seen| seen < count);
    let is_incomplete =
        |bytes: &[u8]| matches!(format.classify(bytes), Classification::Incomplete { .. });
    kani::assume(seen == 0 || !HAS_DELIMITER || is_incomplete(&bytes[..usize::from(seen)]));
    let mut place = 0;
    while place < MOST {
        c_set(place.to_le_bytes()[0], bytes[place]);
        place += 1;
    }
    let bytes_before = &bytes[..usize::from(count)];
    let (outcome, number) = in_c(format.classify_after(bytes_before, usize::from(seen)));
    assert!(c_classify(count, seen) == outcome);
    assert!(outcome < 8 || usize::from(c_number()) == number);
    assert!(format.starts(bytes[0]) == (c_begins(bytes[0]) != 0));
    if IS_SILENT {
        let event: u8 = kani::any_where(|event| *event < 5);
        let before = format.classify_before(bytes_before, LINE_EVENTS[usize::from(event)]);
        let (before, number) = in_c(before);
        assert!(c_classify_before(count, event) == before);
        assert!(before < 8 || usize::from(c_number()) == number);
        kani::cover!(before == 8, "a frame");
        kani::cover!(before == 5, "a wrong checksum");
    } else {
        kani::cover!(outcome == 8, "a frame");
    }
    kani::cover!(outcome == 9 && count > 1, "an incomplete frame");
}

/// Returns the number that the C files use for a classification, and the number that belongs to the classification.
fn in_c(classification: Classification) -> (u8, usize) {
    let why = match classification {
        Classification::Frame(length) => return (8, length),
        Classification::Incomplete { at_least } => return (9, at_least),
        Classification::Rejected(why) => why,
    };
    let reason = match why {
        DiscardReason::NoSync => 0,
        DiscardReason::BrokenSync => 1,
        DiscardReason::BadHeader => 2,
        DiscardReason::TooLong => 3,
        DiscardReason::UnknownMessage => 4,
        DiscardReason::ChecksumMismatch => 5,
        DiscardReason::WrongTerminator => 6,
        _ => 7,
    };
    (reason, 0)
}

/// Defines the harness of a format, in a module with the name of its C file.
macro_rules! for_formats {
    ($($name:ident $format:expr, $most:literal $bound:literal $has_delimiter:literal;)*) => {
        $(
            mod $name {
                use super::*;

                #[kani::proof]
                #[kani::unwind($bound)]
                fn classification_is_same() {
                    same::<_, $most, $has_delimiter, false>(&$format);
                }
            }
        )*
    };
}
for_formats! {
    crsf Crsf, 8 10 false;
    ubx Ubx::<4096>, 12 14 false;
    nmea Nmea, 6 9 true;
    rtcm Rtcm, 8 10 false;
    sbus Sbus, 25 27 false;
    ibus Ibus, 32 34 false;
    mavlink1 Mavlink1(ARDUPILOTMEGA), 9 12 false;
    ibus_any IbusAny, 32 34 false;
    ibus_telemetry IbusTelemetry, 8 10 false;
}

mod modbus_rtu {
    use super::{ModbusRtu, same};

    #[kani::proof]
    #[kani::unwind(10)]
    fn classification_is_same() {
        same::<_, 8, false, true>(&ModbusRtu);
    }
}
