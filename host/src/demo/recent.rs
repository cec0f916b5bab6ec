//! The bytes to be shown: those that came last, and a fault from close up.

use std::collections::VecDeque;
use std::time::Duration;

use super::station::Outcome;

/// One byte on the line, and what it made of each receiver.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct ByteOnLine {
    pub(super) sent: u8,
    /// Its place in its frame: 0 to 6.
    pub(super) place: usize,
    pub(super) received: Option<u8>,
    /// What it made of the lecture's machine; nothing if it was lost.
    pub(super) discard: Option<Outcome>,
    /// What it made of the receiver; nothing if it was lost.
    pub(super) rescan: Option<Outcome>,
}

impl ByteOnLine {
    fn is_fault(&self) -> bool {
        self.received != Some(self.sent)
    }
}

/// Three frames: the one at fault, the one that follows, and one to see how it goes on.
const CLOSE_UP_LENGTH: usize = 21;

/// For how long a fault is looked at, at least.
const CLOSE_UP_TIME: Duration = Duration::from_millis(1200);

/// How many bytes there may be room for.
const RECENT_LENGTH: usize = 128;

/// What has been on the line lately.
#[derive(Debug, Default)]
pub(super) struct Recent {
    bytes: VecDeque<ByteOnLine>,
    close_up: Vec<ByteOnLine>,
    close_up_from: Duration,
}

impl Recent {
    pub(super) fn push(&mut self, now: Duration, byte: ByteOnLine) {
        if self.bytes.len() == RECENT_LENGTH {
            self.bytes.pop_front();
        }
        self.bytes.push_back(byte);

        if !self.close_up.is_empty() && self.close_up.len() < CLOSE_UP_LENGTH {
            self.close_up.push(byte);
            return;
        }
        let has_been_seen = self.close_up.is_empty() || now >= self.close_up_from + CLOSE_UP_TIME;
        if byte.is_fault() && has_been_seen {
            self.close_up_from = now;
            self.close_up.clear();
            // From the first byte of the frame on.
            let behind = self.bytes.len().saturating_sub(byte.place + 1);
            self.close_up.extend(self.bytes.iter().skip(behind));
        }
    }

    /// The bytes that came last, at most so many, oldest first.
    pub(super) fn last(&self, count: usize) -> impl Iterator<Item = &ByteOnLine> {
        self.bytes
            .iter()
            .skip(self.bytes.len().saturating_sub(count))
    }

    /// The frame of the latest fault, and the two behind it, as far as they have come.
    pub(super) fn close_up(&self) -> &[ByteOnLine] {
        &self.close_up
    }
}
