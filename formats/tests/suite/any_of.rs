//! Tests the receiver of several layouts on one line, where the layouts' frames begin with the same byte.

use framelock::{BufferedReceiver, Classification, DiscardReason, Format, LineEvent};
use framelock_formats::layout::{
    Algorithm, CheckedLayout, Checksum, Crc, FixedBits, KnownMessage, Layout, Length, LengthField,
    Messages, Number, Patterns,
};
use framelock_formats::{AnyOf, check_laws};
use proptest::prelude::*;

use crate::built;

/// Lines that begin with `$`.
const LINES: Layout = Layout {
    sync: Patterns::one(b"$"),
    length: Length::Delimiter,
    longest: 10,
    ..Layout::NONE
};

/// The longest frame may belong to any of several layouts.
#[test]
fn the_longest_frame_of_several_layouts_may_be_of_any_of_them() {
    let layout = |longest| {
        built(&Layout {
            sync: Patterns::one(b"$"),
            longest,
            ..Layout::NONE
        })
    };
    for lengths in [[3, 5, 4], [5, 3, 4], [3, 4, 5]] {
        assert_eq!(AnyOf(&lengths.map(layout)).longest(), 5);
    }
}

/// If several layouts reject the bytes, the reason comes from the layout that found an error latest in the frame.
#[test]
fn the_reason_is_that_of_the_layout_that_comes_furthest() {
    let layout = |sync| Layout {
        sync: Patterns::one(sync),
        length: Length::Field(LengthField::byte(2)),
        longest: 10,
        ..Layout::NONE
    };
    let other = built(&layout(&[0x55, 0x01]));
    let half = built(&layout(&[0x24, 0x02]));
    let too_long = built(&layout(&[0x24, 0x01]));
    let too_short = built(&Layout {
        shortest: 250,
        longest: 255,
        ..layout(&[0x24, 0x01])
    });
    let summed = built(&Layout {
        sync: Patterns::one(b"$"),
        longest: 3,
        checksum: Some(Checksum::at_the_end(1)),
        ..Layout::NONE
    });
    for (layouts, why) in [
        ([other, half, other], DiscardReason::BrokenSync),
        ([half, too_long, other], DiscardReason::TooLong),
        ([too_long, half, too_short], DiscardReason::TooLong),
        ([too_short, too_long, half], DiscardReason::BadHeader),
        ([too_long, summed, half], DiscardReason::ChecksumMismatch),
        ([summed, too_long, half], DiscardReason::ChecksumMismatch),
    ] {
        let classification = AnyOf(&layouts).classify(&[0x24, 0x01, 200]);
        assert_eq!(classification, Classification::Rejected(why));
    }
}

/// `classify_after` skips the first `seen` bytes only if the layout has searched them for the end of the frame. The
/// layout has not searched these bytes if its header was incomplete, or if an earlier layout found the bytes
/// incomplete.
#[test]
fn an_end_in_what_was_seen_is_found() {
    let lines = Layout {
        terminator: Patterns::one(b"\n"),
        ..LINES
    };
    let messages = [KnownMessage::new(u32::from(b'x'))];
    let with_a_longer_header = built(&Layout {
        messages: Some(Messages {
            number: Number::byte(2),
            known: &messages,
        }),
        ..lines
    });
    assert_eq!(
        with_a_longer_header.classify_after(b"$\nx", 2),
        Classification::Rejected(DiscardReason::BadHeader)
    );
    let begins_like_it = built(&Layout {
        sync: Patterns::one(b"$\n$"),
        ..lines
    });
    let any_of = AnyOf(&[begins_like_it, built(&lines)]);
    assert_eq!(
        any_of.classify(b"$\n"),
        Classification::Incomplete { at_least: 3 }
    );
    assert_eq!(any_of.classify_after(b"$\nx", 2), Classification::Frame(2));
    assert!(any_of.starts(b'$') && !any_of.starts(b'#'));
}

