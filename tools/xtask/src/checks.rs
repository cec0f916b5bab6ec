//! The stages that check sources, tests and documentation on this machine.

use std::path::Path;

use anyhow::{Context as _, Result, ensure};
use xshell::cmd;

use crate::bare_metal::Compiler;
use crate::stage_report::{Report, run_tests};
use crate::workspace::{CORE, Workspace};
use crate::{firmware, install, prove};

/// The targets for which the core must compile. They include one without atomic compare-and-swap, one with a
/// floating-point unit, and one that is not Arm.
const MICROCONTROLLERS: [&str; 3] = [
    "thumbv6m-none-eabi",
    firmware::TARGET,
    "riscv32imac-unknown-none-elf",
];

const FORMATS: &str = "framelock-formats";
const HOST: &str = "framelock-host";

/// Checks that rustfmt has formatted the sources.
pub(crate) fn format(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    for folder in [".", "firmware", "firmware/examples/rp2040", "fuzz"] {
        let _here = sh.push_dir(folder);
        cmd!(sh, "cargo fmt --all --check").run().context(
            "run `cargo fmt --all`; if rustfmt is missing: rustup component add rustfmt",
        )?;
    }
    Ok(())
}

/// Checks that neither the compiler nor clippy has a warning about libraries, programs, tests,
/// benchmarks and harnesses.
pub(crate) fn clippy(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let mut cargo = workspace.cargo_test();
    let status = cargo.args(["--all-targets", "--no-run"]).status()?;
    ensure!(
        status.success(),
        "there are warnings or errors, see above; if clippy is missing: rustup component add clippy"
    );
    prove::clippy(workspace)
}

/// Installs the programs that the tests of generated C need, if any of them is missing.
fn install_for_c(workspace: &Workspace) -> Result<()> {
    const COMMANDS: [&str; 5] = ["clang", "cmake", "arm-none-eabi-gcc", "avr-gcc", "simavr"];
    let sh = &workspace.shell()?;
    let is_there = |command: &&str| {
        let version = cmd!(sh, "{command} --version").quiet().ignore_status();
        version.ignore_stdout().ignore_stderr().run().is_ok()
    };
    let has_arduino = Path::new(ARDUINO).exists();
    if has_arduino && COMMANDS.iter().all(is_there) {
        return Ok(());
    }
    install::from_debian(sh, &PACKAGES_FOR_C).context("generated C cannot be compiled")
}

/// The folder of Debian's core for Arduino boards.
const ARDUINO: &str = "/usr/share/arduino/hardware/arduino/avr";

/// The Debian packages with compilers and a build system for C, a cache of what they compiled, and a simulator of an
/// AVR.
const PACKAGES_FOR_C: [&str; 8] = [
    "ccache",
    "clang",
    "cmake",
    "gcc-arm-none-eabi",
    "gcc-avr",
    "avr-libc",
    "simavr",
    "arduino-core-avr",
];

/// Runs unit and integration tests, and each benchmark once without measuring time.
pub(crate) fn tests(workspace: &Workspace, report: &mut Report) -> Result<()> {
    install_for_c(workspace)?;
    let mut cargo = workspace.cargo_test();
    // Leave out the firmware's tests, because they need the images and have a stage of their own.
    cargo.args([
        "--all-targets",
        "--no-fail-fast",
        "--exclude",
        firmware::TESTS,
    ]);
    run_tests(&mut cargo, &mut report.tests)
}

/// Runs the tests of the line's simulation with the full number of trials.
pub(crate) fn statistics(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let mut cargo = workspace.cargo();
    cargo.args(["test", "--package", "framelock-simulation"]);
    run_tests(cargo.env("FRAMELOCK_STATISTICS", "full"), &mut report.tests)
}

/// Checks that pandas and polars read the command line's tables correctly, and that pymavlink and framelock use the
/// same names for the messages of `MAVLink`.
pub(crate) fn tables(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let python = workspace.python_with(&["pandas==3.1.1", "polars==2.1.0", "pymavlink==2.4.50"])?;
    let sh = workspace.shell()?;
    cmd!(sh, "cargo build --package {HOST}").run()?;
    let framelock = workspace.target_directory.join("debug/framelock");
    let tests = workspace.root.join("host/cli/tests");
    let (script, recordings) = (tests.join("tables.py"), tests.join("recordings.txt"));
    let tables = cmd!(sh, "{python} {script} {framelock} {recordings}").read()?;
    let script = workspace
        .root
        .join("host/description/tests/message_names.py");
    let names = workspace
        .root
        .join("host/description/src/message_names.txt");
    let dialects = workspace.root.join("formats/src/dialects.rs");
    let names = cmd!(sh, "{python} {script} {names} {dialects}").read()?;
    report.says = format!("{tables}; {names}");
    Ok(())
}

