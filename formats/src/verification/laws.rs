//! Proves the laws for any layout.

use core::cell::Cell;

use framelock::any_format::{any_mismatch, any_up_to};
use framelock::{Classification, DiscardReason};

use super::any_layout::{Parts, patterns};
use crate::classify::Header;
use crate::layout::check::check_bounds;
use crate::layout::{CheckedLayout, Layout, Length, LengthField, Messages, Number, Patterns};

/// Asserts laws 1 to 3 for the classification `early` of `some` bytes and the classification `late` of `more` bytes.
pub(super) fn assert_lawful(
    early: Classification,
    late: Classification,
    some: usize,
    more: usize,
    longest: usize,
) {
    match early {
        Classification::Frame(length) => {
            assert!(1 <= length && length <= some && length <= longest);
            assert!(late == early);
        }
        Classification::Rejected(_) => assert!(late == early),
        Classification::Incomplete { at_least } => {
            assert!(some < at_least && at_least <= longest);
            assert!(more >= at_least || matches!(late, Classification::Incomplete { .. }));
        }
    }
    kani::cover!(
        matches!(early, Classification::Incomplete { .. })
            && matches!(late, Classification::Frame(_)),
        "an incomplete frame is completed"
    );
    kani::cover!(
        matches!(early, Classification::Incomplete { .. })
            && matches!(late, Classification::Rejected(_)),
        "an incomplete frame is rejected"
    );
}

/// Returns two arbitrary numbers of bytes in ascending order. Both numbers are at most `most`, and at most `longest`.
pub(super) fn any_some_and_more(most: usize, longest: usize) -> (usize, usize) {
    let most = most.min(longest);
    let some = kani::any_where(|&some| 1 <= some && some <= most);
    (some, kani::any_where(|&more| some <= more && more <= most))
}

/// A layout for which two functions return arbitrary results: the function that parses the header, and the function
/// that checks the rest of the frame. Within one run of a harness, each function always returns the same result.
struct Classified<'a> {
    layout: Layout<'a>,
    header: Result<Header, DiscardReason>,
    mismatch: Option<DiscardReason>,
    /// The length of the frame that was checked; `None` if no frame has been checked yet.
    asked: Cell<Option<usize>>,
}

impl Classified<'_> {
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        self.try_classify(bytes, seen)
            .unwrap_or_else(|classification| classification)
    }

    fn try_classify(&self, bytes: &[u8], seen: usize) -> Result<Classification, Classification> {
        let header = self.layout.header_bytes(bytes)?;
        assert!(core::ptr::eq(
            header,
            &raw const bytes[..self.layout.header()]
        ));
        let header = self.header.map_err(Classification::Rejected)?;
        let frame = self.layout.frame_of(&header, bytes, seen, false)?;
        // Every call must check the same frame, because `mismatch` is the answer to every call.
        let length = self.asked.get().unwrap_or(frame.len());
        assert!(core::ptr::eq(frame, &raw const bytes[..length]));
        self.asked.set(Some(length));
        Ok(self
            .mismatch
            .map_or(Classification::Frame(frame.len()), Classification::Rejected))
    }
}

/// Returns true if parsing a header can have this result. [`what_a_header_says`] proves that this function returns true
/// for every parsed header.
fn is_possible(layout: &Layout, header: Result<Header, DiscardReason>) -> bool {
    match header {
        Ok(header) => match header.length {
            Some(length) => layout.header() <= length && length <= layout.longest,
            None => has_no_length(layout),
        },
        Err(why) => why != DiscardReason::NoSync,
    }
}

/// Returns true if the header does not tell the length of the frame.
fn has_no_length(layout: &Layout) -> bool {
    matches!(layout.length, Length::Delimiter | Length::Silence)
}

#[kani::proof]
#[kani::unwind(9)]
fn what_a_header_says() {
    let bytes: [u8; 8] = kani::any();
    let parts = Parts::<2, 2>::any();
    let layout = Layout {
        terminator: Patterns::any_of(&[], any_up_to(2)),
        ..parts.layout()
    };
    let count = layout.header();
    // Only the bounds are known to be valid here, so the layout may still contain other contradictions.
    if check_bounds(&layout).is_ok() {
        // With a delimiter and without messages, a frame may consist of only the delimiter, so the frame needs no
        // header.
        let is_alone = layout.length == Length::Delimiter && layout.messages.is_none();
        assert!(is_alone || has_header_and_terminator(&layout));
        assert!(layout.shortest <= layout.longest);
        kani::cover!(count == layout.shortest, "the shortest frame is its header");
    }
    kani::assume(count <= 8 && count <= layout.longest);
    let header = layout.parse_header(layout.known(), &bytes[..count]);
    assert!(is_possible(&layout, header));
    kani::cover!(header.is_ok_and(|header| header.trailer > 0 && header.length.is_some()));
    kani::cover!(header.is_ok_and(|header| header.extra.is_some()));
}

