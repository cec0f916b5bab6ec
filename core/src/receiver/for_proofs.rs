//! The parts of [`Parser::feed`](crate::Parser::feed), each of which is proved by itself.
#![cfg(kani)]

use super::{Receiver, first_mismatch};
use crate::{Format, Mismatch, Policy, Sink, slice};

impl<F: Format, P: Policy> Receiver<F, P> {
    /// The message of the frame that begins a slice.
    #[must_use]
    pub fn whole_frame_of_slice(rest: &[u8]) -> Option<F::Message> {
        Self::whole_frame(rest)
    }

    /// Takes some of a short slice, and returns how many bytes.
    pub fn some_of_slice<S: Sink<F::Message>>(
        &mut self,
        rest: &[u8],
        at: usize,
        sink: &mut S,
    ) -> usize {
        self.take_some(rest, at, sink)
    }

    /// Takes frames from the head of a slice in whole rows; returns the place behind the last.
    pub fn rows_of_slice<S: Sink<F::Message>>(bytes: &[u8], sink: &mut S) -> usize {
        slice::rows::<F, S>(bytes, 0, sink)
    }

    /// Judges the next candidate of a block's starts from `judged` on, if there is one, and the
    /// starts in front of it; returns the start behind the last that is judged then.
    pub fn next_in_block<S: Sink<F::Message>>(
        bytes: &[u8; slice::REACH],
        judged: u32,
        sink: &mut S,
    ) -> Option<u32> {
        let of_block = slice::Starts::new::<F>(bytes)?;
        let start = of_block.candidate::<P>(judged)?;
        let (judged, _) = of_block.judge::<F, P, S>(judged, start, 0, bytes, sink)?;
        Some(judged)
    }

    /// Tells why no frame begins at these starts of a block, a bit for each.
    pub fn drop_in_block<S: Sink<F::Message>>(
        bytes: &[u8; slice::REACH],
        starts: u64,
        sink: &mut S,
    ) {
        if let Some(of_block) = slice::Starts::new::<F>(bytes) {
            of_block.report_dropped::<F, S>(starts, bytes, sink);
        }
    }

    /// Where the frame that would begin with the lowest `known` bytes of `bytes` fails, and why.
    #[must_use]
    pub fn mismatch(bytes: F::Word, known: u8) -> Option<(u8, Mismatch)> {
        first_mismatch::<F>(bytes, known)
    }
}
