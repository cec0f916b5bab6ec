//! Target `formats`: a line with frames of one of the shipped formats on it, cut into slices anywhere, with
//! faults and line events.

use arbitrary::{Arbitrary, Unstructured};
use framelock::{Classification, FixedFormat, Format, Found, LineEvent, Receiver};
use framelock_formats::{
    classify_by,
    crsf::Crsf,
    ibus::Ibus,
    mavlink::{Mavlink1, Mavlink2},
    motion::{SIX_AXES, SixAxes},
    nmea::Nmea,
    rtcm::Rtcm,
    sbus::Sbus,
    ubx::Ubx,
};
use framelock_proofs::reference::framed;

use crate::framing::{Frames, as_the_reference};
use crate::protocol::{DIALECT, Protocol};
use crate::rest;
use crate::stream::{Stream, StreamStep};

/// A format, and what its line carries.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FormatLine {
    /// Which format.
    pub protocol: Protocol,
    /// What comes, in order.
    pub steps: Vec<FormatStep>,
}

/// What comes next.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FormatStep {
    /// These bytes, in one slice.
    Slice(Vec<u8>),
    /// A frame made of these bytes, of which one is lost or changed if there is a fault, in slices of so many bytes.
    Frame(Vec<u8>, Option<Fault>, u8),
    /// A line event.
    Silence,
}

/// What happens to a byte of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fault {
    /// The byte's place, modulo the frame's length.
    pub place: u8,
    /// The bits that are inverted; if none are, the byte is lost.
    pub inverted: u8,
}

impl<'a> Arbitrary<'a> for FormatLine {
    fn arbitrary(u: &mut Unstructured<'a>) -> arbitrary::Result<Self> {
        let protocol = match u8::arbitrary(u)? % 9 {
            0 => Protocol::Sbus,
            1 => Protocol::Ibus,
            2 => Protocol::Crsf,
            3 => Protocol::Ubx,
            4 => Protocol::Mavlink2,
            5 => Protocol::SixAxes,
            6 => Protocol::Mavlink1,
            7 => Protocol::Nmea,
            _ => Protocol::Rtcm,
        };
        Ok(Self {
            protocol,
            steps: rest(u),
        })
    }
}

impl<'a> Arbitrary<'a> for FormatStep {
    /// The first byte modulo 4 says what it is. 0: a slice, its length in the next byte. 1: a frame made of as many bytes as the
    /// next one says, in slices of a quarter of the first. 2: the same, and behind it the fault's place and bits.
    /// 3: silence.
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
            _ => {
                let [place, inverted] = u.arbitrary()?;
                Self::Frame(bytes, Some(Fault { place, inverted }), first / 4)
            }
        })
    }
}

/// Pushed, and fed in slices, the receiver finds what the reference does; and at each place of the stream the format says that a
/// frame begins there if and only if what this file says of its protocol, bit by bit, does.
///
/// # Panics
/// If the line shows a bug.
pub fn formats(line: &FormatLine) {
    let steps = &line.steps;
    match line.protocol {
        Protocol::Sbus => check::<_, 25>(Sbus, Protocol::Sbus, steps),
        Protocol::Ibus => check::<_, 32>(Ibus, Protocol::Ibus, steps),
        Protocol::Crsf => check::<_, 64>(Crsf, Protocol::Crsf, steps),
        Protocol::Ubx => check::<_, 100>(Ubx::<64>, Protocol::Ubx, steps),
        Protocol::Mavlink1 => check::<_, 263>(Mavlink1(DIALECT), Protocol::Mavlink1, steps),
        Protocol::Mavlink2 => check::<_, 280>(Mavlink2(DIALECT), Protocol::Mavlink2, steps),
        Protocol::Nmea => check::<_, 515>(Nmea, Protocol::Nmea, steps),
        Protocol::Rtcm => check::<_, 1029>(Rtcm, Protocol::Rtcm, steps),
        Protocol::SixAxes => {
            check::<_, 16>(SixAxesByLayout, Protocol::SixAxes, steps);
            six_axes_by_the_small_receiver(steps);
        }
    }
}

