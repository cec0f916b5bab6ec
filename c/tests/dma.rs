//! Simulates a UART with a circular DMA, byte by byte, for the programs in C and in Rust. Interrupts may be late.

use std::cell::Cell;
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::ops::Range;
use std::process::Command;
use std::sync::atomic::{AtomicU8, Ordering::Relaxed};

use framelock::{BufferedReceiver, EncodeInto as _};
use framelock_description::hex::glued;
use framelock_formats::crsf::{self, Crsf};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tempfile::TempDir;

use crate::compilers::{GCC, assert_same, beside, succeeds};
use crate::delivery::{PAGE, blocks};
use crate::headers;

/// The program in Rust, which must be right for the same streams as the program in C.
#[allow(
    dead_code,
    clippy::print_stdout,
    reason = "the example's own simulation is not called"
)]
#[path = "../../core/examples/dma.rs"]
mod in_rust;

/// Steps of the simulation: a kind, and a number. `stm32_dma.c` beside this file lists them.
type Steps = Vec<[u8; 2]>;

/// The time of a byte for the program in Rust, in microseconds. With this time, both programs report a pause after the
/// same number of byte times.
const BYTE_TIME: u32 = 120;

/// The time between two calls by the timer, and the shortest reported pause. These and the following constants are
/// numbers of byte times.
const TICK: usize = 42;
const PAUSE: usize = 42;

/// The greatest delay of an interrupt.
const LATEST: usize = 20;

/// The longest time for which another interrupt delays a call that has begun.
const PREEMPTION: usize = 8;

/// A pause that is reported however late the interrupts are.
const LONG: usize = 200;

/// At least the length of a frame with channels, which is 26 or 27.
const WHOLE: usize = 27;

/// A UART and a DMA that continue after an error.
struct Simulated<'a> {
    /// The steps that have not happened.
    steps: Cell<&'a [[u8; 2]]>,
    /// The number of steps that happen during the next call, and the number of accesses to the hardware before them.
    preempting: Cell<(u8, u8)>,
    buffer: [AtomicU8; in_rust::SIZE],
    position: Cell<usize>,
    now: Cell<u32>,
    has_error: Cell<bool>,
}

impl Simulated<'_> {
    fn next(&self) -> Option<[u8; 2]> {
        let (step, rest) = self.steps.get().split_first()?;
        self.steps.set(rest);
        Some(*step)
    }

    /// Takes the steps that happen after this access to the hardware.
    fn preempt(&self) {
        let (steps, accesses) = self.preempting.get();
        if accesses > 1 {
            return self.preempting.set((steps, accesses - 1));
        }
        for _ in 0..self.preempting.take().0 {
            self.pass(self.next().unwrap());
        }
    }

    /// Takes a step in which time passes.
    fn pass(&self, [kind, number]: [u8; 2]) {
        let mut count = u32::from(number);
        if kind != b's' {
            let position = self.position.get();
            self.buffer[position].store(number, Relaxed);
            self.position.set((position + 1) % in_rust::SIZE);
            self.has_error.set(self.has_error.get() || kind == b'c');
            count = 1;
        }
        let now = self.now.get();
        self.now.set(now.wrapping_add(count * BYTE_TIME));
    }
}

impl in_rust::Serial for Simulated<'_> {
    fn now(&self) -> u32 {
        let now = self.now.get();
        self.preempt();
        now
    }

    fn position(&self) -> usize {
        let position = self.position.get();
        self.preempt();
        position
    }

    fn has_error(&self) -> bool {
        self.has_error.get()
    }

    fn restart(&self) -> bool {
        self.has_error.set(false);
        false
    }
}

