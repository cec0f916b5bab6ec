//! The self-test: asks this chip what the firmware assumes of it, and logs the answers as a table.
//!
//! It needs one wire, from P1.01 to P1.02: D0 to D1 on the nRF52840-DK. The firmware's own pin, P0.08,
//! will not do, since the kit's probe may drive it.
#![no_std]
#![no_main]
#![allow(dead_code, reason = "shared modules have parts for the firmware only")]
#![allow(clippy::cast_possible_truncation, reason = "words have 32 bits here")]

mod debug_port;
mod line_timers;
mod loopback;
mod panic;
mod receive;
mod receive_buffer;
mod servo;
mod setpoint;
mod settings;
mod telemetry;

use core::hint::black_box;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::{DWT, NVIC, SCB};
use cortex_m_rt::entry;
use nrf52840_hal::clocks::Clocks;
use nrf52840_hal::gpio::{Level, p1};
use nrf52840_hal::pac::{self, Interrupt, NVMC};

use crate::line_timers::LineTimers;
use crate::loopback::{Receiver, Sender, pause};
use crate::settings::{BAUD, HALF, Parser};
use crate::telemetry::COUNTERS;

/// Frames that are sent at once.
const FRAMES: usize = 80;

/// How often each of the smaller questions is asked.
const TIMES: u32 = 16;

/// Most cycles that the parser may take for a byte: half of what 1 Mbaud leaves.
const MOST_CYCLES: u32 = 320;

/// The numbers of the table, three in a row: `print ANSWERS` in a debugger.
#[unsafe(no_mangle)]
static ANSWERS: [[AtomicU32; 3]; 6] = [const { [const { AtomicU32::new(0) }; 3] }; 6];

/// 1: all of them are there. 2: there is no wire.
#[unsafe(no_mangle)]
static FINISHED: AtomicU32 = AtomicU32::new(0);

/// How long frames are sent: 10^6 bytes at 115 200 baud, 10^7 at 1 Mbaud. A debugger may set less.
#[unsafe(no_mangle)]
static MILLISECONDS: AtomicU32 = AtomicU32::new(100_000);

/// Notes a row of numbers, and logs them with a verdict.
macro_rules! answer {
    ($row:expr, $text:literal, [$($number:expr),+], $is_fine:expr) => {
        let numbers = [$($number),+];
        for (word, number) in ANSWERS.get($row).into_iter().flatten().zip(numbers) {
            word.store(number, Ordering::Relaxed);
        }
        let verdict = if $is_fine { "fine" } else { "NOT FINE" };
        defmt::info!($text, $($number,)+ verdict);
    };
}

