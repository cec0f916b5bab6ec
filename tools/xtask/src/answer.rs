//! What a prover answers about a harness.

use serde::Deserialize;

/// A harness, as the offline prover lists it.
#[derive(Deserialize)]
pub(crate) struct Harness {
    pub(crate) name: String,
    /// Whether the last thing it does is a cover, which shows that its end is reached: Kani does not ask.
    #[cfg(test)]
    pub(crate) ends_with_cover: bool,
}

/// What became of a harness.
#[derive(Default, Deserialize)]
pub(crate) struct Answer {
    pub(crate) harness: String,
    pub(crate) verdict: String,
    pub(crate) failures: Vec<String>,
    /// The counterexample.
    pub(crate) inputs: Vec<String>,
}

impl Answer {
    pub(crate) fn is_proved(&self) -> bool {
        self.verdict == "proved"
    }

    /// Whether the engine has shown that the harness does not hold. Without an answer it has not.
    pub(crate) fn is_refuted(&self) -> bool {
        !["proved", "error", "no_answer_in_time"].contains(&self.verdict.as_str())
    }

    pub(crate) fn fail(&mut self, verdict: &str, what: &str) {
        verdict.clone_into(&mut self.verdict);
        self.failures.push(what.to_owned());
    }
}
