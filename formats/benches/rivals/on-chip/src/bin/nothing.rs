//! A receiver that does nothing: what the others are compared with.
#![no_std]
#![no_main]

use core::hint::black_box;

use framelock_rivals_on_chip::{Receiver, receiver};

struct Nothing;

impl Receiver for Nothing {
    #[inline(never)]
    fn take(&mut self, byte: u8) -> u32 {
        black_box(byte);
        0
    }
}

receiver!(Nothing);
