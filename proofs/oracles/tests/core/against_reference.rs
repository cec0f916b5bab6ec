//! Compares the receivers with the naive reference, on every short stream and on random streams.
//! Also compares the reference itself with regular expressions.

use std::sync::{Mutex, MutexGuard};

use framelock::motion::Bin;
use framelock::{Counters, Line, LineEvent, Receiver};
use framelock_oracles::{AnyFormat, Occurred, Stream, StreamStep, framing, parser, reader};
use framelock_proofs::reference::{self, whole_buffer};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Checks the stream as one slice.
fn check(bytes: &[u8]) {
    let stream = Stream(vec![StreamStep::Slice(bytes.to_vec())]);
    parser(&stream, &mut Occurred::default());
}

/// Checks every stream of up to ten bytes over {'A', 'B', CR, other}. There are 4^10 streams of ten
/// bytes. Every shorter stream is the beginning of one of them.
#[test]
fn every_stream_of_ten_bytes() {
    const ALPHABET: [u8; 4] = [0x41, 0x42, 0x0D, 0x80];
    for stream in 0..1_u32 << 20 {
        let bytes: [u8; 10] =
            std::array::from_fn(|place| ALPHABET[(stream >> (2 * place) & 3) as usize]);
        // Cut each stream at a different position than the previous one.
        let (before, behind) = bytes.split_at(stream as usize % 11);
        let slices = [before, behind].map(|slice| StreamStep::Slice(slice.to_vec()));
        parser(&Stream(slices.into()), &mut Occurred::default());
    }
}

/// Checks every stream of up to seven bytes over {'A', 'B', CR, other}, on the fast path for slices. The stream lies in
/// a slice that is long enough for this path. Frames or noise come before and after the stream, so that the stream also
/// lies across the edge of a block, which is the unit in which this path searches.
#[test]
fn every_stream_of_seven_bytes_within_a_long_slice() {
    const ALPHABET: [u8; 4] = [0x41, 0x42, 0x0D, 0x80];
    for stream in 0..1_usize << 14 {
        let short: [u8; 7] = std::array::from_fn(|place| ALPHABET[stream >> (2 * place) & 3]);
        let frames = b"AB\0xyz\r".repeat(stream % 11);
        let noise = vec![b'x'; 55 + stream % 13];
        check(&[&frames, short.as_slice(), &noise, &short, &noise].concat());
        check(&[&noise, short.as_slice(), &frames, &noise[..40]].concat());
    }
}

/// Generates streams that often break parsers: frames, bytes that look like frames, and noise.
fn stream(longest: usize) -> impl Strategy<Value = Vec<u8>> {
    let likely = prop::sample::select(vec![b'A', b'B', b'\r', 0x80]);
    let part = prop_oneof![
        any::<[u8; 4]>().prop_map(|[a, b, c, d]| vec![b'A', b'B', a, b, c, d, b'\r']),
        (any::<[u8; 4]>(), 8..20_usize)
            .prop_map(|([a, b, c, d], count)| [b'A', b'B', a, b, c, d, b'\r'].repeat(count)),
        any::<[u8; 4]>().prop_map(|payload| {
            let crc = reference::crc8(&payload);
            [b"AB".as_slice(), &payload, &[crc, b'\r']].concat()
        }),
        prop::collection::vec(likely, 1..20),
        prop::collection::vec(any::<u8>(), 1..20),
        (any::<u8>(), 1..200_usize).prop_map(|(byte, count)| vec![byte; count]),
    ];
    prop::collection::vec(part, 0..longest).prop_map(|parts| parts.concat())
}

/// Generates slices of such streams, with line events between some of them.
fn steps() -> impl Strategy<Value = Vec<StreamStep>> {
    let event = prop::sample::select(vec![
        LineEvent::Framing,
        LineEvent::Parity,
        LineEvent::Overrun,
        LineEvent::Break,
        LineEvent::Idle,
    ]);
    let slices =
        (stream(20), prop::collection::vec(0..200_usize, 0..4)).prop_map(|(bytes, mut cuts)| {
            let mut rest = bytes.as_slice();
            cuts.push(usize::MAX);
            let slice = |cut: usize| {
                let (slice, behind) = rest.split_at(cut.min(rest.len()));
                rest = behind;
                StreamStep::Slice(slice.to_vec())
            };
            cuts.into_iter().map(slice).collect::<Vec<_>>()
        });
    let part = (slices, prop::option::of(event)).prop_map(|(mut steps, event)| {
        steps.extend(event.map(StreamStep::Event));
        steps
    });
    prop::collection::vec(part, 0..6).prop_map(|parts| parts.concat())
}

/// Returns the indices of the last bytes of the frames that the reference finds.
fn ends<F: reference::NaiveFormat>(bytes: &[u8]) -> Vec<usize> {
    let mut ends = Vec::new();
    let mut known = 0;
    whole_buffer::<F>(bytes, |found| {
        known += found.bytes();
        ends.extend(found.message().map(|_| known - 1));
    });
    ends
}

/// The outcomes in the random streams for each machine, in the order of the results of `parser`.
static OF_MACHINES: [Mutex<Occurred>; 3] = [const { Mutex::new(Occurred::NOTHING) }; 3];
/// The outcomes of all machines, and the states of their lines.
static OF_LINES: Mutex<Occurred> = Mutex::new(Occurred::NOTHING);
/// The outcomes of the reader.
static OF_READER: Mutex<Occurred> = Mutex::new(Occurred::NOTHING);
/// The outcomes of the random formats, for each length of the longest frame.
static OF_FORMATS: [Mutex<Occurred>; 4] = [const { Mutex::new(Occurred::NOTHING) }; 4];

