//! The stage that builds the core for microcontrollers, where there is no std.
//!
//! The targets' own libraries come from one of three places, whichever is there first:
//! the installed toolchain, `rustup target add`, or Debian's compiler, which brings the source
//! of Rust's own `core` so that cargo can build it for any target.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Error, Result, bail, ensure};

use crate::command::{cargo, output, run, run_within, version};
use crate::debian::{self, DebianCompiler};
use crate::stage::Report;
use crate::workspace::{CORE, Workspace};

/// From the smallest to the largest: no atomic compare-and-swap, a floating-point unit, not Arm.
const TARGETS: [&str; 3] = [
    "thumbv6m-none-eabi",
    "thumbv7em-none-eabihf",
    "riscv32imac-unknown-none-elf",
];

/// How long `rustup target add` may take: enough for a slow line to fetch all targets, short
/// enough to wait for where it cannot be reached.
const RUSTUP_LIMIT: Duration = Duration::from_secs(120);

/// Where the targets' own libraries come from.
#[derive(Debug, PartialEq, Eq)]
enum Source {
    Installed,
    Rustup,
    Debian(DebianCompiler),
}

/// The core builds for microcontrollers, where there is no std.
pub(crate) fn build_core(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let sysroot = output(Command::new("rustc").args(["--print", "sysroot"]))?;
    let sysroot = PathBuf::from(sysroot);
    let missing: Vec<&str> = TARGETS
        .into_iter()
        .filter(|target| !is_installed(&sysroot, target))
        .collect();
    let source = choose(
        &missing,
        |targets| add_with_rustup(&sysroot, targets),
        debian::compiler,
    )?;

    let toolchain = version(&mut Command::new("rustc"))?;
    report.engine = match &source {
        Source::Installed => format!("{toolchain}, targets installed"),
        Source::Rustup => format!("{toolchain}, targets just added by rustup"),
        Source::Debian(compiler) => format!("Debian {}, build-std", compiler.version),
    };
    report.extent = format!("{} targets", TARGETS.len());
    println!("The targets' libraries: {}", report.engine);

    for features in ["--no-default-features", "--all-features"] {
        build(workspace, &source, features)?;
    }
    Ok(())
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
        "the core was not built, for want of the targets {missing}.\n\
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

/// Builds the core for all targets.
fn build(workspace: &Workspace, source: &Source, features: &str) -> Result<()> {
    // At once, so that all processors have work while Rust's `core` is built for each.
    let Err(error) = run(&mut build_command(workspace, source, features, &TARGETS)) else {
        return Ok(());
    };
    // Cargo does not say for which of the targets it failed; one by one shows it.
    let failed: Vec<&str> = TARGETS
        .into_iter()
        .filter(|target| run(&mut build_command(workspace, source, features, &[target])).is_err())
        .collect();
    bail!("{error:#}; on its own it fails for: {}", failed.join(", "))
}

fn build_command(
    workspace: &Workspace,
    source: &Source,
    features: &str,
    targets: &[&str],
) -> Command {
    let mut command = cargo(workspace);
    command.args(["build", "--package", CORE, features, "--release"]);
    for target in targets {
        command.args(["--target", target]);
    }
    // An own folder, so that a second compiler does not disturb what the host's builds keep.
    command
        .arg("--target-dir")
        .arg(workspace.target_directory.join("no-std"));
    if let Source::Debian(_) = source {
        debian::use_in(&mut command);
    }
    command
}

#[cfg(test)]
mod tests {
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
        let workspace = Workspace {
            root: "/w".into(),
            target_directory: "/w/target".into(),
            packages: vec![],
        };
        let variables = |source: &Source| {
            let command = build_command(&workspace, source, "--all-features", &TARGETS);
            command.get_envs().count()
        };
        assert_eq!(variables(&Source::Installed), 0);
        assert_eq!(variables(&Source::Rustup), 0);
        assert!(variables(&Source::Debian(debian())) > 0);
    }
}
