//! The rival for iBUS. A textbook state machine finds the thirty-two bytes of a frame, and `parse_rc_ibus` checks and
//! decodes the frame.

use framelock::EncodeInto;
use framelock_formats::ibus::Ibus;
use parse_rc_ibus::IbusPacket;

use crate::contender::{Contender, Entry};
use crate::streams::{Payload, Protocol};

pub(crate) const PROTOCOL: Protocol = Protocol {
    name: "iBUS",
    sync_dense: &[0x20, 0x40],
    length_at: 1,
    longest: 32,
    frame,
    key: |frame| frame[2..30].to_vec(),
};

fn frame(payload: &mut Payload) -> Vec<u8> {
    let mut frame = [&[0x20, 0x40][..], &payload.bytes(28)].concat();
    // The upper bits of the last two numbers belong to no channel.
    for place in [27, 29] {
        frame[place] &= 0x0F;
    }
    let sum = frame
        .iter()
        .fold(0xFFFF_u16, |sum, &byte| sum - u16::from(byte));
    frame.extend(sum.to_le_bytes());
    frame
}

pub(crate) fn contenders() -> Vec<Entry> {
    vec![
        Entry::ours::<64, _>("framelock", Ibus, |channels| {
            let frame = Ibus.encode_into(channels, &mut [0; 32]).map(<[u8]>::to_vec);
            frame.expect("it fits")[2..30].to_vec()
        }),
        Entry::rival("parse_rc_ibus", Textbook::default, |packet| {
            key(packet.get_all_channels())
        }),
    ]
}

fn key(channels: [u16; 14]) -> Vec<u8> {
    channels.into_iter().flat_map(u16::to_le_bytes).collect()
}

/// The textbook state machine. Waits for the bytes 0x20 and 0x40, takes thirty more bytes, and starts again, whether
/// the frame is valid or not.
#[derive(Default)]
struct Textbook {
    bytes: [u8; 32],
    taken: usize,
}

impl Contender for Textbook {
    type Message<'a> = IbusPacket;

    fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(IbusPacket)) {
        for &byte in bytes {
            self.bytes[self.taken] = byte;
            self.taken = match (self.taken, byte) {
                (0, 0x20) => 1,
                (1, 0x40) => 2,
                (2.., _) => self.taken + 1,
                _ => 0,
            };
            if self.taken == 32 {
                self.taken = 0;
                if let Ok(packet) = IbusPacket::try_from_bytes(&self.bytes) {
                    found(packet);
                }
            }
        }
    }
}
