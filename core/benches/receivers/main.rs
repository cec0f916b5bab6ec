//! Throughput of the receivers, and of other ways to find the same frames in the same streams.
//!
//! There is one group of benchmarks per stream, and one benchmark per contender. Before a contender is timed, its
//! answer is compared with the answer of the naive reference. `BENCHMARKS.md` explains the figures.

use std::hint::black_box;
use std::time::Duration;

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, Criterion, SamplingMode, Throughput};
use framelock::Receiver;
use framelock::lecture::Lecture;
use framelock::motion::{Bin, BinCrc8};
use framelock_proofs::reference;

use crate::answer::Answer;
use crate::inputs::Input;

mod answer;
mod contenders;
mod goals;
mod inputs;

/// A benchmark's name, the expected answer, and the function to measure.
type Contender = (&'static str, Answer, fn(&[u8]) -> Answer);

fn main() {
    let mut criterion = Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_millis(1500))
        .sample_size(30)
        .configure_from_args();
    everybody(&mut criterion, &inputs::clean_frames());
    everybody(&mut criterion, &inputs::frames_with_losses());
    everybody(&mut criterion, &inputs::noise());
    for input in &inputs::worst_cases() {
        core_only(&mut criterion, input);
    }
    checksum(&mut criterion, &inputs::clean_frames_with_checksum());
    cobs(&mut criterion, &inputs::clean_frames());
    criterion.final_summary();

    // Skip the goals if the user has picked other benchmarks. Also skip the goals if cargo does not pass `--bench`,
    // because then only the answers are checked. No benchmark has "goals" in its name, so the argument "goals" picks
    // only the goals.
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--bench")
        && arguments
            .iter()
            .all(|argument| argument == "--bench" || argument == "goals")
    {
        goals::compare();
    }
}

/// Measures the core's machines and all other contenders that find the lecture's frames.
fn everybody(criterion: &mut Criterion, input: &Input) {
    let mut group = group(criterion, input.name, &input.bytes);
    let framelock = Answer::of_reference::<reference::Bin>(&input.bytes);
    let every_a = contenders::every_a(&input.bytes);
    let others: [Contender; 5] = [
        (
            "reference",
            framelock,
            contenders::reference::<reference::Bin>,
        ),
        ("regex", framelock, contenders::regex),
        ("memmem", framelock, contenders::memmem),
        ("winnow", framelock, contenders::winnow),
        ("memchr pass", every_a, contenders::memchr_pass),
    ];
    for contender in core_machines(&input.bytes).into_iter().chain(others) {
        time(&mut group, &input.bytes, contender);
    }
}

fn core_only(criterion: &mut Criterion, input: &Input) {
    let mut group = group(criterion, input.name, &input.bytes);
    for contender in core_machines(&input.bytes) {
        time(&mut group, &input.bytes, contender);
    }
}

fn core_machines(bytes: &[u8]) -> [Contender; 6] {
    let framelock = Answer::of_reference::<reference::Bin>(bytes);
    let lecture = Answer::of_reference::<reference::Lecture>(bytes);
    [
        ("push", framelock, contenders::push::<Receiver<Bin>>),
        ("feed", framelock, contenders::feed::<Receiver<Bin>>),
        (
            "line push",
            framelock,
            contenders::line_push::<Receiver<Bin>>,
        ),
        (
            "line feed",
            framelock,
            contenders::line_feed::<Receiver<Bin>>,
        ),
        ("lecture push", lecture, contenders::push::<Lecture>),
        ("lecture feed", lecture, contenders::feed::<Lecture>),
    ]
}

fn checksum(criterion: &mut Criterion, input: &Input) {
    let mut group = group(criterion, input.name, &input.bytes);
    let expected = Answer::of_reference::<reference::BinCrc8>(&input.bytes);
    let contenders: [Contender; 3] = [
        ("push", expected, contenders::push::<Receiver<BinCrc8>>),
        ("feed", expected, contenders::feed::<Receiver<BinCrc8>>),
        (
            "reference",
            expected,
            contenders::reference::<reference::BinCrc8>,
        ),
    ];
    for contender in contenders {
        time(&mut group, &input.bytes, contender);
    }
}

fn cobs(criterion: &mut Criterion, input: &Input) {
    let encoded = contenders::cobs_encode(&input.bytes);
    let mut group = group(criterion, "clean frames, encoded in COBS", &encoded);
    let expected = Answer::of_reference::<reference::Bin>(&input.bytes);
    time(
        &mut group,
        &encoded,
        ("cobs", expected, contenders::cobs_decode),
    );
}

fn group<'a>(
    criterion: &'a mut Criterion,
    name: &str,
    bytes: &[u8],
) -> BenchmarkGroup<'a, WallTime> {
    let mut group = criterion.benchmark_group(name);
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.sampling_mode(SamplingMode::Flat);
    group
}

/// Compares the answer with the expected one, then measures the time.
fn time(group: &mut BenchmarkGroup<'_, WallTime>, bytes: &[u8], (name, expected, run): Contender) {
    group.bench_function(name, |bencher| {
        assert_eq!(run(bytes), expected, "{name}");
        bencher.iter(|| run(black_box(bytes)));
    });
}
