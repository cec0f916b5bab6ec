//! The programs in `docs/c-library.md` behave like the same programs in Rust, on this computer and on the emulated chip.

use std::fmt::Write;
use std::num::NonZeroU32;

use framelock::motion::{Bin, Failsafe, FailsafeParameters};
use framelock::{BufferedReceiver, Format, Found, Frame, Line, LineEvent, Receiver};
use framelock_formats::layout::{Algorithm, Checksum, Crc, Layout, Length, LengthField, Patterns};
use framelock_formats::{classify_by, crsf};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::pages::{IN_C, blocks, faulty_stream};
use crate::steps::Program;

#[test]
fn the_guides_programs_do_what_it_says() {
    programs(5000).iter().for_each(Program::check_here);
}

/// Returns the page's programs, with streams of about `frames` frames.
pub(crate) fn programs(frames: usize) -> [Program; 4] {
    let [platform, crsf, gnss, motor] = blocks(IN_C, "c")[..] else {
        panic!("the page has four programs");
    };
    // The stream ends with noise, an error within a frame, and silence.
    let mut stream = faulty_stream(frames);
    stream.extend(b"AB\0\xFFxyz\rAB\0xyz\r");
    stream.extend([0; 3000]);
    let crsf_steps = steps(&crsf::LAYOUT, 26, frames, (2, 0x16), &[0xC8, 62]);
    let motor_steps = steps(&MOTOR, 11, frames, (3, 1), &[0xAA, 0x55, 16]);
    [
        Program {
            page: Some(platform),
            source: "guide_platform.c",
            options: &[],
            expected: driven(&stream),
            steps: stream,
        },
        Program {
            page: Some(crsf),
            source: "guide_layouts.c",
            options: &[],
            expected: received(Any(&crsf::LAYOUT), &crsf_steps, |frame| {
                (frame.len() == 26 && frame[2] == 0x16).then(|| frame[3..25].to_vec())
            }),
            steps: crsf_steps,
        },
        Program {
            page: Some(gnss),
            source: "guide_start.c",
            options: &[],
            steps: vec![0],
            expected: "it starts\n".to_owned(),
        },
        Program {
            page: Some(motor),
            source: "guide_layouts.c",
            options: &["-DMOTOR"],
            expected: received(Any(&MOTOR), &motor_steps, |frame| {
                (frame.len() == 11 && frame[3] == 1)
                    .then(|| [5, 4, 7, 6, 8].map(|at| frame[at]).to_vec())
            }),
            steps: motor_steps,
        },
    ]
}

/// Returns the setpoint of the actuators after each millisecond.
fn driven(stream: &[u8]) -> String {
    let mut line = Line::new(Receiver::<Bin>::new());
    let parameters = FailsafeParameters {
        hold_after: 100,
        ramp_after: 500,
        park: [128; 3],
        ticks_per_unit: [NonZeroU32::new(10).unwrap(); 3],
    };
    let mut failsafe = Failsafe::new(parameters, 0).unwrap();
    let mut text = String::new();
    for (now, &byte) in (0..).zip(stream) {
        if byte == 0xFF {
            line.line_event(LineEvent::Framing, |_| ());
        } else if let Some(setpoint) = line.push(byte) {
            failsafe.frame(now, setpoint);
        }
        let [pitch, roll, yaw] = failsafe.poll(now).axes;
        writeln!(text, "{pitch} {roll} {yaw}").unwrap();
    }
    assert!(text.ends_with("128 128 128\n"), "it parks");
    text
}

/// The page's motor, from its captured bytes and `docs/own-frame.md`.
const MOTOR: Layout = Layout::builder()
    .sync(Patterns::one(&[0xAA, 0x55]))
    .length(Length::Field(LengthField::byte(2).plus(5)))
    .shortest(6)
    .longest(21)
    .checksum(
        Checksum::at_the_end(2)
            .algorithm(Algorithm::Crc(
                Crc::new(16, 0x8005).initial(0xFFFF).reflected(),
            ))
            .from(2),
    )
    .build_const();

/// A format whose message is the frame itself, for any layout.
#[derive(Clone, Copy)]
struct Any(&'static Layout<'static>);

impl Format for Any {
    classify_by!(MOTOR.to_builder().longest(64).build_const(), |format| {
        format.0
    });
    type Message<'a> = &'a [u8];

    fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] {
        frame
    }
}

/// Returns frames with `byte` at index `at`, most of them with `length` bytes. Some are broken. Some follow a false
/// start and precede an idle line.
fn steps(
    layout: &Layout,
    length: usize,
    frames: usize,
    (at, byte): (usize, u8),
    beginning: &[u8],
) -> Vec<u8> {
    let random = &mut ChaCha8Rng::seed_from_u64(5);
    let mut steps = Vec::new();
    for _ in 0..frames {
        let is_usual = random.random_range(0..8) > 0;
        let length = if is_usual {
            length
        } else {
            layout.shortest() + 3
        };
        let mut frame: Vec<u8> = (0..length).map(|_| random.random()).collect();
        frame[at] = byte;
        assert!(layout.seal(&mut frame));
        let is_late = random.random_range(0..20) == 0;
        let beginning = if is_late { beginning } else { &[] };
        for byte in [beginning, &frame].concat() {
            match random.random_range(0..400) {
                0 => {}
                1 => steps.extend([b'b', !byte]),
                2 => steps.extend([b'e', byte]),
                _ => steps.extend([b'b', byte]),
            }
        }
        match random.random_range(0..20) {
            _ if is_late => steps.push(b'i'),
            0 => steps.extend([b's', random.random()]),
            _ => {}
        }
    }
    steps.push(b'i');
    steps
}

/// Returns the program's expected output: the bytes that `say` returns for the received frames.
fn received(format: Any, steps: &[u8], say: impl Fn(&[u8]) -> Option<Vec<u8>>) -> String {
    let sends = format.0 == &MOTOR;
    let mut line = Line::new(BufferedReceiver::<_, [u8; 128]>::new(format));
    let (mut text, mut at_events) = (String::new(), 0);
    let mut steps = steps.iter().copied();
    while let Some(step) = steps.next() {
        let mut event = |line: &mut Line<_>, event, text: &mut String| {
            Line::<BufferedReceiver<Any, [u8; 128]>>::line_event(
                line,
                event,
                |found: Found<Frame<'_, Any>>| {
                    if let Some(said) = found.message().and_then(|frame| say(frame.bytes())) {
                        hex(text, &said);
                        at_events += 1;
                    }
                },
            );
        };
        match step {
            b'i' => event(&mut line, LineEvent::Idle, &mut text),
            b'e' => {
                steps.next();
                event(&mut line, LineEvent::Framing, &mut text);
            }
            b's' => {
                let mut frame = [0, 0, 0, 2, steps.next().unwrap(), 0, 0];
                if sends {
                    assert!(MOTOR.seal(&mut frame));
                    hex(&mut text, &frame);
                }
            }
            _ => {
                if let Some(said) = line
                    .push(steps.next().unwrap())
                    .and_then(|frame| say(frame.bytes()))
                {
                    hex(&mut text, &said);
                }
            }
        }
    }
    // Frames were received, some of them at an event, and other frames were lost.
    assert!(text.lines().count() * 3 > line.counters().frames as usize && at_events > 0);
    assert!(line.counters().resynchronisations > 0);
    text
}

pub(crate) fn hex(text: &mut String, bytes: &[u8]) {
    for byte in bytes {
        write!(text, "{byte:02X}").unwrap();
    }
    text.push('\n');
}
