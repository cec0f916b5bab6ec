//! What became of a harness, and the table of all.

use std::time::{Duration, Instant};

use anyhow::Result;
use comfy_table::Table;
use serde::Serialize;

use super::harness::Harness;
use crate::table::with_header;

/// What an engine found out about a harness.
#[derive(Debug, Default, Clone, Serialize)]
pub(crate) struct Outcome {
    /// Properties checked, covers not counted.
    pub(crate) properties: usize,
    pub(crate) covers_satisfied: usize,
    pub(crate) covers: usize,
    pub(crate) seconds: f64,
    /// Why it does not hold, or was not shown to; none if it is proved.
    pub(crate) failures: Vec<Failure>,
}

/// One reason.
#[derive(Debug, Default, Clone, Serialize)]
pub(crate) struct Failure {
    /// What fails and where.
    pub(crate) what: String,
    /// The counterexample, a line for each value that was asked for, in the order of asking.
    pub(crate) inputs: Vec<String>,
}

impl Failure {
    pub(crate) fn new(what: impl Into<String>) -> Self {
        Self {
            what: what.into(),
            inputs: Vec::new(),
        }
    }
}

impl Outcome {
    pub(crate) fn failed(what: impl Into<String>) -> Self {
        Self {
            failures: vec![Failure::new(what)],
            ..Self::default()
        }
    }

    /// The engine did not answer within the limit.
    pub(crate) fn no_answer(limit: Duration) -> Self {
        Self::failed(format!(
            "no answer within {} s; --timeout gives it longer",
            limit.as_secs()
        ))
    }

    /// What checking comes to, and how long it takes. That it could not be done is a failure too.
    pub(crate) fn timed(check: impl FnOnce() -> Result<Self>) -> Self {
        let start = Instant::now();
        let mut outcome = check().unwrap_or_else(|error| Self::failed(format!("{error:#}")));
        outcome.seconds = start.elapsed().as_secs_f64();
        outcome
    }

    pub(crate) fn is_proved(&self) -> bool {
        self.failures.is_empty()
    }

    /// The failures, in full.
    pub(crate) fn print_failures(&self, name: &str) {
        for failure in &self.failures {
            println!("FAILED {name}: {}", failure.what);
            for input in &failure.inputs {
                println!("    {input}");
            }
        }
    }
}

/// A harness, the engine that checked it, and what it found.
#[derive(Serialize)]
pub(crate) struct Row<'a> {
    pub(crate) theorem: &'a str,
    pub(crate) harness: &'a str,
    pub(crate) length: &'a str,
    pub(crate) engine: &'a str,
    pub(crate) proved: bool,
    #[serde(flatten)]
    pub(crate) outcome: &'a Outcome,
}

pub(crate) fn rows<'a>(results: &'a [(&Harness, Outcome)], engine: &'a str) -> Vec<Row<'a>> {
    results
        .iter()
        .map(|(harness, outcome)| Row {
            theorem: &harness.theorem,
            harness: &harness.name,
            length: &harness.length,
            engine,
            proved: outcome.is_proved(),
            outcome,
        })
        .collect()
}

pub(crate) fn table(rows: &[Row]) -> Table {
    let mut table = with_header([
        "theorem",
        "harness",
        "stream length",
        "engine",
        "properties",
        "covers",
        "time",
        "result",
    ]);
    for row in rows {
        let outcome = row.outcome;
        let length = if row.length == "any" {
            "any".to_owned()
        } else {
            format!("bounded: {}", row.length)
        };
        table.add_row([
            row.theorem.to_owned(),
            row.harness.to_owned(),
            length,
            row.engine.to_owned(),
            outcome.properties.to_string(),
            format!("{}/{}", outcome.covers_satisfied, outcome.covers),
            format!("{:.1} s", outcome.seconds),
            if row.proved { "proved" } else { "FAILED" }.to_owned(),
        ]);
    }
    table
}
