//! An independent definition of the shipped formats: the beginning, the end and the checksum of
//! their frames. Checksums are calculated bit by bit.
#![allow(
    clippy::cast_possible_truncation,
    reason = "sums are taken modulo 256, and lengths fit"
)]

use framelock_formats::layout::{CheckedLayout, KnownMessage};
use framelock_formats::{crsf, ibus, mavlink, motion::SIX_AXES, nmea, rtcm, sbus, ubx};

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

/// The known `MAVLink` messages: HEARTBEAT, ATTITUDE, and two whose payloads may have 255 bytes, the most possible.
pub(crate) const DIALECT: &[KnownMessage] = &[
    KnownMessage::with_extra(0, 50, 9),
    KnownMessage::with_extra(0x03, 7, 255),
    KnownMessage::with_extra(30, 39, 28),
    KnownMessage::with_extra(0x01_02_03, 7, 255),
];

fn definition(id: u32) -> Option<(u8, u8)> {
    match id {
        0 => Some((50, 9)),
        30 => Some((39, 28)),
        0x03 | 0x01_02_03 => Some((7, 255)),
        _ => None,
    }
}

impl Protocol {
    /// Returns framelock's own layout of the protocol.
    fn layout(self) -> CheckedLayout<'static> {
        match self {
            Self::Sbus => sbus::LAYOUT,
            Self::Ibus => ibus::LAYOUT,
            Self::Crsf => crsf::LAYOUT,
            Self::Ubx => ubx::LAYOUT,
            Self::Mavlink1 => mavlink::layout_v1(DIALECT),
            Self::Mavlink2 => mavlink::layout_v2(DIALECT),
            Self::Nmea => nmea::LAYOUT,
            Self::Rtcm => rtcm::LAYOUT,
            Self::SixAxes => SIX_AXES,
        }
    }

    /// Corrupts one byte whose value the layout determines, and checks that sealing the frame
    /// restores this byte.
    pub(crate) fn seals_again(self, frame: &[u8]) {
        if self.begins(frame) != Some(frame.len()) {
            return;
        }
        let known = match self {
            Self::Sbus => 0,
            Self::Mavlink2 => 10 + usize::from(frame[1]),
            // The checksum's last digit.
            Self::Nmea => {
                frame
                    .iter()
                    .rposition(|byte| *byte == b'*')
                    .unwrap_or_default()
                    + 2
            }
            _ => frame.len() - 1,
        };
        let mut sealed = frame.to_vec();
        sealed[known] ^= 0x55;
        assert!(self.layout().seal(&mut sealed), "{frame:02X?}");
        assert_eq!(sealed, frame);
    }

    /// Returns the length of the frame at the beginning of the bytes, or `None` if they do not begin with a frame.
    pub(crate) fn begins(self, bytes: &[u8]) -> Option<usize> {
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
            Self::Nmea => {
                let is_content = |byte: &u8| (b' '..=b'~').contains(byte) && !b"$!".contains(byte);
                let end = 1 + bytes[1..].iter().position(|byte| !is_content(byte))?;
                let ends = [&b"\n"[..], b"\r\n", b"\r\r\n"];
                end + ends.iter().find(|it| bytes[end..].starts_with(it))?.len()
            }
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
                let text = frame.split(|byte| b"\r\n".contains(byte)).next()?;
                let digits = |end: usize| std::str::from_utf8(&text[end - 2..]).ok();
                let end = text.len();
                b"$!".contains(&first)
                    && end >= 5
                    && length <= 515
                    && text[end - 3] == b'*'
                    && text[end - 2..].iter().all(u8::is_ascii_hexdigit)
                    && digits(end).and_then(|it| u8::from_str_radix(it, 16).ok())
                        == Some(Self::xor(&text[1..end - 3]))
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

    /// Returns a frame whose payload is these bytes. Leaves out bytes that do not fit, and adds zeros if there are too
    /// few.
    pub(crate) fn frame(self, bytes: &[u8]) -> Vec<u8> {
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
                let text = at_most(250).iter().map(|byte| b'%' + byte % 90);
                let text: Vec<u8> = text.collect();
                let ends = ["\r\n", "\n", "\r\r\n"];
                let check = format!("*{:02X}{}", Self::xor(&text), ends[bytes.len() % 3]);
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

    /// Computes a CRC that processes the most significant bit of each byte first, and whose initial value is 0.
    fn crc(bytes: &[u8], width: u32, polynomial: u32) -> u32 {
        let mut register = 0_u32;
        for &byte in bytes {
            register ^= u32::from(byte) << (width - 8);
            for _ in 0..8 {
                register <<= 1;
                if register >> width == 1 {
                    register ^= 1 << width | polynomial;
                }
            }
        }
        register
    }

    fn crc8(bytes: &[u8]) -> u8 {
        Self::crc(bytes, 8, 0xD5) as u8
    }

    fn xor(bytes: &[u8]) -> u8 {
        bytes.iter().fold(0, |xor, byte| xor ^ byte)
    }

    fn crc24(bytes: &[u8]) -> [u8; 3] {
        let [_, crc @ ..] = Self::crc(bytes, 24, 0x86_4CFB).to_be_bytes();
        crc
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