/// Returns true if the shortest frame has room for its header, its terminator and the bytes after it.
/// [`what_a_header_says`] proves that this holds for layouts with valid bounds, unless a frame may consist of only the
/// delimiter.
fn has_header_and_terminator(layout: &Layout) -> bool {
    let end = layout.terminator.length.saturating_add(layout.behind);
    layout.header().saturating_add(end) <= layout.shortest
}

/// Returns the layout with an arbitrary possible header and an arbitrary mismatch.
fn classified<'a>(layout: &Layout<'a>) -> Classified<'a> {
    let header = if kani::any() {
        Ok(Header {
            length: (!has_no_length(layout)).then(kani::any),
            trailer: kani::any(),
            extra: None,
        })
    } else {
        Err(any_mismatch())
    };
    kani::assume(layout.longest >= 1 && is_possible(layout, header));
    let mismatch = kani::any::<bool>().then(any_mismatch);
    kani::assume(mismatch != Some(DiscardReason::NoSync));
    Classified {
        layout: *layout,
        header,
        mismatch,
        asked: Cell::new(None),
    }
}

/// Asserts laws 1 to 4 for a layout.
fn keeps_the_laws<const MOST: usize>(layout: &Layout) {
    let bytes: [u8; MOST] = kani::any();
    let layout = classified(layout);
    let longest = layout.layout.longest;
    let (some, more) = any_some_and_more(MOST, longest);
    let early = layout.classify_after(&bytes[..some], 0);
    let late = layout.classify_after(&bytes[..more], 0);
    // Check law 4. If the layout has frames, also check that `starts` accepts no byte that cannot start a frame.
    let no_sync = late == Classification::Rejected(DiscardReason::NoSync);
    let has_frames = layout.layout.header() <= longest;
    assert!(CheckedLayout(layout.layout).starts(bytes[0]) != no_sync || no_sync && !has_frames);
    // A frame is recognised as soon as the frame's last byte has arrived, because `check` rejects layouts whose frames
    // may be shorter than their header.
    let is_checked = layout.layout.header() <= layout.layout.shortest;
    assert!(!is_checked || late != Classification::Frame(some) || early == late);
    assert_lawful(early, late, some, more, longest);
}

/// A header that does not tell the length of the frame.
const WITHOUT_LENGTH: Header = Header {
    length: None,
    trailer: 0,
    extra: None,
};

/// Asserts law 5 for a layout. Only [`Layout::frame_of`] uses `seen`, and it does so only to search for the end of a
/// frame.
fn what_was_seen_changes_nothing<const MOST: usize>(layout: &Layout) {
    let bytes: [u8; MOST] = kani::any();
    let end = |bytes, seen| {
        layout
            .frame_of(&WITHOUT_LENGTH, bytes, seen, false)
            .map(<[u8]>::len)
    };
    let (seen, more) = any_some_and_more(MOST, layout.longest);
    // If the header was incomplete, the bytes have not been searched for the end of the frame.
    let looked = seen >= layout.header();
    let found_none = matches!(
        end(&bytes[..seen], 0),
        Err(Classification::Incomplete { .. })
    );
    kani::assume(!looked || found_none);
    let late = end(&bytes[..more], seen);
    assert!(late == end(&bytes[..more], 0));
    let [_, other] = &layout.other_terminators;
    kani::cover!(
        looked && late == Ok(MOST) && layout.behind + other.length > 0,
        "a frame whose end was searched for before"
    );
}

/// Asserts laws 1 to 4 for a layout with a length field and two syncs of `SYNC` bytes. The length field begins at byte
/// 0 and has an arbitrary size, so the header has an arbitrary length.
fn a_layout_with_lengths<const SYNC: usize, const MOST: usize>() {
    let syncs = kani::any::<[[u8; SYNC]; 2]>();
    keeps_the_laws::<MOST>(&Layout {
        sync: patterns(&syncs),
        length: Length::Field(LengthField {
            number: Number {
                bytes: kani::any(),
                ..Number::byte(0)
            },
            ..LengthField::byte(0)
        }),
        longest: kani::any(),
        ..Layout::NONE
    });
}

#[kani::proof]
#[kani::unwind(7)]
fn lengths_behind_one_byte() {
    a_layout_with_lengths::<1, 6>();
}

#[kani::proof]
#[kani::unwind(7)]
fn lengths_behind_three_bytes() {
    a_layout_with_lengths::<3, 6>();
}

