//! Tests that the programs in `docs/c.md` do the same as programs in Rust, on faulty streams.

use framelock::motion::{Bin, Failsafe, FailsafeParameters};
use framelock::{BufferedReceiver, Counters, Encode, Format, Line, LineEvent, Receiver};
use framelock_description::hex::glued;
use framelock_description::{Description, shipped};
use framelock_description_oracles as drawn;
use framelock_oracles::broken;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::compilers::{GCC, assert_same};
use crate::delivery::{PAGE, blocks};

/// Kinds of steps in `guide.c`: a received byte, and an event, whose meaning depends on the program.
const BYTE: u8 = 0;
const EVENT: u8 = 1;

/// Compiles `guide.c` with program number `program` of the page. Asserts that the program prints the expected
/// output. `option` selects the part of `guide.c`.
fn check(program: usize, option: &str, steps: &[u8], expected: &str) {
    let page = blocks(PAGE, "c")[program];
    let program = GCC.program("guide.c", &[("page.c", page)], &[option]);
    assert_same(&program.run(steps), expected);
}

/// Asserts that many frames were received, some of them after discarded bytes.
fn assert_many(counters: &Counters) {
    let is_many = counters.frames > 500 && counters.resynchronisations > 50;
    assert!(is_many, "{counters:?}");
}

/// Returns the last line of the output.
fn totals(counters: &Counters) -> String {
    let (frames, bytes) = (counters.frames, counters.bytes);
    let resynchronisations = counters.resynchronisations;
    format!("{frames} frames in {bytes} bytes, {resynchronisations} resynchronisations\n")
}

fn hex(bytes: &[u8]) -> String {
    glued(bytes) + "\n"
}

/// Returns the bytes of a frame as they arrive. About one frame in 20 has a fault.
fn with_faults(frame: &[u8], random: &mut ChaCha8Rng) -> Vec<u8> {
    if random.random_range(0..20) == 0 {
        broken(frame, |count| random.random_range(0..count))
    } else {
        frame.to_vec()
    }
}

/// In the program with a failsafe: a byte that arrives while the next step's `control` runs.
const BYTE_IN_CONTROL: u8 = 2;
/// In the programs with a ring buffer and with a queue: a byte with an error.
const ERROR: u8 = 2;

/// Does in Rust what the program with a failsafe does in C. Returns the output and the receiver. The interrupt puts
/// setpoints into a mailbox.
fn interrupt_and_control(steps: &[u8]) -> (String, Line<Receiver<Bin>>) {
    let mut line = Line::new(Receiver::<Bin>::new());
    let parameters = FailsafeParameters::for_clock(1_000, 10, [128; 3]);
    let mut failsafe = Failsafe::new(parameters, 0).unwrap();
    let (mut now, mut byte_time, mut text) = (0_u32, 0, String::new());
    let (mut mailbox, mut waiting) = (None, None);
    let mut interrupt = |now: u32, mailbox: &mut Option<_>, byte: Option<u8>| {
        if now - byte_time >= 5 {
            line.line_event(LineEvent::Idle, |_| ());
        }
        byte_time = now;
        if let Some(byte) = byte {
            *mailbox = line.push(byte).or(*mailbox);
        } else {
            line.line_event(LineEvent::Framing, |_| ());
        }
    };
    for step in steps.chunks_exact(2) {
        match *step {
            [BYTE, byte] => interrupt(now, &mut mailbox, Some(byte)),
            [BYTE_IN_CONTROL, byte] => waiting = Some(byte),
            [_, 0] => interrupt(now, &mut mailbox, None),
            [_, milliseconds] => {
                now += u32::from(milliseconds);
                if let Some(setpoint) = mailbox.take() {
                    failsafe.frame(setpoint);
                }
                if waiting.is_some() {
                    interrupt(now, &mut mailbox, waiting.take());
                }
                text.push_str(&hex(&failsafe.poll(now).axes));
            }
            _ => panic!("half a step"),
        }
    }
    (text, line)
}

#[test]
fn interrupt_handler_with_failsafe() {
    let random = &mut ChaCha8Rng::seed_from_u64(1);
    let mut steps = Vec::new();
    for number in 0..3000 {
        let payload = [(); 3].map(|()| b"AAB\r\x80"[random.random_range(0..5)]);
        let frame = Bin::encode(payload.into());
        for byte in with_faults(&frame, random) {
            match random.random_range(0..200) {
                0 => steps.extend([EVENT, 0]),
                1..20 => steps.extend([BYTE_IN_CONTROL, byte, EVENT, 1]),
                _ => steps.extend([BYTE, byte]),
            }
        }
        // Half of the time, frames come fast enough to make the output live.
        let longest = if number / 500 % 2 == 0 { 20 } else { 120 };
        let is_silent = random.random_range(0..300) == 0;
        for _ in 0..if is_silent { 300 } else { 1 } {
            steps.extend([EVENT, random.random_range(1..longest)]);
        }
    }
    let (text, line) = interrupt_and_control(&steps);
    let is_parked = |line: &&str| *line == "808080";
    assert!(text.lines().filter(is_parked).count() > 100, "it parks");
    let has_moved = |line: &&str| line.contains("41") || line.contains("42");
    assert!(text.lines().filter(has_moved).count() > 100, "it moves");
    let events = line.counters().events;
    assert!(events.framing > 50 && events.idle > 1000, "{events:?}");
    assert_many(line.counters());
    check(1, "-DINTERRUPT", &steps, &(text + &totals(line.counters())));
}

/// The program with a ring buffer, and the program with a queue.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Buffer {
    Ring,
    Queue,
}

