//! Compares the firmware with the reference under random events on the line and in the processor.
//!
//! `FRAMELOCK_RANDOM_RUNS=20000 cargo xtask verify --only emulated` tries 20 000 streams instead of 200. A failure names
//! its seed, and `FRAMELOCK_RANDOM_SEED` sets the first seed.

use framelock_oracles::Occurred;
use framelock_proofs::reference::{Bin, Lecture, NaiveFormat as _};
use nrf52840_emulator::{Assumptions, LineSymbol, MICROSECOND, MILLISECOND};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::firmware::{Firmware, RESTART, Reference, Setpoint, frame, is_some_of, reference};

/// The longest silence in the streams that is not a gap. A gap begins after 5 ms.
const LONGEST_PAUSE: u64 = 4_500 * MICROSECOND;
/// The longest delay of handlers that loses nothing, in bits. The FIFO may hold only five bytes of ten bits, and at 1
/// Mbaud a slow core needs some time for the waiting bytes.
const HOLD_OFF: u64 = 45;
/// A time, in cycles, that is longer than this delay at any baud rate.
const HELD_OFF: u64 = 500 * MICROSECOND;
/// Number of streams, unless `FRAMELOCK_RANDOM_RUNS` is set.
const RUNS: u64 = 200;
/// Number of streams with mixes of assumptions, unless `FRAMELOCK_RANDOM_RUNS` is set.
const MIXES: u64 = 50;
/// The fixed bytes of frames. With them, parts of frames and payloads look like frames.
const AMBIGUOUS: [u8; 4] = *b"AB\0\r";

/// An event on the line or in the processor.
#[derive(Clone, PartialEq, Eq, Debug)]
enum Step {
    Bytes(Vec<u8>),
    /// Silence for this number of cycles, too short for a gap.
    Pause(u64),
    /// Silence that ends the current frame.
    Gap,
    /// A byte without a stop bit, which is not delivered.
    BadStop(u8),
    /// A low level for this number of bits, more than a byte has.
    Break(u32),
    /// A delay of all handlers, which begins with this step, in thousandths of the longest harmless delay.
    HoldOff(u64),
    /// The same in the middle of a flood of frames, and longer than harmless. Bytes may be lost, and the loss is reported.
    TooLong(u64, Vec<u8>),
}

fn byte(random: &mut ChaCha8Rng) -> u8 {
    if random.random() {
        AMBIGUOUS[random.random_range(0..AMBIGUOUS.len())]
    } else {
        random.random()
    }
}

fn step(random: &mut ChaCha8Rng) -> Step {
    match random.random_range(0..8) {
        0 => {
            let count = random.random_range(1..32);
            Step::Bytes((0..count).map(|_| byte(random)).collect())
        }
        1 | 2 => {
            let [a, b, c, d] = std::array::from_fn(|_| byte(random));
            let count = random.random_range(1..=32);
            Step::Bytes([b'A', b'B', a, b, c, d, b'\r'].repeat(count))
        }
        3 if random.random() => {
            let (_, flood) = crate::firmware::frames(150);
            Step::TooLong(random.random_range(1_000..=20_000), flood)
        }
        3 => Step::Pause(random.random_range(0..=LONGEST_PAUSE)),
        4 => Step::Gap,
        5 => Step::BadStop(byte(random)),
        6 => Step::Break(random.random_range(11..=42)),
        _ => Step::HoldOff(random.random_range(0..=1_000)),
    }
}

/// Checks the firmware's behaviour. *Delivered* bytes are those that were sent with a stop bit.
///
/// * Only delivered frames are committed, in order. No committed frame has bytes from both sides of an error or a gap.
/// * If the firmware has received every byte, it commits all setpoints of the reference.
/// * If there was no error on the line and no lost ENDRX, the firmware has received every byte, and there was no
///   overrun.
/// * Every byte is part of a frame, discarded or pending.
#[test]
fn whatever_happens_it_does_as_the_reference() {
    for_seeds(RUNS, |seed, occurred| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        one_run(seed, &mut random, occurred, |_| {});
    });
}

/// Checks the same properties under random mixes of assumptions about the chip. Within half a second, the firmware
/// receives a frame again.
#[test]
fn whatever_the_chip_does_it_does_as_the_reference() {
    for_seeds(MIXES, |seed, occurred| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        one_run(seed, &mut random, occurred, |all| {
            *all = Assumptions::mixed(seed);
        });
    });
}

