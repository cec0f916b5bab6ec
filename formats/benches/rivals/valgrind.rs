//! Counts instructions on this machine with valgrind's callgrind.

use std::error::Error;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use crate::costs::Case;

/// The argument with which the benchmark starts itself under valgrind. With this argument, the benchmark runs only the
/// receivers whose instructions are counted.
pub(crate) const ARGUMENT: &str = "--under-valgrind";

/// Runs a receiver. Callgrind counts only the instructions from the call of this function to its return.
#[inline(never)]
#[unsafe(no_mangle)]
extern "Rust" fn framelock_counted(run: &dyn Fn(&[u8]), stream: &[u8]) {
    run(stream);
}

/// Runs every receiver on every stream under valgrind. Each receiver runs twice: on the bytes that are not counted, and
/// on the whole stream. The difference of the two runs is the cost of the counted bytes.
pub(crate) fn take_all(cases: &[Case]) {
    for case in cases {
        for contender in &case.contenders {
            let run = |stream: &[u8]| {
                (contender.time)(stream, 1);
            };
            for (stream, skipped) in &case.streams {
                framelock_counted(&run, &stream[..*skipped]);
                framelock_counted(&run, stream);
            }
        }
    }
}

/// Returns the instructions per byte, for each protocol, contender and stream, in this order.
pub(crate) fn count(cases: &[Case]) -> Result<Vec<f64>, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("on-chip/target/callgrind");
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    let file = folder.join("out");
    let status = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=framelock_counted"])
        .arg("--dump-after=framelock_counted")
        .arg(format!("--callgrind-out-file={}", file.display()))
        .arg(std::env::current_exe()?)
        .arg(ARGUMENT)
        .stderr(Stdio::null())
        .status()
        .map_err(|error| format!("cannot run valgrind, which counts instructions: {error}"))?;
    if !status.success() {
        return Err("the benchmark fails under valgrind".into());
    }
    // Callgrind writes one file for each call.
    let mut calls = 0;
    let mut next = || -> Result<u64, Box<dyn Error>> {
        calls += 1;
        let text = fs::read_to_string(folder.join(format!("out.{calls}")))?;
        let mut lines = text.lines();
        let total = lines.find_map(|line| line.strip_prefix("totals: "));
        Ok(total.ok_or("no total")?.trim().parse()?)
    };
    let mut counts = Vec::new();
    for case in cases {
        for (stream, skipped) in case.contenders.iter().flat_map(|_| &case.streams) {
            let begin = next()?;
            let counted = next()? - begin;
            counts.push(counted as f64 / (stream.len() - skipped) as f64);
        }
    }
    Ok(counts)
}
