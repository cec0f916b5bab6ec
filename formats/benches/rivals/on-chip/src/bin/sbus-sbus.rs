//! `sbus`.
#![no_std]
#![no_main]

use core::hint::black_box;
use framelock_rivals_on_chip::{Receiver, receiver};
use sbus::SBusPacketParser;

struct Rival(SBusPacketParser);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        self.0.push_bytes(&[byte]);
        let mut frames = 0;
        while let Some(packet) = self.0.try_parse() {
            black_box(&packet);
            frames += 1;
        }
        frames
    }
}

receiver!(Rival(SBusPacketParser::new()));