fn locked(occurred: &Mutex<Occurred>) -> MutexGuard<'_, Occurred> {
    occurred.lock().expect("no oracle panics")
}

proptest! {
    fn any_stream(steps in steps()) {
        let stream = Stream(steps);
        let counters = parser(&stream, &mut locked(&OF_LINES));
        for (occurred, counters) in OF_MACHINES.iter().zip(counters) {
            locked(occurred).count_all(&counters);
        }
        reader(&stream, &mut locked(&OF_READER));
    }

    /// Regular expressions are a second, independent oracle. A match of the second expression is the bytes that the
    /// lecture's machine takes from an `A` until it is again in its state at reset.
    #[test]
    fn the_reference_against_regular_expressions(bytes in stream(40)) {
        let framelock = regex::bytes::Regex::new(r"(?s-u)AB.{4}\r").expect("a valid expression");
        let found: Vec<_> = framelock.find_iter(&bytes).map(|frame| frame.end() - 1).collect();
        prop_assert_eq!(ends::<reference::Bin>(&bytes), found);

        let lecture =
            regex::bytes::Regex::new(r"(?s-u)A(?:B.{4}(?:(\r)|.)|[^B])").expect("a valid expression");
        let found: Vec<_> = lecture
            .captures_iter(&bytes)
            .filter_map(|consumed| consumed.get(1))
            .map(|terminator| terminator.start())
            .collect();
        prop_assert_eq!(ends::<reference::Lecture>(&bytes), found);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1_000, rng_seed: RngSeed::Fixed(1), ..ProptestConfig::default() })]

    fn any_format(seed: u32, patience: u8, steps in steps()) {
        let occurred = &OF_FORMATS[usize::from(patience / 16 % 4)];
        let input = AnyFormat { seed, patience, stream: Stream(steps) };
        framing(&input, &mut locked(occurred));
    }
}

#[test]
fn any_stream_cut_anywhere_with_line_events() {
    any_stream();
    let without_checksum = [
        "bad header",
        "broken stuffing",
        "checksum mismatch",
        "too long",
        "unknown message",
    ];
    let with_checksum = [
        "bad header",
        "broken stuffing",
        "too long",
        "unknown message",
    ];
    let expected = [&without_checksum[..], &without_checksum, &with_checksum];
    assert_eq!(
        OF_MACHINES.each_ref().map(|it| locked(it).missing()),
        expected
    );
    assert_eq!(locked(&OF_LINES).missing(), with_checksum);
    let of_reader = [
        &with_checksum[..],
        &["break", "framing error", "parity error"],
    ]
    .concat();
    let missing = locked(&OF_READER).missing();
    assert!(
        missing.iter().all(|it| of_reader.contains(it)),
        "{missing:?}"
    );
}

/// Tests formats whose classifications are random, and whose longest frame has 9, 5, 2 or 1 bytes.
#[test]
fn any_format_cut_anywhere_with_line_events() {
    any_format();
    let [nine, five, two, one] = OF_FORMATS.each_ref().map(|it| locked(it).missing());
    assert_eq!([nine, five, two], [["broken stuffing"]; 3]);
    // A frame of one byte is never pending.
    let of_pending = [
        "a line event ends a frame",
        "a line event while bytes are undecided",
        "a pushed frame comes late",
        "broken stuffing",
        "discarded by a line event",
        "fed while bytes are pending",
        "fed while bytes are undecided",
        "polled in steps while bytes are undecided",
        "pulled while bytes are pending",
        "pulled while bytes are undecided",
        "pushed while bytes are pending",
        "pushed while bytes are undecided",
    ];
    assert_eq!(one, of_pending);
}

/// Counters wrap around from their largest value to 0. The total of the discarded bytes wraps, too.
#[test]
fn counters_wrap() {
    let most = u32::MAX;
    let mut counters = Counters::default();
    let (discarded, events) = (&mut counters.discarded, &mut counters.events);
    for counter in [
        &mut counters.bytes,
        &mut counters.frames,
        &mut counters.frame_bytes,
        &mut counters.resynchronisations,
        &mut discarded.no_sync,
        &mut discarded.broken_sync,
        &mut discarded.bad_header,
        &mut discarded.too_long,
        &mut discarded.unknown_message,
        &mut discarded.checksum_mismatch,
        &mut discarded.wrong_terminator,
        &mut discarded.broken_stuffing,
        &mut discarded.line_event,
        &mut events.framing,
        &mut events.parity,
        &mut events.overrun,
        &mut events.line_break,
        &mut events.idle,
    ] {
        *counter = most;
    }
    let discarded = counters.discarded;
    let mut line = Line::resumed(Receiver::<Bin>::new(), counters);
    line.feed(b"xAB\0abc\rAB", |_| ());
    line.line_event(LineEvent::Idle, |_| ());
    let after = *line.counters();
    assert_eq!(
        (after.bytes, after.frames, after.resynchronisations),
        (9, 0, 0)
    );
    assert_eq!(
        (after.discarded.no_sync, after.discarded.line_event),
        (0, 1)
    );
    assert_eq!(after.events.idle, 0);
    assert_eq!(after.discarded.total(), discarded.total().wrapping_add(3));
}
