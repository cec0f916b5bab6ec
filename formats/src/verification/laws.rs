//! The laws, for any layout, and for any two on one line.

use core::cell::Cell;

use framelock::{DiscardReason, Format, Verdict};

use super::any_layout::Parts;
use crate::AnyOf;
use crate::judge::Head;
use crate::layout::{Checksum, Layout};

/// Laws 1 to 3, of what is said of `some` bytes, and of `more`.
fn assert_lawful(early: Verdict, late: Verdict, some: usize, more: usize, longest: usize) {
    match early {
        Verdict::Frame(length) => {
            assert!(1 <= length && length <= some && length <= longest);
            assert!(late == early);
        }
        Verdict::Reject(_) => assert!(late == early),
        Verdict::Incomplete { at_least } => {
            assert!(some < at_least && at_least <= longest);
            assert!(more >= at_least || matches!(late, Verdict::Incomplete { .. }));
        }
    }
    kani::cover!(
        matches!(early, Verdict::Incomplete { .. }) && matches!(late, Verdict::Frame(_)),
        "it is completed"
    );
    kani::cover!(
        matches!(early, Verdict::Incomplete { .. }) && matches!(late, Verdict::Reject(_)),
        "it is refused"
    );
}

/// Two numbers of bytes, neither above `most` or `longest`.
fn any_some_and_more(most: usize, longest: usize) -> (usize, usize) {
    let most = most.min(longest);
    let some = kani::any_where(|&some| 1 <= some && some <= most);
    (some, kani::any_where(|&more| some <= more && more <= most))
}

/// With the checksum of any frame right or wrong.
struct Checked<'a> {
    layout: Layout<'a>,
    is_right: bool,
    /// Bytes in the frame that was asked about.
    asked: Cell<Option<usize>>,
}

impl Checked<'_> {
    fn judge_on(&self, bytes: &[u8], seen: usize) -> Verdict {
        match self.layout.head(bytes) {
            Head::Reject(why) => Verdict::Reject(why),
            Head::Incomplete(at_least) => Verdict::Incomplete { at_least },
            Head::Known(known) => self.layout.body_by(&known, bytes, seen, |_, frame, _| {
                // It is asked about the same frame each time.
                let length = *self.asked.get().get_or_insert(frame.len());
                assert!(core::ptr::eq(frame, &raw const bytes[..length]));
                self.asked.set(Some(length));
                self.is_right
            }),
        }
    }
}

fn a_layout_keeps_the_laws<const MOST: usize, const P: usize, const F: usize, const M: usize>() {
    let bytes: [u8; MOST] = kani::any();
    let parts = Parts::<P, F, M>::any();
    let checksum = kani::any::<bool>().then(|| Checksum::at_the_end(1));
    let layout = Checked {
        layout: parts.layout(checksum),
        is_right: kani::any(),
        asked: Cell::new(None),
    };
    let longest = layout.layout.longest;
    kani::assume(longest >= 1);
    let (some, more) = any_some_and_more(MOST, longest);
    let early = layout.judge_on(&bytes[..some], 0);
    let late = layout.judge_on(&bytes[..more], 0);
    assert_lawful(early, late, some, more, longest);
    // Law 4, and no byte that starts nothing is taken for one that does.
    let no_sync = late == Verdict::Reject(DiscardReason::NoSync);
    assert!(layout.layout.starts(bytes[0]) != no_sync);
    // Law 5.
    if matches!(early, Verdict::Incomplete { .. }) {
        let seen = kani::any_where(|&seen| seen <= some);
        assert!(layout.judge_on(&bytes[..more], seen) == late);
    }
}

#[kani::proof]
#[kani::unwind(9)]
fn a_layout() {
    a_layout_keeps_the_laws::<7, 4, 2, 2>();
}

/// Whichever layout a frame is of, by its bytes alone it is told to be of that.
#[kani::proof]
#[kani::unwind(7)]
fn any_of_two() {
    const MOST: usize = 4;
    let bytes: [u8; MOST] = kani::any();
    let parts = [Parts::<2, 1, 1>::any(), Parts::any()];
    let layouts = [parts[0].layout(None), parts[1].layout(None)];
    let both = AnyOf(&layouts);
    let longest = both.longest();
    assert!(longest == layouts[0].longest.max(layouts[1].longest));
    kani::assume(longest >= 1);
    let (some, more) = any_some_and_more(MOST, longest);
    let early = both.judge(&bytes[..some]);
    let late = both.judge(&bytes[..more]);
    assert_lawful(early, late, some, more, longest);
    let no_sync = late == Verdict::Reject(DiscardReason::NoSync);
    assert!(both.starts(bytes[0]) != no_sync);
    if matches!(early, Verdict::Incomplete { .. }) {
        assert!(both.judge_on(&bytes[..more], some) == late);
    }
    if let Verdict::Frame(length) = late {
        let (kind, frame) = both.decode(&bytes[..length]);
        assert!(layouts[kind].judge(frame) == late);
        kani::cover!(kind == 0);
        kani::cover!(kind == 1);
    }
}