/// Frames of the second and third layouts begin with the same byte. Their second byte tells them apart.
#[test]
fn a_frame_belongs_to_the_layout_that_accepts_it() {
    let layout = |sync| {
        built(&Layout {
            sync: Patterns::one(sync),
            longest: 3,
            ..Layout::NONE
        })
    };
    let layouts = [layout(b"#"), layout(b"$A"), layout(b"$B")];
    for (kind, frame) in [b"#A1", b"$A2", b"$B3"].into_iter().enumerate() {
        assert_eq!(AnyOf(&layouts).decode(frame), (kind, &frame[..]));
    }
}

/// The first layout rejects `$a`, because its content is only digits. If it examined only the bytes after `$a`, it
/// would accept the line feed as the end of its frame.
#[test]
fn a_layout_that_rejected_what_was_seen_rejects_it_again() {
    let lines = Layout {
        terminator: Patterns::one(b"\n"),
        ..LINES
    };
    let digits = Layout {
        content: &[(b'0', b'9')],
        ..lines
    };
    let two_line_feeds = Layout {
        terminator: Patterns::one(b"\n\n"),
        ..lines
    };
    let layouts = [built(&digits), built(&two_line_feeds)];
    let any_of = AnyOf(&layouts);
    for seen in 0..3 {
        let says = any_of.classify_after(b"$a\n", seen);
        assert_eq!(says, Classification::Incomplete { at_least: 4 });
    }
}

/// The outcomes of a line that gets these bytes and then this event: each frame's offset, kind and length.
fn delivered_at(
    layouts: &[CheckedLayout],
    bytes: &[u8],
    event: LineEvent,
) -> Vec<(usize, usize, usize)> {
    let format = AnyOf(layouts);
    let buffer = vec![0; 2 * format.longest()];
    let mut receiver = BufferedReceiver::with_buffer(format, buffer).expect("it holds the longest");
    let (mut at, mut frames) = (0, Vec::new());
    let mut note = |bytes: usize, frame: Option<(usize, &[u8])>| {
        frames.extend(frame.map(|(kind, frame)| (at, kind, frame.len())));
        at += bytes;
    };
    receiver.feed(bytes, |found| {
        note(found.bytes(), found.message().map(|it| it.message()));
    });
    receiver.line_event(event, |found| {
        note(found.bytes(), found.message().map(|it| it.message()));
    });
    assert_eq!((at, receiver.pending()), (bytes.len(), 0));
    frames
}

const EVENTS: [LineEvent; 5] = [
    LineEvent::Framing,
    LineEvent::Parity,
    LineEvent::Overrun,
    LineEvent::Break,
    LineEvent::Idle,
];

/// Frames that begin with `AA` and end with the sum of the other bytes.
const SUMMED: Layout = Layout {
    sync: Patterns::one(&[0xAA]),
    checksum: Some(Checksum::at_the_end(1)),
    ..Layout::NONE
};

/// The first kind waits for six bytes. A line event delivers the whole frame of the second kind.
#[test]
fn a_line_event_delivers_a_frame_of_a_later_kind() {
    let layouts = [6, 4].map(|longest| built(&Layout { longest, ..SUMMED }));
    let frame = [0xAA, 1, 2, 0xAD];
    for event in EVENTS {
        assert_eq!(delivered_at(&layouts, &frame, event), [(0, 1, 4)]);
        // A false start precedes the frame.
        let late = [&[0xAA, 7][..], &frame].concat();
        assert_eq!(delivered_at(&layouts, &late, event), [(2, 1, 4)]);
    }
    check_laws(&AnyOf(&layouts), &mut frame.repeat(3)).unwrap_or_else(|broken| panic!("{broken}"));
}

