//! Packets of any bytes between delimiters: SLIP, COBS, and HDLC with a CRC-16.
//!
//! `MOST` is the number of bytes in the longest packet, without delimiters, stuffing and CRC. A receiver needs a buffer
//! of `MOST + 1` bytes, or of `MOST + 3` bytes for [`Hdlc`], whose packets have a checksum. SLIP and COBS have
//! no checksum, so a packet whose bytes have changed on the line may be delivered. If your packets have a checksum,
//! describe them as a [`Layout`](crate::layout::Layout), or check them in the program.
//!
//! ```
//! use framelock::{PacketReceiver, Stuffing};
//! use framelock_formats::packet::{Cobs, Hdlc};
//!
//! let mut receiver = PacketReceiver::<_, [u8; 65]>::new(Cobs::<64>);
//! let mut buffer = [0; 68];
//! let sent = Stuffing::Cobs.stuff(b"a\0b", &mut buffer).unwrap();
//! let mut packets = Vec::new();
//! receiver.feed(sent, |found| packets.extend(found.decoded().map(<[u8]>::to_vec)));
//! assert_eq!(packets, [b"a\0b"]);
//!
//! // Append the CRC to the packet, and then stuff both.
//! let mut receiver = PacketReceiver::<_, [u8; 67]>::new(Hdlc::<64>);
//! let [low, high] = Hdlc::<64>::crc(b"~~");
//! let mut buffer = [0; 16];
//! let sent = Stuffing::HDLC.stuff(&[b'~', b'~', low, high], &mut buffer).unwrap();
//! let mut packets = Vec::new();
//! receiver.feed(sent, |found| packets.extend(found.decoded().map(<[u8]>::to_vec)));
//! assert_eq!(packets, [b"~~"]);
//! ```

use framelock::{Classification, DiscardReason, Format, LineEvent, PacketFormat, Stuffing};

use crate::layout::Crc;

/// The CRC of HDLC and PPP frames: CRC-16/IBM-SDLC.
const CRC: Crc = Crc {
    initial: 0xFFFF,
    reflected_in: true,
    reflected_out: true,
    xor_out: 0xFFFF,
    ..Crc::new(16, 0x1021)
};

/// The number of bytes in this CRC.
const CRC_BYTES: usize = 2;

/// The format of SLIP's packets (RFC 1055), of up to `MOST` bytes. KISS uses the same packets, and their first byte is
/// the command.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Slip<const MOST: usize>;

/// The format of packets of up to `MOST` bytes with Consistent Overhead Byte Stuffing.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Cobs<const MOST: usize>;

/// The format of packets of up to `MOST` bytes, framed like HDLC on a UART, with a CRC-16/IBM-SDLC after the packet.
/// The CRC's low byte comes first. The message is the packet, without the CRC.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Hdlc<const MOST: usize>;

impl<const MOST: usize> Hdlc<MOST> {
    /// Returns the CRC that follows the packet.
    #[must_use]
    pub fn crc(packet: &[u8]) -> [u8; CRC_BYTES] {
        let [low, high, ..] = CRC.result(CRC.update(CRC.start(), packet)).to_le_bytes();
        [low, high]
    }
}

/// Defines a format of packets that end only at a delimiter.
macro_rules! packets {
    ($name:ident, $stuffing:expr, $checked:expr, $before:ident, $decode:expr) => {
        impl<const MOST: usize> Format for $name<MOST> {
            const LONGEST: usize = MOST.saturating_add($checked + 1);
            type Message<'a> = &'a [u8];

            #[inline]
            fn classify(&self, bytes: &[u8]) -> Classification {
                if bytes.len() < Self::LONGEST {
                    let at_least = Self::LONGEST;
                    Classification::Incomplete { at_least }
                } else {
                    Classification::Rejected(DiscardReason::TooLong)
                }
            }

            #[inline]
            fn classify_before(&self, bytes: &[u8], _: LineEvent) -> Classification {
                $before(bytes)
            }

            #[inline]
            fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
                $decode(frame)
            }
        }

        impl<const MOST: usize> PacketFormat for $name<MOST> {
            #[inline]
            fn stuffing(&self) -> Stuffing {
                $stuffing
            }
        }
    };
}
packets!(Slip, Stuffing::SLIP, 0, unchecked, core::convert::identity);
packets!(Cobs, Stuffing::Cobs, 0, unchecked, core::convert::identity);
packets!(Hdlc, Stuffing::HDLC, CRC_BYTES, checked, without_crc);

fn unchecked(bytes: &[u8]) -> Classification {
    Classification::Frame(bytes.len())
}

fn checked(bytes: &[u8]) -> Classification {
    let packet = without_crc(bytes);
    match bytes.get(packet.len()..) {
        _ if packet.is_empty() => Classification::Rejected(DiscardReason::BadHeader),
        Some(crc) if crc == Hdlc::<0>::crc(packet) => Classification::Frame(bytes.len()),
        _ => Classification::Rejected(DiscardReason::ChecksumMismatch),
    }
}

fn without_crc(frame: &[u8]) -> &[u8] {
    let length = frame.len().saturating_sub(CRC_BYTES);
    frame.get(..length).unwrap_or_default()
}
