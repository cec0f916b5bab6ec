//! `sbus-rs`.
#![no_std]
#![no_main]

use core::hint::black_box;
use framelock_rivals_on_chip::{Receiver, receiver};
use sbus_rs::StreamingParser;

struct Rival(StreamingParser);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        match self.0.push_byte(byte) {
            Ok(Some(packet)) => {
                black_box(&packet);
                1
            }
            _ => 0,
        }
    }
}

receiver!(Rival(StreamingParser::new()));