/// A request to read a register, and its response, both with function 3. Whichever kind is listed first, both frames
/// are delivered, if a pause follows each frame.
#[test]
fn no_order_of_modbus_requests_and_responses_loses_a_frame() {
    const CRC: Crc = Crc {
        initial: 0xFFFF,
        reflected_in: true,
        reflected_out: true,
        ..Crc::new(16, 0x8005)
    };
    const READ: &[FixedBits] = &[FixedBits {
        at: 1,
        mask: 0xFF,
        value: 3,
    }];
    let checksum = Checksum {
        algorithm: Algorithm::Crc(CRC),
        ..Checksum::at_the_end(2)
    };
    let read = Layout {
        fixed: READ,
        checksum: Some(checksum),
        ..Layout::NONE
    };
    let request = built(&Layout { longest: 8, ..read });
    let response = built(&Layout {
        length: Length::Field(LengthField {
            plus: 5,
            ..LengthField::byte(2)
        }),
        longest: 255,
        ..read
    });
    for layouts in [[request, response], [response, request]] {
        let kind = |layout| {
            layouts
                .iter()
                .position(|it| *it == layout)
                .expect("it is there")
        };
        for asked in [
            b"\x01\x03\x02\x00\x00\x01\x85\xB2",
            b"\x01\x03\x70\x02\x00\x01\x3F\x0A",
        ] {
            let delivered = delivered_at(&layouts, asked, LineEvent::Idle);
            assert_eq!(delivered, [(0, kind(request), 8)]);
        }
        for answered in [
            b"\x01\x03\x02\x00\x00\xB8\x44",
            b"\x01\x03\x02\x17\x81\x77\xD4",
        ] {
            let delivered = delivered_at(&layouts, answered, LineEvent::Idle);
            assert_eq!(delivered, [(0, kind(response), 7)]);
        }
    }
}

/// Frames of the kinds in [`kinds`], noise, and cut frames.
fn stretches() -> impl Strategy<Value = Vec<u8>> {
    let byte = || prop_oneof![Just(0xAA), 0..4_u8, any::<u8>()];
    let frame = prop_oneof![Just(2), Just(4), Just(6), Just(9)].prop_flat_map(move |length| {
        prop::collection::vec(byte(), length - 2).prop_map(|content| {
            let frame = [&[0xAA][..], &content].concat();
            let sum = frame
                .iter()
                .fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
            [&frame[..], &[sum]].concat()
        })
    });
    let noise = prop::collection::vec(byte(), 0..5);
    let cut = (frame.clone(), any::<prop::sample::Index>())
        .prop_map(|(frame, at)| frame[..at.index(frame.len())].to_vec());
    let part = prop_oneof![3 => frame, 1 => noise, 1 => cut];
    prop::collection::vec(part, 0..8).prop_map(|parts| parts.concat())
}

/// Kinds of frames of 4, 6, 9 and 2 bytes, in any order.
fn kinds() -> impl Strategy<Value = Vec<usize>> {
    Just(vec![4, 6, 9, 2]).prop_shuffle()
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(1), ..ProptestConfig::default() })]

    /// At a line event, each frame of any kind is delivered, unless it shares bytes with a delivered frame. If two kinds
    /// begin at the same byte and both are delivered at the event, the kind that is listed first wins.
    #[test]
    fn no_order_of_kinds_loses_a_frame(kinds in kinds(), bytes in stretches(), event in prop::sample::select(&EVENTS[..])) {
        let layouts: Vec<CheckedLayout> = kinds.iter().map(|length| built(&Layout { longest: *length, ..SUMMED })).collect();
        let delivered = delivered_at(&layouts, &bytes, event);
        let is_frame = |at: usize, length: usize| {
            let frame = bytes.get(at..at + length)?.split_last()?;
            let sum = frame.1.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
            (bytes[at] == 0xAA && sum == *frame.0).then_some(())
        };
        for at in 0..bytes.len() {
            for (kind, &length) in kinds.iter().enumerate() {
                let this = (at, kind, length);
                if is_frame(at, length).is_none() {
                    prop_assert!(!delivered.contains(&this), "{this:?} is no frame");
                } else if !delivered.contains(&this) {
                    let shares = |other: &&(usize, usize, usize)| other.0 < at + length && at < other.0 + other.2;
                    let other = delivered.iter().find(shares);
                    prop_assert!(other.is_some(), "{this:?} of {kinds:?} is lost");
                    let is_first = |other: &(usize, usize, usize)| other.0 != at || other.1 < kind;
                    prop_assert!(other.is_none_or(is_first), "{this:?} of {kinds:?} comes first");
                }
            }
        }
    }
}
