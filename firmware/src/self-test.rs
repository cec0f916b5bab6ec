//! The self-test: checks the firmware's assumptions about this chip, and logs the results as a report.
//!
//! It needs one wire, from P1.01 to P1.02: D0 to D1 on the nRF52840-DK. It cannot use the firmware's own pin,
//! P0.08, because the kit's probe may drive that pin.
#![no_std]
#![no_main]
#![allow(dead_code, reason = "shared modules have parts for the firmware only")]
#![allow(clippy::cast_possible_truncation, reason = "words have 32 bits here")]

mod clock;
mod debug_port;
mod loopback;
mod receive;
mod reset;
mod servo;
mod setpoint;
mod settings;
mod telemetry;

use core::hint::black_box;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::{DWT, NVIC, SCB};
use cortex_m_rt::entry;
use framelock::motion::Failsafe;
use nrf52840_hal::clocks::Clocks;
use nrf52840_hal::gpio::{Level, p1};
use nrf52840_hal::pac::uarte0::baudrate::BAUDRATE_A;
use nrf52840_hal::pac::{self, FICR, Interrupt, NVMC, PWM0, TIMER0};

use crate::loopback::{BYTE, Receiver, Sender, pause, wait};
use crate::setpoint::Published;
use crate::settings::{BAUD, BYTE_TIME, FAILSAFE, Line, PULSE_PERIOD, Parser, TICK};
use crate::telemetry::COUNTERS;

/// Number of frames in one transmission.
const FRAMES: usize = 80;

/// The number of measurements in rows 3, 4, 5, 14, 15 and 18.
const TIMES: u32 = 16;

/// The limit on the parser's cycles per byte: half of a byte's duration at 1 Mbaud.
const MOST_CYCLES: u32 = 320;

/// The state of the test. 0: running. 1: finished. 2: the wire is missing.
#[unsafe(no_mangle)]
static FINISHED: AtomicU32 = AtomicU32::new(0);

/// How long frames are sent, in milliseconds. The default sends about 10^6 bytes at 115 200 baud, or 10^7 bytes at 1
/// Mbaud. A debugger may set a shorter time.
#[unsafe(no_mangle)]
static MILLISECONDS: AtomicU32 = AtomicU32::new(100_000);

/// The largest number of units by which an output may move from one poll to the next. A debugger may set a smaller
/// bound, to see row 17 of the report fail.
#[unsafe(no_mangle)]
static BOUND: AtomicU32 = AtomicU32::new(FAILSAFE.most_per_poll());

/// Logs a row of numbers with "fine" or "NOT FINE".
macro_rules! answer {
    ($text:literal, [$($number:expr),+], $is_fine:expr) => {
        let verdict = if $is_fine { "fine" } else { "NOT FINE" };
        defmt::info!($text, $($number,)+ verdict);
    };
}

#[entry]
fn main() -> ! {
    static mut LINE: Line = receive::NOTHING_YET;
    static mut SENT: [u8; 7 * FRAMES] = [0; 7 * FRAMES];
    static mut WIDTHS: [[u16; 4]; 2] = [[0; 4]; 2];

    let (Some(chip), Some(mut core)) = (pac::Peripherals::take(), pac::CorePeripherals::take())
    else {
        SCB::sys_reset()
    };
    debug_port::keep_open(&chip.FICR, &chip.UICR, &chip.NVMC);
    // Wake without delay, as the firmware does.
    chip.POWER
        .tasks_constlat
        .write(|w| w.tasks_constlat().set_bit());
    // If this program was flashed over the firmware, the firmware's watchdog still runs. Wait here until the watchdog
    // resets the chip. Otherwise the watchdog would reset the chip during a later test.
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
    let receiver = Receiver::new(&chip.UARTE0, &pin);

    begin_report(&chip.FICR);
    cache(&chip.NVMC, SENT);
    period(chip.PWM0, WIDTHS);
    if is_wired(&receiver, &sender, SENT) {
        waiting_bytes(&receiver, &sender, SENT);
        bad_stop_bits(&receiver, &sender, SENT);
        late_end(&receiver, &sender, SENT);
        overruns(&receiver, &sender, SENT);
        // The frame's third byte, which is 0.
        let zero = SENT.split_at(2).1.split_at(1).0;
        long_break(&receiver, &sender, zero);
        clearing(&receiver, &sender, zero);
        second_start(&receiver, &sender, SENT);
        stopping(&receiver, &sender, SENT);
        flushing(&receiver, &sender, SENT);
        // The remaining test uses the firmware's reception.
        receiver.switch_off();
        chip.UARTE0.events_endrx.reset();
        receive::start(chip.UARTE0, chip.TIMER2, &pin, LINE);
        for interrupt in [Interrupt::UARTE0_UART0, Interrupt::TIMER2] {
            // SAFETY: no critical section relies on the mask, and all state that the handlers use is initialised.
            unsafe { NVIC::unmask(interrupt) };
        }
        loopback(&sender, SENT, chip.TIMER0);
        telemetry::log_counters();
        defmt::info!("--- end ---");
        FINISHED.store(1, Ordering::Relaxed);
    } else {
        FINISHED.store(2, Ordering::Relaxed);
        defmt::error!("nothing was received: is P1.01 wired to P1.02?");
    }
    loop {
        cortex_m::asm::wfi();
    }
}

