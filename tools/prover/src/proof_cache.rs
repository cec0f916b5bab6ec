//! The files of each harness: its program, CBMC's answer, and a mark that the program was proved. An unchanged
//! program is not proved again.

use std::fs;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};

use anyhow::Result;

use crate::cbmc_setup::Cbmc;
use crate::harness::Harness;

/// The folders with programs and answers, and with proofs.
pub(crate) struct ProofCache {
    harnesses: PathBuf,
    proofs: PathBuf,
    /// This program and CBMC: what another prover has found counts for nothing.
    prover: DefaultHasher,
}

impl ProofCache {
    /// In a folder of the prover's own. `anew` forgets all proofs.
    pub(crate) fn new(folder: &Path, cbmc: &Cbmc, anew: bool) -> Result<Self> {
        let [harnesses, proofs] = ["harnesses", "proofs"].map(|name| folder.join(name));
        if anew && proofs.exists() {
            fs::remove_dir_all(&proofs)?;
        }
        fs::create_dir_all(&harnesses)?;
        fs::create_dir_all(&proofs)?;
        let mut prover = DefaultHasher::new();
        (fs::read(std::env::current_exe()?)?, &cbmc.says).hash(&mut prover);
        Ok(Self {
            harnesses,
            proofs,
            prover,
        })
    }

    /// Where a harness's program is written.
    pub(crate) fn source(&self, harness: &Harness) -> PathBuf {
        let name = harness.name.replace("::", ".");
        self.harnesses.join(format!("{name}.c"))
    }

    /// The file that says, if it is there, that this program of the harness was proved: it holds the number of
    /// properties.
    pub(crate) fn proof(&self, program: &str, harness: &Harness) -> PathBuf {
        let mut hasher = self.prover.clone();
        (program, harness.unwind, &harness.covers).hash(&mut hasher);
        self.proofs.join(format!("{:016x}", hasher.finish()))
    }
}
