use framelock::Format;

use crate::layout::{
    Algorithm, Appendix, ByteOrder, Checksum, Crc, FixedBits, Layout, Length, LengthField, Message,
    Messages, Number, Patterns,
};

/// CRC-16/MCRF4XX.
const CRC: Crc<'static> = Crc {
    width: 16,
    polynomial: 0x1021,
    initial: 0xFFFF,
    reflected_in: true,
    reflected_out: true,
    ..Crc::ZERO
};

/// MAVLink's checksum: of all but the first byte.
const CHECKSUM: Checksum<'static> = Checksum {
    algorithm: Algorithm::Crc(Crc {
        #[cfg(feature = "table")]
        table: crate::layout::Table::Sixteens(&CRC.table_of_sixteens()),
        ..CRC
    }),
    from: 1,
    ..Checksum::at_the_end(2)
};

/// What a MAVLink 1 frame with these messages looks like: see [`Mavlink1`].
#[must_use]
pub const fn mavlink1(messages: &[Message]) -> Layout<'_> {
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
            known: messages,
        }),
        checksum: Some(CHECKSUM),
        ..Layout::NONE
    }
}

/// What a MAVLink 2 frame with these messages looks like, signed or not: see [`Mavlink2`].
#[must_use]
pub const fn mavlink2(messages: &[Message]) -> Layout<'_> {
    Layout {
        sync: Patterns::one(&[0xFD]),
        length: Length::Field(LengthField {
            plus: 12,
            ..LengthField::byte(1)
        }),
        shortest: 12,
        longest: 280,
        fixed: &[FixedBits {
            at: 2,
            mask: 0xFE,
            value: 0,
        }],
        messages: Some(Messages {
            number: Number {
                at: 7,
                bytes: 3,
                order: ByteOrder::Little,
            },
            known: messages,
        }),
        checksum: Some(CHECKSUM),
        appendix: Some(Appendix {
            at: 2,
            mask: 1,
            bytes: 13,
        }),
        ..Layout::NONE
    }
}

/// MAVLink 2: `FD`, nine bytes of header, up to 255 of payload, a CRC-16, and 13 bytes of signature if
/// the header says so.
///
/// It holds the messages of a dialect, by rising numbers: [`ARDUPILOTMEGA`](crate::ARDUPILOTMEGA) has all of the
/// dialects `common` and `ardupilotmega`. Frames of other messages are dropped: their CRC, which includes a byte
/// made of the message's definition, cannot be checked. So are those with incompatible flags other than "signed".
/// **Signatures are not verified.**
///
/// For MAVLink 1 on the same line give [`AnyOf`](crate::AnyOf) the layouts [`mavlink1`] and [`mavlink2`].
///
/// The CRC notices every burst of up to 16 wrong bits, and lets one in 65 536 random frames pass. It is computed
/// without a table; with the feature `table` by one of 16 KiB, which is faster on a PC.
///
/// Source: <https://mavlink.io/en/guide/serialization.html>, "MAVLink 2 Packet Format", "Payload
/// Truncation", "Checksum", and <https://mavlink.io/en/guide/message_signing.html>.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Mavlink2, layout::Message};
///
/// /// HEARTBEAT and ATTITUDE of the dialect `common`: the extra byte of the CRC, and the longest payload.
/// const MESSAGES: &[Message] = &[
///     Message::with_extra(0, 50, 9),
///     Message::with_extra(30, 39, 28),
/// ];
/// let receiver = BufferedReceiver::<_, 560>::new(Mavlink2(MESSAGES));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mavlink2<'a>(pub &'a [Message]);

/// MAVLink 1: `FE`, five bytes of header, up to 255 of payload, a CRC-16. It holds messages as [`Mavlink2`] does.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mavlink1<'a>(pub &'a [Message]);