#[entry]
fn main() -> ! {
    static mut LINE: receive::Line = receive::NOTHING_YET;
    static mut SENT: [u8; 7 * FRAMES] = [0; 7 * FRAMES];
    static mut RECEIVED: [u8; HALF as usize] = [0; HALF as usize];

    let (Some(chip), Some(mut core)) = (pac::Peripherals::take(), pac::CorePeripherals::take())
    else {
        SCB::sys_reset()
    };
    debug_port::keep_open(&chip.FICR, &chip.UICR, &chip.NVMC);
    // The firmware's watchdog outlives flashing. Let it bite now, not in the middle.
    while chip.WDT.runstatus.read().bits() != 0 {}
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();
    let _clocks = Clocks::new(chip.CLOCK).enable_ext_hfosc();
    for (frame, number) in SENT.chunks_exact_mut(7).zip(0..) {
        frame.copy_from_slice(&[b'A', b'B', 0, number, !number, 7, b'\r']);
    }
    let pins = p1::Parts::new(chip.P1);
    let pin = pins.p1_01.into_push_pull_output(Level::High).degrade();
    let sender = Sender::new(chip.UARTE1, pin);
    let pin = pins.p1_02.into_pullup_input().degrade();
    let timers = (chip.TIMER1, chip.TIMER2, chip.TIMER3);
    let timers = LineTimers::start(timers, chip.PPI, &chip.UARTE0);
    let mut receiver = Receiver::new(&chip.UARTE0, &pin, RECEIVED);

    defmt::info!("framelock self-test, P1.01 wired to P1.02");
    cache(&chip.NVMC, SENT);
    if is_wired(&mut receiver, &sender, &timers, SENT) {
        order(&mut receiver, &sender, &timers, SENT);
        bad_stop_bits(&mut receiver, &sender, &timers, SENT);
        empty_stops(&mut receiver, &sender, SENT);
        // From here on the firmware's reception.
        chip.UARTE0.enable.reset();
        timers.silent().reset();
        timers.gap().reset();
        receive::start(chip.UARTE0, pin, timers, LINE);
        for interrupt in [Interrupt::UARTE0_UART0, Interrupt::TIMER2] {
            // SAFETY: no critical section relies on it, and all that the handlers need is set up.
            unsafe { NVIC::unmask(interrupt) };
        }
        loopback(&sender, SENT);
        FINISHED.store(1, Ordering::Relaxed);
        defmt::info!("done");
    } else {
        FINISHED.store(2, Ordering::Relaxed);
        defmt::error!("nothing was received: is P1.01 wired to P1.02?");
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// Whether a byte that is sent is counted.
fn is_wired(receiver: &mut Receiver, sender: &Sender, timers: &LineTimers, bytes: &[u8]) -> bool {
    let count = timers.count();
    receiver.start();
    sender.send(bytes.split_at(1).0, || {});
    receiver.stop();
    timers.count() != count
}

/// 9: what the instruction cache gains.
fn cache(nvmc: &NVMC, bytes: &[u8]) {
    nvmc.icachecnf.write(|w| w.cacheen().disabled());
    let without = cycles(bytes);
    nvmc.icachecnf.write(|w| w.cacheen().enabled());
    // The second run finds in the cache what the first brings there.
    let [_, with] = [0; 2].map(|_| cycles(bytes));
    answer!(
        4,
        "9 cycles of the parser for a byte | at most 320 | {=u32} with the cache, {=u32} without | {=str}",
        [with, without],
        with <= MOST_CYCLES
    );
}

#[inline(never)]
fn cycles(bytes: &[u8]) -> u32 {
    let mut parser = Parser::new();
    let began = DWT::cycle_count();
    for byte in bytes {
        black_box(parser.push(*byte));
    }
    DWT::cycle_count().wrapping_sub(began) / bytes.len() as u32
}

/// 3: what is counted when a half is full, in a stream without pauses; and whether RXTO comes unasked.
fn order(receiver: &mut Receiver, sender: &Sender, timers: &LineTimers, bytes: &[u8]) {
    let (mut least, mut most, mut unasked) = (u32::MAX, 0, 0);
    for _ in 0..TIMES {
        let mut begun_at = timers.count();
        receiver.start();
        sender.send(bytes, || {
            for _ in 0..bytes.len() / HALF as usize {
                receiver.end();
                let counted = timers.count_at_end().wrapping_sub(begun_at);
                (least, most) = (counted.min(least), counted.max(most));
                begun_at = begun_at.wrapping_add(HALF);
            }
        });
        unasked += u32::from(receiver.has_timed_out());
        receiver.stop();
    }
    answer!(
        0,
        "3 bytes counted at ENDRX of a half; RXTO unasked | the half's or 1 less; maybe | {=u32} to {=u32}; {=u32} of 16 times | {=str}",
        [least, most, unasked],
        least >= HALF - 1 && most <= HALF
    );
}

/// 4: bad stop bits.
fn bad_stop_bits(receiver: &mut Receiver, sender: &Sender, timers: &LineTimers, bytes: &[u8]) {
    receiver.start();
    let (count, errors) = (timers.count(), timers.errors());
    for _ in 0..TIMES {
        // The frame's 'A' has two ones.
        sender.send_with_parity(bytes.split_at(1).0);
    }
    let errors = timers.errors().wrapping_sub(errors);
    let counted = timers.count().wrapping_sub(count);
    // And a good one, since RXD.AMOUNT may say anything if none is stored.
    sender.send(bytes.split_at(1).0, || {});
    let stored = receiver.stop().wrapping_sub(1);
    receiver.clear_errors();
    answer!(
        1,
        "4 of 16 bytes with a bad stop bit | all errors, none stored, all or none counted | {=u32} errors, {=u32} stored, {=u32} counted | {=str}",
        [errors, stored, counted],
        errors == TIMES && stored == 0 && (counted == 0 || counted == TIMES)
    );
}

/// 5 and 6: STOPRX with nothing received, after a transfer of five bytes, and FLUSHRX behind it.
fn empty_stops(receiver: &mut Receiver, sender: &Sender, bytes: &[u8]) {
    let mut amount = 0;
    for _ in 0..TIMES {
        receiver.start();
        sender.send(bytes.split_at(5).0, || {});
        receiver.stop();
        receiver.start();
        amount = receiver.stop();
    }
    let (stops, timeouts, ends) = (receiver.stops, receiver.timeouts, receiver.flush_ends);
    answer!(
        2,
        "5 RXD.AMOUNT after an empty STOPRX; RXTO | 0 or 5 as before; always | {=u32}; {=u32} of {=u32} times | {=str}",
        [amount, timeouts, stops],
        (amount == 0 || amount == 5) && timeouts == stops
    );
    answer!(
        3,
        "6 ENDRX of an empty FLUSHRX | always or never | {=u32} of {=u32} times, within {=u32} cycles | {=str}",
        [ends, stops, receiver.slowest_flush],
        ends == stops || ends == 0
    );
}

/// 2: every frame is committed, by the firmware's own reception at its own rate.
fn loopback(sender: &Sender, bytes: &[u8]) {
    let byte_count = BAUD / 10_000 * MILLISECONDS.load(Ordering::Relaxed);
    let rounds = byte_count / bytes.len() as u32;
    defmt::info!("2 sending {=u32} bytes at {=u32} baud", byte_count, BAUD);
    sender.set_baud(settings::baud_register());
    for _ in 0..rounds {
        sender.send(bytes, || {
            receive::tick();
        });
    }
    pause(640_000);
    receive::tick();
    let sent = rounds * FRAMES as u32;
    let commits = COUNTERS.frames.get();
    let late = COUNTERS.late.get();
    answer!(
        5,
        "2 frames sent | all committed, never late | {=u32} sent, {=u32} committed, late {=u32} times | {=str}",
        [sent, commits, late],
        commits == sent && late == 0
    );
}
