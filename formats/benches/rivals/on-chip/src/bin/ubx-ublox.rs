//! `ublox`.
#![no_std]
#![no_main]

use core::hint::black_box;
use framelock_rivals_on_chip::{Receiver, receiver};
use ublox::proto23::PacketRef;
use ublox::{FixedBuffer, Parser, ParserError, UbxProtocol, UbxUnknownPacketRef};

/// Tells the longest payload, and leaves messages as they are.
struct FramesOnly;

impl UbxProtocol for FramesOnly {
    type PacketRef<'a> = PacketRef<'a>;
    const MAX_PAYLOAD_LEN: u16 = 98;

    fn match_packet(class: u8, msg_id: u8, payload: &[u8]) -> Result<PacketRef<'_>, ParserError> {
        Ok(PacketRef::Unknown(UbxUnknownPacketRef {
            payload,
            class,
            msg_id,
        }))
    }
}

struct Rival(Parser<FixedBuffer<106>, FramesOnly>);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        let bytes = [byte];
        let mut packets = self.0.consume_ubx(&bytes);
        let mut frames = 0;
        while let Some(result) = packets.next() {
            frames += u32::from(black_box(&result).is_ok());
        }
        frames
    }
}

receiver!(Rival(Parser::with_fixed_buffer()));
