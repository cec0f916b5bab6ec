//! Frames of several layouts on one line.

use core::borrow::Borrow;

use framelock::{Classification, DiscardReason, Format, LineEvent};

use crate::classify::is_silence;
use crate::layout::{CheckedLayout, Length};

/// Frames of several layouts on one line, for example UBX, NMEA and RTCM frames, or different messages of one protocol.
///
/// The layouts are tried in order. If a layout rejects the bytes, the next layout is tried. The first layout that does
/// not reject the bytes decides whether the bytes are a frame or are incomplete. So several layouts may have the same
/// header, as Modbus requests and responses do. A frame of a later layout stays pending as long as its bytes may still
/// become a frame of an earlier layout.
///
/// A line event ends this wait. Then the first layout that finds a whole frame decides. So if a pause follows each
/// frame and is reported, waiting loses no frame, whatever the order of the layouts. The order decides how early a
/// frame is delivered, and which frame is delivered if bytes fit several layouts. If pauses are not reported, put
/// layouts with shorter frames first.
///
/// A layout whose frames end with [silence](Length::Silence) waits at every sync, so put such a layout last. If the
/// bytes of a frame fit such a layout and another layout, the message has the index of the first of these layouts.
///
/// # Examples
/// ```
/// use framelock::{BufferedReceiver, Format};
/// use framelock_formats::AnyOf;
/// use framelock_formats::layout::{CheckedLayout, Layout, Patterns};
///
/// const fn short(sync: &[u8], longest: usize) -> CheckedLayout<'_> {
///     Layout { sync: Patterns::one(sync), longest, ..Layout::NONE }.checked()
/// }
/// const DOLLAR: CheckedLayout = short(b"$", 3);
/// const HASH: CheckedLayout = short(b"#", 2);
///
/// let mut receiver = BufferedReceiver::with_buffer(AnyOf(&[DOLLAR, HASH]), [0; 6]).expect("it holds the longest");
/// let mut found = Vec::new();
/// for byte in *b"$ab #c" {
///     found.extend(receiver.push(byte).map(|frame| (frame.message().0, frame.bytes().to_vec())));
/// }
/// assert_eq!(found, [(0, b"$ab".to_vec()), (1, b"#c".to_vec())]);
/// ```
#[derive(PartialEq, Eq, Debug)]
pub struct AnyOf<'a, L = CheckedLayout<'a>>(
    /// The layouts, in the order in which they are tried. Each element is a layout or contains one.
    pub &'a [L],
);

// `Clone` and `Copy` are not derived, because a derived implementation would require that `L` implements the trait too.
// A copy contains only a reference to the layouts, so `L` need not implement it.
impl<L> Clone for AnyOf<'_, L> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<L> Copy for AnyOf<'_, L> {}

impl<'l, L: Borrow<CheckedLayout<'l>>> Format for AnyOf<'_, L> {
    /// The length of the longest frame is known only at run time, so construct the receiver
    /// [`with_buffer`](framelock::BufferedReceiver::with_buffer), and give the receiver a buffer that holds the longest
    /// frame of all layouts.
    const LONGEST: usize = usize::MAX;
    /// The index of the frame's layout, and the bytes of the frame.
    type Message<'a> = (usize, &'a [u8]);

    #[inline]
    fn longest(&self) -> usize {
        let longest = self.0.iter().map(|it| it.borrow().most_bytes());
        longest.max().unwrap_or_default()
    }

    #[inline]
    fn classify(&self, bytes: &[u8]) -> Classification {
        self.classify_after(bytes, 0)
    }

    #[inline]
    fn classify_after(&self, bytes: &[u8], seen: usize) -> Classification {
        first(
            self.0,
            seen,
            |it| bytes.first().is_some_and(|&byte| it.borrow().starts(byte)),
            |it, seen| classify(it.borrow(), bytes, seen, false),
        )
    }

    #[inline]
    fn classify_before(&self, bytes: &[u8], event: LineEvent) -> Classification {
        let is_over = is_silence(event);
        first_before(self.0, |it| {
            let layout: &CheckedLayout = it.borrow();
            let ends_with_silence = matches!(layout.length, Length::Silence);
            (classify(layout, bytes, 0, is_over), ends_with_silence)
        })
    }

    #[inline]
    fn starts(&self, byte: u8) -> bool {
        self.0.iter().any(|it| it.borrow().starts(byte))
    }

    #[inline]
    fn decode<'a>(&self, frame: &'a [u8]) -> (usize, &'a [u8]) {
        let starts = |it: &L| frame.first().is_some_and(|&byte| it.borrow().starts(byte));
        let is_its_frame =
            |it: &L| classify(it.borrow(), frame, 0, true) == Classification::Frame(frame.len());
        (kind(self.0, starts, is_its_frame), frame)
    }
}

