//! One target, fuzzed for some time, and what came of it.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};
use comfy_table::Table;

use super::setup::Fuzzer;
use super::{Target, corpus};
use crate::command::{run, run_and_read};
use crate::firmware::images;
use crate::firmware_tests::IMAGES;
use crate::table::with_header;
use crate::workspace::Workspace;

pub(crate) struct Session<'a> {
    pub(crate) workspace: &'a Workspace,
    pub(crate) fuzzer: &'a Fuzzer,
    pub(crate) target: Target,
    pub(crate) time: Duration,
    pub(crate) jobs: u32,
}

/// What came of it.
#[derive(Default, Debug, PartialEq, Eq)]
pub(crate) struct Outcome {
    pub(crate) executions: u64,
    /// A second, over all processes.
    pub(crate) rate: u64,
    /// Edges of the program that were reached, of all processes' the most.
    pub(crate) coverage: u64,
    /// Files with inputs that show a bug.
    pub(crate) findings: Vec<PathBuf>,
}

impl Session<'_> {
    pub(crate) fn run(&self) -> Result<Outcome> {
        let name = self.target.name();
        println!("\n=== Fuzzing {name} for {} s ===", self.time.as_secs());
        let findings = self
            .workspace
            .target_directory
            .join("fuzz-findings")
            .join(name);
        let logs = self.workspace.target_directory.join("fuzz-logs").join(name);
        let new = corpus::found_here(self.workspace, self.target);
        if logs.exists() {
            fs::remove_dir_all(&logs)?;
        }
        for folder in [&findings, &logs, &new] {
            fs::create_dir_all(folder)?;
        }
        let known = files(&findings)?;
        // Built first, so that building does not count as fuzzing.
        run(self.fuzzer.command("build")?.arg(name))?;

        let start = Instant::now();
        // libFuzzer says by its exit code that it has found something; the files say what.
        let mut processes = Vec::new();
        for job in 0..self.jobs {
            let log = fs::File::create(logs.join(job.to_string()))?;
            let mut command = self.fuzzer.command("run")?;
            command
                .arg(name)
                .args([&new, &corpus::committed(self.workspace, self.target)])
                .arg("--")
                .arg(format!("-max_total_time={}", self.time.as_secs()))
                .arg(format!("-max_len={}", self.target.longest_input()))
                .arg(format!("-artifact_prefix={}/", findings.display()))
                .args(["-print_final_stats=1", "-reload=1"])
                .env(IMAGES, images(self.workspace, &self.workspace.root))
                .stdout(log.try_clone()?)
                .stderr(log);
            let dictionary = self.workspace.root.join(format!("fuzz/{name}.dict"));
            if dictionary.exists() {
                command.arg(format!("-dict={}", dictionary.display()));
            }
            processes.push(command.spawn().context("cargo fuzz could not be started")?);
        }
        let mut outcome = Outcome::default();
        for (job, mut process) in processes.into_iter().enumerate() {
            let status = process.wait()?;
            let log = logs.join(job.to_string());
            let text = String::from_utf8_lossy(&fs::read(&log)?).into_owned();
            outcome.add(&text);
            let has_new = files(&findings)?.iter().any(|file| !known.contains(file));
            if !status.success() && !has_new {
                anyhow::bail!("{name} ended with {status}; it wrote {}", log.display());
            }
        }
        outcome.rate = rate(outcome.executions, start.elapsed());
        outcome.findings = files(&findings)?;
        outcome.findings.retain(|file| !known.contains(file));
        for finding in &outcome.findings {
            self.tell(finding)?;
        }
        Ok(outcome)
    }

    /// Shows an input that shows a bug, and what to do with it.
    fn tell(&self, finding: &Path) -> Result<()> {
        let name = self.target.name();
        let bytes = fs::read(finding)?;
        println!("\nThe target {name} fails for {} bytes:", bytes.len());
        println!("  {}", hexadecimal(&bytes));
        println!("What it says:");
        let mut command = self.fuzzer.command("run")?;
        command
            .arg(name)
            .arg(finding)
            .env(IMAGES, images(self.workspace, &self.workspace.root));
        // It fails again, as it should.
        let _ = run_and_read(&mut command, |_| ());
        println!(
            "Once it is fixed, keep the input: cp {} fuzz/corpus/{name}/WHAT-IT-IS",
            finding.display()
        );
        Ok(())
    }
}

impl Outcome {
    /// Adds what a process of libFuzzer has written.
    fn add(&mut self, log: &str) {
        let executed = log
            .lines()
            .filter_map(|line| line.strip_prefix("stat::number_of_executed_units:"))
            .filter_map(|number| number.trim().parse().ok())
            .next_back()
            .or_else(|| log.lines().filter_map(execution_of).next_back());
        self.executions += executed.unwrap_or(0);
        let coverage = log.lines().filter_map(coverage_of).max();
        self.coverage = self.coverage.max(coverage.unwrap_or(0));
    }
}

/// The number of the execution that a line such as `#123 NEW cov: 45 ...` is about.
fn execution_of(line: &str) -> Option<u64> {
    let (number, _) = line.strip_prefix('#')?.split_once(char::is_whitespace)?;
    number.parse().ok()
}

/// The edges reached by then.
fn coverage_of(line: &str) -> Option<u64> {
    let (_, rest) = line.split_once(" cov: ")?;
    rest.split_whitespace().next()?.parse().ok()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "a rate is rounded"
)]
fn rate(executions: u64, time: Duration) -> u64 {
    (executions as f64 / time.as_secs_f64()) as u64
}

/// What is in a folder, in order.
pub(crate) fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        files.push(entry?.path());
    }
    files.sort();
    Ok(files)
}

fn hexadecimal(bytes: &[u8]) -> String {
    let digits: Vec<String> = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    digits.join(" ")
}

/// A row for each target.
pub(crate) fn table(targets: &[Target], outcomes: &[Outcome]) -> Table {
    let mut table = with_header([
        "target",
        "executions",
        "a second",
        "edges reached",
        "new findings",
    ]);
    for (target, outcome) in targets.iter().zip(outcomes) {
        table.add_row([
            target.name().to_owned(),
            outcome.executions.to_string(),
            outcome.rate.to_string(),
            outcome.coverage.to_string(),
            outcome.findings.len().to_string(),
        ]);
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "\
#2\tINITED cov: 36 ft: 113 corp: 1/1b exec/s: 0 rss: 28Mb
#4096\tpulse  cov: 300 ft: 1214 corp: 180/14267b lim: 256 exec/s: 2048 rss: 28Mb
";

    #[test]
    fn executions_and_coverage_are_read() {
        let mut outcome = Outcome::default();
        outcome.add(&format!("{LOG}stat::number_of_executed_units: 5000\n"));
        assert_eq!((outcome.executions, outcome.coverage), (5000, 300));
        // A second process counts on; a process that crashed has no sums.
        outcome.add(LOG);
        assert_eq!((outcome.executions, outcome.coverage), (9096, 300));
    }

    #[test]
    fn an_input_is_shown_in_hexadecimal() {
        assert_eq!(hexadecimal(b"AB\r"), "41 42 0D");
    }
}
