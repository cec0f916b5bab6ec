//! Runs CBMC on a harness, and reads CBMC's answer.

#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs::{self, File};
use std::path::PathBuf;
use std::process::Command;
use std::time::Instant;

use anyhow::{Context as _, Result, bail, ensure};
use serde::{Deserialize, Serialize};

use crate::child_processes::status_within;
use crate::harness::{Harness, Language};
use crate::proof_cache::ProofCache;
use crate::translate::{COVER, END, INPUT};

/// CBMC's further options for harnesses in C: its checks, and the removal of unused functions. Unsigned arithmetic that
/// wraps is an error too, so that the results do not depend on the width of `int`.
const CHECKS_OF_C: [&str; 6] = [
    "--signed-overflow-check",
    "--unsigned-overflow-check",
    "--undefined-shift-check",
    "--div-by-zero-check",
    "--pointer-overflow-check",
    "--drop-unused-functions",
];

/// The result for a harness.
#[derive(Debug, Default, Serialize)]
pub(crate) struct Answer {
    pub(crate) harness: String,
    pub(crate) verdict: Verdict,
    /// The failed properties with their positions, or the reason why there is no answer.
    pub(crate) failures: Vec<String>,
    /// A counterexample, with one line for each value that the harness asked for.
    pub(crate) inputs: Vec<String>,
    /// The number of properties checked, without the covers and the end of the harness.
    pub(crate) properties: usize,
    pub(crate) covers: usize,
    /// True if the harness was proved before and has not changed.
    pub(crate) is_old: bool,
    pub(crate) seconds: f64,
}

/// The outcomes of a harness, from the worst to the best.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Verdict {
    /// An assertion fails, or the program panics or has undefined behaviour. CBMC may leave other properties undecided.
    Failed,
    /// The harness could not be checked.
    #[default]
    Error,
    /// A loop performs more iterations than `kani::unwind` allows.
    UnwindingTooSmall,
    CoverUnsatisfied,
    /// No input reaches the end of the harness.
    Vacuous,
    NoAnswerInTime,
    /// Every property holds, every loop ends, every cover is satisfied, and some input reaches the
    /// end of the harness.
    Proved,
}

impl Verdict {
    /// Returns true if the harness has an answer, and the answer is not a proof.
    pub(crate) const fn is_failure(self) -> bool {
        !matches!(self, Self::Error | Self::NoAnswerInTime | Self::Proved)
    }
}

/// A property of the C program.
struct Property {
    id: String,
    description: String,
    status: Status,
    /// The file and the line of the property.
    file: String,
    line: String,
}

/// CBMC's answer about a property.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Status {
    /// The property holds in every execution.
    Success,
    /// An execution exists in which the property does not hold.
    Failure,
    /// CBMC has not decided the property.
    Unknown,
    /// CBMC could not check the property.
    Error,
}

/// A part of CBMC's answer in JSON. `result` contains the executions that lead to failed properties.
#[derive(Deserialize)]
struct Part {
    result: Option<Vec<Traced>>,
}

#[derive(Deserialize)]
struct Traced {
    #[serde(default)]
    trace: Vec<Step>,
}

/// A step of the execution that leads to a failed property.
#[derive(Deserialize)]
struct Step {
    #[serde(rename = "inputID")]
    input: Option<String>,
    #[serde(rename = "outputID")]
    output: Option<String>,
    #[serde(default)]
    values: Vec<TraceValue>,
}

#[derive(Deserialize)]
struct TraceValue {
    #[serde(default)]
    binary: String,
}

impl Property {
    /// Returns whether there is an execution in which the property does not hold.
    fn fails(&self) -> bool {
        self.status == Status::Failure
    }

    /// Returns the description. If the description only names a function that panics, the source line follows. If the
    /// description contains no position in the sources, the position in the checked program follows.
    fn says(&self) -> String {
        let Self {
            description,
            file,
            line,
            ..
        } = self;
        match source_line(description) {
            Some(source) if description.starts_with("core::") => format!("{description}: {source}"),
            Some(_) => description.clone(),
            None => format!("{description} at {file}:{line}"),
        }
    }

    fn holds(&self) -> bool {
        self.status == Status::Success
    }

    /// Returns whether this property is expected to fail: a cover, or the end of the harness.
    fn is_goal(&self) -> bool {
        self.description == END || self.description.starts_with(COVER)
    }
}

