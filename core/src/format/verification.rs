//! Any classifications, lawful or not: for theorem 13, here and in `framelock-formats`.

use crate::{Classification, DiscardReason};

/// What a lawful format says from one place of the stream on. With fewer than `settled_at` bytes it is
/// `Incomplete`, with as many or more always the same (laws 1 to 3).
#[derive(Clone, Copy)]
pub struct Row {
    /// How many bytes it takes.
    pub settled_at: usize,
    /// What it says then.
    pub settled: Classification,
}

impl Row {
    /// With frames of up to so many bytes.
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

    /// Of so many bytes; `None` if they are incomplete.
    pub fn settled(&self, length: usize) -> Option<Classification> {
        (length >= self.settled_at).then_some(self.settled)
    }

    /// Of so many bytes. How many more it takes is another answer each time.
    pub fn classify(&self, length: usize) -> Classification {
        self.settled(length).unwrap_or_else(|| {
            let at_least = any_up_to(self.settled_at);
            kani::assume(length < at_least);
            Classification::Incomplete { at_least }
        })
    }
}

/// Any reason.
pub fn any_mismatch() -> DiscardReason {
    match kani::any::<u8>() {
        0 => DiscardReason::NoSync,
        1 => DiscardReason::BrokenSync,
        2 => DiscardReason::BadHeader,
        3 => DiscardReason::ChecksumMismatch,
        4 => DiscardReason::WrongTerminator,
        5 => DiscardReason::TooLong,
        6 => DiscardReason::UnknownMessage,
        _ => DiscardReason::LineEvent,
    }
}

/// Any number up to one that fits a byte.
pub fn any_up_to(most: usize) -> usize {
    let number = usize::from(kani::any::<u8>());
    kani::assume(number <= most);
    number
}

/// Any at all, lawful or not.
pub fn any_verdict() -> Classification {
    let number: u8 = kani::any();
    // As wrong as a number can be.
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
