//! MAVLink 1 and 2.

use framelock::{Classification, EncodeError, EncodeInto, Format, LineEvent};

pub use crate::dialects::{ARDUPILOTMEGA, COMMON};
use crate::layout::{
    Algorithm, ByteOrder, CheckedLayout, Checksum, Crc, FixedBits, KnownMessage, Layout, Length,
    LengthField, Messages, Number, Patterns, Trailer,
};

/// CRC-16/MCRF4XX.
const CRC: Crc<'static> = Crc {
    initial: 0xFFFF,
    reflected_in: true,
    reflected_out: true,
    ..Crc::new(16, 0x1021)
};

/// MAVLink's checksum, which covers all bytes before it except the first, and the message's extra byte.
const CHECKSUM: Option<Checksum<'static>> = Some(Checksum {
    algorithm: Algorithm::Crc(CRC),
    from: 1,
    ..Checksum::at_the_end(2)
});

/// Returns the layout of MAVLink 1 frames with these messages: see [`Mavlink1`].
///
/// # Panics
/// Panics if the messages are not in ascending order of their numbers, or if two of them have the same number.
#[must_use]
pub const fn layout_v1(messages: &[KnownMessage]) -> CheckedLayout<'_> {
    unchecked_v1(messages).checked()
}

/// Returns the layout of MAVLink 2 frames with these messages, signed or unsigned: see [`Mavlink2`].
///
/// # Panics
/// Panics if the messages are not in ascending order of their numbers, or if two of them have the same number.
#[must_use]
pub const fn layout_v2(messages: &[KnownMessage]) -> CheckedLayout<'_> {
    unchecked_v2(messages).checked()
}

#[inline(always)]
const fn unchecked_v1(known: &[KnownMessage]) -> Layout<'_> {
    Layout {
        sync: Patterns::one(&[0xFE]),
        length: Length::Field(LengthField {
            plus: 8,
            ..LengthField::byte(1)
        }),
        shortest: 8,
        longest: 263,
        messages: Some(Messages {
            number: Number::byte(5),
            known,
        }),
        checksum: CHECKSUM,
        ..Layout::NONE
    }
}

#[inline(always)]
const fn unchecked_v2(known: &[KnownMessage]) -> Layout<'_> {
    Layout {
        sync: Patterns::one(&[0xFD]),
        length: Length::Field(LengthField {
            plus: 12,
            ..LengthField::byte(1)
        }),
        shortest: 12,
        longest: 280,
        fixed: const {
            &[FixedBits {
                at: 2,
                mask: 0xFE,
                value: 0,
            }]
        },
        messages: Some(Messages {
            number: Number::new(7, 3, ByteOrder::Little),
            known,
        }),
        checksum: CHECKSUM,
        trailer: Some(Trailer {
            at: 2,
            mask: 1,
            bytes: 13,
        }),
        ..Layout::NONE
    }
}

/// Both layouts are checked at compile time, with a placeholder message. A format has its own messages, and does not
/// check the layout again for each byte.
const MAVLINK1: CheckedLayout<'static> = layout_v1(&[KnownMessage::new(0)]);
const MAVLINK2: CheckedLayout<'static> = layout_v2(&[KnownMessage::new(0)]);

/// A constant layout, and the messages that take the place of its placeholder message. The compiler specialises the code
/// for the constant layout.
struct Dialect<'a>(&'static Layout<'static>, &'a [KnownMessage]);

impl Dialect<'_> {
    #[inline(always)]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.0.classify_known(self.1, bytes, seen)
    }

    #[inline(always)]
    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        self.0.classify_before(bytes, event)
    }

    #[inline(always)]
    fn starts(&self, byte: u8) -> bool {
        self.0.starts(byte)
    }
}

/// MAVLink 2: `FD`, nine more bytes of header, up to 255 bytes of payload, a CRC-16, and 13 bytes of signature if the
/// header announces it.
///
/// A value of this type contains the messages of a dialect, in ascending order of their numbers. [`ARDUPILOTMEGA`]
/// contains all messages of the dialects `common` and `ardupilotmega`. Frames of messages that are not in the value are
/// rejected, because their CRC cannot be checked: it covers an extra byte that is computed from the message's
/// definition. Frames with incompatibility flags other than "signed" are rejected too. **Signatures are not verified.**
///
/// To receive MAVLink 1 on the same line, give [`AnyOf`](crate::AnyOf) the layouts [`layout_v1`] and [`layout_v2`].
///
/// The CRC detects every burst of up to 16 wrong bits within the payload. One in 65 536 random frames passes
/// undetected. The CRC is computed without a table.
///
/// Source: <https://mavlink.io/en/guide/serialization.html>, "MAVLink 2 Packet Format", "Payload
/// Truncation", "Checksum", and <https://mavlink.io/en/guide/message_signing.html>.
///
/// # Examples
/// ```
/// use framelock_formats::layout::KnownMessage;
/// use framelock_formats::mavlink::{Mavlink2, Receiver2};
///
/// /// HEARTBEAT and ATTITUDE of the dialect `common`: the extra byte of the CRC, and the longest payload.
/// const MESSAGES: &[KnownMessage] = &[
///     KnownMessage::with_extra(0, 50, 9),
///     KnownMessage::with_extra(30, 39, 28),
/// ];
/// let receiver = Receiver2::new(Mavlink2(MESSAGES));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mavlink2<'a>(pub &'a [KnownMessage]);

