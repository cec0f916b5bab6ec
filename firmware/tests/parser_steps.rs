//! A program for the chip, run in the emulator only: single steps of the parsers, for the figures. Every
//! state and kind of byte, each step a call.
#![no_std]
#![no_main]
#![allow(improper_ctypes_definitions)]

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::entry;
use framelock::Receiver;
use framelock::lecture::{Lecture, State};
use framelock::motion::{Bin, Setpoint};
// The vector table.
use nrf52840_hal as _;

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::asm::udf()
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn lecture_step(machine: &mut Lecture, byte: u8) -> Option<Setpoint> {
    machine.push(byte)
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn receiver_step(receiver: &mut Receiver<Bin>, byte: u8) -> Option<Setpoint> {
    receiver.push(byte)
}

/// What any such call costs: the frame that the compiler makes, and the way back.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn no_step(_machine: &mut Lecture, _byte: u8) -> Option<Setpoint> {
    None
}

/// Bytes of every kind that the machines tell apart, and the sync bytes in front of a terminator.
const BYTES: [u8; 4] = [b'A', b'B', b'\r', 0x55];

#[entry]
fn main() -> ! {
    // Through a pointer, or there would be no call.
    let no_step = black_box(no_step as extern "C" fn(&mut Lecture, u8) -> Option<Setpoint>);
    black_box(no_step(&mut Lecture::new(), 0));
    for state in State::ALL {
        for byte in BYTES {
            let temp = Setpoint::default();
            let mut machine = Lecture { state, temp };
            black_box(lecture_step(black_box(&mut machine), black_box(byte)));
        }
    }
    for history in [*b"AB\x01\x02\x03\x04", *b"UUUUUU", *b"AUUUUU"] {
        for count in 0..=6 {
            for byte in BYTES {
                let mut receiver = Receiver::<Bin>::new();
                for &held in history.iter().skip(6 - count) {
                    receiver.push(held);
                }
                black_box(receiver_step(black_box(&mut receiver), black_box(byte)));
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
