//! Compiles the packages with the harnesses against the stand-in for Kani's library, and reads the
//! compiler's output in LLVM's assembly language.

use std::fs::{self, File};
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result, ensure};
use cargo_metadata::{Artifact, Message, MetadataCommand};
use nix::fcntl::{Flock, FlockArg};

use crate::child_processes::output;
use crate::llvm::Module;

/// The path of the stand-in's manifest in the workspace. A copy of the workspace with a seeded bug has its own
/// stand-in.
const STAND_IN: &str = "tools/prover/stand-in/Cargo.toml";

/// The optimisation passes that the compiler runs before it writes LLVM's assembly. They inline calls and turn memory
/// whose address is not needed into values. They do not change loops, so CBMC knows the value of a loop's counter in
/// each iteration.
const PASSES: &str = "-Cpasses=function(sroa,early-cse,simplifycfg,instcombine<no-verify-fixpoint>),\
    cgscc(inline,function(sroa,early-cse,simplifycfg,instcombine<no-verify-fixpoint>)),\
    function(sroa,early-cse,simplifycfg,instcombine<no-verify-fixpoint>),globaldce";

/// The workspace in the current folder, and its packages to compile.
pub(crate) struct Sources<'a> {
    packages: &'a [String],
    /// The folder in which everything is built.
    pub(crate) target: PathBuf,
    stand_in: Vec<String>,
    /// The lock on the folder, which the prover holds until its end.
    _lock: Flock<File>,
}

impl<'a> Sources<'a> {
    pub(crate) fn new(packages: &'a [String]) -> Result<Self> {
        let metadata = MetadataCommand::new().no_deps().exec()?;
        let target = metadata.target_directory.join("prove").into_std_path_buf();
        let mut stand_in = metadata.workspace_root.join(STAND_IN);
        if !stand_in.exists() {
            // The workspace belongs to another project, which has no stand-in.
            stand_in = concat!(env!("CARGO_MANIFEST_DIR"), "/stand-in/Cargo.toml").into();
        }
        let lock = lock(&target)?;
        eprintln!("Compiling the harnesses");
        let stand_in = flags_for(stand_in.as_str(), &target.join("stand-in"))?;
        Ok(Self {
            packages,
            target,
            stand_in,
            _lock: lock,
        })
    }

    /// Returns the module before LLVM's optimisations. LLVM has not yet removed code that it finds
    /// to be unreachable.
    pub(crate) fn as_written(&self) -> Result<Module> {
        self.module("as-written", None)
    }

    /// Returns the module that is checked.
    pub(crate) fn improved(&self) -> Result<Module> {
        self.module("improved", Some(PASSES))
    }

    fn module(&self, folder: &str, passes: Option<&str>) -> Result<Module> {
        let host = output(Command::new("rustc").args(["--print", "host-tuple"]))?;
        let mut flags = vec![
            "--cfg=kani",
            "-Cdebug-assertions=on",
            "-Coverflow-checks=on",
            "-Cpanic=abort",
            "-Ccodegen-units=1",
            "-Crelocation-model=static",
            // With this name mangling, names are readable and the same in both modules.
            "-Csymbol-mangling-version=v0",
            "-Cllvm-args=-inline-threshold=100000",
            "-Cno-prepopulate-passes",
            "--emit=llvm-ir,metadata,link",
        ];
        flags.extend(passes);
        flags.extend(self.stand_in.iter().map(String::as_str));
        let mut cargo = self.cargo("build", &flags);
        // With `--target`, the compiler's flags apply only to code for this target. The flags do not apply to the
        // procedural macros, which run on the host.
        cargo
            .args(["--release", "--target", &host, "--target-dir"])
            .arg(self.target.join(folder))
            .env("CARGO_PROFILE_RELEASE_LTO", "off")
            .env("CARGO_PROFILE_RELEASE_OPT_LEVEL", "2");
        let mut module = Module::default();
        for artifact in artifacts(&mut cargo)? {
            let Some(path) = file(&artifact, ".rmeta") else {
                continue;
            };
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let name = name.strip_prefix("lib").unwrap_or(&name);
            let path = path.with_file_name(format!("{name}.ll"));
            if path.exists() {
                module.add(&fs::read_to_string(path)?)?;
            }
        }
        Ok(module)
    }

