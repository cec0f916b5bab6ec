use framelock::{DiscardReason, Format, Verdict};

use crate::Headed;
use crate::channels;
use crate::checksums::crc8_dvb_s2;

/// TBS's Crossfire protocol, which ExpressLRS uses too: 4 to 64 bytes, an address, a length, a type, up to
/// 60 bytes of payload, a CRC-8 of type and payload. The lines have 416 666 or 400 000 baud.
///
/// A frame may begin with the serial sync byte C8 or with any [device's address](address). Each
/// that is accepted makes more false beginnings, so [`Crsf::default`] accepts C8 alone.
///
/// The CRC notices every burst of up to 8 wrong bits in type, payload and itself, and lets one in 256
/// random frames pass.
///
/// Source: <https://github.com/tbs-fpv/tbs-crsf-spec/blob/main/crsf.md>, "Frame Construction", "CRC",
/// "Device Addresses", "RC Channels Packed Payload".
///
/// # Examples
/// What comes from a handset, from the same with EdgeTX, and to a flight controller:
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Crsf, crsf_address};
/// let addresses = [crsf_address::REMOTE_CONTROL, crsf_address::TRANSMITTER, 0xC8];
/// let receiver = BufferedReceiver::<_, 128>::new(Crsf::accepting(addresses));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Crsf<const ADDRESSES: usize = 1> {
    addresses: [u8; ADDRESSES],
}

impl<const ADDRESSES: usize> Crsf<ADDRESSES> {
    /// Frames that begin with any of these bytes.
    #[must_use]
    pub const fn accepting(addresses: [u8; ADDRESSES]) -> Self {
        Self { addresses }
    }
}

impl Default for Crsf {
    fn default() -> Self {
        Self::accepting([address::FLIGHT_CONTROLLER])
    }
}

/// What a CRSF frame says.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct CrsfMessage<'a> {
    /// The frame's first byte.
    pub address: u8,
    /// The frame's type. From 0x28 on the payload begins with the addresses of destination and origin.
    pub kind: u8,
    /// 0 to 60 bytes; numbers in it are big endian.
    pub payload: &'a [u8],
}

impl<const ADDRESSES: usize> Format for Crsf<ADDRESSES> {
    const LONGEST: usize = 64;
    type Message<'a> = CrsfMessage<'a>;

    #[inline]
    fn judge(&self, bytes: &[u8]) -> Verdict {
        if !bytes.first().is_some_and(|&first| self.starts(first)) {
            return Verdict::Reject(DiscardReason::NoSync);
        }
        let frame = Headed {
            sync: &[],
            header: 2,
            longest: Self::LONGEST,
        };
        frame.judge(
            bytes,
            |header| match *header {
                [_, length] if length >= 2 => Some(usize::from(length).wrapping_add(2)),
                _ => None,
            },
            |frame| matches!(frame, [_, _, checked @ .., crc] if crc8_dvb_s2(0, checked) == *crc),
        )
    }

    #[inline]
    fn starts(&self, byte: u8) -> bool {
        // All of them at once, not one after the other until one fits.
        let is_it = |address: &u8| *address == byte;
        let addresses = self.addresses.iter();
        addresses.fold(false, |any, address| any | is_it(address))
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> CrsfMessage<'a> {
        match *frame {
            [address, _, kind, ref payload @ .., _] => CrsfMessage {
                address,
                kind,
                payload,
            },
            _ => CrsfMessage::default(),
        }
    }
}

impl CrsfMessage<'_> {
    /// The channels of a frame of type 0x16: 0 to 2047, where 172 is 988 µs, 992 is 1500 µs and 1811 is 2012 µs.
    #[must_use]
    pub fn channels(&self) -> Option<[u16; 16]> {
        let bytes = self.payload.first_chunk().filter(|_| self.kind == 0x16)?;
        Some(channels::unpack(bytes))
    }

    /// Writes the frame that says it to the front of `into`, and gives its length; nothing if it is longer than
    /// 64 bytes or than `into`.
    pub fn encode(&self, into: &mut [u8]) -> Option<usize> {
        let length = u8::try_from(self.payload.len()).ok();
        let length = length.filter(|&length| length <= 60)?.wrapping_add(2);
        let crc = crc8_dvb_s2(crc8_dvb_s2(0, &[self.kind]), self.payload);
        let head = [self.address, length, self.kind];
        crate::write(into, &[&head, self.payload, &[crc]])
    }
}

/// CRSF's device addresses, without the reserved ones.
#[allow(missing_docs, reason = "the specification, too, has names only")]
pub mod address {
    pub const BROADCAST: u8 = 0x00;
    pub const CLOUD: u8 = 0x0E;
    pub const USB_DEVICE: u8 = 0x10;
    pub const BLUETOOTH_MODULE: u8 = 0x12;
    pub const WIFI_RECEIVER: u8 = 0x13;
    pub const VIDEO_RECEIVER: u8 = 0x14;
    pub const OSD: u8 = 0x80;
    /// 1 to 8.
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
