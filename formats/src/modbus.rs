//! Modbus RTU.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{Algorithm, CheckedLayout, Checksum, Crc, Layout, Length};

/// The layout of a Modbus RTU frame: see [`ModbusRtu`].
pub const LAYOUT: CheckedLayout<'static> = Layout {
    length: Length::Silence,
    shortest: 4,
    longest: 256,
    checksum: Some(Checksum {
        algorithm: Algorithm::Crc(Crc {
            initial: 0xFFFF,
            reflected_in: true,
            reflected_out: true,
            ..Crc::new(16, 0x8005)
        }),
        ..Checksum::at_the_end(2)
    }),
    ..Layout::NONE
}
.checked();

/// Modbus RTU: an address, a function code, up to 252 bytes of data, and a CRC-16. A pause of at least 3.5 characters
/// follows each frame. Only a pause or a break ends a frame, so report each pause to the receiver as
/// [`LineEvent::Idle`](framelock::LineEvent::Idle).
///
/// At a pause, the receiver delivers the longest frame that ends there and begins after the previous line event. If the
/// pause between two frames is missed, only the second is delivered. If a frame contains a pause, this frame is lost.
///
/// The message contains the bytes before the CRC: the address, the function code and the data. The CRC detects every
/// burst of up to 16 wrong bits. At a pause, the receiver tries one suffix of the pending bytes after another. One in
/// 65 536 suffixes of noise has a valid CRC.
///
/// Source: "MODBUS over Serial Line, Specification and Implementation Guide V1.02", sections 2.5.1 and 6.2.2.
///
/// # Examples
/// ```
/// use framelock::{BufferedReceiver, LineEvent};
/// use framelock_formats::modbus::ModbusRtu;
///
/// let (mut receiver, mut received) = (BufferedReceiver::<_, [u8; 514]>::new(ModbusRtu), Vec::new());
/// receiver.feed(b"\x01\x03\x00\x00\x00\x01\x84\x0A", |_| ());
/// receiver.line_event(LineEvent::Idle, |found| received.extend(found.decoded().map(<[u8]>::to_vec)));
/// assert_eq!(received, [b"\x01\x03\x00\x00\x00\x01"]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct ModbusRtu;

impl Format for ModbusRtu {
    crate::classify_by!(LAYOUT);
    type Message<'a> = &'a [u8];

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
            .split_last_chunk::<2>()
            .map_or(frame, |(message, _)| message)
    }
}

impl EncodeInto for ModbusRtu {
    /// Fails for messages of fewer than 2 or more than 254 bytes.
    fn encode_into<'b>(&self, message: &[u8], into: &'b mut [u8]) -> Result<&'b [u8], EncodeError> {
        crate::write(&LAYOUT, into, &[message, &[0, 0]])
    }
}