    /// Runs the compiler and clippy on the harnesses. Treats warnings as errors.
    pub(crate) fn clippy(&self) -> Result<()> {
        let mut flags = vec!["--cfg=kani"];
        flags.extend(self.stand_in.iter().map(String::as_str));
        let mut cargo = self.cargo("clippy", &flags);
        cargo.arg("--target-dir").arg(self.target.join("clippy"));
        let status = cargo.args(["--", "-Dwarnings"]).status()?;
        ensure!(
            status.success(),
            "the harnesses do not compile without warnings"
        );
        Ok(())
    }

    /// Returns `cargo SUBCOMMAND` for the packages' libraries, with these flags for the compiler.
    fn cargo(&self, subcommand: &str, flags: &[&str]) -> Command {
        let mut cargo = cargo();
        cargo
            .args([subcommand, "--quiet", "--lib"])
            .env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"));
        for package in self.packages {
            cargo.args(["--package", package]);
        }
        cargo
    }
}

/// Waits until no other prover uses the folder, because provers would overwrite each other's files.
fn lock(folder: &Path) -> Result<Flock<File>> {
    fs::create_dir_all(folder)?;
    let file = File::create(folder.join("lock"))?;
    Flock::lock(file, FlockArg::LockExclusiveNonblock)
        .or_else(|(file, _)| {
            eprintln!("Waiting for another prover in {}", folder.display());
            Flock::lock(file, FlockArg::LockExclusive)
        })
        .map_err(|(_, error)| error.into())
}

fn cargo() -> Command {
    Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
}

/// Builds the stand-in. Returns the compiler's flags that provide the stand-in as the crate `kani`.
fn flags_for(manifest: &str, target: &Path) -> Result<Vec<String>> {
    let mut cargo = cargo();
    cargo.args(["build", "--quiet", "--manifest-path", manifest]);
    let artifacts = artifacts(cargo.arg("--target-dir").arg(target))?;
    let named = |name: &str, ending: &str| {
        let mut files = artifacts.iter().filter(|built| built.target.name == name);
        let file = files.find_map(|built| file(built, ending));
        file.with_context(|| format!("cargo does not report the file of {name}"))
    };
    let kani = named("kani", ".rlib")?;
    let macros = named("kani_macros", std::env::consts::DLL_SUFFIX)?;
    // A flag contains the hash of the stand-in. So cargo recompiles the packages when the stand-in changes.
    let mut hasher = DefaultHasher::new();
    fs::read(&kani)?.hash(&mut hasher);
    Ok(vec![
        format!("--extern=kani={}", kani.display()),
        format!("-Ldependency={}", macros.with_file_name("").display()),
        format!("--cfg=stand_in_{:016x}", hasher.finish()),
    ])
}

/// Runs cargo and passes on the compiler's messages. Returns the built artifacts.
fn artifacts(cargo: &mut Command) -> Result<Vec<Artifact>> {
    cargo.arg("--message-format=json-render-diagnostics");
    let output = cargo.stderr(Stdio::inherit()).output()?;
    ensure!(output.status.success(), "the harnesses do not compile");
    let messages = Message::parse_stream(output.stdout.as_slice());
    let artifacts = messages.filter_map(|message| match message {
        Ok(Message::CompilerArtifact(artifact)) => Some(Ok(artifact)),
        Ok(_) => None,
        Err(error) => Some(Err(error.into())),
    });
    artifacts.collect()
}

/// Returns the artifact's file with this ending.
fn file(artifact: &Artifact, ending: &str) -> Option<PathBuf> {
    let mut files = artifact.filenames.iter();
    let file = files.find(|file| file.as_str().ends_with(ending))?;
    Some(file.clone().into_std_path_buf())
}
