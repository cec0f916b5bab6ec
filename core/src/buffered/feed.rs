//! Takes slices. Most frames lie whole in a slice, so the receiver classifies the slice's own bytes without a copy.
//! It stores only bytes that wait for the next slice, and bytes that follow pending bytes.

use super::{BufferedReceiver, classify};
use crate::noise::run_without_start;
use crate::{Classification, DiscardReason, Format, Found, Frame};

impl<F: Format, B: AsRef<[u8]> + AsMut<[u8]>> BufferedReceiver<F, B> {
    /// Takes a slice. Reports the outcome of all bytes that can be decided, in the order of the stream. If no bytes are
    /// pending before the call, the function copies only the bytes that are pending after the call.
    ///
    /// The results do not depend on how a stream is cut into slices. If the call drops `d` bytes and delivers `f`
    /// frames, it asks the format for at most `2 (d + f) + 1` classifications. Feed an empty slice to classify the
    /// bytes that `push` has left undecided.
    pub fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Found<Frame<'_, F>>)) {
        let mut rest = bytes;
        while self.pending() > 0 {
            let is_enough = self.store_up_to_longest(&mut rest);
            while self.poll_step(&mut found) {}
            if !is_enough {
                return;
            }
            rest = self.give_back(bytes, rest);
        }
        while !rest.is_empty() {
            let Some(behind) = self.take(rest, &mut found) else {
                return;
            };
            rest = behind;
        }
    }

    /// Moves bytes from the front of the slice into the buffer, until as many bytes are pending as the longest frame
    /// has. The decision about the first pending byte never needs more bytes. Returns whether the slice had enough.
    #[inline]
    pub(super) fn store_up_to_longest(&mut self, bytes: &mut &[u8]) -> bool {
        let missing = self.format.longest().saturating_sub(self.pending());
        let (now, later) = bytes.split_at_checked(missing).unwrap_or((*bytes, &[]));
        self.store(now);
        *bytes = later;
        now.len() == missing
    }

    /// If all pending bytes came from the slice, forgets them, and returns the slice from the first pending byte on.
    /// Otherwise returns `rest`, which is the part of the slice that the caller has not taken yet.
    #[inline]
    pub(super) fn give_back<'b>(&mut self, bytes: &'b [u8], rest: &'b [u8]) -> &'b [u8] {
        let taken = bytes.len().wrapping_sub(rest.len());
        let Some(back) = taken.checked_sub(self.pending()) else {
            return rest;
        };
        self.reset();
        bytes.get(back..).unwrap_or_default()
    }

    /// Delivers or drops the first bytes of a slice. No bytes may be pending. Returns the rest of the slice. If the
    /// slice has too few bytes for a decision, stores the whole slice and returns `None`.
    #[inline]
    pub(super) fn take<'b>(
        &mut self,
        bytes: &'b [u8],
        found: &mut impl FnMut(Found<Frame<'_, F>>),
    ) -> Option<&'b [u8]> {
        let run = run_without_start(bytes, |byte| self.format.starts(byte));
        if run > 0 {
            found(Found::discarded(run, DiscardReason::NoSync));
            return bytes.get(run..);
        }
        let classified = bytes.get(..self.format.longest()).unwrap_or(bytes);
        match classify(&self.format, classified, 0) {
            Classification::Frame(length) => {
                let (frame, behind) = bytes.split_at_checked(length)?;
                found(Found::frame(length, Frame::new(self.format.clone(), frame)));
                Some(behind)
            }
            Classification::Rejected(why) => {
                found(Found::discarded(1, why));
                bytes.get(1..)
            }
            Classification::Incomplete { at_least } => {
                self.store(bytes);
                self.ask_at = self.from.wrapping_add(at_least);
                None
            }
        }
    }
}
