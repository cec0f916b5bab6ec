//! Frames of several layouts on one line.

use core::borrow::Borrow;

use framelock::{Classification, DiscardReason, Format};

use crate::layout::Layout;

/// Frames of several layouts on one line: UBX and NMEA and RTCM, or the messages of one protocol.
///
/// Which layout a frame is of, its header tells: the first that has such a header says the rest.
///
/// # Examples
/// ```
/// use framelock::{BufferedReceiver, Format};
/// use framelock_formats::AnyOf;
/// use framelock_formats::layout::{Layout, Patterns};
///
/// const DOLLAR: Layout = Layout::builder().sync(Patterns::one(b"$")).longest(3).build_const();
/// const HASH: Layout = Layout::builder().sync(Patterns::one(b"#")).longest(2).build_const();
///
/// let mut receiver = BufferedReceiver::with_buffer(AnyOf(&[DOLLAR, HASH]), [0; 6]).expect("it holds the longest");
/// let mut found = Vec::new();
/// for byte in *b"$ab #c" {
///     found.extend(receiver.push(byte).map(|frame| (frame.message().0, frame.bytes().to_vec())));
/// }
/// assert_eq!(found, [(0, b"$ab".to_vec()), (1, b"#c".to_vec())]);
/// ```
#[derive(PartialEq, Eq, Debug)]
pub struct AnyOf<'a, L = Layout<'a>>(
    /// The layouts, in the order in which they are asked; or what holds one each, as the C library's memory does.
    pub &'a [L],
);

// Not derived: the layouts lie behind a reference, so `L` need not be any of these.
impl<L> Clone for AnyOf<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for AnyOf<'_, L> {}

impl<'l, L: Borrow<Layout<'l>>> Format for AnyOf<'_, L> {
    /// A receiver of these is made [`with_buffer`](framelock::BufferedReceiver::with_buffer) memory that is as long as the layouts
    /// say.
    const LONGEST: usize = usize::MAX;
    /// Which of the layouts, the first being 0; and the frame.
    type Message<'a> = (usize, &'a [u8]);

    #[inline]
    fn longest(&self) -> usize {
        let longest = self.0.iter().map(|it| it.borrow().longest);
        longest.max().unwrap_or_default()
    }

    #[inline]
    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    #[inline]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        first(self.0, seen, |it, seen| {
            it.borrow().try_classify(bytes, seen)
        })
    }

    #[inline]
    fn starts(&self, byte: u8) -> bool {
        self.0.iter().any(|it| it.borrow().starts(byte))
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> (usize, &'a [u8]) {
        if let [_] = self.0 {
            return (0, frame);
        }
        // More bytes may have come before an earlier one rejected it, so that one may be incomplete here.
        let is_known = |it: &L| it.borrow().parse(frame).is_ok();
        let kind = self.0.iter().position(is_known);
        (kind.unwrap_or_default(), frame)
    }
}

/// What the first says that has such a header, or may have it yet; each is [`Layout::try_classify`].
#[inline(always)]
pub(crate) fn first<L>(
    all: &[L],
    seen: usize,
    classify: impl Fn(&L, usize) -> Result<Classification, Classification>,
) -> Classification {
    let mut furthest = DiscardReason::NoSync;
    for one in all {
        // The first bytes were incomplete by this one only if none before it begins like it.
        let seen = if furthest == DiscardReason::NoSync {
            seen
        } else {
            0
        };
        match classify(one, seen) {
            Err(Classification::Rejected(why)) => {
                if further_on(why) > further_on(furthest) {
                    furthest = why;
                }
            }
            Ok(classification) | Err(classification) => return classification,
        }
    }
    Classification::Rejected(furthest)
}

/// How far on in a header it is found.
const fn further_on(why: DiscardReason) -> u8 {
    match why {
        DiscardReason::NoSync => 0,
        DiscardReason::BrokenSync => 1,
        _ => 2,
    }
}