fn for_seeds(runs: u64, run: impl Fn(u64, &mut Occurred)) {
    let variable = |name: &str| std::env::var(name).ok().map(|text| text.parse().unwrap());
    let first = variable("FRAMELOCK_RANDOM_SEED").unwrap_or(0);
    let wanted = variable("FRAMELOCK_RANDOM_RUNS").unwrap_or(runs);
    let mut occurred = Occurred::NOTHING;
    for form in FORMS {
        occurred.count(form, 0_u64);
    }
    (first..first + wanted).for_each(|seed| run(seed, &mut occurred));
    // If fewer runs than usual were requested, to repeat a failure, some forms may be missing.
    assert!(
        wanted < runs || occurred.rarer_than(6).is_empty(),
        "{occurred:?}"
    );
}

/// The forms of runs. The first seven are kinds of steps, and [`Occurred`] counts these steps. The next three are images.
/// For an image, [`Occurred`] counts the commits that were compared with the reference, not the runs. The last form is
/// a run in which bytes were lost.
const FORMS: [&str; 11] = [
    "bytes", "pause", "gap", "bad stop", "break", "hold-off", "too long", "megabaud", "default",
    "lecture", "loss",
];

fn one_run(
    seed: u64,
    random: &mut ChaCha8Rng,
    occurred: &mut Occurred,
    assume: impl FnOnce(&mut Assumptions),
) {
    let (image, baud, reference): (_, _, Reference) = match random.random_range(0..3) {
        0 => ("megabaud", 1_000_000_u64, reference::<Bin>),
        1 => ("default", 115_200, reference::<Bin>),
        _ => ("lecture", 115_200, reference::<Lecture>),
    };
    let mut firmware = Firmware::booted(image);
    firmware.assume(assume);
    // The sender's rate is off by at most two per cent, and often by exactly two.
    let rates = [980, 1_020, random.random_range(980..=1_020)];
    let millibaud = baud * rates[random.random_range(0..3)];
    firmware.board.line(|line| line.set_millibaud(millibaud));
    // Half of the runs have no errors. In these runs nothing may be lost.
    let with_errors: bool = random.random();
    let count = random.random_range(1..16);
    let steps: Vec<Step> = std::iter::repeat_with(|| step(random))
        .filter(|step| {
            let is_error = matches!(step, Step::BadStop(_) | Step::Break(_) | Step::TooLong(..));
            with_errors || !is_error
        })
        .take(count)
        .collect();
    let hold_off = HOLD_OFF * 64_000_000 / baud;
    let sent = send(&mut firmware, &steps, hold_off);
    let what = format!(
        "seed {seed}, {image}: {steps:02X?}; {:?}",
        firmware.assumptions
    );
    let form = match check(&mut firmware, reference, &sent, &what) {
        Some(commits) => (image, commits),
        None => ("loss", 1),
    };
    for (form, times) in sent.forms.iter().map(|form| (*form, 1)).chain([form]) {
        occurred.count(form, times as u64);
    }
    let serves = (0..5).any(|_| {
        firmware.send_and_wait(&frame([1, 2, 3]), 100 * MILLISECOND);
        firmware.commits() == [[1, 2, 3]]
    });
    assert!(serves, "it does not come back: {what}");
    assert_eq!(firmware.board.trace().resets, [], "{what}");
}

/// The delivered bytes, as stretches between errors and gaps.
struct Sent {
    stretches: Vec<Vec<u8>>,
    has_errors: bool,
    /// The sum of the delays that are longer than harmless, in cycles.
    late: u64,
    /// Cycles of a bit.
    bit: u64,
    /// The forms of the steps.
    forms: Vec<&'static str>,
}