/// Returns the expected output: the text that `say` returns for each frame, and then the totals.
fn expected(
    buffer: Buffer,
    description: &Description,
    steps: &[u8],
    say: impl Fn(&[u8]) -> String,
) -> String {
    let format = description.format();
    let receiver = BufferedReceiver::with_buffer(format.clone(), vec![0; 2 * format.longest()]);
    let mut line = Line::new(receiver.unwrap());
    let mut text = String::new();
    let mut waiting = Vec::new();
    let mut event = None;
    let (mut now, mut byte_time, mut at_events) = (0_u32, 0, 0);
    for step in steps.chunks_exact(2) {
        if step[0] != EVENT {
            match buffer {
                Buffer::Ring if event.is_some() => {}
                Buffer::Ring if step[0] == ERROR => event = Some(LineEvent::Framing),
                Buffer::Ring if waiting.len() == 63 => event = Some(LineEvent::Overrun),
                Buffer::Queue if step[0] == ERROR => event = Some(LineEvent::Parity),
                _ => waiting.push(step[1]),
            }
            if buffer != Buffer::Queue || event.is_none() {
                continue;
            }
        }
        if buffer == Buffer::Ring {
            now += u32::from(step[1]);
            if !waiting.is_empty() {
                byte_time = now;
            }
        }
        for byte in waiting.drain(..) {
            if let Some(frame) = line.push(byte) {
                text.push_str(&say(frame.bytes()));
            }
        }
        let pause = match buffer {
            Buffer::Ring => line.pending() > 0 && now - byte_time >= 50,
            Buffer::Queue => true,
        };
        let before = text.len();
        if let Some(event) = event.take().or(pause.then_some(LineEvent::Idle)) {
            line.line_event(event, |found| {
                if let Some(frame) = found.message() {
                    text.push_str(&say(frame.bytes()));
                }
            });
        }
        while buffer == Buffer::Ring
            && let Some(frame) = line.poll()
        {
            text.push_str(&say(frame.bytes()));
        }
        at_events += u32::from(text.len() > before);
    }
    // The program with a ring receives NMEA. A broken NMEA sentence is rejected before the next sentence begins, so no
    // event delivers a sentence.
    assert!(
        at_events > 0 || buffer == Buffer::Ring,
        "no event delivers a frame"
    );
    let events = line.counters().events;
    assert!(events.idle > 20, "{events:?}");
    assert_eq!(events.overrun > 50, buffer == Buffer::Ring, "{events:?}");
    assert_eq!(events.framing > 50, buffer == Buffer::Ring, "{events:?}");
    assert_eq!(events.parity > 50, buffer == Buffer::Queue, "{events:?}");
    assert_many(line.counters());
    text + &totals(line.counters())
}

/// Returns steps with the frames, some of which are faulty. An event follows some of the frames. There are at most
/// `most` bytes between two events.
fn steps(
    frames: impl IntoIterator<Item = Vec<u8>>,
    most: usize,
    random: &mut ChaCha8Rng,
) -> Vec<u8> {
    let (mut steps, mut count) = (Vec::new(), 0);
    for frame in frames {
        for byte in with_faults(&frame, random) {
            if count == most {
                steps.extend([EVENT, u8::from(random.random_range(0..8) == 0)]);
                count = random.random_range(0..most);
            }
            steps.extend([BYTE, byte]);
            count += 1;
        }
        if random.random_range(0..4) == 0 {
            steps.extend([EVENT, 1]);
            count = 0;
        }
    }
    steps.extend([EVENT, 1]);
    steps
}

/// Replaces some of the bytes by errors.
fn with_errors(steps: &mut [u8], random: &mut ChaCha8Rng) {
    for step in steps.chunks_exact_mut(2) {
        if step[0] == BYTE && random.random_range(0..500) == 0 {
            // In the program with a queue, 1 is a parity error.
            step.copy_from_slice(&[ERROR, 1]);
        }
    }
}

fn description(name: &str) -> Description {
    Description::parse(name, shipped(name).unwrap()).unwrap()
}

/// Draws random frames 500 times, and returns all of them.
fn drawn_frames(description: &Description, random: &mut ChaCha8Rng) -> Vec<Vec<u8>> {
    (0..500)
        .flat_map(|_| drawn::frames(description, random))
        .collect()
}

#[test]
fn main_loop_with_ring_buffer() {
    let random = &mut ChaCha8Rng::seed_from_u64(3);
    let description = description("nmea");
    let mut steps = steps(drawn_frames(&description, random), 70, random);
    with_errors(&mut steps, random);
    // Make some pauses so long that the program reports them.
    let steps = steps.chunks_exact(2).flat_map(|step| match step[0] {
        EVENT if random.random() => [step, &[EVENT, random.random_range(40..60)]].concat(),
        _ => step.to_vec(),
    });
    let steps: Vec<u8> = steps.collect();
    let sentence = |frame: &[u8]| {
        let star = frame.iter().rposition(|byte| *byte == b'*');
        hex(&frame[1..star.unwrap()])
    };
    let expected = expected(Buffer::Ring, &description, &steps, sentence);
    check(3, "-DRING", &steps, &expected);
}

#[test]
fn task_with_queue() {
    let random = &mut ChaCha8Rng::seed_from_u64(4);
    let description = description("mavlink2");
    let mut steps = steps(drawn_frames(&description, random), usize::MAX, random);
    with_errors(&mut steps, random);
    let message = |frame: &[u8]| {
        let number = u32::from_le_bytes([frame[7], frame[8], frame[9], 0]);
        let payload = &frame[10..][..usize::from(frame[1])];
        format!("{number} {}", hex(payload))
    };
    let expected = expected(Buffer::Queue, &description, &steps, message);
    check(4, "-DQUEUE", &steps, &expected);
}
