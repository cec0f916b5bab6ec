//! Tests two or three random layouts on one line against the interpreter of layouts. Many of their frames begin alike.

use framelock::Classification::{self, Frame, Incomplete, Rejected};
use framelock::{DiscardReason, Format as _, LineEvent};
use framelock_formats::layout::*;
use framelock_formats::{AnyOf, check_laws};
use framelock_oracles::{
    EVENTS, Occurred, Stream, StreamStep, cut, faulty, interpret, layouts, random_frame,
};
use rand::seq::IndexedRandom as _;
use rand::{Rng as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

use crate::against_reference::whole_frames_are_delivered;

/// Returns a random layout of short frames, or `None` if its parts contradict each other. The frames of most layouts
/// begin with `$`.
fn layout(random: &mut ChaCha8Rng) -> Option<CheckedLayout<'static>> {
    const KNOWN: &[KnownMessage] = &[
        KnownMessage::new(b'1' as u32),
        KnownMessage::new(b'x' as u32),
    ];
    let mut one_of = |these: &[&'static [u8]]| *these.choose(random).expect("several");
    let sync = Patterns::one(one_of(&[b"$", b"$", b"$A", b"$B", b"$\n$", b"#"]));
    let terminator = Patterns::one(one_of(&[b"\n", b"\n\n"]));
    let layout = Layout {
        sync,
        longest: random.random_range(2..12),
        ..Layout::NONE
    };
    let layout = match random.random_range(0..5) {
        0 => layout,
        1 | 2 => Layout {
            length: Length::Field(LengthField::byte(2)),
            shortest: *[0, 5, 9].choose(random)?,
            ..layout
        },
        _ => Layout {
            length: Length::Delimiter,
            terminator,
            content: [&[][..], &[(b'$', b'~')]].choose(random)?,
            ..layout
        },
    };
    let number = Number::byte(2);
    let layout = Layout {
        messages: random.random_ratio(1, 4).then_some(Messages {
            number,
            known: KNOWN,
        }),
        checksum: random.random_ratio(1, 4).then_some(Checksum::at_the_end(1)),
        ..layout
    };
    layout.check().ok()
}

/// Asserts that `classify_after` gives the answer of `classify`, however many of the bytes have been seen. Also checks
/// `decode` and `starts`. Counts the special cases, for example whether the reason for rejecting the bytes comes from
/// the first layout or from a later one.
fn check(all: &'static [CheckedLayout<'static>], bytes: &[u8], occurred: &mut Occurred) {
    let any_of = AnyOf(all);
    let expected = any_of.classify(bytes);
    for seen in 1..bytes.len() {
        if matches!(any_of.classify(&bytes[..seen]), Incomplete { .. }) {
            assert_eq!(
                any_of.classify_after(bytes, seen),
                expected,
                "{seen} {bytes:02X?} {all:?}"
            );
            occurred.count("an answer after seen bytes", true);
        }
    }
    let alone = all
        .iter()
        .map(|layout| interpret(layout, &bytes[..bytes.len().min(layout.longest)]));
    let alone: Vec<Classification> = alone.collect();
    if let Rejected(_) = expected {
        let place = alone.iter().position(|one| *one == expected);
        occurred.count(
            "the reason of the first layout",
            place == Some(0) && alone[1] != expected,
        );
        occurred.count("the reason of a later layout", place > Some(0));
    }
    if let Frame(length) = expected {
        let bytes = &bytes[..length];
        let kind = all.iter().position(|layout| {
            length <= layout.longest && interpret(layout, bytes) == Frame(length)
        });
        assert_eq!(
            any_of.decode(bytes),
            (kind.expect("one of them"), bytes),
            "{all:?}"
        );
        occurred.count("a frame of a later layout", kind > Some(0));
        let is_header = kind.is_some_and(|kind| length == all[kind].header());
        occurred.count("a frame that is only a header", is_header);
        let waits = alone.iter().any(|one| matches!(one, Incomplete { .. }));
        occurred.count("a frame for which a later layout waits", waits);
    }
    let is_start = alone
        .iter()
        .any(|one| *one != Rejected(DiscardReason::NoSync));
    assert_eq!(any_of.starts(bytes[0]), is_start, "{bytes:02X?} {all:?}");
    let before = any_of.classify_before(bytes, LineEvent::Idle);
    let is_ended = matches!((expected, before), (Incomplete { .. }, Frame(_)));
    occurred.count("a frame that only an event ends", is_ended);
}

#[test]
fn several_layouts_do_what_the_interpreter_says() {
    let (mut random, mut occurred) = (ChaCha8Rng::seed_from_u64(1), Occurred::NOTHING);
    let mut states = Occurred::NOTHING;
    for number in 0..800 {
        let mut all = Vec::new();
        while all.len() < 2 + number % 2 {
            all.extend(layout(&mut random));
        }
        let all: &'static [CheckedLayout] = all.leak();
        let longest = all.iter().map(|layout| layout.most_bytes()).max();
        assert_eq!(Some(AnyOf(all).longest()), longest);
        let tries =
            (0..12).filter_map(|_| random_frame(all.choose(&mut random)?, &mut random).ok());
        let frames: Vec<Vec<u8>> = tries.collect();
        let event = EVENTS[number % 5];
        let bytes = faulty(&frames, &mut random);
        for from in 0..bytes.len() {
            let to = bytes.len().min(from + AnyOf(all).longest());
            check(all, &bytes[from..to], &mut occurred);
        }
        let idle = StreamStep::Event(event);
        let stream = [
            cut(&bytes, &mut random),
            vec![idle],
            cut(&frames.concat(), &mut random),
        ];
        let stream = Stream(stream.concat());
        occurred.count_all(&layouts(&AnyOf(all), all, &stream, &mut states));
        let [delivered, lost] = whole_frames_are_delivered(all, &frames, event, &mut random);
        occurred.count("a whole frame is delivered", delivered as u64);
        occurred.count("a whole frame shares bytes with another one", lost as u64);
        let mut beginning: Vec<u8> = frames.concat();
        beginning.truncate(10);
        check_laws(&AnyOf(all), &mut beginning)
            .unwrap_or_else(|broken| panic!("{broken}: {all:?}"));
    }
    assert_eq!(states.missing(), ["broken stuffing"]);
    assert_eq!(
        occurred.rarer_than(10),
        ["broken stuffing"],
        "{occurred:#?}"
    );
}