/// Checks a harness, unless its program was proved before. Keeps the program, the answer and the
/// proof in files.
pub(crate) fn check(
    program: impl FnOnce() -> Result<String>,
    harness: &Harness,
    cache: &ProofCache,
    limit: u64,
) -> Answer {
    let start = Instant::now();
    let mut answer = Answer {
        harness: harness.name.clone(),
        covers: harness.covers.len(),
        ..Answer::default()
    };
    let run = Run {
        cache,
        harness,
        source: cache.source(harness),
        limit,
    };
    let done = program().and_then(|program| run.all(program, &mut answer));
    if let Err(error) = done {
        answer.verdict = Verdict::Error;
        answer.failures.push(format!("{error:#}"));
    }
    answer.seconds = start.elapsed().as_secs_f64();
    answer
}

/// Returns the worst outcome, and a list of all problems, the worst first.
fn classify(properties: &[Property], harness: &Harness) -> (Verdict, Vec<String>) {
    // This is a set, because CBMC reports the same failure for each copy of an inlined function.
    let mut wrong = BTreeSet::new();
    for broken in properties
        .iter()
        .filter(|one| !one.is_goal() && !one.holds())
    {
        let verdict = if !broken.fails() {
            Verdict::Error
        } else if broken.id.contains(".unwind.") {
            Verdict::UnwindingTooSmall
        } else {
            Verdict::Failed
        };
        wrong.insert((verdict, broken.says()));
    }
    let hit = |goal: &str| {
        properties
            .iter()
            .any(|one| one.fails() && one.description == goal)
    };
    // For a harness in C, only CBMC's answer names the covers.
    let covers = properties
        .iter()
        .filter(|one| one.is_goal() && !one.fails());
    for cover in covers.filter(|_| harness.language != Language::Rust) {
        if cover.description != END {
            wrong.insert((Verdict::CoverUnsatisfied, cover.says()));
        }
    }
    for cover in &harness.covers {
        if !hit(&format!("{COVER}{cover}")) {
            let what = format!("no input satisfies the cover {}", place(cover));
            wrong.insert((Verdict::CoverUnsatisfied, what));
        }
    }
    if !hit(END) {
        let what = "no input reaches the end of the harness".to_owned();
        wrong.insert((Verdict::Vacuous, what));
    }
    let verdict = wrong
        .first()
        .map_or(Verdict::Proved, |(verdict, _)| *verdict);
    (verdict, wrong.into_iter().map(|(_, what)| what).collect())
}

/// Returns the position of a cover in words. `cover` is a name such as `kani::cover_in_line::<12,
/// FUNCTION::{closure#0}>`.
fn place(cover: &str) -> String {
    let words: Vec<&str> = cover.splitn(3, ['<', ',']).collect();
    let [_, line, function] = words.as_slice() else {
        return cover.to_owned();
    };
    let function = function.split("::{closure").next().unwrap_or(function);
    format!("in line {line}, in{function}")
}

/// Returns the source line of an input such as `u8 at core/src/line.rs:12:5`, if the prover runs in the workspace's
/// root.
fn source_line(place: &str) -> Option<String> {
    let (_, at) = place.rsplit_once(" at ")?;
    let mut parts = at.rsplitn(3, ':').skip(1);
    let line: usize = parts.next()?.parse().ok()?;
    let source = fs::read_to_string(parts.next()?).ok()?;
    Some(source.lines().nth(line.checked_sub(1)?)?.trim().to_owned())
}

/// The runs of CBMC for one harness.
struct Run<'a> {
    cache: &'a ProofCache,
    harness: &'a Harness,
    source: PathBuf,
    /// The limit of processor time, in seconds.
    limit: u64,
}

