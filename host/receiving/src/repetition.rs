//! Finds stretches of a stream that repeat themselves, such as a false start that is sent again and again.
//!
//! The outcome at a position depends only on the bytes from there on, as many as the longest frame has. In a periodic
//! stretch, the same bytes follow one period later, so the outcomes at both positions are the same.

use framelock::Found;

/// The length in bytes of the longest period that the search finds.
const LONGEST_PERIOD: usize = 64;

/// The number of bytes between two searches. It is large, so that searches cost little.
const PAUSE: usize = 256;

/// The last stretch of the stream that repeats itself.
#[derive(Clone, Default, Debug)]
pub(crate) struct Repetition {
    /// The positions of the stretch's first byte and of the byte after the stretch. The two positions are equal if the
    /// stretch is empty.
    from: usize,
    to: usize,
    period: usize,
    /// The known outcomes at the positions of one period.
    outcomes: Vec<Option<Found<()>>>,
    /// The position of the next search.
    next_search: usize,
}

impl Repetition {
    /// Returns the outcome at a position. It depends on the `longest` bytes from this position on. Returns `None` if
    /// the outcome is not known yet.
    #[inline]
    pub(crate) fn outcome(&self, at: usize, longest: usize) -> Option<Found<()>> {
        *self.outcomes.get(self.place(at, longest)?)?
    }

    /// Records the outcome at a position. `bytes` is the stream from this position on, and the outcome depends on the
    /// first `longest` of these bytes.
    pub(crate) fn note(&mut self, at: usize, bytes: &[u8], longest: usize, outcome: Found<()>) {
        if self.next_search <= at && self.to < at + longest {
            self.search(at, bytes, longest);
        }
        let place = self.place(at, longest);
        if let Some(place) = place.and_then(|place| self.outcomes.get_mut(place)) {
            *place = Some(outcome);
        }
    }

    /// Returns a position's index in the period; `None` if the outcome at this position depends on a byte outside the
    /// stretch.
    #[inline]
    fn place(&self, at: usize, longest: usize) -> Option<usize> {
        let is_in = self.from <= at && at + longest <= self.to;
        is_in.then(|| (at - self.from) % self.period)
    }

    #[inline(never)]
    fn search(&mut self, at: usize, bytes: &[u8], longest: usize) {
        let mut most = 0;
        for period in 1..=LONGEST_PERIOD {
            let later = bytes.iter().skip(period);
            let same = bytes.iter().zip(later).take_while(|(a, b)| a == b).count();
            if same >= longest {
                *self = Self {
                    from: at,
                    to: at + same + period,
                    period,
                    outcomes: vec![None; period],
                    next_search: 0,
                };
                break;
            }
            most = most.max(same);
        }
        // The stretch ends where a byte breaks the period. A search before that byte would find nothing new.
        self.next_search = at + most + PAUSE;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::indexing_slicing, reason = "a panic fails the test")]

    use framelock::DiscardReason;
    use rand::{Rng, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;

    const LONGEST: usize = 9;

    /// Stands for the outcome: a function of the next bytes.
    fn computed(bytes: &[u8]) -> Found<()> {
        let sum = bytes[..LONGEST]
            .iter()
            .fold(7_u8, |sum, byte| sum.wrapping_mul(31) ^ byte);
        match sum % 4 {
            0 => Found::frame(LONGEST, ()),
            1 => Found::discarded(2, DiscardReason::NoSync),
            2 => Found::discarded(1, DiscardReason::BadHeader),
            _ => Found::discarded(1, DiscardReason::ChecksumMismatch),
        }
    }

    #[test]
    fn known_outcomes_are_those_that_would_be_computed() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let (mut known, mut unknown) = (0, 0);
        for _ in 0..300 {
            let mut stream = Vec::new();
            for _ in 0..random.random_range(1..6) {
                let length = random.random_range(1..=LONGEST_PERIOD + 2);
                let unit: Vec<u8> = (0..length).map(|_| random.random_range(0..3)).collect();
                stream.extend(unit.repeat(random.random_range(1..200)));
            }
            // When the test records an outcome, only part of the stream has arrived.
            let (mut repetition, mut at) = (Repetition::default(), 0);
            while at + LONGEST <= stream.len() {
                let expected = computed(&stream[at..]);
                if let Some(outcome) = repetition.outcome(at, LONGEST) {
                    assert_eq!(outcome, expected, "{at} of {stream:?}");
                    known += 1;
                } else {
                    let seen = random.random_range(LONGEST..=400).min(stream.len() - at);
                    repetition.note(at, &stream[at..at + seen], LONGEST, expected);
                    unknown += 1;
                }
                at += expected.bytes();
            }
        }
        assert!(known > unknown && unknown > 1_000, "{known} {unknown}");
    }
}
