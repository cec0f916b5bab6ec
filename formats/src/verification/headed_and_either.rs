//! Theorem 13g: [`Headed`] and [`Either`] keep the laws of [`Format`].
//!
//! Each harness takes any bytes, and asks about the first of them twice: about `some`, and about `more`.
//! Neither has a `judge_on` of its own, which is law 5.
//!
//! * [`Headed`]: whatever the sync bytes (up to three), the header's length, the longest frame (up to 280
//!   bytes), and whatever the length function and the check say of these bytes.
//! * [`Either`] of any two formats that keep the laws. If besides the first knows each frame by the
//!   frame's own bytes, `decode` asks the format that the frame is of.

use framelock::any_format::{Row, any_mismatch, any_up_to};
use framelock::{DiscardReason, Format, Verdict};

use crate::{Either, EitherMessage, Headed};

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
}

fn any_some_and_more(most: usize) -> (usize, usize) {
    let some = kani::any_where(|&some| 1 <= some && some <= most);
    (some, kani::any_where(|&more| some <= more && more <= most))
}

#[kani::proof]
#[kani::unwind(5)]
fn headed_is_lawful() {
    const MOST: usize = 280;
    let (first, sync): ([u8; 3], [u8; 3]) = (kani::any(), kani::any());
    // What stands behind the sync only the functions look at.
    let mut bytes = [0; MOST];
    (bytes[0], bytes[1], bytes[2]) = (first[0], first[1], first[2]);
    let format = Headed {
        sync: &sync[..any_up_to(3)],
        header: kani::any(),
        longest: kani::any_where(|&longest| longest <= MOST),
    };
    let header = format.header.max(format.sync.len()).max(1);
    kani::assume(header <= format.longest);
    let length: Option<usize> = kani::any();
    let mismatch = kani::any::<bool>().then(any_mismatch);
    let judge = |known: usize| {
        format.judge_and_say_why(
            &bytes[..known],
            |asked| {
                assert!(core::ptr::eq(asked, &raw const bytes[..header]));
                length
            },
            |frame| {
                assert!(core::ptr::eq(frame, &raw const bytes[..length.unwrap()]));
                mismatch
            },
        )
    };
    let (some, more) = any_some_and_more(format.longest);
    let (early, late) = (judge(some), judge(more));
    // Law 4, with the `starts` that there is without another.
    if judge(1) == Verdict::Reject(DiscardReason::NoSync) {
        assert!(early == Verdict::Reject(DiscardReason::NoSync));
    }
    if let Verdict::Frame(frame) = late {
        assert!(length == Some(frame) && frame >= header && mismatch.is_none());
        let at = any_up_to(2);
        assert!(at >= format.sync.len() || bytes[at] == sync[at]);
    }
    assert_lawful(early, late, some, more, format.longest);
}

/// Any format, on one stream.
struct Lawful<const L: usize> {
    row: Row,
    starts: bool,
}

impl<const L: usize> Lawful<L> {
    fn any() -> Self {
        let (row, starts) = (Row::any(L), kani::any());
        let is_no_sync =
            row.settled_at == 1 && row.settled == Verdict::Reject(DiscardReason::NoSync);
        kani::assume(starts || is_no_sync);
        Self { row, starts }
    }
}

impl<const L: usize> Format for Lawful<L> {
    const LONGEST: usize = L;
    type Message<'a> = usize;

    fn judge(&self, bytes: &[u8]) -> Verdict {
        assert!(bytes.len() <= L);
        self.row.judge(bytes.len())
    }

    fn starts(&self, _: u8) -> bool {
        self.starts
    }

    fn decode(&self, frame: &[u8]) -> usize {
        frame.len()
    }
}

fn either_is_lawful<const A: usize, const B: usize>() {
    let longest = Either::<Lawful<A>, Lawful<B>>::LONGEST;
    assert!(longest == A.max(B));
    let (first, second) = (Lawful::<A>::any(), Lawful::<B>::any());
    let (first_row, second_row) = (first.row, second.row);
    let either = Either(first, second);
    let bytes = [0; 64];
    let (some, more) = any_some_and_more(longest);
    let early = either.judge(&bytes[..some]);
    let late = either.judge(&bytes[..more]);
    if !either.starts(0) {
        assert!(early == Verdict::Reject(DiscardReason::NoSync));
    }
    let knows_its_frames = match first_row.settled {
        Verdict::Frame(length) => length == first_row.settled_at,
        _ => true,
    };
    if let (true, Verdict::Frame(length)) = (knows_its_frames, late) {
        let expected = if first_row.settled(more) == Some(late) {
            EitherMessage::First(length)
        } else {
            assert!(second_row.settled(more) == Some(late));
            EitherMessage::Second(length)
        };
        assert!(either.decode(&bytes[..length]) == expected);
        kani::cover!(
            expected == EitherMessage::Second(length) && first_row.settled_at > length,
            "the first rejects it late"
        );
    }
    assert_lawful(early, late, some, more, longest);
}

#[kani::proof]
#[kani::unwind(2)]
fn either_with_a_longer_first_is_lawful() {
    either_is_lawful::<64, 8>();
}

#[kani::proof]
#[kani::unwind(2)]
fn either_with_a_longer_second_is_lawful() {
    either_is_lawful::<8, 64>();
}
