//! Runs many trials on all cores.

use std::panic::resume_unwind;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use anyhow::Result;
use framelock_simulation::{Parameters, Tally};
use indicatif::{ProgressBar, ProgressStyle};

/// One set of parameters and its results.
pub struct Point {
    /// The parameters of the simulation.
    pub parameters: Parameters,
    /// The results of all trials.
    pub tally: Tally,
}

/// Runs all points one after another, and shows the progress on a terminal.
///
/// # Errors
/// Returns an error if the parameters of a point contradict each other.
pub fn run_all(points: Vec<Parameters>) -> Result<Vec<Point>> {
    let trials = points.iter().map(|point| u64::from(point.trials)).sum();
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} trials, {eta} left");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    // The progress bar appears on standard error, and only if standard error is a terminal.
    let progress = ProgressBar::new(trials).with_style(style);
    let threads = thread::available_parallelism().map_or(1, usize::from);
    let outcome = points
        .into_iter()
        .map(|parameters| {
            let tally = tally(&parameters, threads, || progress.inc(1))?;
            Ok(Point { parameters, tally })
        })
        .collect();
    progress.finish_and_clear();
    outcome
}

/// Runs all trials, and calls `done` at the end of each. The results do not depend on the number of
/// threads.
fn tally(parameters: &Parameters, threads: usize, done: impl Fn() + Sync) -> Result<Tally> {
    let next = AtomicU64::new(0);
    let some_trials = || {
        let mut tally = Tally::default();
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            if number >= u64::from(parameters.trials) {
                return anyhow::Ok(tally);
            }
            tally = tally.and(framelock_simulation::run(parameters, number, false)?.tally());
            done();
        }
    };
    thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(some_trials)).collect();
        threads
            .into_iter()
            .try_fold(Tally::default(), |sum, thread| {
                let more = thread.join().unwrap_or_else(|panic| resume_unwind(panic));
                Ok(sum.and(more?))
            })
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[test]
    fn results_depend_on_the_seed_and_not_on_the_threads() {
        let parameters = Parameters {
            lose: 0.1,
            duplicate: 0.1,
            bit_flip: 0.01,
            burst_rate: 5.0,
            break_rate: 5.0,
            trials: 6,
            frames: 300,
            ..Parameters::DEFAULT
        };
        let with = |threads| tally(&parameters, threads, || ()).unwrap();
        assert_eq!(with(1).trials, 6);
        assert_eq!(with(3), with(1));
        assert_eq!(with(8), with(1));
        let other = Parameters {
            seed: 2,
            ..parameters
        };
        assert_ne!(tally(&other, 1, || ()).unwrap(), with(1));
    }
}
