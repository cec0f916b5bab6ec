//! TBS's Crossfire protocol, which ExpressLRS uses too.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{
    Algorithm, CheckedLayout, Checksum, Crc, Layout, Length, LengthField, Patterns, Table,
};
use crate::sbus::{CHANNEL_BYTES, unpack_channels};

/// CRC-8/DVB-S2.
const CRC: Crc = Crc::new(8, 0xD5);

/// The layout of a CRSF frame: see [`Crsf`].
pub const LAYOUT: CheckedLayout<'static> = Layout {
    sync: Patterns::any_byte_of(&[
        address::FLIGHT_CONTROLLER,
        address::BROADCAST,
        address::REMOTE_CONTROL,
        address::RECEIVER,
        address::TRANSMITTER,
    ]),
    length: Length::Field(LengthField {
        plus: 2,
        ..LengthField::byte(1)
    }),
    shortest: 4,
    longest: 64,
    checksum: Some(Checksum {
        algorithm: Algorithm::Crc(Crc {
            table: Table::Bytes(&CRC.table_of_bytes()),
            ..CRC
        }),
        from: 2,
        ..Checksum::at_the_end(1)
    }),
    ..Layout::NONE
}
.checked();

/// TBS's Crossfire protocol, which ExpressLRS uses too. A frame has 4 to 64 bytes: an address, a length, a type, up to
/// 60 bytes of payload, and a CRC-8 of type and payload. By default the line runs at 416 666 or 400 000 baud.
///
/// A frame begins with the serial sync byte C8 or with the [`address`] of a device. This format accepts the bytes
/// that flight controllers, handsets, receivers and transmitter modules send: C8, 00, EA, EC, EE. Each additional
/// accepted byte would cause more false starts. To accept other bytes, define a format of your own that uses [`LAYOUT`]
/// with another `sync`.
///
/// The CRC detects every burst of up to 8 wrong bits in the type, the payload and the CRC. One in 256 random frames
/// passes undetected.
///
/// Source: <https://github.com/tbs-fpv/tbs-crsf-spec/blob/main/crsf.md>, "Frame Construction", "CRC",
/// "Device Addresses", "RC Channels Packed Payload".
///
/// # Examples
/// ```
/// use framelock_formats::crsf::{self, Crsf};
/// let receiver = crsf::Receiver::new(Crsf);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Crsf;

/// A receiver whose buffer is twice as long as the longest frame.
pub type Receiver = framelock::BufferedReceiver<Crsf, [u8; 128]>;

/// The contents of a CRSF frame.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Message<'a> {
    /// The frame's first byte.
    pub address: u8,
    /// The frame's type. With most types from 0x28 on, the payload begins with the addresses of the destination and the
    /// origin.
    pub kind: u8,
    /// The payload, 0 to 60 bytes. Its numbers are big endian, except the packed channels.
    pub payload: &'a [u8],
}

impl Format for Crsf {
    crate::classify_by!(LAYOUT);
    type Message<'a> = Message<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        match *frame {
            [address, _, kind, ref payload @ .., _] => Message {
                address,
                kind,
                payload,
            },
            _ => Message::default(),
        }
    }
}

impl Message<'_> {
    /// Returns the channels of a frame of type 0x16, or `None` for other frames and payloads that are too short. A
    /// channel is 0 to 2047: 172 means 988 µs, 992 means 1500 µs, and 1811 means 2012 µs.
    #[must_use]
    pub fn channels(&self) -> Option<[u16; 16]> {
        let bytes = self.payload.first_chunk::<CHANNEL_BYTES>();
        let bytes = bytes.filter(|_| self.kind == 0x16)?;
        let mut channels = [0; 16];
        unpack_channels(bytes, &mut channels);
        Some(channels)
    }
}

impl EncodeInto for Crsf {
    /// Fails for payloads of more than 60 bytes, and for an [`address`] that [`Crsf`] does not accept.
    fn encode_into<'b>(
        &self,
        message: Message<'_>,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        let head = [message.address, 0, message.kind];
        let frame = crate::write(&LAYOUT, into, &[&head, message.payload, &[0]])?;
        // Reject the address here, because sealing would replace it with an accepted one.
        if frame.first() == Some(&message.address) {
            Ok(frame)
        } else {
            Err(EncodeError::InvalidMessage)
        }
    }
}

/// CRSF's device addresses, except the reserved and the dynamic addresses.
#[allow(missing_docs, reason = "the specification, too, has names only")]
pub mod address {
    pub const BROADCAST: u8 = 0x00;
    pub const CLOUD: u8 = 0x0E;
    pub const USB_DEVICE: u8 = 0x10;
    pub const BLUETOOTH_MODULE: u8 = 0x12;
    pub const WIFI_RECEIVER: u8 = 0x13;
    pub const VIDEO_RECEIVER: u8 = 0x14;
    pub const OSD: u8 = 0x80;
    /// The addresses of speed controllers 1 to 8.
    pub const SPEED_CONTROLLERS: [u8; 8] = [0x90, 0x91, 0x92, 0x93, 0x94, 0x95, 0x96, 0x97];
    pub const CURRENT_SENSOR: u8 = 0xC0;
    pub const GPS: u8 = 0xC2;
    pub const BLACKBOX: u8 = 0xC4;
    /// Also the serial sync byte.
    pub const FLIGHT_CONTROLLER: u8 = 0xC8;
    pub const RACE_TAG: u8 = 0xCC;
    pub const VIDEO_TRANSMITTER: u8 = 0xCE;
    pub const REMOTE_CONTROL: u8 = 0xEA;
    pub const RECEIVER: u8 = 0xEC;
    pub const TRANSMITTER: u8 = 0xEE;
}