/// Tests code that is generated from many random descriptions.
pub(crate) fn generated(workspace: &Workspace, report: &mut Report) -> Result<()> {
    install_for_c(workspace)?;
    let mut cargo = workspace.cargo_test();
    cargo.args(["--test", "c", "--", "--ignored"]);
    run_tests(&mut cargo, &mut report.tests)
}

/// Runs the examples in the documentation, and checks that the documentation builds without
/// warnings.
pub(crate) fn docs(workspace: &Workspace, report: &mut Report) -> Result<()> {
    run_tests(workspace.cargo_test().arg("--doc"), &mut report.tests)?;
    let libraries = [
        CORE,
        FORMATS,
        "framelock-proofs",
        "framelock-receiving",
        "framelock-simulation",
    ];
    let packages = libraries.map(|library| ["--package", library]).concat();
    let sh = workspace.shell()?;
    cmd!(sh, "cargo doc --no-deps --all-features {packages...}")
        .env("RUSTDOCFLAGS", "-Dwarnings")
        .run()?;
    Ok(())
}

/// Checks that the core compiles for microcontrollers without a warning under every subset of its
/// features. The formats, which have no features, must compile too.
pub(crate) fn core(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let compiler = Compiler::of(&MICROCONTROLLERS)?;
    let subsets = subsets(&workspace.core_features);
    report.says = format!("{} sets of features, by {}", subsets.len(), compiler.says);
    let sh = workspace.shell()?;
    // Build in a separate folder. With another compiler and other flags, cargo would compile everything in
    // the common folder again.
    let folder = workspace.target_directory.join("microcontrollers");
    for (index, features) in subsets.iter().enumerate() {
        // Check every microcontroller with no features and with all features. Check the other subsets with one
        // microcontroller only.
        let is_end = index == 0 || features.len() == workspace.core_features.len();
        let targets = if is_end {
            &MICROCONTROLLERS[..]
        } else {
            &[firmware::TARGET]
        };
        let targets = targets.iter().flat_map(|target| ["--target", target]);
        let others = (index == 0).then_some(["--package", FORMATS]);
        let others = others.iter().flatten();
        let features = features.join(",");
        let cargo = cmd!(
            sh,
            "cargo check --package {CORE} {others...} --no-default-features --features={features} --target-dir {folder} {targets...}"
        );
        compiler
            .with(&sh, cargo.env("RUSTFLAGS", "-Dwarnings"))
            .run()?;
    }
    Ok(())
}

/// Checks that the command line and its tests compile for Windows and macOS, and xtask for macOS.
pub(crate) fn systems(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    for (target, packages) in [
        ("x86_64-pc-windows-msvc", &[HOST][..]),
        ("aarch64-apple-darwin", &[HOST, "xtask"]),
    ] {
        cmd!(sh, "rustup target add {target}")
            .run()
            .with_context(|| format!("only rustup can install the libraries of {target}"))?;
        let packages = packages.iter().flat_map(|package| ["--package", package]);
        let cargo = cmd!(
            sh,
            "cargo check {packages...} --all-targets --target {target}"
        );
        cargo.env("RUSTFLAGS", "-Dwarnings").run()?;
    }
    Ok(())
}

/// Checks that the core and the formats compile with the oldest Rust that their manifests promise.
pub(crate) fn minimum(workspace: &Workspace, report: &mut Report) -> Result<()> {
    const OLDEST: &str = "1.85";
    let sh = workspace.shell()?;
    cmd!(sh, "rustup toolchain install {OLDEST} --profile minimal")
        .run()
        .context("only rustup can install an old Rust")?;
    for package in ["core", "formats"] {
        let manifest = format!("{package}/Cargo.toml");
        let promised = format!("rust-version = \"{OLDEST}\"");
        let text = sh.read_file(&manifest)?;
        ensure!(
            text.contains(&promised),
            "{manifest} does not promise {promised}"
        );
        cmd!(
            sh,
            "cargo +{OLDEST} check --manifest-path {manifest} --all-features --ignore-rust-version"
        )
        .env("CARGO_TARGET_DIR", workspace.target_directory.join(OLDEST))
        .run()?;
    }
    report.says = format!("Rust {OLDEST}");
    Ok(())
}

/// Returns every subset of the features, beginning with the empty one.
fn subsets(features: &[String]) -> Vec<Vec<&str>> {
    let mut subsets = vec![vec![]];
    for feature in features {
        for mut subset in subsets.clone() {
            subset.push(feature.as_str());
            subsets.push(subset);
        }
    }
    subsets
}
