//! `parse_rc_ibus` behind the machine of the textbook.
#![no_std]
#![no_main]

use core::hint::black_box;
use framelock_rivals_on_chip::{Receiver, receiver};
use parse_rc_ibus::IbusPacket;

struct Textbook {
    bytes: [u8; 32],
    taken: usize,
}

impl Receiver for Textbook {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        self.bytes[self.taken] = byte;
        self.taken = match (self.taken, byte) {
            (0, 0x20) => 1,
            (1, 0x40) => 2,
            (2.., _) => self.taken + 1,
            _ => 0,
        };
        if self.taken < 32 {
            return 0;
        }
        self.taken = 0;
        u32::from(black_box(&IbusPacket::try_from_bytes(&self.bytes)).is_ok())
    }
}

receiver!(Textbook {
    bytes: [0; 32],
    taken: 0,
});
