//! Proves which bytes are a frame if silence ends the frames, and which of these frames a receiver delivers.

use framelock::any_format::any_line_event;
use framelock::{BufferedReceiver, Classification, Format, LineEvent};

use super::any_layout::patterns;
use super::laws::any_some_and_more;
use crate::layout::{Algorithm, CheckedLayout, Checksum, Layout, Length};

/// Returns whether the event is a silence. This definition is independent of the format's own function.
fn is_silence(event: LineEvent) -> bool {
    event == LineEvent::Idle || event == LineEvent::Break
}

fn xor(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |xor, byte| xor ^ byte)
}

/// A layout whose frames end with silence keeps the laws. Before a line event, the bytes are a frame if and only if the
/// event is a pause or a break, and the sync, the length and the checksum of all the bytes together are right.
#[kani::proof]
#[kani::unwind(6)]
fn silence_ends_a_frame() {
    let syncs = kani::any::<[[u8; 1]; 2]>();
    let layout = CheckedLayout(Layout {
        sync: patterns(&syncs),
        length: Length::Silence,
        shortest: kani::any_where(|&shortest| shortest >= 2),
        longest: kani::any_where(|longest| (2..usize::MAX).contains(longest)),
        checksum: Some(Checksum {
            algorithm: Algorithm::Xor,
            ..Checksum::at_the_end(1)
        }),
        ..Layout::NONE
    });
    let bytes: [u8; 4] = kani::any();
    let (some, more) = any_some_and_more(4, layout.most_bytes());
    let (early, late) = (
        layout.classify(&bytes[..some]),
        layout.classify(&bytes[..more]),
    );
    if let Classification::Incomplete { at_least } = early {
        assert!(some < at_least && at_least <= layout.most_bytes());
        assert!(more >= at_least || matches!(late, Classification::Incomplete { .. }));
    } else {
        assert!(matches!(early, Classification::Rejected(_)) && late == early);
    }

    let event = any_line_event();
    let before = layout.classify_before(&bytes[..some], event);
    let begins = bytes[0] == syncs[0][0] || bytes[0] == syncs[1][0];
    let fits = layout.shortest <= some && some <= layout.longest;
    let is_frame = is_silence(event) && begins && fits && xor(&bytes[..some]) == 0;
    match before {
        Classification::Frame(length) => assert!(is_frame && length == some),
        // Law 6.
        _ => assert!(!is_frame && matches!(before, Classification::Rejected(_))),
    }
    kani::cover!(is_frame, "a frame");
    kani::cover!(begins && some > layout.longest, "too long");
}

/// Frames of two or three bytes, whose exclusive or is zero.
#[derive(Clone, Copy)]
struct Short;

impl Format for Short {
    crate::classify_by!(
        Layout {
            length: Length::Silence,
            longest: 3,
            checksum: Some(Checksum {
                algorithm: Algorithm::Xor,
                ..Checksum::at_the_end(1)
            }),
            ..Layout::NONE
        }
        .checked()
    );
    type Message<'a> = ();

    fn decode(&self, _: &[u8]) {}
}

/// At a pause or a break, the receiver delivers only the longest frame that ends there and begins after the previous
/// event. It delivers nothing earlier, and nothing at any other event.
mod the_longest_suffix_is_delivered {
    use super::{BufferedReceiver, Short, any_line_event, is_silence, xor};

    fn after<const COUNT: usize>() {
        let bytes: [u8; COUNT] = kani::any();
        let mut receiver = BufferedReceiver::<Short, [u8; 8]>::new(Short);
        for byte in &bytes {
            assert!(receiver.push(*byte).is_none());
        }
        let event = any_line_event();
        let is_frame = |suffix: &&[u8]| (2..=3).contains(&suffix.len()) && xor(suffix) == 0;
        let expected = (0..COUNT)
            .map(|from| &bytes[from..])
            .find(is_frame)
            .filter(|_| is_silence(event))
            .map(<[u8]>::len);
        let mut delivered = None;
        receiver.line_event(event, |found| {
            if let Some(frame) = found.message() {
                assert!(delivered.is_none());
                delivered = Some(frame.bytes().len());
            }
        });
        assert!(delivered == expected && receiver.pending() == 0);
        kani::cover!(delivered == Some(2), "the shortest frame");
    }

    #[kani::proof]
    #[kani::unwind(4)]
    fn after_two_bytes() {
        after::<2>();
    }

    #[kani::proof]
    #[kani::unwind(5)]
    fn after_three_bytes() {
        after::<3>();
    }

    #[kani::proof]
    #[kani::unwind(6)]
    fn after_four_bytes() {
        after::<4>();
    }
}