/// Logs the first lines of the report: the program's version, and the chip.
fn begin_report(ficr: &FICR) {
    let info = &ficr.info;
    let variant = info.variant.read().bits().to_be_bytes();
    defmt::info!("--- framelock board report ---");
    defmt::info!(
        "image: self-test {=str}, {=u32} baud",
        env!("CARGO_PKG_VERSION"),
        BAUD
    );
    defmt::info!(
        "chip: nRF{=u32:x} {=str}, package {=u32:x}, {=u32} KiB of RAM, {=u32} KiB of flash",
        info.part.read().bits(),
        core::str::from_utf8(&variant).unwrap_or("without a build code"),
        info.package.read().bits(),
        info.ram.read().bits(),
        info.flash.read().bits()
    );
}

/// Returns whether a byte arrives over the wire.
fn is_wired(receiver: &Receiver, sender: &Sender, bytes: &[u8]) -> bool {
    sender.send(bytes.split_at(1).0, || {});
    receiver.ended()
}

/// Row 9: measures the parser's cycles per byte with and without the instruction cache.
fn cache(nvmc: &NVMC, bytes: &[u8]) {
    nvmc.icachecnf.write(|w| w.cacheen().disabled());
    let without = cycles(bytes);
    nvmc.icachecnf.write(|w| w.cacheen().enabled());
    // Only the second run counts, because the first one fills the cache.
    let [_, with] = [0; 2].map(|_| cycles(bytes));
    answer!(
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

/// Row 3: sends bytes while no transfer is open. Then counts the bytes that are stored in order, and measures how long
/// the UARTE takes to store a waiting byte once a transfer is open.
fn waiting_bytes(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    let (mut fewest, mut most, mut slowest) = (u32::MAX, 0, 0);
    for _ in 0..TIMES {
        receiver.switch_on();
        sender.send(bytes.split_at(5).0, || {});
        // The first byte is in memory.
        let mut in_order = u32::from(receiver.ended() && bytes.first() == Some(&Receiver::byte()));
        for byte in bytes.iter().take(5).skip(1) {
            receiver.open();
            if let Some(cycles) = receiver.end() {
                slowest = slowest.max(cycles);
                in_order += u32::from(Receiver::byte() == *byte);
            }
        }
        (fewest, most) = (fewest.min(in_order), most.max(in_order));
    }
    answer!(
        "3 of 5 bytes while no transfer is open | all are stored later, in order, each within 192 cycles | {=u32} to {=u32}, within {=u32} cycles | {=str}",
        [fewest, most, slowest],
        fewest == 5 && most == 5 && slowest <= 192
    );
}

/// Row 4: sends bad stop bits, each followed by a good byte. Reads ERRORSRC when the good byte is in memory.
fn bad_stop_bits(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    let (mut said, mut stored) = (0, 0);
    receiver.switch_on();
    for _ in 0..TIMES {
        // The byte is 'A', which has two ones, so its parity bit is 0. The receiver takes this bit for the stop bit.
        sender.send_with_parity(bytes.split_at(1).0);
        if receiver.ended() {
            stored += 1;
            receiver.open();
        }
        sender.send(bytes.split_at(1).0, || {});
        if receiver.ended() {
            said += u32::from(receiver.causes() != 0);
            receiver.open();
        }
    }
    answer!(
        "4 of 16 bad stop bits | ERRORSRC shows each when the next byte is stored; no bad byte is stored | {=u32} shown, {=u32} stored | {=str}",
        [said, stored],
        said == TIMES && stored == 0
    );
}

/// Row 18: measures the time from a byte in memory to its ENDRX.
fn late_end(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    let mut slowest = 0;
    receiver.switch_on();
    for _ in 0..TIMES {
        let measure = || slowest = slowest.max(receiver.end_after_byte().unwrap_or(u32::MAX));
        sender.send(bytes.split_at(1).0, measure);
        receiver.open();
    }
    answer!(
        "18 cycles from a byte in memory to its ENDRX | at most 192 | {=u32} | {=str}",
        [slowest],
        slowest <= 192
    );
}

/// Rows 5 and 19: sends more bytes than the FIFO can hold. Then sends one byte more than the FIFO can hold, and
/// measures when the overrun comes.
fn overruns(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    let (mut said, mut waited, mut oldest_is_lost) = (0, 0, 0);
    for _ in 0..TIMES {
        receiver.switch_on();
        sender.send(bytes.split_at(12).0, || {});
        said += receiver.causes() & 1;
        receiver.ended();
        waited = 0;
        receiver.open();
        pause(BYTE / 2);
        // The first byte was stored before, so the oldest byte in the FIFO is the second one, 'B'.
        oldest_is_lost += u32::from(Receiver::byte() != b'B');
        while receiver.ended() && waited < 12 {
            waited += 1;
            receiver.open();
            pause(BYTE / 2);
        }
    }
    answer!(
        "5 of 16 overruns | ERRORSRC shows each; at least 5 bytes wait; any byte may be lost | {=u32} shown, {=u32} wait, the oldest lost {=u32} times | {=str}",
        [said, waited, oldest_is_lost],
        said == TIMES && waited >= 5
    );
    receiver.switch_on();
    // One byte goes to memory, `waited` bytes fill the FIFO, and one byte finds no room.
    let (mut error, count) = (None, 2 + waited as usize);
    let end = sender.send(bytes.split_at(count).0, || error = receiver.error());
    let before = error.map_or(u32::MAX, |error| end.wrapping_sub(error));
    answer!(
        "19 cycles from an overrun to the end of the byte that finds no room | at most 700: about 640 at its start bit, 32 at its stop bit | {=u32} | {=str}",
        [before],
        before <= 700
    );
}

/// Row 6: sends a break of 7.5 ms, which is a byte 0 at 1200 baud, and counts how often ERROR comes.
fn long_break(receiver: &Receiver, sender: &Sender, zero: &[u8]) {
    receiver.switch_on();
    let mut errors = 0;
    sender.set_baud(BAUDRATE_A::BAUD1200);
    sender.send(zero, || errors = receiver.errors_in(7 * 64_000));
    sender.set_baud(BAUDRATE_A::BAUD1M);
    let causes = receiver.causes();
    answer!(
        "6 ERROR in a break of 7.5 ms | 1 or 2; framing and break | {=u32}; ERRORSRC {=u32} | {=str}",
        [errors, causes],
        (1..=2).contains(&errors) && causes & 8 != 0
    );
}

/// Row 13: finds out which writes clear ERRORSRC. A break sets causes 4 and 8, which are framing and break.
fn clearing(receiver: &Receiver, sender: &Sender, zero: &[u8]) {
    receiver.switch_on();
    sender.set_baud(BAUDRATE_A::BAUD1200);
    sender.send(zero, || {});
    sender.set_baud(BAUDRATE_A::BAUD1M);
    let [after_0, after_4, after_all] = [0, 4, 15].map(|causes| receiver.clear(causes));
    answer!(
        "13 ERRORSRC, which is 12, after writes of 0, 4 and 15 | 12, 8, 0; or 0, 0, 0 | {=u32}, {=u32}, {=u32} | {=str}",
        [after_0, after_4, after_all],
        after_all == 0
    );
}

/// Row 14: gives a second STARTRX while a transfer is open, then sends two bytes.
fn second_start(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    let (mut ended_at_once, mut stored) = (0, 0);
    for _ in 0..TIMES {
        receiver.switch_on();
        receiver.open();
        pause(BYTE);
        ended_at_once += u32::from(receiver.ended());
        sender.send(bytes.split_at(2).0, || {});
        for byte in bytes.iter().take(2) {
            stored += u32::from(receiver.ended() && Receiver::byte() == *byte);
            receiver.open();
            pause(BYTE / 2);
        }
    }
    answer!(
        "14 of 16 second STARTRX, and 32 bytes | none ends the transfer; all are stored | {=u32} end it, {=u32} stored | {=str}",
        [ended_at_once, stored],
        ended_at_once == 0 && stored == 2 * TIMES
    );
}

/// Row 15: measures the time from STOPRX to RXTO, also with a parity bit, and counts how often RXTO comes without
/// STOPRX.
fn stopping(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    let (mut when_open, mut when_ended, mut without) = (0, 0, 0);
    let (usual, mut is_usual) = (4 * BYTE..=6 * BYTE, true);
    let mut measure = |slowest: &mut u32| {
        let cycles = receiver.switch_on().unwrap_or(u32::MAX);
        *slowest = cycles.max(*slowest);
        is_usual &= usual.contains(&cycles);
    };
    receiver.switch_on();
    for _ in 0..TIMES {
        measure(&mut when_open);
        receiver.timed_out();
        sender.send(bytes.split_at(1).0, || {});
        without += u32::from(receiver.timed_out());
        measure(&mut when_ended);
    }
    receiver.expect_parity(true);
    let with_parity = receiver.switch_off().unwrap_or(u32::MAX);
    receiver.expect_parity(false);
    answer!(
        "15 cycles from STOPRX to RXTO | 2560 to 3840, with a transfer open or ended; any with a parity bit; RXTO may also come with any of 16 ENDRX | {=u32} open, {=u32} ended, {=u32} with parity, {=u32} with ENDRX | {=str}",
        [when_open, when_ended, with_parity, without],
        is_usual
    );
}

/// Row 20: stops the receiver while three bytes wait, and flushes the FIFO.
fn flushing(receiver: &Receiver, sender: &Sender, bytes: &[u8]) {
    receiver.switch_on();
    sender.send(bytes.split_at(4).0, || {});
    receiver.stop();
    receiver.ended();
    let (mut stored, mut started) = (0, 0);
    for byte in bytes.iter().take(4).skip(1) {
        started += u32::from(receiver.flush());
        stored += u32::from(Receiver::byte() == *byte);
    }
    answer!(
        "20 of 3 FLUSHRX, which the firmware does not use | any | {=u32} store a byte, {=u32} with RXSTARTED | {=str}",
        [stored, started],
        true
    );
}

/// Row 10: finds out whether SEQSTART in the middle of a PWM period immediately begins a new period. The firmware works
/// in both cases.
fn period(pwm: PWM0, widths: &'static mut [[u16; 4]; 2]) {
    let (now, middle) = (0, u32::from(PULSE_PERIOD) * 64 / 2);
    let mut servos = servo::Servos::start(pwm, [], widths, (now, [0; 3].into()));
    pause(middle);
    servos.hand_over([255; 3].into());
    let started = wait(4 * middle, || servos.period_has_ended()).unwrap_or_default() / 64;
    let at_once = started > u32::from(PULSE_PERIOD) * 3 / 4;
    answer!(
        "10 from SEQSTART in the middle of a period of 20000 us to the period's end | 10000 us; or 20000, if it begins a new one | {=u32} us, {=u32} | {=str}",
        [started, u32::from(at_once)],
        started > 0
    );
    servo::stop();
}

/// The firmware's main loop without its pins: polls a failsafe once a tick, and measures its outputs.
struct MainLoop {
    timer: TIMER0,
    failsafe: Failsafe<u8, 3>,
    seen: Published,
    polled_at: u32,
    output: [u8; 3],
    /// The largest number of units by which an axis moved from one poll to the next.
    largest_step: u32,
    /// The lowest and the highest output.
    range: [u8; 2],
    /// The longest pass of this loop, in cycles, including the handlers that interrupted it, but without the poll.
    longest_handler: u32,
}

impl MainLoop {
    fn start(timer: TIMER0) -> Self {
        clock::count_microseconds(&timer);
        let Ok(failsafe) = Failsafe::new(FAILSAFE, 0) else {
            SCB::sys_reset() // This never happens: the settings check `FAILSAFE` at compile time.
        };
        Self {
            timer,
            failsafe,
            seen: Published::now(),
            polled_at: 0,
            output: FAILSAFE.park,
            largest_step: 0,
            range: [u8::MAX, 0],
            longest_handler: 0,
        }
    }

    fn now(&self) -> u32 {
        clock::microseconds(&self.timer)
    }

    /// Runs for this time, in microseconds.
    fn run_for(&mut self, time: u32) {
        let began = self.now();
        let mut last_pass = DWT::cycle_count();
        loop {
            let now = self.now();
            let pass = DWT::cycle_count();
            self.longest_handler = self.longest_handler.max(pass.wrapping_sub(last_pass));
            last_pass = pass;
            if now.wrapping_sub(self.polled_at) >= TICK {
                self.polled_at = now;
                self.poll(now);
                last_pass = DWT::cycle_count();
            }
            if now.wrapping_sub(began) >= time {
                break;
            }
        }
    }

    fn poll(&mut self, now: u32) {
        let published = Published::now();
        if published != self.seen {
            self.seen = published;
            self.failsafe.frame(published.setpoint());
        }
        let output = self.failsafe.poll(now).axes;
        receive::tick();
        for (last, new) in self.output.into_iter().zip(output) {
            self.largest_step = self.largest_step.max(last.abs_diff(new).into());
            let [lowest, highest] = self.range;
            self.range = [lowest.min(new), highest.max(new)];
        }
        self.output = output;
    }
}

/// Rows 2, 16 and 17: sends frames to the firmware's own reception, at the firmware's baud rate. Every frame must be
/// delivered. The pitch jumps from one end to the other. The failsafe's outputs must not jump.
fn loopback(sender: &Sender, bytes: &mut [u8], timer: TIMER0) {
    let byte_count = BAUD / 10_000 * MILLISECONDS.load(Ordering::Relaxed);
    let rounds = byte_count / bytes.len() as u32;
    defmt::info!("sending: {=u32} bytes", byte_count);
    sender.set_baud(settings::baud_register());
    let mut main_loop = MainLoop::start(timer);
    for _ in 0..rounds {
        // The pitch stays at each end for 2^18 us. The failsafe needs 200 ms for the full travel.
        let is_low = main_loop.now() & (1 << 18) == 0;
        for pitch in bytes.iter_mut().skip(2).step_by(7) {
            *pitch = if is_low { 0 } else { 255 };
        }
        let time = bytes.len() as u32 * BYTE_TIME;
        sender.send(bytes, || main_loop.run_for(time));
    }
    main_loop.run_for(10_000);
    let sent = rounds * FRAMES as u32;
    let commits = COUNTERS.frames.get();
    let overruns = COUNTERS.overrun.get();
    answer!(
        "2 frames sent | all committed, no overrun | {=u32} sent, {=u32} committed, {=u32} overruns | {=str}",
        [sent, commits, overruns],
        commits == sent && overruns == 0
    );
    let longest = main_loop.longest_handler;
    answer!(
        "16 cycles of the worst handler | at most 3200, because five bytes can wait | {=u32} | {=str}",
        [longest],
        longest <= 5 * BYTE
    );
    let step = main_loop.largest_step;
    let bound = BOUND.load(Ordering::Relaxed);
    let [lowest, highest] = main_loop.range.map(u32::from);
    answer!(
        "17 units that an output moves between two polls | at most {=u32} | {=u32}, between {=u32} and {=u32} | {=str}",
        [bound, step, lowest, highest],
        step <= bound && lowest < highest
    );
}
