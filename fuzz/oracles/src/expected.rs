//! What the naive reference makes of a stream, in the core's words.

use framelock::{Discarded, Mismatch, Setpoint};
use framelock_proofs::reference::{Event, Format, Policy, whole_buffer};

/// What a parser that was reset in front of a stream must report of it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(crate) struct Expected {
    /// Each with the index of its last byte.
    pub(crate) frames: Vec<(usize, Setpoint)>,
    pub(crate) dropped: Discarded,
    /// Bytes at the end that may yet become a frame.
    pub(crate) pending: usize,
    /// Frames that came after bytes were dropped.
    pub(crate) resynchronisations: u64,
    /// Bytes were dropped behind the last frame.
    pub(crate) lost: bool,
}

impl Expected {
    /// Of the whole stream.
    pub(crate) fn of<F: Format>(bytes: &[u8], policy: Policy) -> Self {
        Self::after::<F>(false, bytes, policy)
    }

    /// Of a stream in front of which bytes were lost, or not.
    pub(crate) fn after<F: Format>(lost: bool, bytes: &[u8], policy: Policy) -> Self {
        let mut expected = Self {
            lost,
            ..Self::default()
        };
        expected.pending = whole_buffer::<F>(bytes, policy, |event| match event {
            Event::Frame { index, setpoint } => {
                expected.frames.push((index, setpoint.into()));
                expected.resynchronisations += u64::from(expected.lost);
                expected.lost = false;
            }
            Event::Dropped { count, place } => {
                let why = match place {
                    0 => Mismatch::NoSync,
                    1 => Mismatch::BrokenSync,
                    place if place == F::LENGTH - 1 => Mismatch::Terminator,
                    _ => Mismatch::Check,
                };
                *counter(&mut expected.dropped, why) += count as u64;
                expected.lost = true;
            }
        });
        expected
    }
}

/// The counter of the bytes that were dropped for that reason.
pub(crate) fn counter(dropped: &mut Discarded, why: Mismatch) -> &mut u64 {
    match why {
        Mismatch::NoSync => &mut dropped.no_sync,
        Mismatch::BrokenSync => &mut dropped.broken_sync,
        Mismatch::Check => &mut dropped.check,
        Mismatch::Terminator => &mut dropped.terminator,
    }
}
