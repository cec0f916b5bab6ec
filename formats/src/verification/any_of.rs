//! That several on one line keep the laws, if each does and knows by the first byte whether a frame may begin, as
//! every layout does.

use framelock::any_format::{Row, any_up_to, any_verdict};
use framelock::{Classification, DiscardReason, Format};

use super::laws::{any_some_and_more, assert_lawful};
use crate::any_of::{AnyOf, first};
use crate::layout::{FixedBits, Layout, Length, LengthField, Patterns};

/// Bytes in the longest frame.
const MOST: usize = 4;

/// One of them: anything that is lawful, about one place of the stream.
struct Classified {
    longest: usize,
    starts: bool,
    row: Row,
    /// How many bytes it takes until its header is known to be right or wrong.
    header: usize,
    /// Whether it is wrong, so that the frame is settled.
    is_wrong: bool,
    /// How many it asks for when it has so many and one more.
    at_least: [usize; MOST],
}

impl Classified {
    fn any() -> Self {
        let longest = any_up_to(MOST);
        kani::assume(longest >= 1);
        let row = Row::any(longest);
        let starts = row.settled != Classification::Rejected(DiscardReason::NoSync);
        let (header, is_wrong) = (any_up_to(row.settled_at), kani::any());
        kani::assume(header >= 1);
        if is_wrong {
            kani::assume(
                header == row.settled_at && matches!(row.settled, Classification::Rejected(_)),
            );
        }
        if !starts {
            kani::assume(row.settled_at == 1 && is_wrong);
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
            header,
            is_wrong,
            at_least,
        }
    }

    /// Classifies `count` bytes as a layout's `try_classify` does.
    fn try_classify(&self, count: usize, seen: usize) -> Result<Classification, Classification> {
        let Some(settled) = self.row.settled(count) else {
            let at_least = self.at_least[count - 1];
            let incomplete = Classification::Incomplete { at_least };
            return if count < self.header {
                Err(incomplete)
            } else {
                Ok(incomplete)
            };
        };
        if self.is_wrong {
            return Err(settled);
        }
        // If these were not incomplete, law 5 says nothing.
        let is_told = seen == 0 || self.row.settled(seen).is_none();
        Ok(if is_told { settled } else { any_verdict() })
    }
}

/// Of three: one that nothing begins is as none.
#[kani::proof]
#[kani::unwind(6)]
fn any_of_three() {
    let all: [Classified; 3] = core::array::from_fn(|_| Classified::any());
    let classify_after = |count, seen| first(&all, seen, |one, seen| one.try_classify(count, seen));
    let longest = all.iter().map(|one| one.longest).max().unwrap_or_default();
    let (some, more) = any_some_and_more(MOST, longest);
    let (early, late) = (classify_after(some, 0), classify_after(more, 0));
    assert_lawful(early, late, some, more, longest);
    // Law 4.
    let starts = all.iter().any(|one| one.starts);
    assert!(starts != (late == Classification::Rejected(DiscardReason::NoSync)));
    // Law 5.
    if matches!(early, Classification::Incomplete { .. }) {
        assert!(classify_after(more, some) == late);
    }
    let [first, _, third] = &all;
    kani::cover!(
        first.starts && first.is_wrong && third.starts && late == Classification::Frame(more),
        "the first has the beginning of a frame, and the third a frame"
    );
}

/// A layout of which nothing is told but its syncs of one byte.
fn of_syncs<'a>(syncs: &'a [u8], no_bits: &'a [FixedBits; 0]) -> Layout<'a> {
    Layout {
        sync: Patterns {
            bytes: syncs,
            length: 1,
        },
        length: Length::Fixed,
        shortest: 0,
        longest: 1,
        fixed: no_bits,
        messages: None,
        checksum: None,
        terminator: Patterns::one(&syncs[..0]),
        trailer: None,
    }
}

/// How long [`AnyOf`] says that its frames are, and what it says that they begin with.
#[kani::proof]
#[kani::unwind(5)]
fn any_of_two_layouts() {
    let (bytes, syncs, no_bits) = (kani::any::<[u8; 3]>(), kani::any::<[[u8; 1]; 2]>(), []);
    let layout = |sync| Layout {
        length: if kani::any() {
            Length::Fixed
        } else {
            Length::Field(LengthField::byte(1))
        },
        longest: any_up_to(3),
        ..of_syncs(sync, &no_bits)
    };
    let [one, other] = &syncs;
    let format = AnyOf(&[layout(one), layout(other)]);
    let bytes = &bytes[..any_up_to(3)];
    kani::assume(!bytes.is_empty() && bytes.len() <= format.longest());
    let classification = format.classify(bytes);
    if let Classification::Incomplete { at_least } | Classification::Frame(at_least) =
        classification
    {
        assert!(at_least <= format.longest() && format.starts(bytes[0]));
    }
    let kind = format.decode(bytes).0;
    kani::cover!(
        kind == 1 && classification == Classification::Frame(bytes.len()),
        "a frame of the second"
    );
}

/// A frame may begin with the first byte of each sync, and with no other: of two layouts, one with six syncs.
#[kani::proof]
#[kani::unwind(8)]
fn starts_are_those_of_the_syncs() {
    let (syncs, byte) = kani::any::<([u8; 7], u8)>();
    let (no_bits, (six, other)) = ([], syncs.split_at(6));
    let format = AnyOf(&[of_syncs(six, &no_bits), of_syncs(other, &no_bits)]);
    let begins = syncs.map(|first| first == byte);
    assert!(format.starts(byte) == begins.contains(&true));
    kani::cover!(begins[5] && !begins[..5].contains(&true), "the sixth");
    kani::cover!(begins[6] && !begins[..6].contains(&true), "the other's");
}
