//! Tests that no output jumps when the core is halted or the chip is reset. Two successive outputs differ by at most
//! the number of units that follows from `firmware/src/settings.rs`.

use nrf52840_emulator::{Board, MILLISECOND};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use crate::firmware::{Firmware, Setpoint, frame, sample};
use crate::outputs::{led3, pulse, pulses};
use crate::resets::{Kind, reset};

/// The most units by which the settings allow one poll to move an output. A live output needs 200 ms for its travel of
/// 255 units, and a poll moves it by the travel of at most 4 ms.
const MOST_PER_POLL: u8 = 6;
/// The most units per poll in an approach and on the way to park, where 255 units take a second.
const MOST_PER_SLOW_POLL: u8 = 2;
/// The most by which a pulse differs from the pulse before, in microseconds. The widths of two pulses in a row are
/// computed at most 26 ms apart, and a width changes by 5 us per millisecond. Rounding to units of 4 us and to whole
/// microseconds adds at most 6 us.
const MOST_PER_PULSE: u64 = 136;
/// The most by which the pulse after a halt differs from the pulse before the halt. Their widths are computed at most
/// 44 ms apart, not counting the halt.
const MOST_PER_HALT: u64 = 226;
/// The most by which a pulse differs from the pulse before, in an approach and on the way to park, also after a halt.
/// There, a width changes by 1 us per millisecond.
const MOST_PER_SLOW_PULSE: u64 = 50;
/// The time between two frames, in milliseconds.
const FRAME_EVERY: u64 = 20;
/// The time of a frame on the line, in cycles.
const FRAME: u64 = 7 * 10 * 64_000_000 / 115_200;

/// Firmware whose outputs are recorded.
pub(crate) struct Recorded {
    pub(crate) firmware: Firmware,
    kept: usize,
}

impl Recorded {
    pub(crate) fn of(mut firmware: Firmware) -> Self {
        let kept = firmware.board.watch("LAST_OUTPUT").unwrap();
        Self { firmware, kept }
    }

    /// Sends a frame every 20 ms for this number of milliseconds. `demand` returns the demands for a time in
    /// milliseconds.
    fn drive(&mut self, milliseconds: u64, demand: impl Fn(u64) -> Setpoint) {
        self.firmware.drive(milliseconds, FRAME_EVERY, demand);
    }

    /// Sends these demands for two seconds. Asserts that the outputs are live and have reached the demands.
    fn live_at(&mut self, demand: Setpoint) {
        self.drive(2_000, |_| demand);
        assert_eq!(led3(&mut self.firmware, 20), (0, 0), "live");
        assert_eq!(self.last_pulses(), demand.map(|unit| pulse(unit.into())));
    }

    fn last_pulses(&mut self) -> [u64; 3] {
        *pulses(&mut self.firmware, 0).last().unwrap()
    }

    /// Returns the output at an instant, and the outputs of all later polls, without repetitions.
    pub(crate) fn polled(&mut self, since: u64) -> Vec<[u8; 3]> {
        let changes = &self.firmware.board.trace().changes;
        let kept = changes.iter().filter(|change| change.watch == self.kept);
        let kept: Vec<_> = kept.collect();
        let later = kept.partition_point(|change| change.at < since);
        let outputs = kept[later.saturating_sub(1)..].iter().map(|change| {
            let [axes @ .., _] = change.value.to_le_bytes();
            axes
        });
        outputs.collect()
    }

    /// Checks all polls and pulses since an instant. Asserts that each poll changed an output by at most `most` units,
    /// and that each pulse differs from the pulse before by no more than the settings allow.
    pub(crate) fn assert_bounded(&mut self, since: u64, most: u8, what: &str) {
        for pair in self.polled(since).windows(2) {
            let differences = (0..3).map(|axis| pair[0][axis].abs_diff(pair[1][axis]));
            assert!(differences.max() <= Some(most), "{what}: {pair:?}");
        }
        let before = since.saturating_sub(FRAME_EVERY * MILLISECOND);
        for pair in pulses(&mut self.firmware, before).windows(2) {
            let differences = (0..3).map(|axis| pair[0][axis].abs_diff(pair[1][axis]));
            let most = match most {
                MOST_PER_SLOW_POLL => MOST_PER_SLOW_PULSE,
                _ if self.firmware.counter("late_polls") > 0 => MOST_PER_HALT,
                _ => MOST_PER_PULSE,
            };
            assert!(differences.max() <= Some(most), "{what}: {pair:?}");
        }
    }
}

/// A debugger halts the core while a frame waits for the main loop. The watchdog pauses, but the clock and the PWM run
/// on.
#[test]
fn after_a_halt_the_outputs_go_on_from_where_they_are() {
    let mut recorded = Recorded::of(Firmware::booted("default"));
    for (n, halt) in (1..).zip(sample(5..50, 15).chain([90, 130, 300, 700, 2_000])) {
        recorded.live_at([255, 0, 255]);
        let firmware = &mut recorded.firmware;
        let from = firmware.board.now();
        firmware.board.send(&frame([0, 255, 128]));
        let taken = from + 2 * FRAME;
        firmware.commits();
        let setpoint = firmware.board.word("SETPOINT").unwrap();
        let waits = firmware
            .board
            .run(taken, |board| board.word("SETPOINT") != Ok(setpoint));
        assert!(waits.unwrap(), "a frame waits");
        firmware.board.halt_for(halt * MILLISECOND);
        firmware.run_for((halt + 1_500) * MILLISECOND);
        assert!(firmware.resets().is_empty(), "{halt} ms");
        assert_eq!(firmware.counter("late_polls"), n, "{halt} ms");
        let what = format!("a halt of {halt} ms");
        recorded.assert_bounded(from, MOST_PER_POLL, &what);
        let polled = recorded.polled(from);
        assert_eq!(polled.last(), Some(&[128; 3]), "it parks without frames");
        if halt >= 130 {
            recorded.assert_bounded(from, MOST_PER_SLOW_POLL, &what);
            assert!(
                polled
                    .iter()
                    .all(|[pitch, roll, _]| *pitch >= 128 && *roll <= 128),
                "only to park"
            );
        }
        recorded.drive(1_500, |_| [0, 255, 128]);
        recorded.assert_bounded(from, MOST_PER_POLL, "frames start it again");
        assert_eq!(recorded.last_pulses(), [pulse(0), pulse(255), pulse(128)]);
    }
}