/// What a MAVLink frame says.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct MavlinkMessage<'a> {
    /// Counts the component's frames: a gap shows that some were lost.
    pub sequence: u8,
    /// The sender's system.
    pub system: u8,
    /// The sender's component.
    pub component: u8,
    /// The message: 24 bits, or 8 of MAVLink 1.
    pub id: u32,
    /// Little endian. Senders of MAVLink 2 leave out the zeros at its end.
    pub payload: &'a [u8],
    /// If the frame is signed.
    pub signature: Option<MavlinkSignature<'a>>,
}

/// A frame's signature, not verified. It is right if `value` is the beginning of the SHA-256 of secret key and
/// `signed`, and the timestamp later than the last one of this link, system and component.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct MavlinkSignature<'a> {
    /// The sender's link.
    pub link: u8,
    /// 48 bits: units of 10 µs since the beginning of 2015, UTC.
    pub timestamp: u64,
    /// The signature itself.
    pub value: [u8; 6],
    /// The frame up to `value`.
    pub signed: &'a [u8],
}

impl Format for Mavlink1<'_> {
    crate::judged_by!(mavlink1(&[]), |format| mavlink1(format.0));
    type Message<'a> = MavlinkMessage<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> MavlinkMessage<'a> {
        let Some((&[_, _, sequence, system, component, id], rest)) = frame.split_first_chunk()
        else {
            return MavlinkMessage::default();
        };
        let (payload, _) = rest.split_last_chunk::<2>().unwrap_or((&[], &[0, 0]));
        MavlinkMessage {
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
    crate::judged_by!(mavlink2(&[]), |format| mavlink2(format.0));
    type Message<'a> = MavlinkMessage<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> MavlinkMessage<'a> {
        let length = frame.get(1).map_or(0, |&length| usize::from(length));
        let parts = frame.split_at_checked(length.wrapping_add(10));
        let Some((head, tail)) = parts else {
            return MavlinkMessage::default();
        };
        let Some((&[_, _, _, _, sequence, system, component, a, b, c], payload)) =
            head.split_first_chunk()
        else {
            return MavlinkMessage::default();
        };
        MavlinkMessage {
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
fn signature<'a>(frame: &'a [u8], tail: &[u8]) -> Option<MavlinkSignature<'a>> {
    let [_, _, link, a, b, c, d, e, f, ..] = *tail.first_chunk::<15>()?;
    let (signed, &value) = frame.split_last_chunk()?;
    Some(MavlinkSignature {
        link,
        timestamp: u64::from_le_bytes([a, b, c, d, e, f, 0, 0]),
        value,
        signed,
    })
}

impl Mavlink1<'_> {
    /// Writes the frame that says `message` to the front of `into`, and gives its length; nothing if there
    /// is no such message or payload, or the frame is longer than `into`.
    pub fn encode(&self, message: &MavlinkMessage, into: &mut [u8]) -> Option<usize> {
        let (system, component) = (message.system, message.component);
        let id = u8::try_from(message.id).ok()?;
        let head = [0, 0, message.sequence, system, component, id];
        crate::write(&mavlink1(self.0), into, &[&head, message.payload, &[0, 0]])
    }
}

impl Mavlink2<'_> {
    /// Writes the frame that says `message`, unsigned, to the front of `into`, and gives its length; nothing if
    /// there is no such message or payload, or the frame is longer than `into`.
    pub fn encode(&self, message: &MavlinkMessage, into: &mut [u8]) -> Option<usize> {
        // Zeros at the end are left out, but not the first byte.
        let zeros = message.payload.iter().skip(1).rev();
        let zeros = zeros.take_while(|&&byte| byte == 0).count();
        let payload = message
            .payload
            .get(..message.payload.len().checked_sub(zeros)?)?;
        let (system, component) = (message.system, message.component);
        let [a, b, c, 0] = message.id.to_le_bytes() else {
            return None;
        };
        let head = [0, 0, 0, 0, message.sequence, system, component, a, b, c];
        crate::write(&mavlink2(self.0), into, &[&head, payload, &[0, 0]])
    }
}
