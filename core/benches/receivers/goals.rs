//! The goals for the speed of `feed`. Each goal states how many times as fast as another contender `feed` must be.
//!
//! This module measures the ratio of the two speeds without criterion, so that other load on the machine cannot favour
//! one contender. The two contenders run alternately on pieces of the stream. The pieces are so short that a run is
//! seldom interrupted. The module prints the median of the ratios of all pieces in all rounds.

use std::hint::black_box;
use std::time::Instant;

use framelock::Receiver;
use framelock::motion::Bin;

use crate::{contenders, inputs};

/// Bytes in a piece.
const PIECE: usize = 1 << 16;

/// Number of times that each piece is measured.
const ROUNDS: usize = 16;

type Contender = (&'static str, fn(&[u8]) -> crate::answer::Answer);

const PUSH: Contender = ("push", contenders::push::<Receiver<Bin>>);
const FEED: Contender = ("feed", contenders::feed::<Receiver<Bin>>);
const REGEX: Contender = ("regex", contenders::regex);

/// Measures every ratio, and prints it with its goal.
pub(crate) fn compare() {
    println!(
        "\n{:<40} {:<27} {:>5} {:>8}   (10 % to 90 %)",
        "times as fast", "", "goal", "median"
    );
    let clean = inputs::clean_frames();
    goal(&clean, FEED, PUSH, 5.0);
    goal(&clean, FEED, REGEX, 30.0);
    goal(&inputs::frames_with_losses(), FEED, PUSH, 1.5);
    goal(&inputs::noise(), FEED, PUSH, 3.0);
    for input in &inputs::worst_cases() {
        goal(input, FEED, PUSH, 0.9);
    }
}

/// Measures and prints the speed of `first` divided by the speed of `other`.
fn goal(input: &inputs::Input, first: Contender, other: Contender, at_least: f64) {
    let seconds = |(_, run): Contender, piece: &[u8]| {
        // The first run brings the bytes into the cache.
        run(piece);
        let start = Instant::now();
        black_box(run(black_box(piece)));
        start.elapsed().as_secs_f64()
    };
    let mut ratios: Vec<f64> = (0..ROUNDS)
        .flat_map(|_| input.bytes.chunks_exact(PIECE))
        .map(|piece| seconds(other, piece) / seconds(first, piece))
        .collect();
    ratios.sort_by(f64::total_cmp);
    let at = |percent: usize| ratios.get(ratios.len() * percent / 100).copied();
    let [tenth, median, ninetieth] = [10, 50, 90].map(|percent| at(percent).unwrap_or_default());
    println!(
        "{:<40} {:<27} {at_least:>5.1} {median:>8.2}   ({tenth:.2} to {ninetieth:.2})",
        input.name,
        format!("{} / {}", first.0, other.0),
    );
}
