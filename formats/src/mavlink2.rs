use framelock::{Format, Verdict};

use crate::Headed;
use crate::checksums::crc16_mcrf4xx;

/// MAVLink 2: `FD`, nine bytes of header, up to 255 of payload, a CRC-16, and 13 bytes of signature if
/// the header says so.
///
/// It holds a function that says what the dialect has for a message id. Frames of other messages are
/// dropped: their CRC, which includes a byte made of the message's definition, cannot be checked. So are those
/// with incompatible flags other than "signed". **Signatures are not verified.**
///
/// The CRC notices every burst of up to 16 wrong bits, and lets one in 65 536 random frames pass.
///
/// Source: <https://mavlink.io/en/guide/serialization.html>, "MAVLink 2 Packet Format", "Payload
/// Truncation", "Checksum", and <https://mavlink.io/en/guide/message_signing.html>.
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Mavlink2, Mavlink2Entry};
///
/// /// HEARTBEAT and ATTITUDE of the dialect `common`.
/// fn dialect(id: u32) -> Option<Mavlink2Entry> {
///     match id {
///         0 => Some(Mavlink2Entry { crc_extra: 50, longest: 9 }),
///         30 => Some(Mavlink2Entry { crc_extra: 39, longest: 28 }),
///         _ => None,
///     }
/// }
/// let receiver = BufferedReceiver::<_, 560>::new(Mavlink2(dialect));
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Mavlink2<Dialect>(pub Dialect);

/// What a dialect says of a message.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Mavlink2Entry {
    /// `CRC_EXTRA`, which the generated libraries have.
    pub crc_extra: u8,
    /// The most bytes its payload has, extensions included; longer ones are dropped with their header.
    pub longest: u8,
}

/// What a MAVLink 2 frame says.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Mavlink2Message<'a> {
    /// Counts the component's frames: a gap shows that some were lost.
    pub sequence: u8,
    /// The sender's system.
    pub system: u8,
    /// The sender's component.
    pub component: u8,
    /// The message, 24 bits.
    pub id: u32,
    /// Little endian. Senders leave out the zeros at its end.
    pub payload: &'a [u8],
    /// If the frame is signed.
    pub signature: Option<Mavlink2Signature<'a>>,
}

/// A frame's signature, not verified. It is right if `value` is the beginning of the SHA-256 of secret key and
/// `signed`, and the timestamp later than the last one of this link, system and component.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub struct Mavlink2Signature<'a> {
    /// The sender's link.
    pub link: u8,
    /// 48 bits: units of 10 µs since the beginning of 2015, UTC.
    pub timestamp: u64,
    /// The signature itself.
    pub value: [u8; 6],
    /// The frame up to `value`.
    pub signed: &'a [u8],
}

impl<Dialect: Fn(u32) -> Option<Mavlink2Entry>> Format for Mavlink2<Dialect> {
    const LONGEST: usize = 280;
    type Message<'a> = Mavlink2Message<'a>;

    #[inline]
    fn judge(&self, bytes: &[u8]) -> Verdict {
        let frame = Headed {
            sync: &[0xFD],
            header: 10,
            longest: Self::LONGEST,
        };
        frame.judge(
            bytes,
            |header| match *header {
                [_, length, incompatible @ 0..=1, ..] if length <= self.entry(header)?.longest => {
                    let around = if incompatible == 1 { 25 } else { 12 };
                    Some(usize::from(length).wrapping_add(around))
                }
                _ => None,
            },
            |frame| match (split(frame), self.entry(frame)) {
                (Some(([_, checked @ ..], [low, high, ..])), Some(entry)) => {
                    let crc = crc16_mcrf4xx(0xFFFF, checked);
                    crc16_mcrf4xx(crc, &[entry.crc_extra]) == u16::from_le_bytes([*low, *high])
                }
                _ => false,
            },
        )
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> Mavlink2Message<'a> {
        match split(frame) {
            Some((
                &[
                    _,
                    _,
                    _,
                    _,
                    sequence,
                    system,
                    component,
                    a,
                    b,
                    c,
                    ref payload @ ..,
                ],
                tail,
            )) => Mavlink2Message {
                sequence,
                system,
                component,
                id: u32::from_le_bytes([a, b, c, 0]),
                payload,
                signature: signature(frame, tail),
            },
            _ => Mavlink2Message::default(),
        }
    }
}

/// Header and payload, CRC and signature.
#[inline]
fn split(frame: &[u8]) -> Option<(&[u8], &[u8])> {
    let length = usize::from(*frame.get(1)?);
    frame.split_at_checked(length.wrapping_add(10))
}

#[inline(never)]
fn signature<'a>(frame: &'a [u8], tail: &[u8]) -> Option<Mavlink2Signature<'a>> {
    let [_, _, link, a, b, c, d, e, f, ..] = *tail.first_chunk::<15>()?;
    let (signed, &value) = frame.split_last_chunk()?;
    Some(Mavlink2Signature {
        link,
        timestamp: u64::from_le_bytes([a, b, c, d, e, f, 0, 0]),
        value,
        signed,
    })
}

impl<Dialect: Fn(u32) -> Option<Mavlink2Entry>> Mavlink2<Dialect> {
    /// What the dialect says of the frame that begins with `header`.
    #[inline]
    fn entry(&self, header: &[u8]) -> Option<Mavlink2Entry> {
        let [_, _, _, _, _, _, _, a, b, c] = *header.first_chunk()?;
        (self.0)(u32::from_le_bytes([a, b, c, 0]))
    }

    /// Writes the frame that says `message`, unsigned, to the front of `into`, and gives its length; nothing if
    /// the dialect has no such message or payload, or the frame is longer than `into`.
    pub fn encode(&self, message: &Mavlink2Message, into: &mut [u8]) -> Option<usize> {
        let entry = (self.0)(message.id)?;
        // Zeros at the end are left out, but not the first byte.
        let zeros = message.payload.iter().skip(1).rev();
        let zeros = zeros.take_while(|&&byte| byte == 0).count();
        let kept = message.payload.len().checked_sub(zeros)?;
        let payload = message.payload.get(..kept)?;
        let length = u8::try_from(payload.len()).ok();
        let length = length.filter(|&length| length <= entry.longest)?;
        let [a, b, c, _] = message.id.to_le_bytes();
        let (system, component) = (message.system, message.component);
        let head = [length, 0, 0, message.sequence, system, component, a, b, c];
        let crc = crc16_mcrf4xx(crc16_mcrf4xx(0xFFFF, &head), payload);
        let crc = crc16_mcrf4xx(crc, &[entry.crc_extra]).to_le_bytes();
        crate::write(into, &[&[0xFD], &head, payload, &crc])
    }
}
