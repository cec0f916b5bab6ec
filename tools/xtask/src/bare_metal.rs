//! Which compiler builds programs without an operating system: the toolchain in PATH, if it has the
//! targets or rustup can add them; else Debian's, which comes with the source of Rust's own `core`.

use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use xshell::{Cmd, Shell, cmd};

use crate::install;

/// Debian keeps a recent compiler for its browsers, and the source of Rust's libraries with it.
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

/// The compiler that was chosen.
pub(crate) struct Compiler {
    pub(crate) is_debian: bool,
    /// What it is, with its version.
    pub(crate) says: String,
}

impl Compiler {
    /// The first that can be had for all those targets; says which.
    pub(crate) fn of(targets: &[&str]) -> Result<Self> {
        let sh = &Shell::new()?;
        let is_debian = !targets.iter().all(|target| has_core(sh, target))
            && cmd!(sh, "rustup target add {targets...}")
                // There is another way, so it need not insist where the server cannot be reached.
                .env("RUSTUP_MAX_RETRIES", "0")
                .env("RUSTUP_DOWNLOAD_TIMEOUT", "60")
                // With a backtrace, its own short explanation would drown.
                .env("RUST_BACKTRACE", "0")
                .run()
                .is_err();
        let says = if is_debian {
            eprintln!("rustup cannot add the targets; Debian's compiler is used");
            let version = debians(sh).with_context(|| {
                let targets = targets.join(" ");
                format!(
                    "there is no compiler for {targets}. With a connection to \
                     static.rust-lang.org: rustup target add {targets}. On Debian, as root: \
                     apt-get install rustc-web rust-web-src, which was tried too"
                )
            })?;
            format!("Debian's {version}, with core built from source")
        } else {
            version(cmd!(sh, "rustc --version"))?
        };
        eprintln!("The compiler: {says}");
        Ok(Self { is_debian, says })
    }

    /// That cargo command, with this compiler.
    pub(crate) fn with<'a>(&self, sh: &'a Shell, cargo: Cmd<'a>) -> Cmd<'a> {
        if !self.is_debian {
            return cargo;
        }
        let cargo = cargo
            .env("RUSTC", DEBIAN_RUSTC)
            // Building `core` is an unstable part of cargo, which a stable one admits only so.
            .env("RUSTC_BOOTSTRAP", "1")
            .env("CARGO_UNSTABLE_BUILD_STD", "core")
            // `cargo xtask` puts the libraries of rustup's toolchain here; they are not for this one.
            .env_remove("LD_LIBRARY_PATH");
        // Debian's compiler has no linker for these targets; rustup's toolchain has one.
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

/// Whether the toolchain in PATH has the target's `core`. The folder alone could be left over from
/// an installation that was cut off.
fn has_core(sh: &Shell, target: &str) -> bool {
    let rustc = cmd!(sh, "rustc --print target-libdir --target {target}").quiet();
    let files = rustc.read().and_then(|folder| sh.read_dir(folder));
    files.is_ok_and(|files| {
        let names = files.iter().filter_map(|file| file.file_name()?.to_str());
        names.into_iter().any(|name| name.starts_with("libcore-"))
    })
}

/// Finds Debian's compiler, or installs it; returns its version.
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

/// Name and version: the first two words of the answer.
fn version(command: Cmd) -> Result<String> {
    let answer = command.quiet().read()?;
    let words: Vec<&str> = answer.split_whitespace().take(2).collect();
    Ok(words.join(" "))
}
