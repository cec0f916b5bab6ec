//! Every short stream, and streams nobody thought of, against the naive reference; and the
//! reference itself against regular expressions.
#![allow(clippy::indexing_slicing, reason = "a test may panic")]

use framelock::{
    Accounting, Bin, BinCrc8, Discard, Discarded, Lecture, LineEvent, Mismatch, Parser, Receiver,
    Setpoint, Sink,
};
use framelock_proofs::reference::{self, Event, Policy, whole_buffer};
use proptest::prelude::*;

/// What a parser, or the reference, makes of a stream.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
struct Outcome {
    frames: Vec<(usize, Setpoint)>,
    dropped: Discarded,
    pending: usize,
}

impl Outcome {
    fn drop(&mut self, count: usize, why: Mismatch) {
        *match why {
            Mismatch::NoSync => &mut self.dropped.no_sync,
            Mismatch::BrokenSync => &mut self.dropped.broken_sync,
            Mismatch::Check => &mut self.dropped.check,
            Mismatch::Terminator => &mut self.dropped.terminator,
        } += count as u64;
    }
}

/// An outcome that is being written; `offset` is where the slice fed now begins.
struct Writer<'a>(&'a mut Outcome, usize);

impl Sink<Setpoint> for Writer<'_> {
    fn frame(&mut self, index: usize, setpoint: Setpoint) {
        self.0.frames.push((self.1 + index, setpoint));
    }

    fn dropped(&mut self, count: usize, why: Mismatch) {
        self.0.drop(count, why);
    }
}

fn expected<F: reference::Format>(bytes: &[u8], policy: Policy) -> Outcome {
    let mut outcome = Outcome::default();
    outcome.pending = whole_buffer::<F>(bytes, policy, |event| match event {
        Event::Frame { index, setpoint } => outcome.frames.push((index, setpoint.into())),
        Event::Dropped { count, place } => outcome.drop(
            count,
            match place {
                0 => Mismatch::NoSync,
                1 => Mismatch::BrokenSync,
                place if place == F::LENGTH - 1 => Mismatch::Terminator,
                _ => Mismatch::Check,
            },
        ),
    });
    outcome
}

/// The stream, cut as given, three ways: pushed, fed to a closure, fed to a sink that wants what
/// was dropped. All must agree with the reference, and end in the same state.
fn check<P, F>(parser: P, policy: Policy, bytes: &[u8], cuts: &[usize])
where
    P: Parser<Message = Setpoint> + Copy + PartialEq + std::fmt::Debug,
    F: reference::Format,
{
    let expected = expected::<F>(bytes, policy);
    let (mut pushed, mut fed, mut accounted) = (parser, parser, Accounting::new(parser));
    let mut pushed_frames = Vec::new();
    for (index, &byte) in bytes.iter().enumerate() {
        pushed_frames.extend(pushed.push(byte).map(|setpoint| (index, setpoint)));
    }
    assert_eq!(pushed_frames, expected.frames, "pushed: {bytes:02X?}");

    let mut fed_frames = Vec::new();
    let mut written = Outcome::default();
    let mut writing = parser;
    let mut from = 0;
    for to in cuts.iter().copied().chain([bytes.len()]) {
        let to = to.clamp(from, bytes.len());
        let slice = &bytes[from..to];
        fed.feed(slice, &mut |index, setpoint| {
            fed_frames.push((from + index, setpoint));
        });
        writing.feed(slice, &mut Writer(&mut written, from));
        accounted.feed(slice, |_, _| ());
        from = to;
    }
    written.pending = writing.pending();
    assert_eq!(
        fed_frames, expected.frames,
        "fed: {bytes:02X?} cut at {cuts:?}"
    );
    assert_eq!(
        written, expected,
        "fed to a sink: {bytes:02X?} cut at {cuts:?}"
    );
    assert_eq!(fed, pushed, "fed: {bytes:02X?} cut at {cuts:?}");
    assert_eq!(
        writing, pushed,
        "fed to a sink: {bytes:02X?} cut at {cuts:?}"
    );

    let counters = accounted.counters();
    assert_eq!(counters.discarded, expected.dropped);
    assert_eq!(counters.frames, expected.frames.len() as u64);
    let placed = P::FRAME_LENGTH as u64 * counters.frames
        + counters.discarded.total()
        + accounted.pending() as u64;
    assert_eq!(
        (counters.bytes, placed),
        (bytes.len() as u64, bytes.len() as u64)
    );
}

fn check_all(bytes: &[u8], cuts: &[usize]) {
    check::<_, reference::Bin>(Receiver::<Bin>::new(), Policy::Rescan, bytes, cuts);
    check::<_, reference::Bin>(
        Receiver::<Bin, Discard>::new(),
        Policy::Discard,
        bytes,
        cuts,
    );
    check::<_, reference::Bin>(Lecture::new(), Policy::Discard, bytes, cuts);
    check::<_, reference::BinCrc8>(Receiver::<BinCrc8>::new(), Policy::Rescan, bytes, cuts);
    check::<_, reference::BinCrc8>(
        Receiver::<BinCrc8, Discard>::new(),
        Policy::Discard,
        bytes,
        cuts,
    );
}

/// Every stream of up to ten bytes over {'A', 'B', CR, other}: 4^10 of the longest, whose
/// beginnings are all the shorter ones.
#[test]
fn every_stream_of_ten_bytes() {
    const ALPHABET: [u8; 4] = [0x41, 0x42, 0x0D, 0x80];
    for stream in 0..1_u32 << 20 {
        let bytes: [u8; 10] =
            std::array::from_fn(|place| ALPHABET[(stream >> (2 * place) & 3) as usize]);
        // A cut that moves on from stream to stream.
        check_all(&bytes, &[stream as usize % 11]);
    }
}

