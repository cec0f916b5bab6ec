//! Compares the firmware with the reference under random events on the line and in the processor.
//!
//! `FRAMELOCK_RANDOM_RUNS=20000 cargo xtask verify --only emulated` tries 20 000 streams in each of the two tests,
//! instead of 200 and 150. A failure names its seed, and `FRAMELOCK_RANDOM_SEED` sets the first seed.

use framelock_oracles::Occurred;
use framelock_proofs::reference::{Bin, Lecture, NaiveFormat as _};
use nrf52840_emulator::{Assumptions, LineSymbol, MICROSECOND, MILLISECOND};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::firmware::{self, Firmware, RESTART, Reference, Setpoint, frame, is_some_of, reference};

/// The longest silence in the streams that is not a gap. A gap begins after 5 ms.
const LONGEST_PAUSE: u64 = 4_500 * MICROSECOND;
/// The longest delay of handlers that loses nothing, in bits. The FIFO may hold only five bytes of ten bits, and at 1
/// Mbaud a slow core needs some time for the waiting bytes.
const HOLD_OFF: u64 = 45;
/// A time, in cycles, that is longer than [`HOLD_OFF`] at the images' baud rates.
const HELD_OFF: u64 = 500 * MICROSECOND;
/// Number of streams, unless `FRAMELOCK_RANDOM_RUNS` is set.
const RUNS: u64 = 200;
/// Number of streams with mixes of assumptions, unless `FRAMELOCK_RANDOM_RUNS` is set.
const MIXES: u64 = 150;
/// The fixed bytes of frames, and 0, the reserved byte. With them, parts of frames and payloads look like frames.
const AMBIGUOUS: [u8; 4] = *b"AB\0\r";

/// Events on the line and in the processor: a delay of the handlers, symbols, then silence.
#[derive(Clone, PartialEq, Eq, Debug)]
struct Step {
    /// One of [`FORMS`].
    form: &'static str,
    /// The time for which all handlers are delayed from the start of this step, in thousandths of the longest harmless
    /// delay.
    hold_off: u64,
    symbols: Vec<LineSymbol>,
    /// The silence after the symbols, in cycles.
    silence: u64,
}

/// The forms of steps after which bytes may be lost: bytes without a stop bit, breaks, and too long a delay during a
/// flood of frames.
const ERRORS: [&str; 3] = ["bad stop", "break", "too long"];

fn byte(random: &mut ChaCha8Rng) -> u8 {
    if random.random() {
        AMBIGUOUS[random.random_range(0..AMBIGUOUS.len())]
    } else {
        random.random()
    }
}

fn step(random: &mut ChaCha8Rng) -> Step {
    let bytes = |bytes: Vec<u8>| bytes.into_iter().map(LineSymbol::Byte).collect();
    let (form, hold_off, symbols, silence) = match random.random_range(0..8) {
        0 => {
            let count = random.random_range(1..32);
            let noise = (0..count).map(|_| byte(random)).collect();
            ("bytes", 0, bytes(noise), 0)
        }
        1 | 2 => {
            let [a, b, c, d] = std::array::from_fn(|_| byte(random));
            let frames = [b'A', b'B', a, b, c, d, b'\r'].repeat(random.random_range(1..=32));
            ("bytes", 0, bytes(frames), 0)
        }
        3 if random.random() => {
            let delay = random.random_range(1_000..=20_000);
            ("too long", delay, bytes(firmware::frames(150).1), HELD_OFF)
        }
        3 => ("pause", 0, vec![], random.random_range(0..=LONGEST_PAUSE)),
        // A silence that ends the current frame.
        4 => ("gap", 0, vec![], RESTART),
        5 => ("bad stop", 0, vec![LineSymbol::BadStop(byte(random))], 0),
        // More bits than a byte has.
        6 => (
            "break",
            0,
            vec![LineSymbol::Break(random.random_range(11..=42))],
            0,
        ),
        _ => (
            "hold-off",
            random.random_range(0..=1_000),
            vec![],
            2 * HELD_OFF,
        ),
    };
    Step {
        form,
        hold_off,
        symbols,
        silence,
    }
}