impl Run<'_> {
    fn all(&self, program: String, answer: &mut Answer) -> Result<()> {
        let proof = self.cache.proof(&program, &self.command(&[]), self.harness);
        if let Ok(properties) = fs::read_to_string(&proof) {
            (answer.verdict, answer.properties) = (Verdict::Proved, properties.parse()?);
            answer.is_old = true;
            return Ok(());
        }
        fs::write(&self.source, program)?;
        let Some(said) = self.output(&[])? else {
            answer.verdict = Verdict::NoAnswerInTime;
            let what = "no answer in time; use --timeout to allow more";
            answer.failures.push(what.to_owned());
            return Ok(());
        };
        let properties = read(&said)?;
        answer.properties = properties.iter().filter(|one| !one.is_goal()).count();
        (answer.verdict, answer.failures) = classify(&properties, self.harness);
        let broken = properties.iter().find(|one| !one.is_goal() && one.fails());
        if let Some(broken) = broken {
            answer.inputs = self.inputs(&broken.id).unwrap_or_default();
        }
        if answer.verdict == Verdict::Proved {
            fs::write(proof, answer.properties.to_string())?;
        }
        Ok(())
    }

    /// Returns the values of a counterexample. Each line has the type of a value, the source position at which the
    /// harness asked for this value, the source line, which usually names the variable, and the numbers in the value.
    fn inputs(&self, property: &str) -> Result<Vec<String>> {
        let said = self.output(&["--json-ui", "--trace", "--property", property])?;
        let parts: Vec<Part> = serde_json::from_str(&said.unwrap_or_default())?;
        let traced = parts.into_iter().filter_map(|part| part.result).flatten();
        let mut lines: Vec<String> = Vec::new();
        for step in traced.flat_map(|traced| traced.trace) {
            if let Some(place) = step.output.as_deref().and_then(|id| id.strip_prefix(INPUT)) {
                let line = source_line(place).map_or_else(String::new, |line| format!(": {line}"));
                lines.push(format!("{place}{line} ="));
            } else if let (Some(_), [value]) = (&step.input, step.values.as_slice())
                && let (Ok(number), Some(line)) =
                    (u128::from_str_radix(&value.binary, 2), lines.last_mut())
            {
                let _ = write!(line, " {number:#04x}");
            }
        }
        Ok(lines)
    }

    /// Returns CBMC's output, or `None` if the time limit is reached.
    fn output(&self, more: &[&str]) -> Result<Option<String>> {
        let answer = self.source.with_extension("txt");
        let status = status_within(self.limit, &self.command(more), File::create(&answer)?)?;
        status.map(|_| Ok(fs::read_to_string(&answer)?)).transpose()
    }

    /// Returns the command that checks the program.
    fn command(&self, more: &[&str]) -> Command {
        let mut command = Command::new(&self.cache.cbmc.program);
        // The solver accesses its memory in an irregular order. With large pages, CBMC takes a tenth less time.
        command.env("GLIBC_TUNABLES", "glibc.malloc.hugetlb=1");
        command
            .arg(&self.source)
            .args(["--object-bits", "16", "--unwinding-assertions"])
            // The translated program already contains Rust's own checks. CBMC adds checks of memory accesses.
            .args(["--no-standard-checks", "--pointer-check", "--bounds-check"])
            // CBMC tracks each element separately in arrays of up to 1024 elements.
            .args([
                "--slice-formula",
                "--max-field-sensitivity-array-size",
                "1024",
            ])
            .args(more);
        if let Language::C { has_int16 } = self.harness.language {
            command.args(CHECKS_OF_C);
            command.args(has_int16.then_some("--16"));
        }
        if let Some(unwind) = self.harness.unwind {
            command.args(["--unwind", &unwind.to_string()]);
        }
        command
    }
}

/// Returns the properties in CBMC's plain-text output. In JSON, CBMC would also write an execution for each cover. A
/// line such as `[f.assertion.1] line 5 a sum: SUCCESS` describes a property. A line such as `FILE function f` names
/// the file of the properties that follow.
fn read(said: &str) -> Result<Vec<Property>> {
    let unchecked = || format!("CBMC did not check the program: {said}");
    let (_, results) = said.split_once("** Results:\n").with_context(unchecked)?;
    let (mut file, mut count) = ("", None);
    let mut properties = Vec::new();
    for line in results.lines() {
        let property = line
            .strip_prefix('[')
            .and_then(|rest| rest.split_once("] "));
        if let Some((id, rest)) = property {
            let (rest, status) = rest.rsplit_once(": ").context("a status")?;
            let place = rest
                .strip_prefix("line ")
                .and_then(|rest| rest.split_once(' '));
            let (line, description) = place.unwrap_or(("", rest));
            properties.push(Property {
                id: id.to_owned(),
                description: description.to_owned(),
                status: match status {
                    "SUCCESS" => Status::Success,
                    "FAILURE" => Status::Failure,
                    "UNKNOWN" => Status::Unknown,
                    "ERROR" => Status::Error,
                    other => bail!("unknown status {other}"),
                },
                file: file.to_owned(),
                line: line.to_owned(),
            });
        } else if let Some((path, _)) = line.split_once(" function ") {
            file = path;
        } else if let Some(sum) = line.strip_prefix("** ") {
            // A line such as `** 2 of 803 failed (3 iterations)`
            count = sum.split(' ').nth(2).and_then(|all| all.parse().ok());
        }
    }
    ensure!(count == Some(properties.len()), "the output is incomplete");
    Ok(properties)
}
