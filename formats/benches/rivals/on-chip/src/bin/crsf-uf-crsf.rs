//! `uf-crsf`.
#![no_std]
#![no_main]

use core::hint::black_box;
use framelock_rivals_on_chip::{Receiver, receiver};
use uf_crsf::CrsfParser;

struct Rival(CrsfParser);

impl Receiver for Rival {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        let mut bytes = &[byte][..];
        let mut frames = 0;
        while let Some(result) = self.0.next_raw_packet(&mut bytes) {
            frames += u32::from(black_box(&result).is_ok());
        }
        frames
    }
}

receiver!(Rival(CrsfParser::new()));
