//! A C program receives the same frames as a Rust program.

use std::fmt::Write;
use std::num::NonZeroU32;

use framelock::motion::{Bin, BinCrc8, Failsafe, FailsafeParameters, Phase, Setpoint};
use framelock::{Encode, FixedFormat, Line, LineEvent, Receiver};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::compiler::{C, CPP, program, run};

pub(crate) const EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

#[test]
fn c_receives_what_rust_does() {
    let steps = faulty_stream::<Bin>();
    let expected = received::<Bin>(&steps);
    let receiver = "-DRECEIVER=framelock_receiver";
    for compiler in [C, CPP] {
        let c = [&compiler[..], &[receiver]].concat();
        assert_same(&run(&c, &[&program("receive.c")], &steps), &expected);
    }
}

#[test]
fn c_receives_checked_frames_as_rust_does() {
    let steps = faulty_stream::<BinCrc8>();
    let expected = received::<BinCrc8>(&steps);
    let c = [&C[..], &["-DRECEIVER=framelock_crc8_receiver"]].concat();
    assert_same(&run(&c, &[&program("receive.c")], &steps), &expected);
}

#[test]
fn nothing_comes_of_nothing() {
    run(&C, &[&program("nothing.c")], &[]);
    run(&CPP, &[&program("nothing.c")], &[]);
}

/// Shows the first line that differs.
pub(crate) fn assert_same(found: &str, expected: &str) {
    for (number, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "line {number}");
    }
    assert_eq!(found.lines().count(), expected.lines().count());
}

/// Returns steps for `receive.c`: frames, some of them broken, with line events and time between them.
fn faulty_stream<F: Encode<Message = Setpoint>>() -> Vec<u8> {
    let mut random = ChaCha8Rng::seed_from_u64(16);
    let mut steps = Vec::new();
    for _ in 0..20_000 {
        // Bytes that look like parts of a frame, or arbitrary bytes.
        let setpoint = [(); 3].map(|()| match random.random_range(0..8) {
            0 => b'A',
            1 => b'B',
            2 => b'\r',
            _ => random.random(),
        });
        for &byte in F::encode(setpoint.into()).as_ref() {
            match random.random_range(0..200) {
                0 | 1 => {}
                2 => steps.extend([b'b', byte ^ 1 << random.random_range(0..8)]),
                3 => steps.extend([b'b', byte, b'b', random.random()]),
                4 => steps.extend([b'e', random.random_range(0..5)]),
                _ => steps.extend([b'b', byte]),
            }
        }
        let silence = random.random_range(0..30) == 0;
        let ticks = random.random_range(0..if silence { 255 } else { 5 });
        steps.extend([b't', ticks]);
    }
    steps
}

/// Returns the expected output of `receive.c`.
fn received<F: FixedFormat<Message = Setpoint> + 'static>(steps: &[u8]) -> String {
    let mut line = Line::new(Receiver::<F>::new());
    let mut now = 0xFFFF_FF00_u32;
    let parameters = FailsafeParameters {
        hold_after: 20,
        ramp_after: 60,
        park: [128, 0, 255],
        ticks_per_unit: [1, 2, 3].map(|ticks| NonZeroU32::new(ticks).unwrap()),
    };
    let mut failsafe = Failsafe::new(parameters, now).unwrap();
    let mut text = String::new();
    for step in steps.chunks_exact(2) {
        match step {
            [b'b', byte] => {
                if let Some(setpoint) = line.push(*byte) {
                    let [pitch, roll, yaw] = setpoint.into();
                    writeln!(text, "{pitch} {roll} {yaw}").unwrap();
                    failsafe.frame(now, setpoint);
                }
            }
            [b'e', event] => line.line_event(EVENTS[usize::from(*event)], |_| ()),
            [_, ticks] => {
                now = now.wrapping_add(u32::from(*ticks));
                let output = failsafe.poll(now);
                let phases = [
                    Phase::Live,
                    Phase::Approach,
                    Phase::Hold,
                    Phase::Ramp,
                    Phase::Parked,
                ];
                let phase = phases.iter().position(|&phase| phase == output.phase);
                let [pitch, roll, yaw] = output.axes;
                writeln!(text, "phase {}: {pitch} {roll} {yaw}", phase.unwrap() + 1).unwrap();
            }
            _ => unreachable!(),
        }
    }
    let counters = line.counters();
    let (discarded, events) = (counters.discarded, counters.events);
    // The comparison is not empty.
    assert!(counters.frames > 10_000 && counters.resynchronisations > 1000);
    writeln!(
        text,
        "{} bytes, {} frames, {} in them, {} resynchronisations, {} pending",
        counters.bytes,
        counters.frames,
        counters.frame_bytes,
        counters.resynchronisations,
        line.pending()
    )
    .unwrap();
    writeln!(
        text,
        "discarded {} {} {} {} {}",
        discarded.no_sync,
        discarded.broken_sync,
        discarded.wrong_terminator,
        discarded.checksum_mismatch,
        discarded.line_event
    )
    .unwrap();
    writeln!(
        text,
        "events {} {} {} {} {}",
        events.framing, events.parity, events.overrun, events.line_break, events.idle
    )
    .unwrap();
    text
}
