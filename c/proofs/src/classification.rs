//! Proves that C and Rust classify arbitrary bytes in the same way. The harnesses cover layouts of receivers with a
//! buffer, each up to the number of bytes in its entry of `for_formats!`. They compare the reason, the length of a
//! frame, and the number of bytes that the next decision needs. If silence ends the frames, they also compare the
//! classifications before a line event.

use framelock::{Classification, DiscardReason, Format};
use framelock_formats::AnyOf;
use framelock_formats::crsf::Crsf;
use framelock_formats::gnss::Gnss;
use framelock_formats::ibus::Ibus;
use framelock_formats::layout::{Checksum, KnownMessage, Layout, Length, LengthField, Patterns};
use framelock_formats::mavlink::{ARDUPILOTMEGA, Mavlink1, Mavlink2, layout_v1, layout_v2};
use framelock_formats::modbus::ModbusRtu;
use framelock_formats::nmea::Nmea;
use framelock_formats::rtcm::Rtcm;
use framelock_formats::sbus::Sbus;
use framelock_formats::ubx::Ubx;

/// The checksum rule that iBUS frames of every length share.
const IBUS_CHECKSUM: Option<Checksum> = Some(Checksum {
    xor_out: 0xFFFF,
    ..Checksum::at_the_end(2)
});

