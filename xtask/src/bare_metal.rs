//! Where the libraries come from that programs without an operating system are built with.
//!
//! From one of three places, whichever is there first: the installed toolchain, `rustup target
//! add`, or Debian's compiler, which brings the source of Rust's own `core` so that cargo can build
//! it for any target.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Error, Result, ensure};

use crate::command::{output, run_within, version};
use crate::debian::{self, DebianCompiler};

/// How long `rustup target add` may take: enough for a slow line to fetch all targets, short
/// enough to wait for where it cannot be reached.
const RUSTUP_LIMIT: Duration = Duration::from_secs(120);

/// Where the targets' own libraries come from.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Source {
    Installed,
    Rustup,
    Debian(DebianCompiler),
}

impl Source {
    /// The first that can be had for all those targets.
    pub(crate) fn of(targets: &[&str]) -> Result<Self> {
        let sysroot = output(Command::new("rustc").args(["--print", "sysroot"]))?;
        let sysroot = PathBuf::from(sysroot);
        let missing: Vec<&str> = targets
            .iter()
            .copied()
            .filter(|target| !is_installed(&sysroot, target))
            .collect();
        choose(
            &missing,
            |targets| add_with_rustup(&sysroot, targets),
            debian::compiler,
        )
    }

    /// What it is, with the compiler's version.
    pub(crate) fn describe(&self) -> Result<String> {
        let toolchain = || version(&mut Command::new("rustc"));
        Ok(match self {
            Self::Installed => format!("{}, targets installed", toolchain()?),
            Self::Rustup => format!("{}, targets just added by rustup", toolchain()?),
            Self::Debian(compiler) => format!("Debian {}, build-std", compiler.version),
        })
    }

    /// Makes that cargo command use it.
    pub(crate) fn use_in(&self, command: &mut Command) {
        if let Self::Debian(_) = self {
            debian::use_in(command);
        }
    }
}

/// Takes the first source that can be had. `missing` are the targets that the toolchain lacks.
fn choose(
    missing: &[&str],
    add_with_rustup: impl FnOnce(&[&str]) -> Result<()>,
    debian_compiler: impl FnOnce() -> Result<DebianCompiler>,
) -> Result<Source> {
    if missing.is_empty() {
        return Ok(Source::Installed);
    }
    println!("Not in the installed toolchain: {}", missing.join(", "));
    let rustup_error = match add_with_rustup(missing) {
        Ok(()) => return Ok(Source::Rustup),
        Err(error) => error,
    };
    println!("{rustup_error:#}; trying Debian's compiler");
    match debian_compiler() {
        Ok(compiler) => Ok(Source::Debian(compiler)),
        Err(debian_error) => Err(none_works(missing, &rustup_error, &debian_error)),
    }
}

fn none_works(missing: &[&str], rustup_error: &Error, debian_error: &Error) -> Error {
    let missing = missing.join(" ");
    anyhow::anyhow!(
        "nothing was built, for want of the targets {missing}.\n\
         First way, rustup: {rustup_error:#}\n\
         Second way, Debian's compiler: {debian_error:#}\n\
         To settle it, with a connection to static.rust-lang.org: rustup target add {missing}\n\
         or, on Debian: {}",
        debian::BY_HAND
    )
}

/// Whether the toolchain has the target's `core`. The folder alone could be left over from an
/// installation that was cut off.
fn is_installed(sysroot: &Path, target: &str) -> bool {
    let libraries = sysroot.join("lib/rustlib").join(target).join("lib");
    let Ok(entries) = libraries.read_dir() else {
        return false;
    };
    entries.flatten().any(|entry| {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        name.starts_with("libcore-") && name.ends_with(".rlib")
    })
}

fn add_with_rustup(sysroot: &Path, targets: &[&str]) -> Result<()> {
    let mut command = Command::new("rustup");
    command.args(["target", "add"]).args(targets);
    // There is another way, so it need not insist where it cannot be reached.
    command.env("RUSTUP_MAX_RETRIES", "0");
    // With a backtrace, its own short explanation would drown.
    command.env("RUST_BACKTRACE", "0");
    run_within(RUSTUP_LIMIT, &mut command)?;
    ensure!(
        targets.iter().all(|target| is_installed(sysroot, target)),
        "rustup added the targets, but not to the toolchain of the `rustc` in PATH, {}",
        sysroot.display()
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use anyhow::bail;

    use super::*;

    fn debian() -> DebianCompiler {
        DebianCompiler {
            version: "rustc-web 1.96.0".to_owned(),
        }
    }

    #[test]
    fn installed_targets_are_used_as_they_are() {
        let source = choose(
            &[],
            |_| panic!("nothing to add"),
            || panic!("no second compiler needed"),
        );
        assert_eq!(source.expect("all is there"), Source::Installed);
    }

    #[test]
    fn rustup_adds_just_the_missing_targets() {
        let source = choose(
            &["one", "two"],
            |targets| {
                assert_eq!(targets, ["one", "two"]);
                Ok(())
            },
            || panic!("no second compiler needed"),
        );
        assert_eq!(source.expect("rustup added them"), Source::Rustup);
    }

    #[test]
    fn debian_helps_where_rustup_cannot() {
        let source = choose(&["one"], |_| bail!("unreachable"), || Ok(debian()));
        assert_eq!(source.expect("Debian has it"), Source::Debian(debian()));
    }

    #[test]
    fn if_nothing_works_the_error_tells_both_reasons_and_what_to_do() {
        let source = choose(&["one"], |_| bail!("unreachable"), || bail!("not root"));
        let error = source.expect_err("neither works").to_string();
        for part in [
            "unreachable",
            "not root",
            "rustup target add one",
            debian::BY_HAND,
        ] {
            assert!(error.contains(part), "{part:?} is missing in: {error}");
        }
    }

    #[test]
    fn a_target_without_its_core_is_not_installed() {
        let sysroot = std::env::temp_dir().join(format!("xtask-sysroot-{}", std::process::id()));
        let libraries = sysroot.join("lib/rustlib/some-target/lib");
        std::fs::create_dir_all(&libraries).expect("the temporary folder can be written");
        let before = is_installed(&sysroot, "some-target");
        std::fs::write(libraries.join("libcore-0123.rlib"), "").expect("it can be written");
        let after = is_installed(&sysroot, "some-target");
        std::fs::remove_dir_all(&sysroot).expect("it is ours");
        assert!(!before);
        assert!(after);
        assert!(!is_installed(&sysroot, "some-target"));
    }

    #[test]
    fn only_a_build_with_the_debian_compiler_gets_its_variables() {
        let variables = |source: &Source| {
            let mut command = Command::new("cargo");
            source.use_in(&mut command);
            command.get_envs().count()
        };
        assert_eq!(variables(&Source::Installed), 0);
        assert_eq!(variables(&Source::Rustup), 0);
        assert!(variables(&Source::Debian(debian())) > 0);
    }
}
