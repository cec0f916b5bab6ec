//! A C program receives frames of arbitrary layouts like a Rust program, and makes the same frames.

use std::fmt::Write;

use framelock::{BufferedReceiver, Line};
use framelock_formats::layout::{
    Algorithm, Checksum, KnownMessage, Layout, Length, LengthField, Number, Patterns,
};
use framelock_formats::{
    AnyOf, crsf, ibus,
    mavlink::{self, ARDUPILOTMEGA, COMMON},
    motion::{BIN, BIN_CRC8, SIX_AXES},
    nmea, rtcm, sbus, ubx,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::guide::hex;
use crate::receiving::EVENTS;
use crate::steps::Program;

const GNSS: &[Layout] = &[
    ubx::LAYOUT.to_builder().longest(100).build_const(),
    nmea::LAYOUT,
    rtcm::LAYOUT,
];

/// The same layouts without a content and other terminators, which C cannot describe.
const OWN_GNSS: &[Layout] = &[
    GNSS[0],
    nmea::LAYOUT
        .to_builder()
        .content(&[])
        .other_terminators(&[])
        .longest(128)
        .build_const(),
    GNSS[2],
];

const MESSAGES: &[KnownMessage] = &[
    KnownMessage::with_extra(0, 50, 9),
    KnownMessage::with_extra(30, 39, 28),
    KnownMessage::with_extra(253, 83, 54),
];

/// Layouts with parts that no protocol has, as in `layouts.c`.
const ODD: &[Layout] = &[
    Layout::builder()
        .sync(Patterns::any_of(b"<1<2", 2))
        .length(Length::Field(
            LengthField::new(Number::byte(2)).mask(7).factor(2).plus(6),
        ))
        .shortest(8)
        .longest(18)
        .checksum(Checksum::at_the_end(2).at(-3).to(-4))
        .terminator(Patterns::one(b">"))
        .build_const(),
    Layout::builder()
        .sync(Patterns::one(b"<<"))
        .longest(6)
        .checksum(
            Checksum::at_the_end(1)
                .algorithm(Algorithm::NegatedSum)
                .from(2),
        )
        .build_const(),
];

/// The lines of `layouts.c`, in its order.
const LINES: [&[Layout]; 14] = [
    &[BIN],
    &[BIN_CRC8],
    &[SIX_AXES],
    &[sbus::LAYOUT],
    &[ibus::LAYOUT],
    &[crsf::LAYOUT],
    GNSS,
    &[
        mavlink::layout_v1(COMMON),
        mavlink::layout_v2(ARDUPILOTMEGA),
    ],
    &[sbus::LAYOUT],
    &[ibus::LAYOUT],
    &[crsf::LAYOUT],
    OWN_GNSS,
    &[mavlink::layout_v1(MESSAGES), mavlink::layout_v2(MESSAGES)],
    ODD,
];

#[test]
fn c_receives_frames_of_any_layouts_as_rust_does() {
    let mut happened = [0; 18];
    let mut delivered = [0; 6];
    for program in programs(3000) {
        program.check_here();
        for line in program.expected.lines() {
            let numbers = line
                .split(' ')
                .map(str::parse)
                .collect::<Result<Vec<usize>, _>>();
            if let Ok(counters) = numbers {
                assert_eq!(counters[0], counters[2..12].iter().sum::<usize>());
                for (sum, counter) in happened.iter_mut().zip(counters) {
                    *sum += counter;
                }
            }
        }
        for (sum, first) in delivered.iter_mut().zip(["b0", "b1", "b2", "p", "e", "s"]) {
            let lines = program.expected.lines();
            *sum += lines.filter(|line| line.starts_with(first)).count();
        }
    }
    // Every compared event occurs at least once.
    assert!(
        happened.iter().all(|&counter| counter > 1000),
        "{happened:?}"
    );
    assert!(delivered.iter().all(|&count| count > 10), "{delivered:?}");
}

/// Returns the program for each line, with `frames` frames.
pub(crate) fn programs(frames: usize) -> impl Iterator<Item = Program> {
    (0..LINES.len()).map(move |number| {
        let steps = steps(number, frames);
        Program {
            page: None,
            source: "layouts.c",
            options: &[],
            expected: taken(&mut steps.clone()),
            steps,
        }
    })
}

/// Returns steps for `layouts.c`: frames of these layouts, some of them broken, with line events and polls between
/// them.
fn steps(number: usize, frames: usize) -> Vec<u8> {
    let random = &mut ChaCha8Rng::seed_from_u64(26);
    let mut steps = vec![u8::try_from(number).unwrap()];
    for _ in 0..frames {
        let which = random.random_range(0..LINES[number].len());
        let frame = frame(&LINES[number][which], random);
        if random.random_range(0..10) == 0 {
            // Sealing must write most of the frame. Sometimes the frame has one byte too many.
            let length = (frame.len() + random.random_range(0..20) / 19).min(255);
            let mut unsealed = frame.clone();
            unsealed.resize(length, 0);
            unsealed[0] = random.random();
            unsealed[length - 1] ^= random.random_range(0..2);
            steps.extend([b's', u8::try_from(which).unwrap()]);
            steps.push(u8::try_from(length).unwrap());
            steps.extend(unsealed);
        }
        for byte in frame {
            match random.random_range(0..600) {
                0 => {}
                1 | 2 => steps.extend([b'b', byte ^ 1 << random.random_range(0..8)]),
                3 => steps.extend([b'b', byte, b'b', random.random()]),
                4 => steps.extend([b'e', random.random_range(0..6)]),
                _ => steps.extend([b'b', byte]),
            }
        }
        match random.random_range(0..20) {
            0 => steps.push(b'p'),
            1 => steps.extend([b'e', 4]),
            2 => steps.push(b'c'),
            _ => {}
        }
    }
    steps.push(b'c');
    steps
}

/// Returns a random frame of the layout, of at most 90 bytes.
fn frame(layout: &Layout, random: &mut ChaCha8Rng) -> Vec<u8> {
    loop {
        let length = random.random_range(layout.shortest()..=layout.longest().min(90));
        let sync = layout.sync().bytes;
        let is_text = layout.length() == Length::Delimiter;
        // Returns a byte that looks like part of a frame, or an arbitrary byte.
        let byte = |random: &mut ChaCha8Rng| match random.random_range(0..8) {
            0 if layout.content().is_empty() => sync[random.random_range(0..sync.len())],
            _ if is_text => random.random_range(b'%'..b'~'),
            _ => random.random(),
        };
        let mut frame: Vec<u8> = (0..length).map(|_| byte(random)).collect();
        if let Some(messages) = layout.messages() {
            let known = messages.known[random.random_range(0..messages.known.len())];
            let place = &mut frame[messages.number.at..messages.number.end()];
            place.copy_from_slice(&known.number.to_le_bytes()[..place.len()]);
        }
        if let Some(trailer) = layout.trailer() {
            frame[trailer.at] = random.random_range(0..2);
            frame.resize(length + usize::from(frame[trailer.at]) * trailer.bytes, 7);
        }
        if layout.seal(&mut frame) {
            return frame;
        }
    }
}

/// Returns the expected output of the program.
fn taken(steps: &mut [u8]) -> String {
    let (number, mut steps) = steps.split_first_mut().unwrap();
    let layouts = LINES[usize::from(*number)];
    let receiver = BufferedReceiver::with_buffer(AnyOf(layouts), vec![0; 2100]).unwrap();
    let mut line = Line::new(receiver);
    let mut text = String::new();
    while let [step, rest @ ..] = steps {
        let used = match step {
            b'b' => {
                if let Some(frame) = line.push(rest[0]) {
                    say_frame(&mut text, 'b', frame.message());
                }
                1
            }
            b'p' => {
                while let Some(frame) = line.poll() {
                    say_frame(&mut text, 'p', frame.message());
                }
                0
            }
            b'e' => {
                // The last event does not exist and is ignored.
                if let Some(&event) = EVENTS.get(usize::from(rest[0])) {
                    line.line_event(event, |found| {
                        if let Some(frame) = found.message() {
                            say_frame(&mut text, 'e', frame.message());
                        }
                    });
                }
                1
            }
            b'c' => {
                say_counters(&mut text, &line);
                0
            }
            _ => {
                let (which, length) = (usize::from(rest[0]), usize::from(rest[1]));
                let frame = &mut rest[2..][..length];
                let is_sealed = layouts[which].seal(frame);
                text.push(if is_sealed { 's' } else { '-' });
                hex(&mut text, frame);
                2 + length
            }
        };
        steps = &mut rest[used..];
    }
    text
}

fn say_frame(text: &mut String, when: char, (layout, frame): (usize, &[u8])) {
    write!(text, "{when}{layout} ").unwrap();
    hex(text, frame);
}

fn say_counters(text: &mut String, line: &Line<BufferedReceiver<AnyOf, Vec<u8>>>) {
    let counters = line.counters();
    let (discarded, events) = (counters.discarded, counters.events);
    let all = [
        counters.bytes,
        counters.frames,
        counters.frame_bytes,
        discarded.no_sync,
        discarded.broken_sync,
        discarded.bad_header,
        discarded.too_long,
        discarded.unknown_message,
        discarded.wrong_terminator,
        discarded.checksum_mismatch,
        discarded.line_event,
        u32::try_from(line.pending()).unwrap(),
        counters.resynchronisations,
        events.framing,
        events.parity,
        events.overrun,
        events.line_break,
        events.idle,
    ];
    writeln!(text, "{}", all.map(|it| it.to_string()).join(" ")).unwrap();
}
