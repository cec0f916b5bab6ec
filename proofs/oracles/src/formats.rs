//! Target `formats`: frames of a shipped format on a line with faults and pauses. The stream is cut
//! into slices anywhere.

use std::fmt::Debug;

use arbitrary::{Arbitrary, Unstructured};
use framelock::motion::{Bin, BinCrc8};
use framelock::{Counters, FixedFormat, Format, Found, LineEvent, Receiver};
use framelock_formats::layout::{CheckedLayout, KnownMessage, Layout};
use framelock_formats::motion::{BIN, BIN_CRC8, SIX_AXES, SixAxes};
use framelock_formats::{AnyOf, crsf, gnss, ibus, mavlink, modbus, nmea, rtcm, sbus, ubx};
use framelock_proofs::reference::framed;

use crate::layout::{Interpreted, layouts};
use crate::outcome::Occurred;
use crate::stream::{Stream, StreamStep};
use crate::{broken, frame, rest};

/// A shipped format.
#[derive(Debug)]
pub struct ShippedFormat {
    /// The format's name.
    pub name: &'static str,
    /// The layouts of the format's frames.
    pub layouts: &'static [CheckedLayout<'static>],
    /// Checks that the format's receivers report the same as the reference with the [interpreter](crate::interpret).
    /// Counts the outcomes. Returns the receivers' counters, and panics if the stream shows a bug.
    pub check: fn(&Self, &Stream, &mut Occurred) -> Counters,
}

/// Messages of `MAVLink`: HEARTBEAT, ATTITUDE, and two whose payloads may have 255 bytes, the most possible.
const DIALECT: &[KnownMessage] = &[
    KnownMessage::with_extra(0, 50, 9),
    KnownMessage::with_extra(0x03, 7, 255),
    KnownMessage::with_extra(30, 39, 28),
    KnownMessage::with_extra(0x01_02_03, 7, 255),
];

const fn ubx(longest: usize) -> CheckedLayout<'static> {
    Layout {
        longest,
        ..ubx::LAYOUT.layout()
    }
    .checked()
}

macro_rules! shipped {
    ($($name:literal, [$($layout:expr),*], $check:expr;)*) => {
        &[$(ShippedFormat {
            name: $name,
            layouts: &[$($layout),*],
            check: |shipped, stream, occurred| $check(shipped.layouts, stream, occurred),
        }),*]
    };
}

fn by<F: Format + Copy + 'static>(
    format: F,
) -> impl Fn(&[CheckedLayout], &Stream, &mut Occurred) -> Counters {
    move |all, stream, occurred| layouts(&format, all, stream, occurred)
}

/// The shipped formats.
pub const FORMATS: &[ShippedFormat] = shipped! {
    "SBUS", [sbus::LAYOUT], by(sbus::Sbus);
    "iBUS", [ibus::LAYOUT], by(ibus::Ibus);
    "CRSF", [crsf::LAYOUT], by(crsf::Crsf);
    "UBX", [ubx(64)], by(ubx::Ubx::<64>);
    "MAVLink 2", [mavlink::layout_v2(DIALECT)], by(mavlink::Mavlink2(DIALECT));
    "six axes", [SIX_AXES], fixed::<SixAxes>;
    "MAVLink 1", [mavlink::layout_v1(DIALECT)], by(mavlink::Mavlink1(DIALECT));
    "NMEA", [nmea::LAYOUT], by(nmea::Nmea);
    "RTCM", [rtcm::LAYOUT], by(rtcm::Rtcm);
    "BIN", [BIN], fixed::<Bin>;
    "BIN-CRC8", [BIN_CRC8], fixed::<BinCrc8>;
    "GNSS", [ubx(1100), nmea::LAYOUT, rtcm::LAYOUT], by(gnss::Gnss::<1100>);
    "Modbus RTU", [modbus::LAYOUT], by(modbus::ModbusRtu);
};

