use framelock::Format;

use crate::layout::{
    Algorithm, ByteOrder, Checksum, Crc, FixedBits, Layout, Length, LengthField, Number, Patterns,
    Written,
};

/// What an RTCM 3 frame looks like: see [`Rtcm`].
pub const RTCM: Layout<'static> = Layout {
    sync: Patterns::one(&[0xD3]),
    length: Length::Field(LengthField {
        number: Number {
            at: 1,
            bytes: 2,
            order: ByteOrder::Big,
        },
        mask: 0x03FF,
        plus: 6,
        ..LengthField::byte(1)
    }),
    shortest: 6,
    longest: 1029,
    fixed: &[FixedBits {
        at: 1,
        mask: 0xFC,
        value: 0,
    }],
    checksum: Some(Checksum {
        algorithm: Algorithm::Crc(Crc {
            width: 24,
            polynomial: 0x86_4CFB,
            ..Crc::ZERO
        }),
        written: Written::Big,
        ..Checksum::at_the_end(3)
    }),
    ..Layout::NONE
};

/// RTCM 3, corrections for satellite receivers: `D3`, six zero bits, a length of ten bits, up to 1 023 bytes of
/// payload, a CRC of 24 bits.
///
/// The CRC notices every burst of up to 24 wrong bits, and lets one in 16 777 216 random frames pass.
///
/// Source: the standard is sold; SNIP, "RTCM 3 message list", and RTKLIB's rtcm.c agree on the frame.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Rtcm, RtcmMessage};
/// let mut receiver = BufferedReceiver::<_, 2058>::new(Rtcm);
/// let mut frame = [0; 32];
/// let length = Rtcm::encode(&[0x43, 0x50, 0x00], &mut frame).expect("it is short");
/// let mut number = None;
/// for byte in &frame[..length] {
///     number = receiver.push(*byte).map_or(number, |message| message.number());
/// }
/// assert_eq!(number, Some(1077));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Rtcm;

/// What an RTCM 3 frame says.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct RtcmMessage<'a> {
    /// 0 to 1 023 bytes. Its fields are of any number of bits, the highest first.
    pub payload: &'a [u8],
}

impl RtcmMessage<'_> {
    /// The message's number, its first twelve bits, if it has any.
    #[must_use]
    pub fn number(&self) -> Option<u16> {
        let bytes = self.payload.first_chunk()?;
        Some(u16::from_be_bytes(*bytes) >> 4)
    }
}

impl Format for Rtcm {
    crate::judged_by!(RTCM);
    type Message<'a> = RtcmMessage<'a>;

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> RtcmMessage<'a> {
        match frame {
            [_, _, _, payload @ .., _, _, _] => RtcmMessage { payload },
            _ => RtcmMessage::default(),
        }
    }
}

impl Rtcm {
    /// Writes the frame with this payload to the front of `into`, and gives its length; nothing if the payload is
    /// longer than 1 023 bytes or the frame than `into`.
    pub fn encode(payload: &[u8], into: &mut [u8]) -> Option<usize> {
        crate::write(&RTCM, into, &[&[0, 0, 0], payload, &[0, 0, 0]])
    }
}
