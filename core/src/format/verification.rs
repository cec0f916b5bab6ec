//! Arbitrary classifications, lawful or not, and other arbitrary values. The harnesses in this crate and in
//! `framelock-formats` use them.

use crate::{Classification, DiscardReason, LineEvent};

/// The answers of a lawful format about one position of the stream. With fewer than `settled_at` bytes the answer is
/// `Incomplete`. With `settled_at` bytes or more it is always `settled` (laws 1 to 3).
#[derive(Clone, Copy)]
pub struct Row {
    /// Number of bytes that decide the classification.
    pub settled_at: usize,
    /// The final classification.
    pub settled: Classification,
}

impl Row {
    /// Returns any row of a format whose longest frame has `longest` bytes.
    pub fn any(longest: usize) -> Self {
        let settled_at = any_up_to(longest);
        let settled = if kani::any() {
            Classification::Frame(any_up_to(longest))
        } else {
            Classification::Rejected(any_mismatch())
        };
        kani::assume(1 <= settled_at);
        if let Classification::Frame(length) = settled {
            kani::assume(1 <= length && length <= settled_at);
        }
        Self {
            settled_at,
            settled,
        }
    }

    /// Returns the final classification, or `None` if `length` bytes are incomplete.
    pub fn settled(&self, length: usize) -> Option<Classification> {
        (length >= self.settled_at).then_some(self.settled)
    }

    /// Classifies `length` bytes. If these bytes are incomplete, `at_least` may differ from one call to the next.
    pub fn classify(&self, length: usize) -> Classification {
        self.settled(length).unwrap_or_else(|| {
            let at_least = any_up_to(self.settled_at);
            kani::assume(length < at_least);
            Classification::Incomplete { at_least }
        })
    }
}

/// Returns any reason.
pub fn any_mismatch() -> DiscardReason {
    match kani::any::<u8>() {
        0 => DiscardReason::NoSync,
        1 => DiscardReason::BrokenSync,
        2 => DiscardReason::BadHeader,
        3 => DiscardReason::ChecksumMismatch,
        4 => DiscardReason::WrongTerminator,
        5 => DiscardReason::TooLong,
        6 => DiscardReason::UnknownMessage,
        7 => DiscardReason::BrokenStuffing,
        _ => DiscardReason::LineEvent,
    }
}

/// Returns `items[from..to]`. Indexing with a range would add the code that formats the range for the panic message.
/// This code would double the number of functions in a harness, and the time that Kani needs to prepare the harness.
///
/// # Panics
/// Panics if the range is not within the items.
#[must_use]
pub fn part<T>(items: &[T], from: usize, to: usize) -> &[T] {
    items.get(from..to).unwrap()
}

/// Returns any number up to `most`, which must fit into a byte.
pub fn any_up_to(most: usize) -> usize {
    let number = usize::from(kani::any::<u8>());
    kani::assume(number <= most);
    number
}

/// Returns any classification, lawful or not.
pub fn any_verdict() -> Classification {
    let number: u8 = kani::any();
    // Byte 255 becomes the largest `usize`, which stands for all numbers that are far too large.
    let number = if number == u8::MAX {
        usize::MAX
    } else {
        usize::from(number)
    };
    match kani::any::<u8>() {
        0 => Classification::Frame(number),
        1 => Classification::Incomplete { at_least: number },
        _ => Classification::Rejected(any_mismatch()),
    }
}

/// Returns any line event.
pub fn any_line_event() -> LineEvent {
    match kani::any::<u8>() {
        0 => LineEvent::Framing,
        1 => LineEvent::Parity,
        2 => LineEvent::Overrun,
        3 => LineEvent::Break,
        _ => LineEvent::Idle,
    }
}

/// Returns any answer that a lawful format can give about `length` incomplete bytes that a line event follows (law 6).
pub fn any_before(length: usize) -> Classification {
    if kani::any() {
        let frame = any_up_to(length);
        kani::assume(frame >= 1);
        Classification::Frame(frame)
    } else {
        Classification::Rejected(any_mismatch())
    }
}