/// Returns the output of the program in Rust.
fn run_in_rust(steps: &[[u8; 2]]) -> String {
    let serial = Simulated {
        steps: Cell::new(steps),
        preempting: Cell::default(),
        buffer: [const { AtomicU8::new(0) }; in_rust::SIZE],
        position: Cell::new(0),
        now: Cell::new(u32::MAX - 999),
        has_error: Cell::new(false),
    };
    let new = || {
        let receiver = BufferedReceiver::<Crsf, [u8; 128]>::new(Crsf);
        in_rust::Reception::new(receiver, serial.now.get())
    };
    let mut reception = new();
    let mut text = String::new();
    while let Some([kind, number]) = serial.next() {
        let before = *reception.line.counters();
        match kind {
            b'n' => {
                serial.position.set(0);
                serial.has_error.set(false);
                reception = new();
                text.push_str("start\n");
                continue;
            }
            b'p' => serial.preempting.set((number / 4, number % 4)),
            b't' | b'i' | b'e' if kind != b'e' || serial.has_error.get() => {
                reception.receive(&serial, &serial.buffer, |found| {
                    if let Some(frame) = found.message() {
                        text.push_str(&(glued(&frame.bytes()[3..25]) + "\n"));
                    }
                });
            }
            b'e' | b'l' => {}
            _ => serial.pass([kind, number]),
        }
        let counters = reception.line.counters();
        if counters.events.idle != before.events.idle {
            writeln!(text, "pause {}", counters.bytes).unwrap();
        }
        if counters.events.overrun != before.events.overrun {
            text.push_str("overrun\n");
        }
        if counters.discarded.checksum_mismatch != before.discarded.checksum_mismatch {
            text.push_str("mismatch\n");
        }
    }
    text
}

/// Runs each variant of both programs, and checks its output. The program in C is compiled for the HAL and for the LL
/// drivers, and for chips with and without the option to stop the DMA at an error.
fn run_all(steps: &[[u8; 2]], check: impl Fn(&str)) {
    let folder = TempDir::new().unwrap();
    let executable = folder.path().join("program");
    let includes = [headers::folder(), beside("stm32")].map(|path| format!("-I{}", path.display()));
    for driver in ["-DUSE_HAL_DRIVER", "-DUSE_FULL_LL_DRIVER"] {
        for chip in ["-UUSART_CR3_DDRE", "-DUSART_CR3_DDRE"] {
            let sanitizers = "-fsanitize=undefined,address";
            let options = [
                "-O1",
                sanitizers,
                "-fno-sanitize-recover=all",
                &includes[0],
                &includes[1],
                driver,
                chip,
            ];
            GCC.compile(&beside("stm32_dma.c"), &options, &executable);
            let mut program = Command::new(&executable);
            check(&succeeds(&mut program, steps.as_flattened(), ""));
        }
    }
    check(&run_in_rust(steps));
}

/// A stream on the line.
#[derive(Default)]
struct Stream {
    /// A byte or silence for each byte time.
    slots: Steps,
    /// The text of each whole frame, and the times of its bytes.
    frames: Vec<(String, Range<usize>)>,
    /// The output if there are no errors.
    expected: String,
}

impl Stream {
    fn silence(&mut self, count: usize) {
        self.slots.extend(vec![[b's', 1]; count]);
    }

    /// Sends a frame with channels, but at most its first `length` bytes. If the frame is cut off, a long pause
    /// follows. `silence` returns the silence before each byte except the first.
    fn send(&mut self, length: usize, mut silence: impl FnMut() -> usize) {
        // Each whole frame has a different payload, and no byte of the payload can begin a frame.
        let number = u8::try_from(self.frames.len() % 100 + 1).unwrap();
        let mut payload = [0x55; 23];
        payload[..2].copy_from_slice(&[number, 0x20]);
        // Some senders append a byte to the channels.
        let message = crsf::Message {
            address: 0xC8,
            kind: 0x16,
            payload: &payload[..22 + usize::from(number % 8 == 0)],
        };
        let mut room = [0; 64];
        let frame = Crsf.encode_into(message, &mut room).unwrap();
        let from = self.slots.len();
        for (index, byte) in frame.iter().take(length).enumerate() {
            self.silence(if index == 0 { 0 } else { silence() });
            self.slots.push([b'b', *byte]);
        }
        if length < frame.len() {
            let bytes = self.slots.iter().filter(|slot| slot[0] == b'b').count();
            writeln!(self.expected, "pause {bytes}").unwrap();
            self.silence(LONG);
        } else {
            let text = glued(&payload[..22]);
            writeln!(self.expected, "{text}").unwrap();
            self.frames.push((text, from..self.slots.len()));
        }
    }

