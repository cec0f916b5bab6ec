//! `uf-sbus`.
#![no_std]
#![no_main]

use core::hint::black_box;
use framelock_rivals_on_chip::{Receiver, receiver};
use uf_sbus::SbusParser;

struct Rival(SbusParser);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        match self.0.push_byte(byte) {
            Some(Ok(packet)) => {
                black_box(&packet);
                1
            }
            _ => 0,
        }
    }
}

receiver!(Rival(SbusParser::new()));