/// Every stream of up to seven bytes over the same, where the slice path finds it: in a slice long
/// enough for that, behind a frame or noise, before frames or noise, and across the edge of a block.
#[test]
fn every_stream_of_seven_bytes_within_a_long_slice() {
    const ALPHABET: [u8; 4] = [0x41, 0x42, 0x0D, 0x80];
    for stream in 0..1_usize << 14 {
        let short: [u8; 7] = std::array::from_fn(|place| ALPHABET[stream >> (2 * place) & 3]);
        let frames = b"AB\0xyz\r".repeat(stream % 11);
        let noise = vec![b'x'; 55 + stream % 13];
        check_all(
            &[&frames, short.as_slice(), &noise, &short, &noise].concat(),
            &[],
        );
        check_all(
            &[&noise, short.as_slice(), &frames, &noise[..40]].concat(),
            &[],
        );
    }
}

/// Frames, bytes that look like frames, and noise: what makes parsers go wrong.
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

proptest! {
    #[test]
    fn any_stream_cut_anywhere(
        bytes in stream(40),
        mut cuts in prop::collection::vec(0..400_usize, 0..8),
    ) {
        cuts.sort_unstable();
        check_all(&bytes, &cuts);
    }

    /// A line event anywhere: afterwards all is as at reset, and nothing is unaccounted for.
    #[test]
    fn line_events_anywhere(
        parts in prop::collection::vec((stream(6), 0..5_usize), 0..8),
    ) {
        let events = [
            LineEvent::Framing,
            LineEvent::Parity,
            LineEvent::Overrun,
            LineEvent::Break,
            LineEvent::Idle,
        ];
        let mut line = Accounting::new(Receiver::<Bin>::new());
        let mut received = Vec::new();
        let mut separate = Vec::new();
        let (mut bytes, mut held, mut counted) = (0, 0, [0; 5]);
        for (part, event) in &parts {
            line.feed(part, |index, setpoint| received.push((bytes + index, setpoint)));
            let alone = expected::<reference::Bin>(part, Policy::Rescan);
            separate.extend(alone.frames.iter().map(|&(index, setpoint)| (bytes + index, setpoint)));
            bytes += part.len();
            prop_assert_eq!(line.pending(), alone.pending);
            held += alone.pending as u64;
            line.line_event(events[*event]);
            counted[*event] += 1;
            prop_assert_eq!(line.parser(), &Receiver::new());
        }
        prop_assert_eq!(received, separate);
        let counters = line.counters();
        prop_assert_eq!(counters.discarded.line_event, held);
        prop_assert_eq!(counters.bytes, 7 * counters.frames + counters.discarded.total());
        let events = counters.events;
        prop_assert_eq!(
            [events.framing, events.parity, events.overrun, events.line_break, events.idle],
            counted
        );
    }

    /// The third oracle. Under Discard, what the machine consumes together is one match.
    #[test]
    fn the_reference_against_regular_expressions(bytes in stream(40)) {
        let rescan = regex::bytes::Regex::new(r"(?s-u)AB.{4}\r").expect("a valid expression");
        let found: Vec<_> = rescan.find_iter(&bytes).map(|frame| frame.end() - 1).collect();
        let ends = |policy| -> Vec<usize> {
            expected::<reference::Bin>(&bytes, policy).frames.iter().map(|frame| frame.0).collect()
        };
        prop_assert_eq!(ends(Policy::Rescan), found);

        let discard =
            regex::bytes::Regex::new(r"(?s-u)A(?:B.{4}(?:(\r)|.)|[^B])").expect("a valid expression");
        let found: Vec<_> = discard
            .captures_iter(&bytes)
            .filter_map(|consumed| consumed.get(1))
            .map(|terminator| terminator.start())
            .collect();
        prop_assert_eq!(ends(Policy::Discard), found);
    }
}

/// A resynchronisation is a commit that ends a loss, and is counted once for each.
#[test]
fn resynchronisations_are_counted() {
    let mut line = Accounting::new(Receiver::<Bin>::new());
    let mut counts = Vec::new();
    for part in [
        b"AB\0abc\r".as_slice(),
        b"x",
        b"AB\0abc\r",
        b"AB\0abc\r",
        b"AB\0ac\r",
        b"AB\0abc\r",
    ] {
        line.feed(part, |_, _| ());
        counts.push(line.counters().resynchronisations);
    }
    assert_eq!(counts, [0, 0, 1, 1, 1, 2]);
    line.feed(b"AB\0", |_, _| ());
    line.line_event(LineEvent::Overrun);
    line.feed(b"AB\0abc\r", |_, _| ());
    assert_eq!(line.counters().resynchronisations, 3);
    // Events that drop nothing lose nothing.
    line.line_event(LineEvent::Idle);
    line.feed(b"AB\0abc\r", |_, _| ());
    assert_eq!(line.counters().resynchronisations, 3);
}

/// Counters wrap, and the identity holds modulo their width.
#[test]
fn counters_wrap() {
    let most = u64::MAX;
    let discarded = Discarded {
        no_sync: most,
        broken_sync: most,
        check: most,
        terminator: most,
        line_event: most,
    };
    let events = framelock::LineEvents {
        framing: most,
        parity: most,
        overrun: most,
        line_break: most,
        idle: most,
    };
    let counters = framelock::Counters {
        bytes: most,
        frames: most,
        discarded,
        resynchronisations: most,
        events,
    };
    let mut line = Accounting::resumed(Receiver::<Bin>::new(), counters);
    line.feed(b"xAB\0abc\rAB", |_, _| ());
    line.line_event(LineEvent::Idle);
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