/// Resets come at different times of a PWM period while the outputs move as fast as they can. After a reset without
/// further frames, the outputs move slowly to park.
#[test]
fn no_reset_lets_an_output_jump() {
    for kind in [
        Kind::Fault,
        Kind::Lockup,
        Kind::Watchdog,
        Kind::Pin,
        Kind::BrownOut,
    ] {
        let what = format!("{kind:?}");
        let mut recorded = Recorded::of(Firmware::booted("default"));
        recorded.live_at([255, 0, 255]);
        let from = recorded.firmware.board.now();
        for offset in sample(0..20, 3) {
            recorded.drive(40, |_| [0, 255, 128]);
            let firmware = &mut recorded.firmware;
            firmware.run_for(offset * MILLISECOND + 300 * offset);
            assert_ne!(recorded.last_pulses(), [pulse(128); 3]);
            let resets = recorded.firmware.resets().len();
            reset(
                &mut recorded.firmware,
                kind,
                &mut ChaCha8Rng::seed_from_u64(0),
            );
            assert_eq!(recorded.firmware.resets().len(), resets + 1, "{what}");
            recorded.firmware.run_for(50 * MILLISECOND);
            recorded.assert_bounded(from, MOST_PER_POLL, &what);
            recorded.live_at([255, 0, 255]);
        }
        reset(
            &mut recorded.firmware,
            kind,
            &mut ChaCha8Rng::seed_from_u64(0),
        );
        let from = recorded.firmware.board.now();
        recorded.firmware.run_for(700 * MILLISECOND);
        recorded.assert_bounded(from, MOST_PER_SLOW_POLL, &what);
        assert_eq!(recorded.last_pulses(), [pulse(128); 3], "{what}");
    }
}

/// The test resets the chip in a pass of the main loop that stores a new output: after each instruction near the
/// stores, and after a sample of the pass's other instructions.
#[test]
fn a_reset_at_any_instruction_resumes_the_last_output_or_the_one_before() {
    const FROM: [u8; 3] = [200, 50, 90];
    let mut firmware = Firmware::booted("default");
    let kept = firmware
        .board
        .image()
        .symbol("LAST_OUTPUT")
        .unwrap()
        .address;
    let [_, mark] = stored(&firmware.board, kept);
    let [pitch, roll, yaw] = FROM;
    let output = u32::from_le_bytes([pitch, roll, yaw, !(pitch ^ roll ^ yaw)]);
    let bytes = [output, mark].map(u32::to_le_bytes).concat();
    let start = |firmware: &mut Firmware| {
        firmware.board.patch(kept, &bytes).unwrap();
        firmware.board.brown_out();
        let board = &firmware.board;
        (board.instructions(), board.now() + 20 * MILLISECOND)
    };
    // Run to the end of the first pass that changes the output. Note the number of the instruction at which the pass
    // began, and of each instruction that changed the stored output.
    let (began, limit) = start(&mut firmware);
    let (mut slept, mut first, mut before) = (0, 0, [output, mark]);
    let mut stores = Vec::new();
    let passed = firmware.board.run(limit, |board| {
        let instructions = board.instructions() - began;
        let sleeps = std::mem::replace(&mut slept, board.slept()) != board.slept();
        let now = stored(board, kept);
        if std::mem::replace(&mut before, now) != now {
            stores.push(instructions);
        }
        if stores.is_empty() && sleeps {
            first = instructions;
        }
        !stores.is_empty() && sleeps
    });
    assert!(passed.unwrap());
    let last = firmware.board.instructions() - began;
    let [next @ .., _] = before[0].to_le_bytes();
    let expected = [FROM, next].map(|axes| axes.map(|unit| pulse(unit.into())));
    assert_ne!(expected[0], expected[1]);
    let near = stores.iter().flat_map(|at| at.saturating_sub(8)..at + 9);
    let mut resumed = [0; 2];
    for place in sample(first..=last, 19).chain(near) {
        let (began, limit) = start(&mut firmware);
        let is_there = |board: &Board| board.instructions() - began >= place;
        assert!(firmware.board.run(limit, is_there).unwrap());
        firmware.board.brown_out();
        let reset = firmware.board.now();
        firmware.run_for(2 * MILLISECOND);
        let widths = pulses(&mut firmware, reset)[0];
        let found = expected.iter().position(|expected| *expected == widths);
        let Some(found) = found else {
            panic!("after instruction {place}: {widths:?}");
        };
        resumed[found] += 1;
        std::mem::take(firmware.board.trace());
    }
    assert!(resumed.iter().all(|count| *count > 5), "{resumed:?}");
}

/// Returns the two words in which the firmware stores the output.
fn stored(board: &Board, kept: u32) -> [u32; 2] {
    [kept, kept + 4].map(|word| board.memory().word(word).unwrap())
}
