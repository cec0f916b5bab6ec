//! Chooses a compiler for programs without an operating system. Chooses the toolchain in PATH if it has the targets, or
//! if rustup can add the targets to it. Otherwise chooses Debian's compiler, which comes with the source of Rust's own
//! `core`.

use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use xshell::{Cmd, Shell, cmd};

use crate::install;

/// Debian keeps a recent compiler to build its browsers, together with the source of Rust's
/// libraries.
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

/// The chosen compiler.
pub(crate) struct Compiler {
    pub(crate) is_debian: bool,
    /// The compiler's name and version.
    pub(crate) says: String,
}

impl Compiler {
    /// Chooses the first available compiler for all these targets, and prints its name.
    pub(crate) fn of(targets: &[&str]) -> Result<Self> {
        let sh = &Shell::new()?;
        let is_debian = !targets.iter().all(|target| has_core(sh, target))
            && cmd!(sh, "rustup target add {targets...}")
                // Do not retry an unreachable server, because Debian's compiler is an alternative.
                .env("RUSTUP_MAX_RETRIES", "0")
                .env("RUSTUP_DOWNLOAD_TIMEOUT", "60")
                // A backtrace would bury rustup's own short explanation.
                .env("RUST_BACKTRACE", "0")
                .run()
                .is_err();
        let says = if is_debian {
            eprintln!("rustup cannot add the targets, so Debian's compiler is used");
            let version = debians(sh).with_context(|| {
                let targets = targets.join(" ");
                format!(
                    "there is no compiler for {targets}, and none could be installed. With a \
                     connection to static.rust-lang.org, run: rustup target add {targets}. On \
                     Debian, run as root: apt-get install rustc-web rust-web-src"
                )
            })?;
            format!("Debian's {version}, with core built from source")
        } else {
            version(cmd!(sh, "rustc --version"))?
        };
        eprintln!("The compiler: {says}");
        Ok(Self { is_debian, says })
    }

    /// Returns this cargo command, set up to use this compiler.
    pub(crate) fn with<'a>(&self, sh: &'a Shell, cargo: Cmd<'a>) -> Cmd<'a> {
        if !self.is_debian {
            return cargo;
        }
        let cargo = cargo
            .env("RUSTC", DEBIAN_RUSTC)
            // Building `core` is an unstable feature, which a stable cargo accepts only with this variable.
            .env("RUSTC_BOOTSTRAP", "1")
            .env("CARGO_UNSTABLE_BUILD_STD", "core")
            // `cargo xtask` puts the libraries of rustup's toolchain into this path, but Debian's compiler must not use
            // them.
            .env_remove("LD_LIBRARY_PATH");
        // Debian's compiler has no linker for these targets, so use the linker of rustup's toolchain.
        let libraries = cmd!(sh, "rustc --print target-libdir").quiet().read();
        let linker = libraries.map(|folder| Path::new(&folder).with_file_name("bin/rust-lld"));
        match linker {
            Ok(linker) if linker.exists() => cargo
                .env("CARGO_TARGET_THUMBV6M_NONE_EABI_LINKER", &linker)
                .env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker),
            _ => cargo,
        }
    }
}

/// Returns whether the toolchain in PATH has `core` for the target. The existence of the folder does not suffice,
/// because an interrupted installation may have left the folder behind.
fn has_core(sh: &Shell, target: &str) -> bool {
    let rustc = cmd!(sh, "rustc --print target-libdir --target {target}").quiet();
    let files = rustc.read().and_then(|folder| sh.read_dir(folder));
    files.is_ok_and(|files| {
        let names = files.iter().filter_map(|file| file.file_name()?.to_str());
        names.into_iter().any(|name| name.starts_with("libcore-"))
    })
}

/// Finds or installs Debian's compiler. Returns its version.
fn debians(sh: &Shell) -> Result<String> {
    install::from_debian(sh, &["rustc-web", "rust-web-src"])?;
    let rustc = || cmd!(sh, "{DEBIAN_RUSTC}").env_remove("LD_LIBRARY_PATH");
    let sysroot = rustc().args(["--print", "sysroot"]).read()?;
    let core = Path::new(&sysroot).join("lib/rustlib/src/rust/library/core");
    ensure!(
        core.is_dir(),
        "the source of core is not at {}",
        core.display()
    );
    version(rustc().arg("--version"))
}

/// Returns the compiler's name and version, which are the first two words of its answer.
fn version(command: Cmd) -> Result<String> {
    let answer = command.quiet().read()?;
    let words: Vec<&str> = answer.split_whitespace().take(2).collect();
    Ok(words.join(" "))
}
