//! RTCM 3, corrections for satellite receivers.

use framelock::{EncodeError, EncodeInto, Format};

use crate::layout::{
    Algorithm, ByteOrder, CheckedLayout, Checksum, Crc, Encoding, FixedBits, Layout, Length,
    LengthField, Number, Patterns,
};

/// The layout of an RTCM 3 frame: see [`Rtcm`].
pub const LAYOUT: CheckedLayout<'static> = Layout {
    sync: Patterns::one(&[0xD3]),
    length: Length::Field(LengthField {
        mask: 0x03FF,
        plus: 6,
        ..LengthField::new(Number::new(1, 2, ByteOrder::Big))
    }),
    longest: 1029,
    fixed: &[FixedBits {
        at: 1,
        mask: 0xFC,
        value: 0,
    }],
    checksum: Some(Checksum {
        algorithm: Algorithm::Crc(Crc::new(24, 0x86_4CFB)),
        encoding: Encoding::Big,
        ..Checksum::at_the_end(3)
    }),
    ..Layout::NONE
}
.checked();

/// RTCM 3, corrections for satellite receivers: `D3`, six zero bits, a length of ten bits, up to 1 023 bytes of
/// payload, a CRC of 24 bits.
///
/// The CRC detects every burst of up to 24 wrong bits. One in 16 777 216 random frames passes undetected.
///
/// Source: SNIP, "RTCM 3 message list", and RTKLIB's rtcm.c agree on the frame. The standard itself is not free.
///
/// # Examples
/// ```
/// use framelock::EncodeInto;
/// use framelock_formats::rtcm::{self, Message, Rtcm};
/// let mut receiver = rtcm::Receiver::new(Rtcm);
/// let mut buffer = [0; 32];
/// let frame = Rtcm.encode_into(Message { payload: &[0x43, 0x50, 0x00] }, &mut buffer)?;
/// let mut number = None;
/// for byte in frame {
///     number = receiver.push(*byte).map_or(number, |frame| frame.message().number());
/// }
/// assert_eq!(number, Some(1077));
/// # Ok::<(), framelock::EncodeError>(())
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Rtcm;

/// A receiver whose buffer is twice as long as the longest frame.
pub type Receiver = framelock::BufferedReceiver<Rtcm, [u8; 2058]>;

/// The contents of an RTCM 3 frame.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Message<'a> {
    /// The payload, 0 to 1 023 bytes. Its fields may have any number of bits, the highest bit of each field first.
    pub payload: &'a [u8],
}

impl Message<'_> {
    /// Returns the message's number: the first twelve bits of the payload, or `None` if the payload is shorter.
    #[must_use]
    pub fn number(&self) -> Option<u16> {
        let bytes = self.payload.first_chunk()?;
        Some(u16::from_be_bytes(*bytes) >> 4)
    }
}

impl Format for Rtcm {
    crate::classify_by!(LAYOUT);
    type Message<'a> = Message<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Message<'a> {
        match frame {
            [_, _, _, payload @ .., _, _, _] => Message { payload },
            _ => Message::default(),
        }
    }
}

impl EncodeInto for Rtcm {
    /// Fails for payloads of more than 1 023 bytes.
    fn encode_into<'b>(
        &self,
        message: Message<'_>,
        into: &'b mut [u8],
    ) -> Result<&'b [u8], EncodeError> {
        crate::write(&LAYOUT, into, &[&[0, 0, 0], message.payload, &[0, 0, 0]])
    }
}
