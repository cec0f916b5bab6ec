use framelock::{Format, Verdict};

use crate::Headed;
use crate::checksums::fletcher8;

/// u-blox's UBX: `B5 62`, class, id, a length of 16 bits, little endian, payload, and a Fletcher checksum
/// of two bytes of all that but the sync.
///
/// `LONGEST` is the longest frame in bytes, eight more than its payload; a header with a greater length
/// begins no frame. Choose what the messages that you switch on need, 100 for NAV-PVT: it is memory, and how
/// late a frame may come behind a false beginning. The protocol allows 65 543.
///
/// The checksum notices each single wrong byte, and lets one in 65 536 random frames pass.
///
/// Source: u-blox F9 HPG 1.32 Interface Description, UBX-22008968, "UBX frame structure", "UBX checksum".
///
/// # Examples
/// ```
/// use framelock::BufferedReceiver;
/// use framelock_formats::{Ubx, UbxMessage};
/// let mut receiver = BufferedReceiver::<Ubx<100>, 200>::new(Ubx);
/// let mut payload = Vec::<u8>::new();
/// for byte in [0xB5, 0x62, 0x05, 0x01, 0x02, 0x00, 0x06, 0x01, 0x0F, 0x38] {
///     if let Some(UbxMessage { class: 0x05, id: 0x01, payload: acknowledged }) = receiver.push(byte) {
///         payload.extend(acknowledged);
///     }
/// }
/// assert_eq!(payload, [0x06, 0x01]);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct Ubx<const LONGEST: usize>;

/// What a UBX frame says.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
pub struct UbxMessage<'a> {
    /// The group of messages, such as 0x01 for NAV.
    pub class: u8,
    /// The message in the group.
    pub id: u8,
    /// Numbers in it are little endian.
    pub payload: &'a [u8],
}

impl<const LONGEST: usize> Format for Ubx<LONGEST> {
    const LONGEST: usize = LONGEST;
    type Message<'a> = UbxMessage<'a>;

    #[inline]
    fn judge(&self, bytes: &[u8]) -> Verdict {
        let frame = Headed {
            sync: &[0xB5, 0x62],
            header: 6,
            longest: LONGEST,
        };
        frame.judge(
            bytes,
            |header| match *header {
                [.., low, high] => usize::from(u16::from_le_bytes([low, high])).checked_add(8),
                _ => None,
            },
            |frame| match *frame {
                [_, _, ref checked @ .., a, b] => fletcher8([0, 0], checked) == [a, b],
                _ => false,
            },
        )
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> UbxMessage<'a> {
        match *frame {
            [_, _, class, id, _, _, ref payload @ .., _, _] => UbxMessage { class, id, payload },
            _ => UbxMessage::default(),
        }
    }
}

impl UbxMessage<'_> {
    /// Writes the frame that says it to the front of `into`, and gives its length; nothing if it is longer than
    /// the protocol allows or than `into`.
    pub fn encode(&self, into: &mut [u8]) -> Option<usize> {
        let [low, high] = u16::try_from(self.payload.len()).ok()?.to_le_bytes();
        let head = [self.class, self.id, low, high];
        let sums = fletcher8(fletcher8([0, 0], &head), self.payload);
        crate::write(into, &[&[0xB5, 0x62], &head, self.payload, &sums])
    }
}
