//! Proves properties of several layouts on one line. They keep the laws if each single layout keeps them. The first
//! layout that does not reject the bytes decides. At a line event, the first layout that finds a frame decides.

use framelock::any_format::{Row, any_up_to, any_verdict, part};
use framelock::{Classification, DiscardReason, Format};

use super::laws::{any_some_and_more, assert_lawful};
use crate::any_of::{AnyOf, first, first_before, further_on, kind};
use crate::layout::{CheckedLayout, FixedBits, Layout, Length, LengthField, Patterns};

/// The number of bytes in the longest frame.
const MOST: usize = 4;

/// A stand-in for one of the layouts. It classifies the first bytes of one stream. The classifications are arbitrary,
/// but keep the laws.
struct Classified {
    longest: usize,
    starts: bool,
    row: Row,
    /// The number of bytes that an incomplete classification asks for. Entry `n` is for `n + 1` bytes.
    at_least: [usize; MOST],
}

impl Classified {
    fn any() -> Self {
        let longest = any_up_to(MOST);
        kani::assume(longest >= 1);
        let row = Row::any(longest);
        let starts = row.settled != Classification::Rejected(DiscardReason::NoSync);
        kani::assume(starts || row.settled_at == 1);
        // A layout recognises a frame as soon as the frame's last byte has arrived: see `keeps_the_laws`.
        if let Classification::Frame(length) = row.settled {
            kani::assume(length == row.settled_at);
        }
        let at_least: [usize; MOST] = core::array::from_fn(|_| any_up_to(MOST));
        for (had, wanted) in at_least.iter().enumerate() {
            kani::assume(
                had + 1 >= row.settled_at || had + 1 < *wanted && *wanted <= row.settled_at,
            );
        }
        Self {
            longest,
            starts,
            row,
            at_least,
        }
    }

    /// Classifies `count` bytes. The caller claims that the first `seen` bytes have been classified as incomplete.
    fn classify(&self, count: usize, seen: usize) -> Classification {
        match self.row.settled(count) {
            None => Classification::Incomplete {
                at_least: self.at_least[count - 1],
            },
            // If the claim is wrong, law 5 allows any answer.
            Some(_) if seen > 0 && self.row.settled(seen).is_some() => any_verdict(),
            Some(settled) => settled,
        }
    }
}

/// Proves the laws for three layouts. The proof includes one and two layouts, because a layout that rejects every first
/// byte has no effect.
#[kani::proof]
#[kani::unwind(6)]
fn any_of_three() {
    let all: [Classified; 3] = core::array::from_fn(|_| Classified::any());
    let starts = |one: &Classified| one.starts;
    let classify_after =
        |count, seen| first(&all, seen, starts, |one, seen| one.classify(count, seen));
    let longest = all.iter().map(|one| one.longest).max().unwrap_or_default();
    let (some, more) = any_some_and_more(MOST, longest);
    let (early, late) = (classify_after(some, 0), classify_after(more, 0));
    assert_lawful(early, late, some, more, longest);
    // Check law 4.
    assert!(all.iter().any(starts) != (late == Classification::Rejected(DiscardReason::NoSync)));
    // Check law 5.
    if matches!(early, Classification::Incomplete { .. }) {
        assert!(classify_after(more, some) == late);
    }
    // The first layout that does not reject the bytes decides.
    let each = all.each_ref().map(|one| one.classify(more, 0));
    let is_rejected = |one: &Classification| matches!(one, Classification::Rejected(_));
    match each.iter().find(|one| !is_rejected(one)) {
        Some(one) => assert!(late == *one),
        None => assert!(is_rejected(&late)),
    }
    // The layout that decided also decodes the frame.
    if let Classification::Frame(length) = late {
        let is_its_frame =
            |one: &Classified| one.classify(length, 0) == Classification::Frame(length);
        let kind = kind(&all, starts, is_its_frame);
        assert!(part(&each, 0, kind).iter().all(is_rejected) && each[kind] == late);
        kani::cover!(
            kind == 2 && starts(&all[0]) && starts(&all[1]),
            "a frame of the third layout, whose first byte the other layouts accept too"
        );
    }
}

