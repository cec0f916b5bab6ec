//! Tests that the simulation measures what is known about the protocol.
//!
//! Seeds are fixed, so a test always passes or always fails. A measurement fails only if its
//! probability, given the expected value, is less than one in a thousand million. So the tests also
//! pass with another seed or another order of the random numbers. For each commit the tests run few
//! trials. With `FRAMELOCK_STATISTICS=full` they run many trials, which takes minutes.
#![allow(clippy::unwrap_used, reason = "a panic fails the test")]

mod findings;
mod limits;
mod theory;

use framelock_simulation::{
    Parameters, Policy, Protocol, ReceiverTally, StationKind, Tally, run_all,
};

fn bin() -> Protocol {
    Protocol::named("bin").unwrap()
}

fn bin_crc8() -> Protocol {
    Protocol::named("bin-crc8").unwrap()
}

/// Runs all trials with BIN frames.
fn simulated(parameters: &Parameters) -> Tally {
    run_all(&bin(), parameters).unwrap()
}

/// Returns the tally of the receiver with this policy.
fn receiver(tally: &Tally, policy: Policy, has_idle_gap: bool) -> &ReceiverTally {
    let kind = StationKind {
        policy,
        has_idle_gap,
    };
    tally
        .receivers
        .iter()
        .find(|receiver| receiver.kind == kind)
        .unwrap()
}

/// Returns the number of trials: `full` if `FRAMELOCK_STATISTICS` is `full`, otherwise `commit`.
fn trials(commit: u32, full: u32) -> u32 {
    match std::env::var("FRAMELOCK_STATISTICS").as_deref() {
        Ok("full") => full,
        _ => commit,
    }
}

/// Returns whether a count of independent events is more likely than one in a thousand million
/// (Poisson) if `low` to `high` events are expected.
#[expect(clippy::cast_precision_loss, reason = "counts are small")]
fn is_plausible(count: u64, low: f64, high: f64) -> bool {
    let expected = (count as f64).clamp(low, high);
    let probability = |count: u64| {
        let factorial: f64 = (1..=count).map(|factor| (factor as f64).ln()).sum();
        (count as f64 * expected.ln() - expected - factorial).exp()
    };
    let mut tail = 0.0;
    let mut term = probability(count);
    let mut place = count as f64;
    let rises = place > expected;
    while term > 1e-12 && place >= 0.0 {
        tail += term;
        term *= if rises {
            expected / (place + 1.0)
        } else {
            place / expected
        };
        place += if rises { 1.0 } else { -1.0 };
    }
    tail > 1e-9
}

#[test]
fn a_count_is_plausible_near_what_is_expected() {
    for (count, expected, is) in [
        (0, 3.0, true),
        (0, 20.0, true),
        (0, 21.0, false),
        (18, 3.0, true),
        (19, 3.0, false),
        (10_590, 10_000.0, true),
        (10_700, 10_000.0, false),
        (9_410, 10_000.0, true),
        (9_300, 10_000.0, false),
    ] {
        assert_eq!(
            is_plausible(count, expected, expected),
            is,
            "{count} {expected}"
        );
    }
}
