//! What a stage of `verify` is, and the list of them.
//!
//! To add one: write its function, and give it a line in [`STAGES`].

use anyhow::Result;

use crate::test_count::TestCount;
use crate::workspace::Workspace;
use crate::{
    benches, feature_subsets, firmware, firmware_tests, fuzz, lints, no_std, prove, test_runs,
};

/// One check.
pub(crate) struct Stage {
    /// What `--only` calls it.
    pub(crate) name: &'static str,
    /// What it checks, in one line.
    pub(crate) checks: &'static str,
    /// Runs it. An error means that the stage failed; what was written into the report until
    /// then still reaches the table.
    pub(crate) run: fn(&Workspace, &mut Report) -> Result<()>,
}

/// What a stage tells about itself while it runs.
#[derive(Default)]
pub(crate) struct Report {
    /// What did the work, with its version.
    pub(crate) engine: String,
    /// How much was checked, if there is more to say than "passed".
    pub(crate) extent: String,
    /// The tests it ran, for a stage that runs tests.
    pub(crate) tests: TestCount,
}

/// All stages, in the order in which they run: what answers soonest comes first.
pub(crate) const STAGES: &[Stage] = &[
    Stage {
        name: "format",
        checks: "the sources are formatted by rustfmt",
        run: lints::format,
    },
    Stage {
        name: "clippy",
        checks: "no warning from the compiler or clippy, in all targets",
        run: lints::clippy,
    },
    Stage {
        name: "features",
        checks: "no warning in the core under any subset of its features",
        run: feature_subsets::every_subset,
    },
    Stage {
        name: "tests",
        checks: "unit and integration tests",
        run: test_runs::unit_and_integration,
    },
    Stage {
        name: "doctests",
        checks: "the examples in the documentation",
        run: test_runs::documentation_examples,
    },
    Stage {
        name: "docs",
        checks: "the documentation builds without warnings",
        run: lints::documentation,
    },
    Stage {
        name: "no-std",
        checks: "the core builds for microcontrollers, where there is no std",
        run: no_std::build_core,
    },
    Stage {
        name: "firmware",
        checks: "the firmware builds for the nRF52840 and fits, with each set of features",
        run: firmware::every_build,
    },
    Stage {
        name: "emulated",
        checks: "the firmware's release images, run in the emulator",
        run: firmware_tests::in_the_emulator,
    },
    Stage {
        name: "benches",
        checks: "the benchmarks compile and confirm their answers, untimed",
        run: benches::confirm,
    },
    Stage {
        name: "fuzz",
        checks: "the fuzz targets' corpora, replayed; every target for a few seconds",
        run: fuzz::stage,
    },
    Stage {
        name: "prove",
        checks: "the theorems, by Kani or by CBMC; every public function of the core is in one",
        run: prove::stage,
    },
    Stage {
        name: "prover",
        checks: "what checks the proofs finds what must fail",
        run: prove::checker_stage,
    },
];