/// Theorem 13f for several layouts. A line event follows `count` bytes. Silence may end the frames of some layouts. If
/// any layouts find a frame at the beginning of the bytes, the first of them decides. So no order of the layouts loses
/// a frame. If no layout finds a frame, the bytes are rejected (law 6). The reason is the line event, unless a layout
/// whose frames end with silence found an error after the header.
#[kani::proof]
#[kani::unwind(6)]
fn any_of_three_before_an_event() {
    let all: [Classified; 3] = core::array::from_fn(|_| Classified::any());
    let count = any_up_to(MOST);
    kani::assume(count >= 1);
    let is_frame = |one: &Classification| matches!(one, Classification::Frame(_));
    // The layouts whose frames end with silence, and their classifications of the bytes at a pause or a break.
    let silent: [Option<Classification>; 3] = core::array::from_fn(|_| {
        kani::any::<bool>().then(|| match any_verdict() {
            Classification::Frame(_) => Classification::Frame(count),
            other => other,
        })
    });
    let is_pause = kani::any::<bool>();
    let before = |place: usize| {
        let (now, end) = (all[place].classify(count, 0), silent[place]);
        // Only silence ends a frame of such a layout.
        kani::assume(end.is_none() || !is_frame(&now));
        let is_over = is_pause && matches!(now, Classification::Incomplete { .. });
        (end.filter(|_| is_over).unwrap_or(now), end.is_some())
    };
    let each = [before(0), before(1), before(2)];
    let starts = |one: &Classified| one.starts;
    // A receiver asks `classify_before` only if `classify` answers `Incomplete`.
    let now = first(&all, 0, starts, |one, _| one.classify(count, 0));
    kani::assume(matches!(now, Classification::Incomplete { .. }));
    let said = first_before(&each, |answer| *answer);
    let first_frame = each.iter().position(|(one, _)| is_frame(one));
    let is_late = |(one, is_silent): &(Classification, bool)| match one {
        Classification::Rejected(why) => *is_silent && further_on(*why) == 3,
        _ => false,
    };
    match first_frame {
        Some(place) => assert!(said == each[place].0),
        None => match each.iter().find(|one| is_late(one)) {
            Some((late, _)) => assert!(said == *late),
            None => assert!(said == Classification::Rejected(DiscardReason::LineEvent)),
        },
    }
    if let Classification::Frame(length) = said {
        assert!(1 <= length && length <= count);
        // Unless silence ends the frames of some layout, the layout that found the frame also decodes it.
        let is_its_frame =
            |one: &Classified| one.classify(length, 0) == Classification::Frame(length);
        let is_silent = silent.iter().any(Option::is_some);
        assert!(is_silent || Some(kind(&all, starts, is_its_frame)) == first_frame);
    }
    kani::cover!(
        first_frame == Some(2) && starts(&all[0]) && starts(&all[1]),
        "a frame of the third layout, for which the other layouts would have waited"
    );
    kani::cover!(
        first_frame == Some(1) && silent[1].is_some(),
        "a frame that the pause ends"
    );
}

/// Returns a layout with these syncs of one byte each. Its other parts do not matter.
fn of_syncs<'a>(syncs: &'a [u8], no_bits: &'a [FixedBits; 0]) -> Layout<'a> {
    Layout {
        sync: Patterns {
            bytes: syncs,
            length: 1,
        },
        longest: 1,
        fixed: no_bits,
        ..Layout::NONE
    }
}

/// Proves that frames are no longer than [`AnyOf`] claims, and begin with bytes that it accepts.
#[kani::proof]
#[kani::unwind(5)]
fn any_of_two_layouts() {
    let (bytes, syncs, no_bits) = (kani::any::<[u8; 3]>(), kani::any::<[[u8; 1]; 2]>(), []);
    let layout = |sync| {
        CheckedLayout(Layout {
            length: if kani::any() {
                Length::Fixed
            } else {
                Length::Field(LengthField::byte(1))
            },
            longest: any_up_to(3),
            ..of_syncs(sync, &no_bits)
        })
    };
    let [one, other] = &syncs;
    let format = AnyOf(&[layout(one), layout(other)]);
    let bytes = part(&bytes, 0, any_up_to(3));
    kani::assume(!bytes.is_empty() && bytes.len() <= format.longest());
    let classification = format.classify(bytes);
    if let Classification::Incomplete { at_least } | Classification::Frame(at_least) =
        classification
    {
        assert!(at_least <= format.longest() && format.starts(bytes[0]));
    }
    kani::cover!(
        bytes[0] != one[0] && classification == Classification::Frame(bytes.len()),
        "a frame of the second layout"
    );
}

/// Proves that a frame may begin with the first byte of each sync and with no other byte, and that the first layout
/// with the frame's sync decodes the frame. Uses two layouts, one of them with six syncs.
#[kani::proof]
#[kani::unwind(8)]
fn starts_are_those_of_the_syncs() {
    let (syncs, byte) = kani::any::<([u8; 7], u8)>();
    let (no_bits, (six, other)) = ([], syncs.split_at(6));
    let layouts = [six, other].map(|syncs| CheckedLayout(of_syncs(syncs, &no_bits)));
    let format = AnyOf(&layouts);
    let begins = syncs.map(|first| first == byte);
    assert!(format.starts(byte) == begins.contains(&true));
    if format.starts(byte) {
        let is_first = part(&begins, 0, 6).contains(&true);
        assert!(format.decode(&[byte]).0 == usize::from(!is_first));
    }
    kani::cover!(
        begins[5] && !part(&begins, 0, 5).contains(&true),
        "the sixth"
    );
    kani::cover!(
        begins[6] && !part(&begins, 0, 6).contains(&true),
        "the other's"
    );
}