/// Defines the format of a layout that exists only as a description, without a Rust module.
macro_rules! format_of {
    ($(#[$about:meta])* $name:ident, $layout:expr) => {
        $(#[$about])*
        #[derive(Clone, Copy)]
        struct $name;

        impl Format for $name {
            framelock_formats::classify_by!($layout.checked());
            type Message<'a> = ();

            fn decode(&self, _: &[u8]) {}
        }
    };
}
format_of! {
    /// The layout of `ibus-any.toml`.
    IbusAny,
    Layout {
        sync: Patterns::one(&[0x20]),
        longest: 32,
        checksum: IBUS_CHECKSUM,
        ..Layout::NONE
    }
}
format_of! {
    /// The layout of `ibus-telemetry.toml`.
    IbusTelemetry,
    Layout {
        sync: Patterns::any_byte_of(&[4, 6, 8]),
        length: Length::Field(LengthField::byte(0)),
        longest: 8,
        checksum: IBUS_CHECKSUM,
        ..Layout::NONE
    }
}

use crate::windows::LINE_EVENTS;

/// Every first byte.
const ANY: Option<u8> = None;

unsafe extern "C" {
    safe fn c_set(place: u8, byte: u8);
    safe fn c_classify(count: u8, seen: u8) -> u8;
    safe fn c_classify_before(count: u8, event: u8) -> u8;
    safe fn c_number() -> u16;
    safe fn c_begins(byte: u8) -> u8;
    safe fn c_know(place: u8, number: u32, extra: u8);
}

/// Compares the classifications of up to `MOST` bytes, the first `seen` of which have been classified before. If
/// `first` is not `None`, the bytes begin with this byte. If frames have a delimiter, assumes that the first `seen`
/// bytes are incomplete. Without a delimiter, the classification does not depend on `seen`.
fn same<F: Format, const MOST: usize, const HAS_DELIMITER: bool, const IS_SILENT: bool>(
    format: &F,
    first: Option<u8>,
) {
    let mut bytes: [u8; MOST] = kani::any();
    // A constant saves the solver work.
    if let Some(first) = first {
        bytes[0] = first;
    }
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

/// Returns the results of `c_classify` and `c_number` that correspond to this classification.
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

/// Defines the harnesses of formats, in a module with the name of the C file. Each entry states the format, the first
/// byte if it is constant, the greatest number of bytes, the bound on the loops, whether frames have a delimiter, and
/// whether silence ends them.
macro_rules! for_formats {
    ($($file:ident { $($name:ident $format:expr, $first:expr, $most:literal $bound:literal $has_delimiter:literal $is_silent:literal;)* })*) => {
        $(
            mod $file {
                use super::*;

                $(
                    #[kani::proof]
                    #[kani::unwind($bound)]
                    fn $name() {
                        same::<_, $most, $has_delimiter, $is_silent>(&$format, $first);
                    }
                )*
            }
        )*
    };
}
for_formats! {
    crsf { classification_is_same Crsf, ANY, 8 10 false false; }
    ubx { classification_is_same Ubx::<4096>, ANY, 12 14 false false; }
    nmea { classification_is_same Nmea, ANY, 6 9 true false; }
    rtcm { classification_is_same Rtcm, ANY, 8 10 false false; }
    sbus { classification_is_same Sbus, ANY, 25 27 false false; }
    ibus { classification_is_same Ibus, ANY, 32 34 false false; }
    ibus_any { classification_is_same IbusAny, ANY, 32 34 false false; }
    ibus_telemetry { classification_is_same IbusTelemetry, ANY, 8 10 false false; }
    modbus_rtu { classification_is_same ModbusRtu, ANY, 8 10 false true; }
    gnss {
        ubx_is_same Ubx::<4096>, Some(0xB5), 10 12 false false;
        rtcm_is_same Rtcm, Some(0xD3), 8 10 false false;
    }
    mavlink1 { classification_is_same Mavlink1(any_messages(&mut [NONE; 4])), Some(0xFE), 9 12 false false; }
    mavlink2 { classification_is_same Mavlink2(any_messages(&mut [NONE; 4])), Some(0xFD), 12 14 false false; }
    mavlink {
        mavlink1_is_same Mavlink1(any_messages(&mut [NONE; 4])), Some(0xFE), 9 12 false false;
        mavlink2_is_same Mavlink2(any_messages(&mut [NONE; 4])), Some(0xFD), 12 14 false false;
    }
}

/// Checks the classification of the first byte, for the headers whose other harnesses begin with a constant byte.
mod first_byte {
    use super::{Format, c_begins, c_classify, c_number, c_set, in_c};

    fn is_same<F: Format>(format: &F) {
        let byte = kani::any();
        c_set(0, byte);
        let (outcome, number) = in_c(format.classify(&[byte]));
        assert!(c_classify(1, 0) == outcome);
        assert!(outcome < 8 || usize::from(c_number()) == number);
        assert!(format.starts(byte) == (c_begins(byte) != 0));
        kani::cover!(outcome == 9, "a byte that begins a frame");
    }

    macro_rules! for_formats {
        ($($file:ident $format:expr;)*) => {
            $(
                mod $file {
                    use super::super::*;

                    #[kani::proof]
                    #[kani::unwind(4)]
                    fn is_same() {
                        super::is_same(&$format);
                    }
                }
            )*
        };
    }
    for_formats! {
        gnss Gnss::<4096>;
        mavlink AnyOf(const { &[layout_v2(ARDUPILOTMEGA), layout_v1(ARDUPILOTMEGA)] });
        mavlink1 Mavlink1(ARDUPILOTMEGA);
        mavlink2 Mavlink2(ARDUPILOTMEGA);
    }
}

const NONE: KnownMessage = KnownMessage::new(0);

/// Returns an arbitrary table of up to four messages, and gives the C receiver the same table.
fn any_messages(known: &mut [KnownMessage; 4]) -> &[KnownMessage] {
    let count: usize = kani::any_where(|count| *count <= 4);
    for (place, message) in (0..).zip(known.iter_mut()) {
        let (number, extra): ([u8; 3], u8) = kani::any();
        let [low, middle, high] = number;
        *message = KnownMessage {
            extra: Some(extra),
            ..KnownMessage::new(u32::from_le_bytes([low, middle, high, 0]))
        };
        let in_c = if usize::from(place) < count {
            message.number
        } else {
            u32::MAX
        };
        c_know(place, in_c, extra);
    }
    let known = &known[..count];
    kani::assume(known.is_sorted_by(|one, other| one.number < other.number));
    known
}
