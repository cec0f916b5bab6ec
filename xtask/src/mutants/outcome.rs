//! What became of the mutants, as cargo-mutants writes it down.

use std::fmt;
use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};
use serde::Deserialize;

/// What became of a source's mutants.
pub(crate) struct Outcomes {
    /// A test failed, or did not end.
    pub(crate) caught: usize,
    /// They do not compile.
    pub(crate) unviable: usize,
    pub(crate) survivors: Vec<Survivor>,
}

/// A mutant that no test noticed.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Survivor {
    pub(crate) file: String,
    /// Such as `Failsafe::poll`.
    pub(crate) function: String,
    /// What stands there instead.
    pub(crate) replacement: String,
    /// The line where it stands, without the space around it; its number changes too often to be
    /// relied on.
    pub(crate) line: String,
    /// As cargo-mutants says it.
    description: String,
}

impl fmt::Display for Survivor {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}, in `{}`", self.description, self.line)
    }
}

#[derive(Deserialize)]
struct Answer {
    outcomes: Vec<Outcome>,
}

#[derive(Deserialize)]
struct Outcome {
    scenario: Scenario,
    summary: String,
}

#[derive(Deserialize)]
enum Scenario {
    Baseline,
    Mutant(Mutant),
}

#[derive(Deserialize)]
struct Mutant {
    name: String,
    file: String,
    function: Option<Function>,
    replacement: String,
    span: Span,
}

#[derive(Deserialize)]
struct Function {
    function_name: String,
}

#[derive(Deserialize)]
struct Span {
    start: Place,
}

#[derive(Deserialize)]
struct Place {
    line: usize,
}

impl Outcomes {
    /// Out of the folder that cargo-mutants was given for its output.
    pub(crate) fn read(root: &Path, folder: &Path) -> Result<Self> {
        let path = folder.join("mutants.out/outcomes.json");
        let text = fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        Self::of(&text, |file| {
            fs::read_to_string(root.join(file)).with_context(|| file.to_owned())
        })
    }

    /// Lets a second run take the mutants whose tests did not end for caught, as they are. It would
    /// try them again otherwise, and wait for each.
    pub(crate) fn leave_out_what_did_not_end(folder: &Path) -> Result<()> {
        let list = |name: &str| folder.join("mutants.out").join(name);
        let read = |name: &str| {
            let path = list(name);
            fs::read_to_string(&path).with_context(|| path.display().to_string())
        };
        let caught = read("caught.txt")? + &read("timeout.txt")?;
        fs::write(list("caught.txt"), caught).context("caught.txt")
    }

    fn of(answer: &str, source: impl Fn(&str) -> Result<String>) -> Result<Self> {
        let answer: Answer =
            serde_json::from_str(answer).context("cargo mutants wrote in an unexpected form")?;
        let mut outcomes = Self {
            caught: 0,
            unviable: 0,
            survivors: Vec::new(),
        };
        for outcome in answer.outcomes {
            let Scenario::Mutant(mutant) = outcome.scenario else {
                continue;
            };
            match outcome.summary.as_str() {
                "CaughtMutant" | "Timeout" => outcomes.caught += 1,
                "Unviable" => outcomes.unviable += 1,
                _ => {
                    let text = source(&mutant.file)?;
                    let line = text.lines().nth(mutant.span.start.line - 1);
                    let function = mutant.function.map(|function| function.function_name);
                    outcomes.survivors.push(Survivor {
                        function: function.unwrap_or_default(),
                        line: line.unwrap_or_default().trim().to_owned(),
                        file: mutant.file,
                        replacement: mutant.replacement,
                        description: mutant.name,
                    });
                }
            }
        }
        Ok(outcomes)
    }

    /// Those of a second run, which tried the survivors of this one.
    pub(crate) fn then(self, second: Self) -> Self {
        Self {
            caught: self.caught + second.caught,
            unviable: self.unviable,
            survivors: second.survivors,
        }
    }

    pub(crate) fn total(&self) -> usize {
        self.caught + self.unviable + self.survivors.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caught_and_surviving_mutants_are_told_apart() {
        let mutant = |summary: &str| {
            format!(
                r#"{{"scenario": {{"Mutant": {{"name": "core/src/a.rs:2:5: replace < with <= in f",
                "file": "core/src/a.rs", "function": {{"function_name": "f", "return_type": ""}},
                "span": {{"start": {{"line": 2, "column": 5}}, "end": {{"line": 2, "column": 6}}}},
                "replacement": "<=", "genre": "BinaryOperator"}}}}, "summary": "{summary}"}}"#
            )
        };
        let answer = format!(
            r#"{{"outcomes": [{{"scenario": "Baseline", "summary": "Success"}}, {}, {}, {}, {}]}}"#,
            mutant("CaughtMutant"),
            mutant("Timeout"),
            mutant("Unviable"),
            mutant("MissedMutant"),
        );
        let outcomes = Outcomes::of(&answer, |_| Ok("fn f() {\n    a < b\n}".to_owned()))
            .expect("the form it writes");
        assert_eq!((outcomes.caught, outcomes.unviable), (2, 1));
        assert_eq!(outcomes.total(), 4);
        let [survivor] = outcomes.survivors.as_slice() else {
            panic!("one survives");
        };
        assert_eq!(survivor.line, "a < b");
        assert_eq!(survivor.replacement, "<=");
    }

    #[test]
    fn a_second_run_decides_what_survives_and_counts_nothing_twice() {
        let survivor = Survivor {
            file: "core/src/a.rs".to_owned(),
            function: "f".to_owned(),
            replacement: "<=".to_owned(),
            line: "a < b".to_owned(),
            description: String::new(),
        };
        let first = Outcomes {
            caught: 4,
            unviable: 1,
            survivors: vec![survivor.clone(), survivor.clone()],
        };
        let second = Outcomes {
            caught: 1,
            unviable: 0,
            survivors: vec![survivor],
        };
        let both = first.then(second);
        assert_eq!((both.caught, both.unviable), (5, 1));
        assert_eq!(both.total(), 7);
    }

    #[test]
    fn mutants_whose_tests_did_not_end_are_not_tried_again() {
        let folder = std::env::temp_dir().join(format!("framelock-mutants-{}", std::process::id()));
        let lists = folder.join("mutants.out");
        fs::create_dir_all(&lists).expect("a folder");
        fs::write(lists.join("caught.txt"), "one\n").expect("a list");
        fs::write(lists.join("timeout.txt"), "two\n").expect("a list");
        Outcomes::leave_out_what_did_not_end(&folder).expect("both lists are there");
        let caught = fs::read_to_string(lists.join("caught.txt")).expect("the list");
        fs::remove_dir_all(&folder).expect("it was made here");
        assert_eq!(caught, "one\ntwo\n");
    }
}