fn check<F: Format + Copy + 'static, const N: usize>(
    format: F,
    protocol: Protocol,
    steps: &[FormatStep],
) {
    let mut stream = Vec::new();
    for step in steps {
        stream.extend(step.slices(protocol).into_iter().map(StreamStep::Slice));
        match step {
            FormatStep::Silence => stream.push(StreamStep::Event(LineEvent::Idle)),
            FormatStep::Frame(bytes, ..) => protocol.seals_again(&protocol.frame(bytes)),
            FormatStep::Slice(_) => {}
        }
    }
    for stretch in stretches(steps, protocol) {
        begins_where_the_protocol_says(&format, protocol, &stretch);
    }
    as_the_reference::<_, N>(|| Frames(format), &Stream(stream), || 0);
}

/// The bytes between silences.
fn stretches(steps: &[FormatStep], protocol: Protocol) -> impl Iterator<Item = Vec<u8>> {
    let stretches = steps.split(|step| *step == FormatStep::Silence);
    stretches.map(move |steps| {
        let slices = steps.iter().flat_map(|step| step.slices(protocol));
        slices.flatten().collect()
    })
}

/// The small receiver finds the same frames, none later.
fn six_axes_by_the_small_receiver(steps: &[FormatStep]) {
    for bytes in stretches(steps, Protocol::SixAxes) {
        let mut expected = Vec::new();
        framed(&SixAxesByLayout, &bytes, true, |found| {
            if let Found::Frame {
                length, message, ..
            } = found
            {
                let end = message + length;
                expected.push((end - 1, SixAxesByLayout.decode(&bytes[message..end])));
            }
        });
        let mut found = Vec::new();
        let mut end = 0;
        Receiver::<SixAxes>::new().feed(&bytes, |one| {
            end += one.bytes();
            found.extend(one.message().map(|axes| (end - 1, axes)));
        });
        assert_eq!(found, expected, "{bytes:02X?}");
    }
}

/// The same frames for a receiver of any layout.
#[derive(Clone, Copy)]
struct SixAxesByLayout;

impl Format for SixAxesByLayout {
    classify_by!(SIX_AXES);
    type Message<'a> = [u16; 6];

    fn decode(&self, frame: &[u8]) -> [u16; 6] {
        <SixAxes as FixedFormat>::decode(frame.try_into().expect("a frame has 16 bytes"))
    }
}

fn begins_where_the_protocol_says(format: &impl Format, protocol: Protocol, bytes: &[u8]) {
    fn known<F: Format>(_: &F, bytes: &[u8]) -> usize {
        F::LONGEST.min(bytes.len())
    }
    for from in 0..bytes.len() {
        let bytes = &bytes[from..];
        let bytes = &bytes[..known(format, bytes)];
        let length = match format.classify(bytes) {
            Classification::Frame(length) => Some(length),
            Classification::Rejected(_) | Classification::Incomplete { .. } => None,
        };
        assert_eq!(length, protocol.begins(bytes), "{bytes:02X?}");
    }
}

impl FormatStep {
    fn slices(&self, protocol: Protocol) -> Vec<Vec<u8>> {
        match self {
            Self::Slice(bytes) => vec![bytes.clone()],
            Self::Frame(bytes, fault, size) => {
                let mut frame = protocol.frame(bytes);
                if let Some(Fault { place, inverted }) = fault {
                    let place = usize::from(*place) % frame.len();
                    frame[place] ^= inverted;
                    if *inverted == 0 {
                        frame.remove(place);
                    }
                }
                frame
                    .chunks(usize::from(*size).max(1))
                    .map(<[u8]>::to_vec)
                    .collect()
            }
            Self::Silence => Vec::new(),
        }
    }
}