fn send(firmware: &mut Firmware, steps: &[Step], hold_off: u64) -> Sent {
    let mut sent = Sent {
        stretches: vec![Vec::new()],
        has_errors: false,
        late: 0,
        bit: hold_off / HOLD_OFF,
        forms: Vec::new(),
    };
    // The silence since the last byte, because consecutive pauses could add up to a gap.
    let mut silence = 0;
    for step in steps {
        // The line is filled ahead of time, so each step begins after everything that was sent before.
        let form = match step {
            Step::Bytes(bytes) => {
                silence = 0;
                firmware.board.send(bytes);
                if let Some(stretch) = sent.stretches.last_mut() {
                    stretch.extend(bytes);
                }
                "bytes"
            }
            Step::Pause(cycles) => {
                let cycles = (*cycles).min(LONGEST_PAUSE - silence);
                wait(firmware, cycles);
                silence += cycles;
                "pause"
            }
            Step::Gap => {
                wait(firmware, RESTART);
                silence = 0;
                sent.stretches.push(Vec::new());
                "gap"
            }
            Step::BadStop(byte) => {
                sent.error(firmware, LineSymbol::BadStop(*byte));
                "bad stop"
            }
            Step::Break(bits) => {
                sent.error(firmware, LineSymbol::Break(*bits));
                "break"
            }
            Step::HoldOff(_) if silence + 2 * HELD_OFF > LONGEST_PAUSE => continue,
            Step::HoldOff(thousandths) => {
                silence += 2 * HELD_OFF;
                let now = firmware.board.now();
                firmware.board.hold_off(now, hold_off * thousandths / 1_000);
                // The next delay begins after the handlers have run.
                firmware.run_for(2 * HELD_OFF);
                "hold-off"
            }
            Step::TooLong(thousandths, flood) => {
                silence = 0;
                sent.has_errors = true;
                let (now, length) = (firmware.board.now(), hold_off * thousandths / 1_000);
                sent.late += length;
                firmware.board.hold_off(now, length);
                firmware.board.send(flood);
                if let Some(stretch) = sent.stretches.last_mut() {
                    stretch.extend(flood);
                }
                wait(firmware, HELD_OFF);
                "too long"
            }
        };
        sent.forms.push(form);
    }
    wait(firmware, RESTART);
    sent
}

impl Sent {
    fn error(&mut self, firmware: &mut Firmware, symbol: LineSymbol) {
        firmware.board.send_symbols(&[symbol]);
        self.has_errors = true;
        self.stretches.push(Vec::new());
    }
}

/// Waits until everything that was sent has arrived, and then for `cycles`.
fn wait(firmware: &mut Firmware, cycles: u64) {
    firmware.send_and_wait(&[], 0);
    firmware.run_for(cycles);
}

/// Returns the number of commits, if the firmware has received every byte.
fn check(firmware: &mut Firmware, reference: Reference, sent: &Sent, what: &str) -> Option<usize> {
    let commits = firmware.commits();
    let possible: Vec<Setpoint> = sent.stretches.iter().flat_map(|s| frames(s)).collect();
    assert!(
        is_some_of(&commits, &possible),
        "{commits:02X?} of {possible:02X?}: {what}"
    );

    let delivered: usize = sent.stretches.iter().map(Vec::len).sum();
    let nothing_is_lost = firmware.losses() == (0, 0)
        && firmware.counter("bytes") as usize == delivered
        && firmware.counter("overrun") == 0;
    let loses_end = firmware.assumptions.lost_end > 0 || firmware.counter("restarts") > 0;
    assert!(nothing_is_lost || sent.has_errors || loses_end, "{what}");
    let streams = sent.stretches.iter();
    let expected: Vec<Setpoint> = streams.flat_map(|bytes| reference(bytes)).collect();
    let late = sent
        .forms
        .iter()
        .filter(|form| **form == "too long")
        .count();
    let is_only_late = !["bad stop", "break"]
        .iter()
        .any(|error| sent.forms.contains(error));
    if nothing_is_lost {
        assert_eq!(commits, expected, "{what}");
    } else if is_only_late && !loses_end {
        let (overruns, skipped) = firmware.losses();
        assert!(overruns > 0 && skipped > 0, "silent loss: {what}");
        // Only these frames may be lost: those that arrived during a delay, those that were arriving when the delay began or
        // ended, and those in the FIFO.
        let most = sent.late / (70 * sent.bit) + 4 * late as u64;
        assert!(
            commits.len() as u64 + most >= expected.len() as u64,
            "{what}"
        );
    }

    firmware.assert_every_byte_has_one_place(what);
    assert_eq!(firmware.board.trace().resets, [], "{what}");
    nothing_is_lost.then_some(commits.len())
}

/// Returns every frame in these bytes, including overlapping ones.
fn frames(bytes: &[u8]) -> impl Iterator<Item = Setpoint> {
    bytes
        .windows(Bin::LENGTH)
        .filter_map(|window| match window {
            &[_, _, _, pitch, roll, yaw, _] if Bin::fails_at(window).is_none() => {
                Some([pitch, roll, yaw])
            }
            _ => None,
        })
}
