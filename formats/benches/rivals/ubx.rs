//! The rival for UBX: `ublox`.

use framelock_formats::ubx::Ubx;
use ublox::proto23::PacketRef;
use ublox::{FixedBuffer, Parser, ParserError, UbxPacket, UbxProtocol, UbxUnknownPacketRef};

use crate::contender::{Contender, Entry};
use crate::streams::{Payload, Protocol};

/// The length of the longest payload in the streams, which is that of NAV-PVT.
const MOST: usize = 92;
/// The length of the longest frame that the receivers accept. Its payload has 0x62 bytes, and 0x62 is also a sync
/// byte. So the length byte of one false start can be a sync byte of another false start, and false starts are as dense
/// as possible.
pub(crate) const LONGEST: usize = 0x62 + 8;

pub(crate) const PROTOCOL: Protocol = Protocol {
    name: "UBX",
    sync_dense: &[0xB5, 0x62, 0xB5, 0x62, 1, 7, 28, 0, 0],
    length_at: 4,
    longest: LONGEST,
    frame,
    key: |frame| [&frame[2..4], &frame[6..frame.len() - 2]].concat(),
};

/// Makes a frame with the length of a NAV message (PVT, SOL, POSLLH, STATUS, CLOCK, VELNED) or of an acknowledgement.
fn frame(payload: &mut Payload) -> Vec<u8> {
    let (id, length) = payload.one_of(&[
        (0x07_u8, MOST),
        (0x06, 52),
        (0x02, 28),
        (0x03, 16),
        (0x22, 20),
        (0x12, 36),
        (0x01, 2),
    ]);
    let low = u8::try_from(length).expect("at most 92");
    let mut frame = vec![0xB5, 0x62, 0x01, id, low, 0];
    frame.extend(payload.bytes(length));
    let (mut a, mut b) = (0_u8, 0_u8);
    for byte in &frame[2..] {
        a = a.wrapping_add(*byte);
        b = b.wrapping_add(a);
    }
    frame.extend([a, b]);
    frame
}

pub(crate) fn contenders() -> Vec<Entry> {
    vec![
        Entry::ours::<{ 2 * LONGEST }, _>("framelock", Ubx::<LONGEST>, |message| {
            [&[message.class, message.id], message.payload].concat()
        }),
        Entry::rival("ublox", Ublox::default, |packet| match packet {
            UbxPacket::Proto23(PacketRef::Unknown(packet)) => {
                [&[packet.class, packet.msg_id], packet.payload].concat()
            }
            UbxPacket::Proto23(_) => Vec::new(),
        }),
    ]
}

/// A protocol version for `ublox` that states the longest payload and does not decode messages. With the crate's own
/// protocol versions, the crate would also decode messages, and would wait for the end of false frames of over a
/// thousand bytes.
struct FramesOnly;

impl UbxProtocol for FramesOnly {
    type PacketRef<'a> = PacketRef<'a>;
    const MAX_PAYLOAD_LEN: u16 = 0x62;

    fn match_packet(class: u8, msg_id: u8, payload: &[u8]) -> Result<PacketRef<'_>, ParserError> {
        Ok(PacketRef::Unknown(UbxUnknownPacketRef {
            payload,
            class,
            msg_id,
        }))
    }
}

/// `ublox`.
struct Ublox(Parser<FixedBuffer<LONGEST>, FramesOnly>);

impl Default for Ublox {
    fn default() -> Self {
        Self(Parser::with_fixed_buffer())
    }
}

impl Contender for Ublox {
    type Message<'a> = UbxPacket<'a>;

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(UbxPacket<'_>)) {
        let mut packets = self.0.consume_ubx(bytes);
        while let Some(result) = packets.next() {
            if let Ok(packet) = result {
                found(packet);
            }
        }
    }
}