/// Calls `keeps` with a layout that is arbitrary within these bounds: two alternative syncs of `SYNC` bytes each, two
/// alternative terminators of `END` bytes each, and one entry in `other_terminators`, of `OTHER` bytes. If `OTHER` is 0,
/// this entry is empty, and a byte may follow the terminator. The content is `RANGES` ranges of bytes; without a range,
/// the content is any bytes. The size of the message's number determines where the header ends.
fn with_delimiters<const SYNC: usize, const END: usize, const OTHER: usize, const RANGES: usize>(
    keeps: impl Fn(&Layout),
) {
    let (syncs, ends) = kani::any::<([[u8; SYNC]; 2], [[u8; END]; 2])>();
    let (content, other) = kani::any::<([(u8, u8); RANGES], [u8; OTHER])>();
    let layout = Layout {
        sync: patterns(&syncs),
        length: Length::Delimiter,
        shortest: kani::any(),
        longest: kani::any(),
        messages: Some(Messages {
            number: Number {
                bytes: kani::any(),
                ..Number::byte(0)
            },
            known: &[],
        }),
        terminator: patterns(&ends),
        behind: if OTHER == 0 { any_up_to(1) } else { 0 },
        content: &content,
        other_terminators: [Patterns::NONE, Patterns::one(&other)],
        ..Layout::NONE
    };
    // `check` rejects most layouts that violate these assumptions; for the others, see theorem 13g.
    let ends_before = |end: &[u8; END]| other.starts_with(end) || end.starts_with(&other);
    kani::assume(OTHER == 0 || !ends.iter().any(ends_before));
    kani::assume(has_header_and_terminator(&layout));
    keeps(&layout);
}

/// Defines a module of harnesses for each entry, for layouts with delimiters. An entry has the parameters `SYNC`,
/// `END` and `OTHER` of [`with_delimiters`]. Only layouts with a range have other terminators, because `check` rejects
/// other terminators without a range. The provers need less time for three harnesses than for one with arbitrary
/// numbers of ranges and terminators.
macro_rules! delimiters {
    ($($module:ident: $keeps:ident $sync:literal $end:literal $other:literal)*) => {$(
        mod $module {
            use super::{$keeps, with_delimiters};

            #[kani::proof]
            #[kani::unwind(5)]
            fn any_content() {
                with_delimiters::<$sync, $end, 0, 0>($keeps::<4>);
            }

            #[kani::proof]
            #[kani::unwind(5)]
            fn one_range() {
                with_delimiters::<$sync, $end, 0, 1>($keeps::<4>);
            }

            #[kani::proof]
            #[kani::unwind(5)]
            fn two_lengths() {
                with_delimiters::<$sync, $end, $other, 1>($keeps::<4>);
            }
        }
    )*};
}
delimiters! {
    delimiters_of_one_byte: keeps_the_laws 1 1 2
    delimiters_without_a_sync: keeps_the_laws 0 2 1
    seen_without_delimiters_of_one_byte: what_was_seen_changes_nothing 1 1 2
    seen_without_delimiters_of_two_bytes: what_was_seen_changes_nothing 1 2 1
}

/// Returns the length of the frame that a layout with a delimiter finds at the beginning of the bytes, or `None`. The
/// layout has two terminators of one byte each.
fn length_by_delimiter(
    bytes: [u8; 3],
    ends: [[u8; 1]; 2],
    content: &[(u8, u8)],
    other: &[u8],
) -> Option<usize> {
    let layout = Layout {
        length: Length::Delimiter,
        shortest: 1,
        longest: 3,
        terminator: patterns(&ends),
        content,
        other_terminators: [Patterns::NONE, Patterns::one(other)],
        ..Layout::NONE
    };
    let frame = layout.frame_of(&WITHOUT_LENGTH, &bytes, 0, false);
    frame.ok().map(<[u8]>::len)
}

/// If the content is any bytes, a frame ends after its first terminator.
#[kani::proof]
#[kani::unwind(5)]
fn where_a_frame_ends() {
    let (bytes, ends) = kani::any::<([u8; 3], [[u8; 1]; 2])>();
    let is_end = |byte: u8| byte == ends[0][0] || byte == ends[1][0];
    let [first, second, third] = bytes.map(is_end);
    let expected = match (first, second, third) {
        (true, ..) => Some(1),
        (_, true, _) => Some(2),
        (.., true) => Some(3),
        _ => None,
    };
    assert!(length_by_delimiter(bytes, ends, &[], &[]) == expected);
    kani::cover!(expected == Some(3), "a frame");
}

/// If the content is a range of bytes, a frame ends after the terminator that directly follows the content.
#[kani::proof]
#[kani::unwind(5)]
fn where_a_frame_with_a_content_ends() {
    let (bytes, ends) = kani::any::<([u8; 3], [[u8; 1]; 2])>();
    let (range, other) = kani::any::<((u8, u8), [u8; 2])>();
    let is_content = |byte: u8| range.0 <= byte && byte <= range.1;
    let is_end = |byte: u8| byte == ends[0][0] || byte == ends[1][0];
    // `check` rejects a terminator that begins with another terminator.
    kani::assume(!is_end(other[0]));
    let [first, second, third] = bytes.map(is_content);
    let expected = if !first {
        if is_end(bytes[0]) {
            Some(1)
        } else {
            ([bytes[0], bytes[1]] == other).then_some(2)
        }
    } else if !second {
        if is_end(bytes[1]) {
            Some(2)
        } else {
            ([bytes[1], bytes[2]] == other).then_some(3)
        }
    } else {
        (!third && is_end(bytes[2])).then_some(3)
    };
    assert!(length_by_delimiter(bytes, ends, &[range], &other) == expected);
    kani::cover!(first && second && expected == Some(3), "a terminator");
    kani::cover!(
        first && !second && expected == Some(3),
        "another terminator"
    );
}
