//! Single steps of the parsers, for the figures: every state and byte, each step a call. It is run
//! in the emulator only, which measures from `step_call` to behind it.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m_rt::entry;
use framelock::{Bin, Lecture, Parser, Receiver, Setpoint, State};
// The vector table.
use nrf52840_hal as _;

#[panic_handler]
fn panic(_: &PanicInfo) -> ! {
    cortex_m::asm::udf()
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "Rust" fn lecture_step(machine: &mut Lecture, byte: u8) -> Option<Setpoint> {
    machine.push(byte)
}

#[unsafe(no_mangle)]
#[inline(never)]
extern "Rust" fn receiver_step(receiver: &mut Receiver<Bin>, byte: u8) -> Option<Setpoint> {
    receiver.push(byte)
}

/// What any such call costs: the frame that the compiler makes, and the way back.
#[unsafe(no_mangle)]
#[inline(never)]
extern "Rust" fn no_step(_machine: &mut Lecture, _byte: u8) -> Option<Setpoint> {
    None
}

/// Bytes of every kind that the machines tell apart, and the sync bytes in front of a terminator.
const BYTES: [u8; 4] = [b'A', b'B', b'\r', 0x55];

#[entry]
fn main() -> ! {
    // Through a pointer, or there would be no call.
    let no_step = black_box(no_step as fn(&mut Lecture, u8) -> Option<Setpoint>);
    black_box(no_step(&mut Lecture::new(), 0));
    for state in State::ALL {
        for byte in BYTES {
            let temp = Setpoint::default();
            let mut machine = Lecture { state, temp };
            black_box(lecture_step(black_box(&mut machine), black_box(byte)));
        }
    }
    for history in [0x4142_0102_0304, 0x5555_5555_5555, 0x4155_5555_5555] {
        for count in 0..=6 {
            for byte in BYTES {
                let mut receiver = Receiver::holding(history, count);
                black_box(receiver_step(black_box(&mut receiver), black_box(byte)));
            }
        }
    }
    loop {
        cortex_m::asm::wfi();
    }
}
