//! Many trials, on every core. What comes out does not depend on how many there are.

use anyhow::Context;
use framelock::{Bin, BinCrc8, Discard, Lecture, Receiver};
use rayon::prelude::*;

use super::parameters::Parameters;
use super::tally::Tally;
use super::trial::{self, Sample};
use crate::names::FrameName;

/// Runs all trials; `done` is called at the end of each.
///
/// # Errors
/// If the parameters are out of their ranges or contradict each other.
pub(super) fn run(parameters: &Parameters, done: impl Fn() + Sync) -> anyhow::Result<Tally> {
    parameters.check()?;
    (0..u64::from(parameters.trials))
        .into_par_iter()
        .map(|number| {
            let tally = run_one(parameters, number, &mut |_| ());
            done();
            tally
        })
        .try_reduce(Tally::default, |sum, more| Ok(sum.and(more)))
}

/// Runs the trial with that number; `watch` is shown what the actuators do.
///
/// # Errors
/// If the failsafe's parameters contradict each other.
pub(super) fn run_one(
    parameters: &Parameters,
    number: u64,
    watch: &mut impl FnMut(Sample),
) -> anyhow::Result<Tally> {
    let tally = match parameters.frame {
        FrameName::Bin => trial::run::<Lecture, Receiver<Bin>>(parameters, number, watch),
        FrameName::BinCrc8 => {
            trial::run::<Receiver<BinCrc8, Discard>, Receiver<BinCrc8>>(parameters, number, watch)
        }
    };
    tally.context("the failsafe's times")
}
