//! `crsf`.
#![no_std]
#![no_main]

use core::hint::black_box;
use crsf::{Packet, PacketError, PacketParser};
use framelock_rivals_on_chip::{Receiver, receiver};

struct Rival(PacketParser<64>);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        self.0.push_bytes(&[byte]);
        let mut frames = 0;
        while let Some(result) = self.0.next_raw_packet() {
            let Ok(raw) = result else { continue };
            match black_box(&Packet::from_raw(&raw)) {
                Ok(_) | Err(PacketError::UnknownType { .. }) => frames += 1,
                Err(_) => {}
            }
        }
        frames
    }
}

receiver!(Rival(PacketParser::new()));
