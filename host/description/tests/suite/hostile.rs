//! Compares the receiver of the command line with the core's receiver on streams that are full of false starts.

use framelock::{BufferedReceiver, Counters, Format, Found, Line, LineEvent, Parser};
use framelock_description::{Description, SHIPPED};
use framelock_fuzz_oracles::Occurred;
use framelock_receiving::StreamReceiver;
use rand::seq::{IndexedMutRandom, IndexedRandom};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::drawn::{description, frames, noisy};

/// A piece of a stream, and whether a line event follows it.
type Step = (Vec<u8>, bool);

/// The results to compare: the bytes of each frame and the reason for each discarded byte, the number of pending bytes
/// after each step, and the counters.
type Outcome = (
    Vec<Result<Vec<u8>, framelock::DiscardReason>>,
    Vec<usize>,
    Counters,
);

fn received<P: Parser>(
    parser: P,
    steps: &[Step],
    frame: impl Fn(P::Message<'_>) -> Vec<u8>,
) -> Outcome {
    let (mut line, mut outcomes, mut pending) = (Line::new(parser), vec![], vec![]);
    for (bytes, is_silence) in steps {
        let mut note = |found: Found<P::Message<'_>>| match found {
            Found::Frame { message, .. } => outcomes.push(Ok(frame(message))),
            Found::Discarded { count, why, .. } => {
                outcomes.extend(std::iter::repeat_n(Err(why), count));
            }
        };
        line.feed(bytes, &mut note);
        if *is_silence {
            line.line_event(LineEvent::Idle, &mut note);
        }
        pending.push(line.pending());
    }
    (outcomes, pending, *line.counters())
}

/// Returns a stream of frame prefixes, each repeated many times and some with one byte changed. Up to three frames and
/// noise follow each prefix.
fn hostile(frames: &[Vec<u8>], random: &mut ChaCha8Rng) -> Vec<u8> {
    let mut stream = Vec::new();
    for _ in 0..random.random_range(1..5) {
        let Some(frame) = frames.choose(random) else {
            break;
        };
        let most = *[2, 12, frame.len()].choose(random).unwrap();
        let mut piece: Vec<u8> = frame
            .iter()
            .copied()
            .take(random.random_range(1..=most))
            .collect();
        if random.random() {
            *piece.choose_mut(random).unwrap() =
                *[0xFF, 3, 9, random.random()].choose(random).unwrap();
        }
        let times = random.random_range(1..1_500) / piece.len();
        stream.extend(piece.repeat(times));
        stream.extend(noisy(
            &frames[..random.random_range(0..=frames.len().min(3))],
            random,
        ));
    }
    stream
}

fn steps(mut stream: &[u8], random: &mut ChaCha8Rng) -> Vec<Step> {
    let most = *[1, 30, 3_000, 20_000].choose(random).unwrap();
    let mut steps = Vec::new();
    while !stream.is_empty() {
        let (piece, rest) = stream.split_at(random.random_range(1..=most.min(stream.len())));
        steps.push((
            piece.to_vec(),
            rest.is_empty() || random.random_ratio(1, 200),
        ));
        stream = rest;
    }
    steps
}

/// Returns the counters of the line.
fn agree(description: &Description, random: &mut ChaCha8Rng) -> Counters {
    let format = description.format();
    let frames = frames(description, random);
    let stream = hostile(&frames, random);
    let steps = steps(&stream, random);
    let buffered = BufferedReceiver::with_buffer(format, vec![0; 2 * format.longest()]).unwrap();
    let expected = received(buffered, &steps, |frame| frame.bytes().to_vec());
    let receiver = StreamReceiver::new(format).unwrap();
    let outcome = received(receiver.clone(), &steps, <[u8]>::to_vec);
    assert_eq!(outcome, expected, "{stream:02X?}");

    // The counters must also agree if a line returns one outcome per call, and if a line takes one byte per call.
    let mut counted = [Line::new(receiver.clone()), Line::new(receiver)];
    for (bytes, is_silence) in &steps {
        let mut rest = bytes.as_slice();
        while counted[0].next(&mut rest).is_some() {}
        for byte in bytes {
            counted[1].push(*byte);
            while counted[1].poll().is_some() {}
        }
        for line in counted.iter_mut().filter(|_| *is_silence) {
            line.line_event(LineEvent::Idle, |_| ());
        }
    }
    for line in counted {
        assert_eq!(*line.counters(), outcome.2);
    }
    outcome.2
}

/// The line events that these streams do not contain. They contain only idle gaps.
const NO_EVENTS: [&str; 4] = ["break", "framing error", "overrun", "parity error"];

/// Tries each shipped description, and UBX with the longest frames that its length field can express.
#[test]
fn shipped_frames_among_false_starts() {
    let ubx = framelock_description::shipped("ubx").unwrap();
    let longest = ubx.replace("longest = 4096", "longest = 65543");
    assert_ne!(longest, ubx);
    let mut in_all = Occurred::NOTHING;
    for (name, text) in SHIPPED.iter().chain(&[("ubx", &*longest)]) {
        let description = Description::parse(name, text).unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(5);
        let mut frames = 0;
        for _ in 0..60 {
            let counters = agree(&description, &mut random);
            frames += counters.frames;
            in_all.count_all(&counters);
        }
        assert!(frames > 60, "{name}: {frames}");
    }
    assert_eq!(in_all.rarer_than(61), NO_EVENTS, "{in_all:?}");
}

#[test]
fn described_frames_among_false_starts() {
    let mut occurred = Occurred::NOTHING;
    for seed in 0..3_000 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        if let Ok(description) = Description::parse("any.toml", &description(&mut random)) {
            occurred.count_all(&agree(&description, &mut random));
        }
    }
    assert_eq!(occurred.rarer_than(2_001), NO_EVENTS, "{occurred:?}");
}