/// Checks the firmware's behaviour. *Delivered* bytes are those that were sent with a stop bit.
///
/// * Each committed frame consists of consecutive delivered bytes, and the commits are in the order of the bytes. No
///   committed frame has bytes from both sides of an error or a gap.
/// * If the firmware has received every delivered byte, it commits exactly the reference's setpoints.
/// * If there was no error on the line, no delay that was too long, and no lost ENDRX, then the firmware has received
///   every byte without an overrun.
/// * If bytes are lost only because of delays that were too long, `overrun` and `skipped` report the loss, and only
///   frames near these delays are lost.
/// * Every byte that the receiver takes is part of a frame, discarded or pending.
/// * After the run, the firmware receives a frame within half a second. The chip is never reset.
#[test]
fn whatever_happens_it_does_as_the_reference() {
    for_seeds(RUNS, &[], |seed, occurred| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        one_run(seed, &mut random, occurred, |_| {});
    });
}

/// The deviations that have no effect on the firmware. The firmware never starts a transfer twice, never flushes the
/// FIFO, and never expects parity.
const WITHOUT_EFFECT: [&str; 3] = [
    "start_twice_is_ignored",
    "timeout_counts_parity",
    "flush_is_silent",
];

/// Checks the properties of [`whatever_happens_it_does_as_the_reference`] under random mixes of assumptions about the
/// chip. Each deviation, except [`WITHOUT_EFFECT`], has an effect in some runs.
#[test]
fn whatever_the_chip_does_it_does_as_the_reference() {
    let each = Assumptions::each().into_iter().map(|(name, _)| name);
    let each: Vec<_> = each.filter(|name| !WITHOUT_EFFECT.contains(name)).collect();
    for_seeds(MIXES, &each, |seed, occurred| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        one_run(seed, &mut random, occurred, |all| {
            *all = Assumptions::mixed(seed);
        });
    });
}

/// Performs the runs. Each of [`FORMS`] and each of `deviations` must occur at least six times.
fn for_seeds(runs: u64, deviations: &[&'static str], run: impl Fn(u64, &mut Occurred)) {
    let variable = |name: &str| std::env::var(name).ok().map(|text| text.parse().unwrap());
    let first = variable("FRAMELOCK_RANDOM_SEED").unwrap_or(0);
    let wanted = variable("FRAMELOCK_RANDOM_RUNS").unwrap_or(runs);
    let mut occurred = Occurred::NOTHING;
    for form in FORMS.iter().chain(deviations) {
        occurred.count(form, 0_u64);
    }
    (first..first + wanted).for_each(|seed| run(seed, &mut occurred));
    // If fewer runs than usual were requested, to repeat a failure, some forms may be missing.
    assert!(
        wanted < runs || occurred.rarer_than(6).is_empty(),
        "{occurred:?}"
    );
}

/// The names that [`Occurred`] counts in addition to deviations. The first seven are forms of steps: each counts the
/// steps of this form. The next three are images: each counts the committed setpoints that were compared with the
/// reference. The last name counts the runs in which bytes were lost.
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
    // About half of the runs have no errors. In these runs, bytes may be lost only if an ENDRX is lost.
    let with_errors: bool = random.random();
    let count = random.random_range(1..16);
    let steps: Vec<Step> = std::iter::repeat_with(|| step(random))
        .filter(|step| with_errors || !ERRORS.contains(&step.form))
        .take(count)
        .collect();
    let hold_off = HOLD_OFF * 64_000_000 / baud;
    let sent = send(&mut firmware, &steps, hold_off);
    let what = format!(
        "seed {seed}, {image}: {steps:02X?}; {:?}",
        firmware.assumptions
    );
    let form = match check(
        &mut firmware,
        reference,
        &sent,
        70 * 64_000_000 / baud,
        &what,
    ) {
        Some(commits) => (image, commits),
        None => ("loss", 1),
    };
    let deviations = &firmware.board.trace().deviations;
    let once = sent.forms.iter().chain(deviations).map(|form| (*form, 1));
    for (form, times) in once.chain([form]) {
        occurred.count(form, times as u64);
    }
    let serves = (0..5).any(|_| {
        firmware.send_and_wait(&frame([1, 2, 3]), 100 * MILLISECOND);
        firmware.commits() == [[1, 2, 3]]
    });
    assert!(serves, "it does not come back: {what}");
    assert_eq!(firmware.board.trace().resets, [], "{what}");
}

