//! Target `formats`: frames of a shipped format on a line with faults and line events. The stream
//! is cut into slices anywhere.

use arbitrary::{Arbitrary, Unstructured};
use framelock::{Classification, Counters, FixedFormat, Format, Found, LineEvent, Receiver};
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

/// A format, and the steps of the stream that its receivers get.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct FormatLine {
    /// The format.
    pub protocol: Protocol,
    /// The steps in order.
    pub steps: Vec<FormatStep>,
}

/// One step of a stream.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum FormatStep {
    /// These bytes, in one slice.
    Slice(Vec<u8>),
    /// A frame that is made from these bytes, in slices of this size. If there is a [`Fault`], one byte is wrong or
    /// lost.
    Frame(Vec<u8>, Option<Fault>, u8),
    /// A line event.
    Silence,
}

/// A fault in one byte of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Fault {
    /// The byte's position, modulo the frame's length.
    pub place: u8,
    /// The mask of the bits to invert. If the mask is 0, the byte is lost instead.
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
    /// The first byte modulo 4 determines the step:
    ///
    /// * 0: a slice. The next byte is its length.
    /// * 1: a frame. The next byte is the number of bytes from which the frame is made. The first byte divided by 4 is
    ///   the size of the slices.
    /// * 2: a frame as in case 1, followed by the position and the mask of a fault.
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
            _ => {
                let [place, inverted] = u.arbitrary()?;
                Self::Frame(bytes, Some(Fault { place, inverted }), first / 4)
            }
        })
    }
}

/// Checks that the receiver reports the same frames and discarded bytes as the reference, both with pushed bytes and
/// with fed slices. The format must find frames at exactly those positions of the stream at which the independent
/// definition in `protocol.rs` finds frames.
///
/// Returns the receiver's counters.
///
/// # Panics
/// Panics if the line shows a bug.
pub fn formats(line: &FormatLine) -> Counters {
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
            six_axes_by_the_small_receiver(steps);
            check::<_, 16>(SixAxesByLayout, Protocol::SixAxes, steps)
        }
    }
}

fn check<F: Format + Copy + 'static, const N: usize>(
    format: F,
    protocol: Protocol,
    steps: &[FormatStep],
) -> Counters {
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
    as_the_reference::<_, N>(|| Frames(format), &format, &Stream(stream), || 0)
}

/// Returns the bytes between one silence and the next, for each part of the stream.
fn stretches(steps: &[FormatStep], protocol: Protocol) -> impl Iterator<Item = Vec<u8>> {
    let stretches = steps.split(|step| *step == FormatStep::Silence);
    stretches.map(move |steps| {
        let slices = steps.iter().flat_map(|step| step.slices(protocol));
        slices.flatten().collect()
    })
}

/// Checks that the small [`Receiver`](framelock::Receiver) finds the same frames as the reference, at the same
/// positions.
fn six_axes_by_the_small_receiver(steps: &[FormatStep]) {
    for bytes in stretches(steps, Protocol::SixAxes) {
        let mut expected = Vec::new();
        framed(&SixAxesByLayout, &bytes, Some(LineEvent::Idle), |found| {
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

/// The six-axes format, defined by its layout, for a [`BufferedReceiver`](framelock::BufferedReceiver).
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
