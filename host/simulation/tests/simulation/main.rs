//! Tests that the simulation measures what is known about the protocol.
//!
//! Seeds are fixed, so a test always passes or always fails. A measurement fails only if its
//! probability, given the expected value, is about one in a thousand million. So the tests also
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

/// Returns whether a count of independent events is plausible if `low` to `high` events are expected: within six standard
/// deviations (Poisson), with an allowance for small counts.
#[expect(clippy::cast_precision_loss, reason = "counts are small")]
fn is_plausible(count: u64, low: f64, high: f64) -> bool {
    let (count, deviations) = (count as f64, |expected: f64| 6.0 * expected.sqrt());
    (low - deviations(low)..=high + deviations(high) + 5.0).contains(&count)
}
