//! That several on one line keep the laws, if each does and knows by the first byte whether a frame may begin, as
//! every layout does.

use framelock::any_format::{Row, any_up_to, any_verdict};
use framelock::{DiscardReason, Format, Verdict};

use super::laws::{any_some_and_more, assert_lawful};
use crate::any_of::{AnyOf, first};
use crate::layout::{FixedBits, Layout, Length, LengthField, Patterns};

/// Bytes in the longest frame.
const MOST: usize = 4;

/// One of them: anything that is lawful, about one place of the stream.
struct Told {
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

impl Told {
    fn any() -> Self {
        let longest = any_up_to(MOST);
        kani::assume(longest >= 1);
        let row = Row::any(longest);
        let starts = row.settled != Verdict::Reject(DiscardReason::NoSync);
        let (header, is_wrong) = (any_up_to(row.settled_at), kani::any());
        kani::assume(header >= 1);
        if is_wrong {
            kani::assume(header == row.settled_at && matches!(row.settled, Verdict::Reject(_)));
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

    /// As a layout's `told`, of so many bytes.
    fn told(&self, count: usize, seen: usize) -> Result<Verdict, Verdict> {
        let Some(settled) = self.row.settled(count) else {
            let at_least = self.at_least[count - 1];
            let incomplete = Verdict::Incomplete { at_least };
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
    let all: [Told; 3] = core::array::from_fn(|_| Told::any());
    let judge_on = |count, seen| first(&all, seen, |one, seen| one.told(count, seen));
    let longest = all.iter().map(|one| one.longest).max().unwrap_or_default();
    let (some, more) = any_some_and_more(MOST, longest);
    let (early, late) = (judge_on(some, 0), judge_on(more, 0));
    assert_lawful(early, late, some, more, longest);
    // Law 4.
    let starts = all.iter().any(|one| one.starts);
    assert!(starts != (late == Verdict::Reject(DiscardReason::NoSync)));
    // Law 5.
    if matches!(early, Verdict::Incomplete { .. }) {
        assert!(judge_on(more, some) == late);
    }
    let [first, _, third] = &all;
    kani::cover!(
        first.starts && first.is_wrong && third.starts && late == Verdict::Frame(more),
        "the first has the beginning of a frame, and the third a frame"
    );
}

/// How long [`AnyOf`] says that its frames are, and what it says that they begin with.
#[kani::proof]
#[kani::unwind(5)]
fn any_of_two_layouts() {
    let (bytes, syncs) = kani::any::<([u8; 3], [[u8; 1]; 2])>();
    let fixed = [FixedBits {
        at: 0,
        mask: 0,
        value: 0,
    }];
    let layout = |sync| Layout {
        sync: Patterns::one(sync),
        length: if kani::any() {
            Length::Fixed
        } else {
            Length::Field(LengthField::byte(1))
        },
        shortest: 0,
        longest: any_up_to(3),
        fixed: &fixed[..0],
        messages: None,
        checksum: None,
        terminator: Patterns::one(&bytes[..0]),
        appendix: None,
    };
    let [one, other] = &syncs;
    let format = AnyOf(&[layout(one), layout(other)]);
    let bytes = &bytes[..any_up_to(3)];
    kani::assume(!bytes.is_empty() && bytes.len() <= format.longest());
    let verdict = format.judge(bytes);
    if let Verdict::Incomplete { at_least } | Verdict::Frame(at_least) = verdict {
        assert!(at_least <= format.longest() && format.starts(bytes[0]));
    }
    let kind = format.decode(bytes).0;
    kani::cover!(
        kind == 1 && verdict == Verdict::Frame(bytes.len()),
        "a frame of the second"
    );
}
