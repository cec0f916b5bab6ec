//! Target `formats`: a line with frames of one of the shipped formats on it, cut into slices anywhere, with
//! faults and line events.
#![allow(
    clippy::cast_possible_truncation,
    reason = "sums are taken modulo 256, lengths fit"
)]

use arbitrary::{Arbitrary, Unstructured};
use framelock::{FixedFormat, Format, Found, LineEvent, Receiver, Verdict};
use framelock_formats::layout::Message;
use framelock_formats::{
    Crsf, Ibus, Mavlink1, Mavlink2, Nmea, Rtcm, SIX_AXES, Sbus, SixAxes, Ubx, judged_by,
};
use framelock_proofs::reference::framed;

use crate::framing::{Frames, as_the_reference};
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

/// The shipped formats.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[allow(missing_docs, reason = "the names are the protocols'")]
pub enum Protocol {
    Sbus,
    Ibus,
    Crsf,
    Ubx,
    Mavlink1,
    Mavlink2,
    Nmea,
    Rtcm,
    SixAxes,
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
        Protocol::Nmea => check::<_, 128>(Nmea, Protocol::Nmea, steps),
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
        if *step == FormatStep::Silence {
            stream.push(StreamStep::Event(LineEvent::Idle));
        }
    }
    for stretch in stretches(steps, protocol) {
        begins_where_the_protocol_says(&format, protocol, &stretch);
    }
    as_the_reference::<_, N>(|| Frames(format), &Stream(stream), |_| 0);
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
            if let Found::Frame { length, message } = found {
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
    judged_by!(SIX_AXES);
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
        let length = match format.judge(bytes) {
            Verdict::Frame(length) => Some(length),
            Verdict::Reject(_) | Verdict::Incomplete { .. } => None,
        };
        assert_eq!(length, protocol.begins(bytes), "{bytes:02X?}");
    }
}

/// HEARTBEAT, ATTITUDE, and two with the longest payload.
const DIALECT: &[Message] = &[
    Message::with_extra(0, 50, 9),
    Message::with_extra(0x03, 7, 255),
    Message::with_extra(30, 39, 28),
    Message::with_extra(0x01_02_03, 7, 255),
];

