//! u-blox's UBX.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{
    Algorithm, ByteOrder, CheckedLayout, Checksum, Layout, Length, LengthField, Number, Patterns,
};

/// The layout of a UBX frame. Its longest frame is the longest that the protocol allows. See [`Ubx`].
pub const LAYOUT: CheckedLayout<'static> = Layout {
    sync: Patterns::one(&[0xB5, 0x62]),
    length: Length::Field(LengthField {
        plus: 8,
        ..LengthField::new(Number::new(4, 2, ByteOrder::Little))
    }),
    longest: 65_543,
    checksum: Some(Checksum {
        algorithm: Algorithm::Fletcher,
        from: 2,
        ..Checksum::at_the_end(2)
    }),
    ..Layout::NONE
}
.checked();

/// u-blox's UBX: `B5 62`, class, id, a 16-bit length in little endian, the payload, and a checksum. The checksum is a
/// Fletcher checksum of two bytes, which covers everything except the sync.
///
/// `LONGEST` is the length in bytes of the longest frame, which is eight more than the length of its payload. Headers
/// that state a longer frame are rejected. Choose `LONGEST` for the messages that you enable: 100 for NAV-PVT, 2 072
/// for RXM-RAWX with 64 measurements. `LONGEST` determines the size of the buffer, and how long a false start can delay
/// the next frame. The protocol allows frames of up to 65 543 bytes.
///
/// The checksum detects each single wrong byte after the length field. One in 65 536 random frames passes undetected.
///
/// Source: u-blox F9 HPG 1.32 Interface Description, UBX-22008968, "UBX frame structure", "UBX checksum".
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::ubx::{Message, Ubx};
/// let mut receiver = BufferedReceiver::<Ubx<100>, [u8; 200]>::new(Ubx);
/// let mut payload = Vec::<u8>::new();
/// for byte in [0xB5, 0x62, 0x05, 0x01, 0x02, 0x00, 0x06, 0x01, 0x0F, 0x38] {
///     match receiver.push(byte).map(|frame| frame.message()) {
///         Some(Message { class: 0x05, id: 0x01, payload: acknowledged }) => payload.extend(acknowledged),
///         _ => {}
///     }
/// }
/// assert_eq!(payload, [0x06, 0x01]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Ubx<const LONGEST: usize>;

/// The contents of a UBX frame.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Message<'a> {
    /// The group of messages, such as 0x01 for NAV.
    pub class: u8,
    /// The message in the group.
    pub id: u8,
    /// The payload. Its numbers are little endian.
    pub payload: &'a [u8],
}

impl<const LONGEST: usize> Ubx<LONGEST> {
    pub(crate) const LAYOUT: CheckedLayout<'static> = Layout {
        longest: LONGEST,
        ..LAYOUT.layout()
    }
    .checked();
}

impl<const LONGEST: usize> Format for Ubx<LONGEST> {
    crate::classify_by!(Self::LAYOUT);
    type Message<'a> = Message<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        match *frame {
            [_, _, class, id, _, _, ref payload @ .., _, _] => Message { class, id, payload },
            _ => Message::default(),
        }
    }
}

impl<const LONGEST: usize> EncodeInto for Ubx<LONGEST> {
    /// Fails for frames of more than `LONGEST` bytes.
    fn encode_into<'b>(
        &self,
        message: Message<'_>,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        let head = [0, 0, message.class, message.id, 0, 0];
        crate::write(&Self::LAYOUT, into, &[&head, message.payload, &[0, 0]])
    }
}
