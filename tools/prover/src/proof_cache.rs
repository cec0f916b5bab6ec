//! The files of each harness: its program, CBMC's answer, and a record that the program was proved. An unchanged
//! program is not proved again.

use std::fs;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::Result;

use crate::cbmc_setup::Cbmc;
use crate::harness::Harness;

/// Two folders: one with the programs and CBMC's answers, and one with the records of proofs.
pub(crate) struct ProofCache {
    pub(crate) cbmc: Cbmc,
    harnesses: PathBuf,
    proofs: PathBuf,
    /// The hash of this prover's program and of CBMC's version. Proofs by other versions do not count.
    prover: DefaultHasher,
}

impl ProofCache {
    /// Creates a cache in `folder`, which only the prover uses.
    pub(crate) fn new(folder: &Path, cbmc: Cbmc) -> Result<Self> {
        let [harnesses, proofs] = ["harnesses", "proofs"].map(|name| folder.join(name));
        fs::create_dir_all(&harnesses)?;
        fs::create_dir_all(&proofs)?;
        let mut prover = DefaultHasher::new();
        (fs::read(std::env::current_exe()?)?, &cbmc.says).hash(&mut prover);
        Ok(Self {
            cbmc,
            harnesses,
            proofs,
            prover,
        })
    }

    /// Returns the path of a harness's program.
    pub(crate) fn source(&self, harness: &Harness) -> PathBuf {
        let name = harness.name.replace("::", ".");
        self.harnesses.join(format!("{name}.c"))
    }

    /// Returns the path of the file that records the proof of this program by this command. If the file exists, the
    /// program was proved. The file contains the number of properties. The path depends on everything that decides the
    /// verdict: the prover and CBMC, the program, CBMC's arguments (with the bound of the loops), and the covers.
    pub(crate) fn proof(&self, program: &str, command: &Command, harness: &Harness) -> PathBuf {
        let mut hasher = self.prover.clone();
        program.hash(&mut hasher);
        for argument in command.get_args() {
            argument.hash(&mut hasher);
        }
        for cover in &harness.covers {
            cover.hash(&mut hasher);
        }
        self.proofs.join(format!("{:016x}", hasher.finish()))
    }
}
