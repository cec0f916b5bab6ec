//! A program for the chip, which runs only in the emulator. It calls single steps of the parsers, so that `figures.rs`
//! can measure their cycles. It calls the lecture's machine in every state and the receiver in many states, with every
//! kind of byte.
#![no_std]
#![no_main]
#![allow(improper_ctypes_definitions)]

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::entry;
use framelock::Receiver;
use framelock::lecture::{Lecture, State};
use framelock::motion::{Bin, Setpoint};
// This crate provides the vector table.
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

/// Does nothing, so its cycles are the cost of a call: the stack frame that the compiler creates, and the return.
#[unsafe(no_mangle)]
#[inline(never)]
extern "C" fn no_step(_machine: &mut Lecture, _byte: u8) -> Option<Setpoint> {
    None
}

/// One byte of every kind that the machines distinguish: both sync bytes, the terminator, any other.
const BYTES: [u8; 4] = [b'A', b'B', b'\r', 0x55];

#[entry]
fn main() -> ! {
    // Call through a pointer, because the compiler would remove a direct call.
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