    /// Returns frames and parts of frames, with silences at random places.
    fn random(random: &mut ChaCha8Rng) -> Self {
        let mut stream = Self::default();
        for _ in 0..40 {
            let is_part = random.random_range(0..4) == 0;
            let part = random.random_range(1..26);
            // The silences inside a frame are too short to be a pause.
            stream.send(if is_part { part } else { WHOLE }, || {
                let silence = [random.random_range(1..PAUSE - 1), PAUSE - 2];
                match random.random_range(0..20) {
                    kind @ 0..2 => silence[kind],
                    _ => 0,
                }
            });
            stream.silence(
                [0, 0, random.random_range(1..2 * PAUSE), LONG][random.random_range(0..4)],
            );
        }
        stream.silence(LONG);
        stream
    }

    /// Returns the steps of the simulation. Also returns the time of each corrupted byte, and the time when the error
    /// was handled. `late` is the delay of every interrupt of the UART and the DMA. If `late` is `None`, each
    /// interrupt has a random delay, other interrupts may delay calls that have begun, and the HAL may be locked.
    fn simulate(
        &self,
        late: Option<usize>,
        random: &mut ChaCha8Rng,
    ) -> (Steps, Vec<(usize, usize)>) {
        // The times of the interrupts, and their kinds.
        let mut calls = BTreeSet::new();
        let tick = random.random_range(0..TICK);
        let (mut count, mut was_byte) = (0, false);
        for (time, slot) in self.slots.iter().enumerate() {
            let at = time + late.unwrap_or_else(|| random.random_range(0..=LATEST));
            let is_byte = slot[0] != b's';
            count += usize::from(is_byte);
            let is_half = is_byte && count % (in_rust::SIZE / 2) == 0;
            if is_half || was_byte && !is_byte {
                calls.insert((at, b'i'));
            }
            if slot[0] == b'c' {
                calls.insert((at, b'e'));
            }
            if time % TICK == tick {
                calls.insert((time + random.random_range(0..=LATEST), b't'));
            }
            was_byte = is_byte;
        }
        let mut steps = vec![[b'n', 0]];
        let (mut errors, mut unhandled) = (vec![], vec![]);
        let (mut time, mut is_locked) = (0, false);
        while time < self.slots.len() {
            steps.push(self.slots[time]);
            unhandled.extend((self.slots[time][0] == b'c').then_some(time));
            while let Some(&(at, kind)) = calls.first()
                && at <= time
            {
                calls.pop_first();
                let is_handled = kind == b'e' || is_locked;
                let is_disturbed = late.is_none() && random.random_range(0..4) == 0;
                is_locked = is_disturbed && kind == b'e';
                let next = &self.slots[time + 1..];
                let mut longest = 0;
                if is_locked {
                    steps.push([b'l', 0]);
                } else if is_disturbed {
                    longest = random.random_range(1..=PREEMPTION);
                }
                let intact = next.iter().take(longest).take_while(|slot| slot[0] != b'c');
                let during: Steps = intact.copied().collect();
                let length = u8::try_from(during.len()).unwrap();
                steps.extend([[b'p', 4 * length + random.random_range(1..=3)], [kind, 0]]);
                time += during.len();
                steps.extend(during);
                if is_handled && !is_locked {
                    errors.extend(unhandled.drain(..).map(|from| (from, time)));
                }
            }
            time += 1;
        }
        (steps, errors)
    }