/// The sent bytes, as stretches between errors and gaps.
#[derive(Default)]
struct Sent {
    stretches: Vec<Vec<u8>>,
    /// The sum of the delays of the form "too long", in cycles.
    late: u64,
    /// The forms of the steps.
    forms: Vec<&'static str>,
}

/// Performs the steps. `hold_off` is the longest harmless delay in cycles.
fn send(firmware: &mut Firmware, steps: &[Step], hold_off: u64) -> Sent {
    let mut sent = Sent::default();
    let mut stretch = Vec::new();
    // The silence since the last byte, because consecutive pauses could add up to a gap.
    let mut silence = 0;
    for step in steps {
        silence *= u64::from(step.symbols.is_empty());
        let pause = match step.form {
            "pause" => step.silence.min(LONGEST_PAUSE - silence),
            "hold-off" if silence + step.silence > LONGEST_PAUSE => continue,
            _ => step.silence,
        };
        let (now, delay) = (firmware.board.now(), hold_off * step.hold_off / 1_000);
        firmware.board.hold_off(now, delay);
        // The line is filled ahead of time: these symbols begin when all earlier symbols have ended.
        firmware.board.send_symbols(&step.symbols);
        for symbol in &step.symbols {
            match symbol {
                LineSymbol::Byte(byte) => stretch.push(*byte),
                _ => sent.stretches.push(std::mem::take(&mut stretch)),
            }
        }
        silence += pause;
        match step.form {
            // The next delay begins after the handlers have run.
            "hold-off" => firmware.run_for(pause),
            _ if pause > 0 => wait(firmware, pause),
            _ => {}
        }
        if step.form == "gap" {
            silence = 0;
            sent.stretches.push(std::mem::take(&mut stretch));
        }
        sent.late += if step.form == "too long" { delay } else { 0 };
        sent.forms.push(step.form);
    }
    wait(firmware, RESTART);
    sent.stretches.push(stretch);
    sent
}

/// Waits until everything that was sent has arrived, and then for `cycles`.
fn wait(firmware: &mut Firmware, cycles: u64) {
    firmware.send_and_wait(&[], 0);
    firmware.run_for(cycles);
}

/// Checks the properties of a run. Returns the number of committed setpoints, or `None` if a byte was lost.
fn check(
    firmware: &mut Firmware,
    reference: Reference,
    sent: &Sent,
    frame_time: u64,
    what: &str,
) -> Option<usize> {
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
    let [bad_stops, breaks, late] = ERRORS.map(|error| {
        let forms = sent.forms.iter().filter(|form| **form == error);
        forms.count() as u64
    });
    let has_errors = bad_stops + breaks + late > 0;
    assert!(nothing_is_lost || has_errors || loses_end, "{what}");
    let streams = sent.stretches.iter();
    let expected: Vec<Setpoint> = streams.flat_map(|bytes| reference(bytes)).collect();
    if nothing_is_lost {
        assert_eq!(commits, expected, "{what}");
    } else if bad_stops + breaks == 0 && !loses_end {
        let (overruns, skipped) = firmware.losses();
        assert!(overruns > 0 && skipped > 0, "silent loss: {what}");
        // Only these frames may be lost: those that arrived during a delay, those that were arriving when the delay
        // began or ended, and those in the FIFO.
        let most = sent.late / frame_time + 4 * late;
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
