//! Tests the receiver of several layouts on one line, where the layouts' frames begin with the same byte.

use framelock::{Classification, DiscardReason, Format};
use framelock_formats::AnyOf;
use framelock_formats::layout::{
    Checksum, KnownMessage, Layout, LayoutBuilder, Length, LengthField, Messages, Number, Patterns,
};

use crate::built;

/// Lines that begin with `$`.
const LINES: LayoutBuilder = Layout::builder()
    .sync(Patterns::one(b"$"))
    .length(Length::Delimiter)
    .longest(10);

/// The longest frame may belong to any of several layouts.
#[test]
fn the_longest_frame_of_several_layouts_may_be_of_any_of_them() {
    let layout = |longest| built(&Layout::builder().sync(Patterns::one(b"$")).longest(longest));
    for lengths in [[3, 5, 4], [5, 3, 4], [3, 4, 5]] {
        assert_eq!(AnyOf(&lengths.map(layout)).longest(), 5);
    }
}

/// If several layouts reject the bytes, the reason comes from the layout that found an error latest in the frame.
#[test]
fn the_reason_is_that_of_the_layout_that_comes_furthest() {
    let layout = |sync| {
        let layout = Layout::builder().sync(Patterns::one(sync));
        layout.length(Length::Field(LengthField::byte(2)))
    };
    let other = built(&layout(&[0x55, 0x01]).longest(10));
    let half = built(&layout(&[0x24, 0x02]).longest(10));
    let too_long = built(&layout(&[0x24, 0x01]).longest(10));
    let too_short = built(&layout(&[0x24, 0x01]).shortest(250).longest(255));
    let summed = Layout::builder().sync(Patterns::one(b"$")).longest(3);
    let summed = built(&summed.checksum(Checksum::at_the_end(1)));
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
    let lines = LINES.terminator(Patterns::one(b"\n"));
    let messages = [KnownMessage::new(u32::from(b'x'))];
    let with_a_longer_header = built(&lines.messages(Messages::new(Number::byte(2), &messages)));
    assert_eq!(
        with_a_longer_header.classify_after(b"$\nx", 2),
        Classification::Rejected(DiscardReason::BadHeader)
    );
    let begins_like_it = built(&lines.sync(Patterns::one(b"$\n$")));
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
    let layout = |sync| built(&Layout::builder().sync(Patterns::one(sync)).longest(3));
    let layouts = [layout(b"#"), layout(b"$A"), layout(b"$B")];
    for (kind, frame) in [b"#A1", b"$A2", b"$B3"].into_iter().enumerate() {
        assert_eq!(AnyOf(&layouts).decode(frame), (kind, &frame[..]));
    }
}

/// The first layout rejects `$a`, because its content is only digits. If it examined only the bytes after `$a`, it
/// would accept the line feed as the end of its frame.
#[test]
fn a_layout_that_rejected_what_was_seen_rejects_it_again() {
    let lines = LINES.terminator(Patterns::one(b"\n"));
    let digits = lines.content(&[(b'0', b'9')]);
    let two_line_feeds = lines.terminator(Patterns::one(b"\n\n"));
    let layouts = [built(&digits), built(&two_line_feeds)];
    let any_of = AnyOf(&layouts);
    for seen in 0..3 {
        let says = any_of.classify_after(b"$a\n", seen);
        assert_eq!(says, Classification::Incomplete { at_least: 4 });
    }
}