    /// Asserts that each frame was delivered, unless it overlaps the time from a corrupted byte until the error was
    /// handled. Asserts that only intact frames were delivered.
    fn check(&self, errors: &[(usize, usize)], output: &str) {
        let mut lines = output.lines().filter(|line| line.len() == 44).peekable();
        for (text, at) in &self.frames {
            let is_delivered = lines.next_if(|line| line == text).is_some();
            let mut touching = errors
                .iter()
                .filter(|(from, to)| at.start <= *to && *from < at.end);
            let is_corrupted = self.slots[at.clone()].iter().any(|slot| slot[0] == b'c');
            assert!(
                is_delivered || touching.next().is_some(),
                "{errors:?}: lost {at:?}"
            );
            assert!(
                !is_delivered || !is_corrupted,
                "{errors:?}: corrupted {at:?}"
            );
        }
        assert_eq!(lines.next(), None, "{errors:?}: a false frame");
    }
}

#[test]
fn no_frame_is_lost_and_only_pauses_are_reported() {
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    let (mut all, mut expected) = (vec![], String::new());
    let mut add = |stream: &Stream, late| {
        all.extend(stream.simulate(late, random).0);
        expected.push_str("start\n");
        expected.push_str(&stream.expected);
    };
    for late in 0..=LATEST {
        for silence in 0..=LATEST + 2 {
            let mut stream = Stream::default();
            for length in [WHOLE, WHOLE, 7, WHOLE, WHOLE] {
                stream.send(length, || 0);
                stream.silence(silence);
            }
            stream.silence(LONG);
            add(&stream, Some(late));
        }
    }
    for seed in 0..300 {
        add(&Stream::random(&mut ChaCha8Rng::seed_from_u64(seed)), None);
    }
    run_all(&all, |output| assert_same(output, &expected));
}

#[test]
fn errors_cost_only_the_frames_that_they_touch() {
    let random = &mut ChaCha8Rng::seed_from_u64(2);
    let (mut all, mut cases) = (vec![], vec![]);
    let mut add = |mut stream: Stream, corrupted: &[usize], late| {
        for time in corrupted {
            let slot = &mut stream.slots[*time];
            if slot[0] == b'b' {
                // The corrupted byte may begin a frame.
                let byte = [0xC8, slot[1] ^ random.random_range(1..=0xFF)];
                let is_other = slot[1] == 0xC8 || random.random();
                *slot = [b'c', byte[usize::from(is_other)]];
            }
        }
        let (steps, errors) = stream.simulate(late, random);
        all.extend(steps);
        cases.push((stream, errors));
    };
    for late in 0..=LATEST {
        for corrupted in 0..3 * WHOLE {
            let mut stream = Stream::default();
            (0..5).for_each(|_| stream.send(WHOLE, || 0));
            stream.silence(LONG);
            add(stream, &[corrupted], Some(late));
        }
    }
    for seed in 0..300 {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let stream = Stream::random(random);
        let corrupted = [(); 10].map(|()| random.random_range(0..stream.slots.len()));
        add(stream, &corrupted, None);
    }
    run_all(&all, |output| {
        let outputs: Vec<&str> = output.split("start\n").skip(1).collect();
        assert_eq!(outputs.len(), cases.len());
        for ((stream, errors), output) in cases.iter().zip(outputs) {
            stream.check(errors, output);
            // If there is only one error, and its interrupt is on time, no program takes the corrupted byte.
            let is_on_time = matches!(errors[..], [(from, to)] if to == from);
            assert!(!is_on_time || !output.contains("mismatch"), "{errors:?}");
        }
    });
}

#[test]
fn a_call_that_is_too_late_reports_an_overrun() {
    let mut stream = Stream::default();
    (0..40).for_each(|_| stream.send(WHOLE, || 0));
    let mut steps = vec![[b'n', 0]];
    for (time, slot) in stream.slots.iter().enumerate() {
        steps.push(*slot);
        // Between the calls at 256 and 512 the DMA fills the whole buffer, so both calls see the same position.
        if time <= 256 || time == 512 || time >= 600 && time % 20 == 0 {
            steps.push([b't', 0]);
        }
    }
    steps.push([b't', 0]);
    run_all(&steps, |output| {
        assert_eq!(output.matches("overrun").count(), 1);
        stream.check(&[(257, 512)], output);
    });
}

#[test]
fn the_page_shows_the_program() {
    let program = include_str!("../examples/stm32_dma.c");
    assert_same(blocks(PAGE, "c")[2], program);
}
