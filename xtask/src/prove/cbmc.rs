//! Checks harnesses with CBMC, the model checker under Kani.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use anyhow::{Context as _, Result};
use serde_json::Value;

use super::harness::Harness;
use super::llvm::{END_OF_HARNESS, INPUT, Module, program};
use super::outcome::{Failure, Outcome};
use crate::command::status_within;

/// Arrays of up to so many elements are followed element by element.
const ELEMENTS: &str = "1024";

/// A checker that is ready to run.
pub(crate) struct Cbmc {
    pub(crate) program: PathBuf,
    /// Where it came from, with its version.
    pub(crate) says: String,
}

/// A property of the C program, and whether it holds: in every execution, or not in one that is
/// known. What is neither is undecided.
struct Property {
    id: String,
    says: String,
    status: Status,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Status {
    Holds,
    Fails,
    Undecided,
}

impl Cbmc {
    /// Translates a harness and checks it; everything about it is left in the folder.
    pub(crate) fn check(
        &self,
        module: &Module,
        symbol: &str,
        harness: &Harness,
        folder: &Path,
        limit: Duration,
    ) -> Result<Outcome> {
        fs::create_dir_all(folder)?;
        let source = folder.join(format!("{}.c", harness.name.replace("::", ".")));
        fs::write(&source, program(module, symbol)?)?;
        let Some(answer) = self.run(&source, harness, &[], limit)? else {
            return Ok(Outcome::no_answer(limit));
        };
        let properties = properties(&answer).with_context(|| {
            let messages = messages(&answer);
            format!("CBMC did not check {}: {messages}", source.display())
        })?;
        let mut outcome = judge(&properties, harness);
        let broken = properties.iter().find(|property| property.is_broken());
        if let (Some(broken), Some(failure)) = (broken, outcome.failures.first_mut()) {
            let trace = ["--trace", "--property", &broken.id];
            if let Some(answer) = self.run(&source, harness, &trace, limit)? {
                failure.inputs = inputs(&answer);
            }
        }
        Ok(outcome)
    }

    /// What it answers; `None` if it does not within the limit.
    fn run(
        &self,
        source: &Path,
        harness: &Harness,
        more: &[&str],
        limit: Duration,
    ) -> Result<Option<Value>> {
        let answer = source.with_extension("json");
        let mut command = Command::new(&self.program);
        command
            .arg(source)
            .args(["--json-ui", "--object-bits", "16"])
            .args([
                "--unwind",
                &harness.unwind.to_string(),
                "--unwinding-assertions",
            ])
            // What Rust itself checks is in the program; memory is checked here once more.
            .args(["--no-standard-checks", "--pointer-check", "--bounds-check"])
            .args([
                "--slice-formula",
                "--max-field-sensitivity-array-size",
                ELEMENTS,
            ])
            .args(more)
            .stdout(File::create(&answer)?)
            .stderr(Stdio::null());
        if status_within(limit, &mut command)?.is_none() {
            return Ok(None);
        }
        let text = fs::read_to_string(&answer)?;
        serde_json::from_str(&text)
            .map(Some)
            .with_context(|| format!("CBMC broke off; see {}", answer.display()))
    }
}

impl Property {
    /// Whether it is one whose failing is the point.
    fn is_goal(&self) -> bool {
        self.says == END_OF_HARNESS || self.says.starts_with("cover: ")
    }

