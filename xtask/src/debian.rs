//! Debian's own Rust compiler, installed if need be.
//!
//! Debian keeps a recent compiler for its browsers, with the source of Rust's own libraries.
//! With that, cargo can build `core` for targets that rustup cannot fetch here.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail, ensure};

use crate::command::{output, run, version};

/// The compiler, and the source of Rust's own libraries.
const PACKAGES: [&str; 2] = ["rustc-web", "rust-web-src"];

/// Where the package puts the compiler. By its full path, since rustup's comes first in PATH.
const COMPILER: &str = "/usr/bin/rustc";

/// What a person would type to install it.
pub(crate) const BY_HAND: &str =
    "sudo apt-get update && sudo apt-get install --no-install-recommends rustc-web rust-web-src";

/// Debian's compiler, installed together with the source of `core`.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct DebianCompiler {
    /// Package and version, such as `rustc-web 1.96.0`.
    pub(crate) version: String,
}

/// Makes that cargo command use Debian's compiler and build `core` itself.
pub(crate) fn use_in(command: &mut Command) {
    command
        .env("RUSTC", COMPILER)
        // Building `core` is an unstable part of cargo, which a stable one admits only so.
        .env("RUSTC_BOOTSTRAP", "1")
        .env("CARGO_UNSTABLE_BUILD_STD", "core")
        // `cargo xtask` puts the rustup toolchain's libraries here; they are not for this one.
        .env_remove("LD_LIBRARY_PATH");
    // Debian's compiler comes without a linker for these targets; rustup's toolchain has one.
    if let Some(linker) = rustup_linker() {
        command.env("CARGO_TARGET_THUMBV7EM_NONE_EABIHF_LINKER", linker);
    }
}

/// `rust-lld` of the toolchain in PATH.
fn rustup_linker() -> Option<PathBuf> {
    let libraries = output(Command::new("rustc").args(["--print", "target-libdir"])).ok()?;
    let linker = Path::new(&libraries).parent()?.join("bin/rust-lld");
    linker.exists().then_some(linker)
}

/// Finds the compiler, and installs it if it is not there.
pub(crate) fn compiler() -> Result<DebianCompiler> {
    if PACKAGES.iter().all(|package| is_installed(package)) {
        println!("Already installed: {}", PACKAGES.join(", "));
    } else {
        install()?;
    }

    let mut debian = Command::new(COMPILER);
    let sysroot = output(
        debian
            .args(["--print", "sysroot"])
            .env_remove("LD_LIBRARY_PATH"),
    )?;
    // The other stages are to go on with the compiler they had.
    let under_rustup = std::env::var_os("RUSTUP_TOOLCHAIN").is_some();
    let host_sysroot = output(Command::new("rustc").args(["--print", "sysroot"]))?;
    ensure!(
        !under_rustup || host_sysroot != sysroot,
        "the `rustc` in PATH is Debian's, not rustup's: put ~/.cargo/bin before /usr/bin in PATH"
    );
    let source = Path::new(&sysroot).join("lib/rustlib/src/rust/library/core");
    ensure!(
        source.is_dir(),
        "{} are installed, but the source of `core` is not at {}",
        PACKAGES.join(" and "),
        source.display()
    );
    let version = version(Command::new(COMPILER).env_remove("LD_LIBRARY_PATH"))?;
    Ok(DebianCompiler {
        version: version.replacen("rustc", "rustc-web", 1),
    })
}

fn is_installed(package: &str) -> bool {
    let mut query = Command::new("dpkg-query");
    query.args(["--show", "--showformat=${db:Status-Status}", package]);
    output(&mut query).is_ok_and(|status| status == "installed")
}

fn install() -> Result<()> {
    if !Path::new("/usr/bin/apt-get").exists() {
        bail!("this is not a Debian system: there is no apt-get");
    }
    let user = output(Command::new("id").arg("--user"))?;
    if user != "0" {
        bail!(
            "{} are not installed, and only root can do it",
            PACKAGES.join(" and ")
        );
    }
    let Err(first_error) = run(&mut install_command()) else {
        return Ok(());
    };
    // The usual reason is that the lists of packages are absent or out of date.
    println!("{first_error:#}; trying again with new lists of packages");
    run(apt_get().arg("update"))
        .and_then(|()| run(&mut install_command()))
        .context("Debian's compiler could not be installed")
}

fn install_command() -> Command {
    let mut command = apt_get();
    command
        // `--no-remove`: rather fail than take away another Rust that someone installed.
        .args(["install", "--yes", "--no-install-recommends", "--no-remove"])
        .args(PACKAGES);
    command
}

fn apt_get() -> Command {
    let mut command = Command::new("apt-get");
    command
        // If another apt-get is at work, wait for it.
        .args(["-o", "DPkg::Lock::Timeout=120"])
        .env("DEBIAN_FRONTEND", "noninteractive");
    command
}