fn definition(id: u32) -> Option<(u8, u8)> {
    match id {
        0 => Some((50, 9)),
        30 => Some((39, 28)),
        0x03 | 0x01_02_03 => Some((7, 255)),
        _ => None,
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

impl Protocol {
    /// The length of the frame that the bytes begin with.
    fn begins(self, bytes: &[u8]) -> Option<usize> {
        let &first = bytes.first()?;
        let &second = bytes.get(1)?;
        let length = match self {
            Self::Sbus => 25,
            Self::Ibus => 32,
            Self::Crsf => usize::from(second) + 2,
            Self::Ubx => usize::from(*bytes.get(4)?) + 256 * usize::from(*bytes.get(5)?) + 8,
            Self::Mavlink2 if *bytes.get(2)? == 1 => usize::from(second) + 25,
            Self::Mavlink2 => usize::from(second) + 12,
            Self::Mavlink1 => usize::from(second) + 8,
            Self::Nmea => bytes.windows(2).skip(1).position(|two| two == b"\r\n")? + 3,
            Self::Rtcm => usize::from(second) * 256 + usize::from(*bytes.get(2)?) + 6,
            Self::SixAxes => 16,
        };
        let frame = bytes.get(..length)?;
        let is_one = match self {
            Self::Sbus => {
                let is_sbus2 = frame[24] & 0x0F == 4 && frame[24] < 0x40;
                first == 0x0F && frame[23] < 16 && (frame[24] == 0 || is_sbus2)
            }
            Self::Ibus => [first, second] == [0x20, 0x40] && frame[30..] == Self::sum(&frame[..30]),
            Self::Crsf => {
                [0xC8, 0x00, 0xEA, 0xEC, 0xEE].contains(&first)
                    && (4..=64).contains(&length)
                    && Self::crc8(&frame[2..length - 1]) == frame[length - 1]
            }
            Self::Ubx => {
                [first, second] == [0xB5, 0x62]
                    && length <= 64
                    && Self::fletcher(&frame[2..length - 2]) == frame[length - 2..]
            }
            Self::Mavlink2 => {
                let end = usize::from(second) + 10;
                let id = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
                let known = definition(id).filter(|&(_, longest)| second <= longest);
                first == 0xFD
                    && frame[2] <= 1
                    && known.is_some_and(|(extra, _)| {
                        Self::crc16(&[&frame[1..end], &[extra]].concat()) == frame[end..end + 2]
                    })
            }
            Self::Mavlink1 => {
                let end = usize::from(second) + 6;
                let known = definition(frame[5].into()).filter(|&(_, longest)| second <= longest);
                first == 0xFE
                    && known.is_some_and(|(extra, _)| {
                        Self::crc16(&[&frame[1..end], &[extra]].concat()) == frame[end..]
                    })
            }
            Self::Nmea => {
                let digits = |end: usize| std::str::from_utf8(&frame[end - 2..end]).ok();
                b"$!".contains(&first)
                    && (7..=128).contains(&length)
                    && frame[length - 5] == b'*'
                    && frame[length - 4..length - 2]
                        .iter()
                        .all(u8::is_ascii_hexdigit)
                    && digits(length - 2).and_then(|it| u8::from_str_radix(it, 16).ok())
                        == Some(Self::xor(&frame[1..length - 5]))
            }
            Self::Rtcm => {
                first == 0xD3
                    && length <= 1029
                    && Self::crc24(&frame[..length - 3]) == frame[length - 3..]
            }
            Self::SixAxes => [first, second] == [0xFF; 2] && frame[14..] == [0x0A, 0x0D],
        };
        is_one.then_some(length)
    }

    /// A frame with these bytes in it, as far as they fit, and zeros where there are too few.
    fn frame(self, bytes: &[u8]) -> Vec<u8> {
        let filled = |length: usize| {
            let mut filled = bytes.to_vec();
            filled.resize(length, 0);
            filled
        };
        let at_most = |length: usize| &bytes[..bytes.len().min(length)];
        match self {
            Self::Sbus => [&[0x0F], &filled(22)[..], &[bytes.len() as u8 & 15, 0x14]].concat(),
            Self::Ibus => {
                let checked = [&[0x20, 0x40], &filled(28)[..]].concat();
                [&checked[..], &Self::sum(&checked)].concat()
            }
            Self::Crsf => {
                let checked = [&[0x16], at_most(60)].concat();
                let head = [0xC8, checked.len() as u8 + 1];
                [&head, &checked[..], &[Self::crc8(&checked)]].concat()
            }
            Self::Ubx => {
                let payload = at_most(56);
                let checked = [&[1, 7, payload.len() as u8, 0], payload].concat();
                [&[0xB5, 0x62], &checked[..], &Self::fletcher(&checked)].concat()
            }
            Self::Mavlink2 => {
                let payload = at_most(255);
                let is_signed = payload.first().is_some_and(|&first| first >= 128);
                let (length, flags) = (payload.len() as u8, u8::from(is_signed));
                let checked = [&[length, flags, 0, 9, 1, 1, 3, 2, 1], payload].concat();
                let crc = Self::crc16(&[&checked[..], &[7]].concat());
                let signature = [0xFD; 13];
                let signature = if is_signed { &signature[..] } else { &[] };
                [&[0xFD], &checked[..], &crc, signature].concat()
            }
            Self::Mavlink1 => {
                let payload = at_most(255);
                let checked = [&[payload.len() as u8, 9, 1, 1, 3], payload].concat();
                let crc = Self::crc16(&[&checked[..], &[7]].concat());
                [&[0xFE], &checked[..], &crc].concat()
            }
            Self::Nmea => {
                let text: Vec<u8> = at_most(100).iter().map(|byte| b' ' + byte % 95).collect();
                let check = format!("*{:02X}\r\n", Self::xor(&text));
                [b"$", &text[..], check.as_bytes()].concat()
            }
            Self::Rtcm => {
                let payload = at_most(255);
                let checked = [&[0xD3, 0, payload.len() as u8], payload].concat();
                [&checked[..], &Self::crc24(&checked)].concat()
            }
            Self::SixAxes => [&[0xFF, 0xFF], &filled(12)[..], &[0x0A, 0x0D]].concat(),
        }
    }

    fn sum(bytes: &[u8]) -> [u8; 2] {
        let sum: u16 = bytes.iter().copied().map(u16::from).sum();
        (0xFFFF - sum).to_le_bytes()
    }

    fn crc8(bytes: &[u8]) -> u8 {
        let mut register = 0_u8;
        for byte in bytes {
            register ^= byte;
            for _ in 0..8 {
                let carry = register & 0x80 != 0;
                register <<= 1;
                if carry {
                    register ^= 0xD5;
                }
            }
        }
        register
    }

    fn xor(bytes: &[u8]) -> u8 {
        bytes.iter().fold(0, |xor, byte| xor ^ byte)
    }

    fn crc24(bytes: &[u8]) -> [u8; 3] {
        let mut register = 0_u32;
        for &byte in bytes {
            register ^= u32::from(byte) << 16;
            for _ in 0..8 {
                register <<= 1;
                if register >> 24 == 1 {
                    register ^= 0x0186_4CFB;
                }
            }
        }
        [
            (register >> 16) as u8,
            (register >> 8) as u8,
            register as u8,
        ]
    }

    fn fletcher(bytes: &[u8]) -> [u8; 2] {
        let (mut a, mut b) = (0_u32, 0_u32);
        for &byte in bytes {
            a += u32::from(byte);
            b += a;
        }
        [a as u8, b as u8]
    }

    fn crc16(bytes: &[u8]) -> [u8; 2] {
        let mut register = 0xFFFF_u16;
        for &byte in bytes {
            register ^= u16::from(byte);
            for _ in 0..8 {
                let carry = register & 1 != 0;
                register >>= 1;
                if carry {
                    register ^= 0x8408;
                }
            }
        }
        register.to_le_bytes()
    }
}