    fn is_broken(&self) -> bool {
        !self.is_goal() && self.status != Status::Holds
    }
}

fn judge(properties: &[Property], harness: &Harness) -> Outcome {
    let mut failures: Vec<Failure> = Vec::new();
    for broken in properties.iter().filter(|property| property.is_broken()) {
        let what = broken.says.strip_prefix("panic: ").unwrap_or(&broken.says);
        if failures.iter().all(|failure| failure.what != what) {
            failures.push(Failure::new(what));
        }
    }
    let satisfied: BTreeSet<&str> = properties
        .iter()
        .filter(|property| property.status == Status::Fails)
        .filter_map(|property| property.says.strip_prefix("cover: "))
        .filter_map(|place| place.rsplit_once(':').map(|(line, _column)| line))
        .collect();
    let missing = harness
        .covers
        .iter()
        .filter(|cover| !satisfied.contains(cover.as_str()));
    failures
        .extend(missing.map(|cover| Failure::new(format!("the cover at {cover} is never hit"))));
    let reaches_end = properties
        .iter()
        .any(|property| property.says == END_OF_HARNESS && property.status == Status::Fails);
    if !reaches_end && failures.is_empty() {
        failures.push(Failure::new(
            "vacuous: no input reaches the end of the harness, so nothing is proved",
        ));
    }
    Outcome {
        properties: properties
            .iter()
            .filter(|property| !property.is_goal())
            .count(),
        covers_satisfied: harness
            .covers
            .iter()
            .filter(|cover| satisfied.contains(cover.as_str()))
            .count(),
        covers: harness.covers.len(),
        seconds: 0.0,
        failures,
    }
}

fn properties(answer: &Value) -> Option<Vec<Property>> {
    let results = answer
        .as_array()?
        .iter()
        .find_map(|part| part.get("result"))?;
    let all = results.as_array()?.iter().map(|result| {
        Some(Property {
            id: result.get("property")?.as_str()?.to_owned(),
            says: result.get("description")?.as_str()?.to_owned(),
            status: match result.get("status")?.as_str()? {
                "SUCCESS" => Status::Holds,
                "FAILURE" => Status::Fails,
                _ => Status::Undecided,
            },
        })
    });
    all.collect()
}

/// Errors that CBMC gives instead of a result.
fn messages(answer: &Value) -> String {
    let parts = answer.as_array().into_iter().flatten();
    let errors = parts.filter(|part| part.get("messageType").is_some_and(|kind| kind == "ERROR"));
    let texts: Vec<&str> = errors
        .filter_map(|part| part.get("messageText")?.as_str())
        .collect();
    texts.join("; ")
}

/// The values of a counterexample: for each thing that was asked for, its type, its place and the
/// values that it is made of.
fn inputs(answer: &Value) -> Vec<String> {
    let parts = answer.as_array().into_iter().flatten();
    let results = parts.filter_map(|part| part.get("result")?.as_array());
    let traces = results
        .flatten()
        .filter_map(|result| result.get("trace")?.as_array());
    let mut lines: Vec<String> = Vec::new();
    for step in traces.flatten() {
        let text = |key: &str| step.get(key).and_then(Value::as_str);
        if let Some(place) = text("outputID").and_then(|id| id.strip_prefix(INPUT)) {
            lines.push(place.trim_start_matches(": ").to_owned());
        } else if text("inputID").is_some_and(|id| id.starts_with("any_")) {
            let value = step.pointer("/values/0/binary").and_then(Value::as_str);
            let number = value.and_then(|bits| u128::from_str_radix(bits, 2).ok());
            let written = number.map_or_else(|| "?".to_owned(), |number| format!("{number:#04x}"));
            if lines.is_empty() {
                lines.push("values".to_owned());
            }
            if let Some(line) = lines.last_mut() {
                line.push_str(if line.contains(" = ") { " " } else { " = " });
                line.push_str(&written);
            }
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    fn harness(covers: &[&str]) -> Harness {
        Harness {
            covers: covers.iter().map(|&cover| cover.to_owned()).collect(),
            ..Harness::example("x::y", "1")
        }
    }

    fn property(says: &str, status: Status) -> Property {
        Property {
            id: "f0.assertion.1".to_owned(),
            says: says.to_owned(),
            status,
        }
    }

    #[test]
    fn proved_means_every_property_every_cover_and_the_end() {
        let all = [
            property(
                "panic: attempt to add with overflow at a.rs:1:2",
                Status::Holds,
            ),
            property("cover: x.rs:3:5", Status::Fails),
            property("cover: x.rs:3:5", Status::Holds),
            property(END_OF_HARNESS, Status::Fails),
        ];
        let outcome = judge(&all, &harness(&["x.rs:3"]));
        assert!(outcome.is_proved(), "{outcome:?}");
        assert_eq!((outcome.properties, outcome.covers_satisfied), (1, 1));
    }

    #[test]
    fn a_cover_that_is_never_hit_or_is_gone_fails() {
        let end = || property(END_OF_HARNESS, Status::Fails);
        let never = [property("cover: x.rs:3:5", Status::Holds), end()];
        for properties in [never.as_slice(), &[end()]] {
            let outcome = judge(properties, &harness(&["x.rs:3"]));
            let what = outcome
                .failures
                .first()
                .map(|failure| failure.what.as_str());
            assert_eq!(what, Some("the cover at x.rs:3 is never hit"));
        }
    }

    #[test]
    fn a_harness_whose_end_no_input_reaches_is_vacuous() {
        let outcome = judge(&[property(END_OF_HARNESS, Status::Holds)], &harness(&[]));
        let first = outcome.failures.first();
        assert!(first.is_some_and(|failure| failure.what.starts_with("vacuous")));
    }

    #[test]
    fn what_is_undecided_is_neither_proved_nor_hit() {
        let end = || property(END_OF_HARNESS, Status::Fails);
        let undecided = |says| [property(says, Status::Undecided), end()];
        assert!(!judge(&undecided("panic: index out of bounds"), &harness(&[])).is_proved());
        assert!(!judge(&undecided("cover: x.rs:3:5"), &harness(&["x.rs:3"])).is_proved());
    }

    #[test]
    fn a_counterexample_is_shown_with_what_was_asked_for() {
        let answer = serde_json::json!([{"result": [{"trace": [
            {"outputID": "input: [u8; 2] at x.rs:7"},
            {"inputID": "any_u8", "values": [{"binary": "01000001"}]},
            {"inputID": "any_u8", "values": [{"binary": "00001101"}]},
        ]}]}]);
        assert_eq!(inputs(&answer), ["[u8; 2] at x.rs:7 = 0x41 0x0d"]);
    }
}