/// Checks that the small [`Receiver`] finds the same frames as the reference, at the same positions. Then [`layouts`]
/// checks receivers with a buffer.
fn fixed<F>(
    all: &'static [CheckedLayout<'static>],
    stream: &Stream,
    occurred: &mut Occurred,
) -> Counters
where
    F: FixedFormat<Message: PartialEq + Debug, Frame: for<'a> TryFrom<&'a [u8], Error: Debug>>,
{
    for bytes in stream.stretches() {
        let mut expected = Vec::new();
        framed(&Interpreted(all), &bytes, Some(LineEvent::Idle), |found| {
            if let Found::Frame {
                length, message, ..
            } = found
            {
                let end = message + length;
                let frame = F::Frame::try_from(&bytes[message..end]).expect("a whole frame");
                expected.push((end, F::decode(frame)));
            }
        });
        let (mut found, mut end) = (Vec::new(), 0);
        Receiver::<F>::new().feed(&bytes, |one| {
            end += one.bytes();
            found.extend(one.message().map(|message| (end, message)));
        });
        assert_eq!(found, expected, "{bytes:02X?}");
    }
    layouts(&AnyOf(all), all, stream, occurred)
}

/// A format, and the stream that its receivers get.
#[derive(Debug)]
pub struct FormatLine {
    /// The format.
    pub format: &'static ShippedFormat,
    /// The stream.
    pub stream: Stream,
}

impl<'a> Arbitrary<'a> for FormatLine {
    /// The first byte determines the format.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let format = &FORMATS[usize::from(u8::arbitrary(u)?) % FORMATS.len()];
        let steps: Vec<Step> = rest(u);
        let steps = steps.iter().flat_map(|step| step.of(format.layouts));
        Ok(Self {
            format,
            stream: Stream(steps.collect()),
        })
    }
}

/// One step of a stream.
enum Step {
    /// These bytes, in one slice.
    Slice(Vec<u8>),
    /// A frame with this content, in slices of this size. If there is a fault, its two bytes choose it.
    Frame(Vec<u8>, Option<[u8; 2]>, u8),
    /// The line event [`LineEvent::Idle`].
    Silence,
}

impl<'a> Arbitrary<'a> for Step {
    /// The first byte modulo 4 determines the step:
    ///
    /// * 0: a slice. The next byte is its length.
    /// * 1: a frame. The next byte is the number of bytes from which the frame is made. The first byte divided by 4 is
    ///   the size of the slices.
    /// * 2: a frame as in case 1, followed by the position and the kind of a fault.
    /// * 3: silence.
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let first = u8::arbitrary(u)?;
        if first % 4 == 3 {
            return Ok(Self::Silence);
        }
        let length = usize::from(u8::arbitrary(u)?).min(u.len());
        let bytes = u.bytes(length)?.to_vec();
        Ok(match first % 4 {
            0 => Self::Slice(bytes),
            1 => Self::Frame(bytes, None, first / 4),
            _ => Self::Frame(bytes, Some(u.arbitrary()?), first / 4),
        })
    }
}

impl Step {
    fn of(&self, layouts: &[CheckedLayout]) -> Vec<StreamStep> {
        match self {
            Self::Slice(bytes) => vec![StreamStep::Slice(bytes.clone())],
            Self::Frame(content, fault, size) => {
                // The content also chooses the layout and the other parts of the frame.
                let layout = &layouts[content.len() % layouts.len()];
                let frame = frame(layout, content, chosen_by(content));
                let mut bytes = frame.unwrap_or_else(|almost| almost);
                if let &Some([place, sort]) = fault {
                    bytes = broken(&bytes, chosen_by(&[place, sort, sort / 8]));
                }
                let slices = bytes.chunks(usize::from(*size).max(1));
                slices
                    .map(|slice| StreamStep::Slice(slice.to_vec()))
                    .collect()
            }
            Self::Silence => vec![StreamStep::Event(LineEvent::Idle)],
        }
    }
}

/// Returns a function that uses one byte for each choice. After the last byte, it chooses 0.
fn chosen_by(bytes: &[u8]) -> impl FnMut(usize) -> usize {
    let mut bytes = bytes.iter();
    move |count| bytes.next().map_or(0, |byte| usize::from(*byte) % count)
}

/// Runs the [check](ShippedFormat::check) of the line's format, and counts the frames of each format.
///
/// # Panics
/// Panics if the line shows a bug.
pub fn formats(line: &FormatLine, occurred: &mut Occurred) {
    let format = line.format;
    let counters = (format.check)(format, &line.stream, occurred);
    for other in FORMATS {
        let is_same = other.name == format.name;
        occurred.count(other.name, if is_same { counters.frames } else { 0 });
    }
}