/// MAVLink 1: `FE`, five more bytes of header, up to 255 bytes of payload, a CRC-16. Like a value of [`Mavlink2`], a
/// value of this type contains the messages of a dialect, in ascending order of their numbers.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mavlink1<'a>(pub &'a [KnownMessage]);

/// A receiver of MAVLink 1 whose buffer is twice as long as the longest frame.
pub type Receiver1 = framelock::BufferedReceiver<Mavlink1<'static>, [u8; 526]>;

/// A receiver of MAVLink 2 whose buffer is twice as long as the longest frame.
pub type Receiver2 = framelock::BufferedReceiver<Mavlink2<'static>, [u8; 560]>;

/// The contents of a MAVLink frame.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Message<'a> {
    /// A counter of the component's frames. A gap in the numbers shows that frames were lost.
    pub sequence: u8,
    /// The sender's system.
    pub system: u8,
    /// The sender's component.
    pub component: u8,
    /// The message's number: 24 bits, or 8 bits in MAVLink 1.
    pub id: u32,
    /// The payload, in little endian. Senders of MAVLink 2 leave out trailing zeros.
    pub payload: &'a [u8],
    /// The signature, if the frame is signed.
    pub signature: Option<Signature<'a>>,
}

/// A frame's signature, not verified. To verify it, check two conditions. `value` must be the first six bytes of the
/// SHA-256 hash of the secret key followed by `signed`. The timestamp must be later than the previous timestamp of this
/// link, system and component.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Signature<'a> {
    /// The sender's link.
    pub link: u8,
    /// The time in units of 10 µs since the beginning of 2015, UTC: 48 bits.
    pub timestamp: u64,
    /// The signature itself.
    pub value: [u8; 6],
    /// All bytes of the frame that precede `value`.
    pub signed: &'a [u8],
}

impl Format for Mavlink1<'_> {
    crate::classify_by!(MAVLINK1, |format| Dialect(&MAVLINK1.0, format.0));
    type Message<'a> = Message<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        let Some((&[_, _, sequence, system, component, id], rest)) = frame.split_first_chunk()
        else {
            return Message::default();
        };
        let (payload, _) = rest.split_last_chunk::<2>().unwrap_or((&[], &[0, 0]));
        Message {
            sequence,
            system,
            component,
            id: id.into(),
            payload,
            signature: None,
        }
    }
}

impl Format for Mavlink2<'_> {
    crate::classify_by!(MAVLINK2, |format| Dialect(&MAVLINK2.0, format.0));
    type Message<'a> = Message<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        let length = frame.get(1).map_or(0, |&length| usize::from(length));
        let parts = frame.split_at_checked(length.wrapping_add(10));
        let Some((head, tail)) = parts else {
            return Message::default();
        };
        let Some((&[_, _, _, _, sequence, system, component, a, b, c], payload)) =
            head.split_first_chunk()
        else {
            return Message::default();
        };
        Message {
            sequence,
            system,
            component,
            id: u32::from_le_bytes([a, b, c, 0]),
            payload,
            signature: signature(frame, tail),
        }
    }
}

#[inline(never)]
fn signature<'a>(frame: &'a [u8], tail: &[u8]) -> Option<Signature<'a>> {
    let [_, _, link, a, b, c, d, e, f, ..] = *tail.first_chunk::<15>()?;
    let (signed, &value) = frame.split_last_chunk()?;
    Some(Signature {
        link,
        timestamp: u64::from_le_bytes([a, b, c, d, e, f, 0, 0]),
        value,
        signed,
    })
}

impl EncodeInto for Mavlink1<'_> {
    /// Fails for messages that the format does not contain, and for payloads that are too long for their message.
    fn encode_into<'b>(
        &self,
        message: Message<'_>,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        let (system, component) = (message.system, message.component);
        let id = u8::try_from(message.id).map_err(|_| EncodeError::InvalidMessage)?;
        let head = [0, 0, message.sequence, system, component, id];
        crate::write(
            &unchecked_v1(self.0),
            into,
            &[&head, message.payload, &[0, 0]],
        )
    }
}

impl EncodeInto for Mavlink2<'_> {
    /// Writes an unsigned frame. Fails for messages that the format does not contain, and for payloads that are too
    /// long for their message.
    fn encode_into<'b>(
        &self,
        message: Message<'_>,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        // Leave out trailing zeros, but always send the first byte of the payload.
        let zeros = message.payload.iter().skip(1).rev();
        let zeros = zeros.take_while(|&&byte| byte == 0).count();
        let (payload, _) = message
            .payload
            .split_at(message.payload.len().saturating_sub(zeros));
        let (system, component) = (message.system, message.component);
        let [a, b, c, 0] = message.id.to_le_bytes() else {
            return Err(EncodeError::InvalidMessage);
        };
        let head = [0, 0, 0, 0, message.sequence, system, component, a, b, c];
        crate::write(&unchecked_v2(self.0), into, &[&head, payload, &[0, 0]])
    }
}