/// Does the same as [`CheckedLayout::classify_after`]. If `is_over`, silence follows the bytes.
// The compiler does not inline this function, because the code for any layout is long.
#[inline(never)]
fn classify(layout: &CheckedLayout, bytes: &[u8], seen: usize, is_over: bool) -> Classification {
    layout.0.classify_at(bytes, seen, is_over)
}

/// Returns the classification of the first layout that does not reject the bytes. If all layouts reject them, returns
/// the reason from the layout that found the error latest in the frame.
#[inline(always)]
pub(crate) fn first<L>(
    all: &[L],
    seen: usize,
    starts: impl Fn(&L) -> bool,
    classify: impl Fn(&L, usize) -> Classification,
) -> Classification {
    let mut furthest = DiscardReason::NoSync;
    let mut rest = all;
    while let [one, others @ ..] = rest {
        // One of the layouts has classified the first `seen` bytes as incomplete. It was `one` if every other layout
        // rejects the first byte.
        let is_alone = furthest == DiscardReason::NoSync && !others.iter().any(&starts);
        match classify(one, if is_alone { seen } else { 0 }) {
            Classification::Rejected(why) => {
                if further_on(why) > further_on(furthest) {
                    furthest = why;
                }
            }
            classification => return classification,
        }
        rest = others;
    }
    Classification::Rejected(furthest)
}

/// Returns the classification of bytes that a line event follows. The first layout that finds a frame decides. If no
/// layout finds a frame, the bytes are rejected. The reason is the line event, because at least one layout had waited for
/// more bytes. But if a layout whose frames end with silence found an error after the header, the reason is this error.
///
/// `classify` returns a layout's classification, and true if the layout's frames end with silence.
#[inline(always)]
pub(crate) fn first_before<L>(
    all: &[L],
    mut classify: impl FnMut(&L) -> (Classification, bool),
) -> Classification {
    let mut furthest = DiscardReason::LineEvent;
    for one in all {
        match classify(one) {
            (Classification::Frame(length), _) => return Classification::Frame(length),
            (Classification::Rejected(why), true) if further_on(why) > further_on(furthest) => {
                furthest = why;
            }
            _ => {}
        }
    }
    Classification::Rejected(furthest)
}

/// Returns the index of the first layout that accepts a frame.
///
/// An earlier layout may have rejected the stream only because of bytes after the frame. Such a layout classifies the
/// frame's bytes alone as incomplete, so this function skips the layout.
#[inline(always)]
pub(crate) fn kind<L>(
    all: &[L],
    starts: impl Fn(&L) -> bool,
    is_its_frame: impl Fn(&L) -> bool,
) -> usize {
    let (mut kind, mut rest) = (0_usize, all);
    while let [one, others @ ..] = rest {
        // If frames of the later layouts cannot begin with this byte, only this layout can have accepted the frame.
        if starts(one) && (!others.iter().any(&starts) || is_its_frame(one)) {
            return kind;
        }
        (kind, rest) = (kind.wrapping_add(1), others);
    }
    0
}

/// Returns a number for the part of a frame in which classification finds this reason: 0 for the first byte, 1 for the
/// rest of the sync, 2 for the header, 3 for the rest of the frame.
pub(crate) const fn further_on(why: DiscardReason) -> u8 {
    match why {
        DiscardReason::NoSync => 0,
        DiscardReason::BrokenSync => 1,
        DiscardReason::WrongTerminator | DiscardReason::ChecksumMismatch => 3,
        _ => 2,
    }
}
