//! Random sequences of resets of every kind, at random times, on chips with random words in UICR.

use nrf52840_emulator::{MICROSECOND, MILLISECOND, RAM_SIZE, RAM_START, ResetCause};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::firmware::{Firmware, RESTART, UICR, sample};
use crate::outputs::pulse;

/// A way to reset the chip.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum Kind {
    PowerOn,
    BrownOut,
    Pin,
    Watchdog,
    Fault,
    Lockup,
}

const KINDS: [Kind; 6] = [
    Kind::PowerOn,
    Kind::BrownOut,
    Kind::Pin,
    Kind::Watchdog,
    Kind::Fault,
    Kind::Lockup,
];

/// Runs the board while frames arrive.
fn run(firmware: &mut Firmware, cycles: u64) {
    let end = firmware.board.now() + cycles;
    firmware.drive(cycles / MILLISECOND, 10, |_| [255, 0, 60]);
    firmware.board.run_until(end).unwrap();
}

/// Resets the chip. A reset by the watchdog takes 263 ms. A reset by a fault takes up to about 22 ms, because the
/// handler waits for the end of a PWM period. A reset by a lockup takes up to about 2 ms.
pub(crate) fn reset(firmware: &mut Firmware, kind: Kind, random: &mut ChaCha8Rng) {
    match kind {
        Kind::PowerOn => {
            firmware.board.brown_out();
            let mut bytes = vec![0; RAM_SIZE as usize];
            random.fill(&mut bytes[..]);
            firmware.board.patch(RAM_START, &bytes).unwrap();
        }
        Kind::BrownOut => firmware.board.brown_out(),
        Kind::Pin => firmware.board.reset(),
        Kind::Watchdog => {
            // Give the program time to start the watchdog.
            firmware.run_for(3 * MILLISECOND);
            firmware.starve_the_watchdog();
        }
        Kind::Fault => firmware.fault_in(&["TIMER0"]),
        Kind::Lockup => firmware.fault_in(&["TIMER0", "HardFault"]),
    }
}

/// Leaves each word of UICR erased, or writes it, or breaks one or all of its bits. Returns the choice for each word.
fn prepare_uicr(firmware: &mut Firmware, random: &mut ChaCha8Rng) -> Vec<u32> {
    let mut states = Vec::new();
    for (word, value) in UICR {
        let offset = word & 0xFFF;
        let state = random.random_range(0..6);
        match state {
            0 | 1 => {}
            2 => firmware.write_uicr([(word, value)]),
            3 => firmware.write_uicr([(word, random.random_range(0..17))]),
            4 => firmware.board.break_uicr(offset, u32::MAX),
            _ => firmware
                .board
                .break_uicr(offset, 1 << random.random_range(0..32)),
        }
        states.push(state);
    }
    states
}

/// The firmware resets itself at most once, to let new words of UICR take effect. After the last reset it logs the
/// cause, opens the debug port if UICR allows it, and receives. The outputs never move faster than usual, and begin at
/// park after power-on.
#[test]
fn after_any_sequence_of_resets_it_works() {
    for seed in sample(0..60, 3) {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let image = ["default", "write-uicr", "write-uicr"][random.random_range(0..3)];
        let mut firmware = Firmware::on_an_erased_chip(image);
        let uicr = prepare_uicr(&mut firmware, random);
        if random.random_range(0..3) == 0 {
            run(&mut firmware, 1_400 * MILLISECOND);
        }
        let mut kinds = Vec::new();
        let mut power_on = Vec::new();
        for left in (0..random.random_range(1..8)).rev() {
            // Half of the resets before the last one come while the firmware starts. The last one comes later, so that
            // its cause is known.
            let most = if left > 0 && random.random() {
                600 * MICROSECOND
            } else {
                40 * MILLISECOND
            };
            let least = if left > 0 { 0 } else { 5 * MILLISECOND };
            run(&mut firmware, random.random_range(least..most));
            let kind = KINDS[random.random_range(0..KINDS.len())];
            kinds.push(kind);
            if kind == Kind::PowerOn {
                power_on.push(firmware.board.now());
            }
            reset(&mut firmware, kind, random);
        }
        let what = format!("seed {seed}, {image}, UICR {uicr:?}, {kinds:?}");
        firmware.run_for(50 * MILLISECOND);
        let resets = firmware.resets();
        let own = resets.len() - kinds.len();
        let most = usize::from(image == "write-uicr");
        assert!(own <= most, "{what}: {resets:?}");
        says_the_cause(&mut firmware, kinds.last().copied(), &what);

        let [.., protection] = UICR.map(|(word, _)| firmware.board.register(word).unwrap());
        let is_open = firmware.board.debug_port_is_open();
        assert_eq!(is_open, protection == 0x5A, "{what}");
        firmware.commits();
        firmware.takes_a_frame(RESTART, &what);
        moves_slowly(&mut firmware, &power_on, &what);
    }
}

/// Asserts that the last start logged the cause of the test's last reset. If the firmware has reset itself since, the
/// log names the causes that RESETREAS has accumulated, or only the pin if the pin is one of them.
fn says_the_cause(firmware: &mut Firmware, last: Option<Kind>, what: &str) {
    let cause = match last.unwrap() {
        Kind::PowerOn | Kind::BrownOut => "power",
        Kind::Pin => "pin",
        Kind::Watchdog => "watchdog",
        Kind::Fault => "software",
        Kind::Lockup => "lockup",
    };
    let own = firmware.resets().last() == Some(&ResetCause::Soft) && last != Some(Kind::Fault);
    let log = firmware.board.log().join("\n");
    let expected = match cause {
        "power" if own => "reset by software (".to_owned(),
        "watchdog" if own => "reset by watchdog software (".to_owned(),
        "lockup" if own => "reset by software lockup (".to_owned(),
        cause => format!("reset by {cause} ("),
    };
    let mut starts = log.lines().filter(|line| line.contains("reset by"));
    let start = starts.next_back().unwrap_or_default();
    assert!(start.contains(&expected), "{what}: not {expected}: {log}");
}

fn moves_slowly(firmware: &mut Firmware, power_on: &[u64], what: &str) {
    let trace = firmware.board.trace();
    let is_whole = |from: u64, to: u64| {
        let mut resets = trace.resets.iter().map(|reset| reset.at);
        !resets.any(|at| (from..to).contains(&at))
    };
    let mut before: Option<(u64, [u64; 3])> = None;
    for period in &trace.pwm_periods {
        let [Some(pitch), Some(roll), Some(yaw), _] = period.pulses() else {
            continue;
        };
        if !is_whole(period.at, period.at + period.length) {
            continue;
        }
        let now = [pitch, roll, yaw];
        // A period has ten polls. In these polls together, a live axis moves by at most 26 units of 4 us.
        let was = match before {
            Some((at, was)) if !power_on.iter().any(|on| (at..period.at).contains(on)) => was,
            _ => [pulse(128); 3],
        };
        for (was, is) in was.iter().zip(now) {
            assert!(was.abs_diff(is) <= 110, "{what}: {was} to {is} us");
        }
        before = Some((period.at, now));
    }
}
