//! The firmware: builds its images, checks them with clippy, and runs their tests in the emulator.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use anyhow::{Context as _, Result, ensure};
use cargo_metadata::Message;
use object::read::elf::{ElfFile32, ProgramHeader as _};
use object::{Endianness, elf::PT_LOAD};
use serde::Deserialize;
use xshell::{Cmd, Shell, cmd};

use crate::bare_metal::Compiler;
use crate::stage_report::{self, Report, TestCount};
use crate::workspace::{CLIPPY, NO_WARNINGS, Workspace};

/// The nRF52840's processor: a Cortex-M4F.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

/// The package that tests the images.
pub(crate) const TESTS: &str = "framelock-firmware-tests";

/// The variable that makes the tests try all cases, not a sample.
const ALL_CASES: &str = "FRAMELOCK_ALL_CASES";

/// A build: the image's name, the program, and the options that select its features.
pub(crate) type Build = (&'static str, &'static str, &'static [&'static str]);

/// All images that the tests run. All images have the same dependencies, so after the first image, each further image
/// takes only a second or two to build. The image `parser-steps` contains single steps of the parsers, to measure their
/// costs.
pub(crate) const BUILDS: [Build; 9] = [
    ("default", "framelock-firmware", &[]),
    ("megabaud", "framelock-firmware", &["--features=megabaud"]),
    ("lecture", "framelock-firmware", &["--features=lecture"]),
    (
        "write-uicr",
        "framelock-firmware",
        &["--features=write-uicr"],
    ),
    ("small", "framelock-firmware", &["--no-default-features"]),
    ("bin-crc8", "framelock-firmware", &["--features=bin-crc8"]),
    ("self-test", "self-test", &[]),
    ("self-test-megabaud", "self-test", &["--features=megabaud"]),
    ("parser-steps", "parser-steps", &["--no-default-features"]),
];

const EXAMPLES: &str = "\
Examples:
  cargo xtask firmware                 the image that `cargo run --release` in firmware/ flashes
  cargo xtask firmware --all           every image that is tested";

/// Build the firmware for the nRF52840, and print its size
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Build every image that is tested
    #[arg(long)]
    all: bool,
}

/// Runs `cargo xtask firmware`.
pub(crate) fn build(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let compiler = Compiler::of(&[TARGET])?;
    let count = if arguments.all { BUILDS.len() } else { 1 };
    for build in BUILDS.iter().take(count) {
        let image = build_image(workspace, &workspace.root, &compiler, build)?;
        println!("{}: {} bytes of flash", image.display(), flash(&image)?);
    }
    Ok(())
}

/// Runs the stage that builds the firmware without a warning from the compiler or clippy.
pub(crate) fn every_build(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let compiler = Compiler::of(&[TARGET])?;
    report.says = format!("{} images, by {}", BUILDS.len(), compiler.says);
    let sh = &Shell::new()?;
    sh.change_dir(workspace.root.join("firmware"));
    let target = &target_folder(workspace, &workspace.root);
    for build in &BUILDS {
        if !compiler.is_debian {
            lint(cargo_build(sh, target, &compiler, build)).run()?;
        }
        build_image(workspace, &workspace.root, &compiler, build)?;
    }
    let copy = workspace.target_directory.join("contradictions");
    self::copy(workspace, &copy)?;
    let accepted = accepted_contradictions(&copy)?;
    ensure!(
        accepted.is_empty(),
        "these settings must not compile, and the error must state the reason: {accepted:#?}"
    );
    Ok(())
}

/// The name by which a seeded bug refers to [`accepted_contradictions`].
pub(crate) const CONTRADICTIONS: &str = "contradictions";

/// The content of `firmware/contradictions.toml`.
#[derive(Deserialize)]
struct Contradictions {
    contradiction: Vec<Contradiction>,
}

/// A replacement in the settings, and the error that it must cause.
#[derive(Deserialize)]
struct Contradiction {
    right: String,
    wrong: String,
    message: String,
}

/// Puts each contradiction of `firmware/contradictions.toml` into a copy of the sources. Returns those that the
/// compiler does not report with the right message.
pub(crate) fn accepted_contradictions(copy: &Path) -> Result<Vec<String>> {
    let compiler = Compiler::of(&[TARGET])?;
    let sh = &Shell::new()?;
    let folder = copy.join("firmware");
    sh.change_dir(&folder);
    let target = copy.join("target");
    let check = || {
        let check = ["check", "--locked", "--release", "--target", TARGET];
        let cargo = cmd!(
            sh,
            "cargo {check...} --target-dir {target} --bin framelock-firmware"
        );
        compiler.with(sh, cargo.env_remove("RUSTFLAGS"))
    };
    check().run()?;
    let list = sh.read_file(folder.join("contradictions.toml"))?;
    let list: Contradictions = toml::from_str(&list)?;
    let file = folder.join("src/settings.rs");
    let settings = sh.read_file(&file)?;
    let mut accepted = Vec::new();
    for Contradiction {
        right,
        wrong,
        message,
    } in list.contradiction
    {
        let places = settings.matches(&right).count();
        ensure!(places == 1, "\"{right}\" occurs {places} times, not once");
        sh.write_file(&file, settings.replace(&right, &wrong))?;
        let output = check().quiet().ignore_status().output()?;
        let errors = String::from_utf8_lossy(&output.stderr);
        if output.status.success() || !says(&errors, &message) {
            accepted.push(wrong);
        }
    }
    sh.write_file(&file, settings)?;
    Ok(accepted)
}

/// Returns whether the compiler reports a constant that panics with this message. The message may be a part of a failed
/// assertion without a message of its own. The lines that quote the source do not count.
fn says(errors: &str, message: &str) -> bool {
    errors
        .lines()
        .any(|line| line.starts_with("error[E0080]: ") && line.contains(message))
}

/// Runs the stage that tests the release images in the emulator, and compares the formats' costs on the chip.
pub(crate) fn in_the_emulator(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let mut tests = tests(workspace, &workspace.root)?;
    stage_report::run_tests(&mut tests, &mut report.tests)?;
    let mut formats = workspace.cargo_test();
    formats.args([
        "--bench",
        "rivals",
        "--",
        "--figures",
        "formats/FIGURES.txt",
    ]);
    let compared = formats.status()?;
    ensure!(
        compared.success(),
        "the formats' costs differ from formats/FIGURES.txt: see above"
    );
    Ok(())
}

/// Runs the stage of the firmware's slow tests, with all cases of each test. It first runs all tests with many more
/// random streams, also under random combinations of assumptions about the chip. Then it repeats all tests under each
/// single assumption.
pub(crate) fn random_streams(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let mut random = tests(workspace, &workspace.root)?;
    if std::env::var_os("FRAMELOCK_RANDOM_RUNS").is_none() {
        random.env("FRAMELOCK_RANDOM_RUNS", "20000");
    }
    stage_report::run_tests(random.env(ALL_CASES, "1"), &mut report.tests)?;
    let mut each = tests(workspace, &workspace.root)?;
    each.env(ALL_CASES, "1");
    stage_report::run_tests(each.args(["--", "--ignored"]), &mut report.tests)
}

/// Runs the stage of the examples for other frameworks. The examples must build without a warning from the compiler or
/// clippy, and pass their tests in the emulator. The commands in the guide to the examples must work.
pub(crate) fn examples(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let compiler = Compiler::of(&[TARGET])?;
    report.says = format!("by {}", compiler.says);
    let sh = &Shell::new()?;
    let folder = workspace.root.join("firmware");
    sh.change_dir(&folder);
    let build = || {
        // Build into the folder in which the guide's commands expect the programs.
        let cargo = cmd!(
            sh,
            "cargo build --locked --release --target-dir target --package framelock-embassy --package framelock-rtic"
        );
        compiler.with(sh, cargo.env_remove("RUSTFLAGS"))
    };
    let mut tests = workspace.cargo_test();
    tests.args(["--test", "examples"]);
    if compiler.is_debian {
        // The guide's commands call plain `cargo`, which does not use Debian's compiler.
        tests.args(["--", "--skip", "the_guides_commands"]);
    } else {
        lint(build()).run()?;
    }
    build().run()?;
    rp2040(workspace)?;
    let images = folder.join("target").join(TARGET).join("release");
    stage_report::run_tests(tests.env("FRAMELOCK_EXAMPLES", images), &mut report.tests)
}

/// Builds the example for the RP2040 without a warning from the compiler or clippy. The example does not run, because
/// there is no emulator for it.
fn rp2040(workspace: &Workspace) -> Result<()> {
    let compiler = Compiler::of(&["thumbv6m-none-eabi"])?;
    let sh = &Shell::new()?;
    sh.change_dir(workspace.root.join("firmware/examples/rp2040"));
    let target = workspace.target_directory.join("rp2040");
    let cargo = cmd!(sh, "cargo build --locked --release --target-dir {target}");
    let build = compiler.with(sh, cargo.env_remove("RUSTFLAGS"));
    if compiler.is_debian {
        build
    } else {
        lint(build)
    }
    .run()?;
    Ok(())
}

/// Returns the build command with clippy. The image must be built again without clippy, because clippy's build is less
/// optimised.
fn lint(build: Cmd) -> Cmd {
    build.args(CLIPPY).envs([NO_WARNINGS])
}

/// Returns whether this test, fast or slow, passes with the images that are built from the sources at `root`.
pub(crate) fn test_passes(workspace: &Workspace, root: &Path, test: &str) -> Result<bool> {
    let mut tests = tests(workspace, root)?;
    let mut count = TestCount::default();
    let outcome =
        stage_report::run_tests(tests.args(["--", "--include-ignored", test]), &mut count);
    ensure!(
        count.passed + count.failed == 1,
        "{test} must be the name of exactly one test"
    );
    Ok(outcome.is_ok())
}

/// Builds the images from the sources at `root`. Returns the command that tests the images.
fn tests(workspace: &Workspace, root: &Path) -> Result<Command> {
    let images = build_images(workspace, root)?;
    let mut tests = workspace.cargo_test();
    tests.args(["--test", "firmware"]);
    tests.env("FRAMELOCK_IMAGES", images);
    Ok(tests)
}

/// Builds the program of the firmware's tests. Returns its path.
pub(crate) fn test_program(workspace: &Workspace) -> Result<PathBuf> {
    let mut cargo = workspace.cargo_test();
    cargo.args([
        "--test",
        "firmware",
        "--no-run",
        "--message-format=json-render-diagnostics",
    ]);
    let output = cargo.stderr(Stdio::inherit()).output()?;
    ensure!(
        output.status.success(),
        "the firmware's tests do not compile"
    );
    let messages = Message::parse_stream(output.stdout.as_slice());
    let programs = messages.filter_map(|message| match message {
        Ok(Message::CompilerArtifact(made)) if made.target.name == "firmware" => made.executable,
        _ => None,
    });
    Ok(programs.last().context("cargo names no program")?.into())
}

/// Copies the firmware's sources to a folder in which mistakes are then seeded. The firmware is a
/// workspace of its own, but its package `reception` belongs to the surrounding workspace.
pub(crate) fn copy(workspace: &Workspace, to: &Path) -> Result<()> {
    let folders = ["core", "formats", "firmware"];
    workspace.copy(to, &folders, &["core", "firmware/reception"])
}

/// Builds all images from the sources at `root`. Returns the images' folder.
pub(crate) fn build_images(workspace: &Workspace, root: &Path) -> Result<PathBuf> {
    let compiler = Compiler::of(&[TARGET])?;
    for build in &BUILDS {
        build_image(workspace, root, &compiler, build)?;
    }
    Ok(images(workspace, root))
}

/// Builds an image from the sources at `root`. Copies it to a file of its own, because the next build would
/// overwrite it. Returns this file's path.
pub(crate) fn build_image(
    workspace: &Workspace,
    root: &Path,
    compiler: &Compiler,
    build: &Build,
) -> Result<PathBuf> {
    let sh = &Shell::new()?;
    sh.change_dir(root.join("firmware"));
    let target = target_folder(workspace, root);
    cargo_build(sh, &target, compiler, build).run()?;
    let (name, program, _) = build;
    let image = sh
        .create_dir(images(workspace, root))?
        .join(format!("{name}.elf"));
    let release = target.join(TARGET).join("release");
    sh.copy_file(release.join(program), &image)?;
    Ok(image)
}

/// Returns the folder for the firmware images that are built from the sources at `root`.
fn images(workspace: &Workspace, root: &Path) -> PathBuf {
    target_folder(workspace, root).join("images")
}

/// Returns the folder in which the sources at `root` are built. A copy has its own folder, because
/// cargo would otherwise mistake the copy's packages for those of the workspace.
fn target_folder(workspace: &Workspace, root: &Path) -> PathBuf {
    if root == workspace.root {
        workspace.target_directory.join("firmware")
    } else {
        root.join("target")
    }
}

fn cargo_build<'a>(
    sh: &'a Shell,
    target: &Path,
    compiler: &Compiler,
    (_, program, features): &Build,
) -> Cmd<'a> {
    let build = ["build", "--locked", "--release", "--target", TARGET];
    let cargo = cmd!(sh, "cargo {build...} --target-dir {target} --bin {program}");
    // Use the firmware's own flags, not those of the caller's environment.
    let cargo = cargo.args(*features).env_remove("RUSTFLAGS");
    compiler.with(sh, cargo)
}

/// Returns the number of bytes that are flashed: code, constants and the initial values of
/// variables.
fn flash(image: &Path) -> Result<u32> {
    let file = std::fs::read(image)?;
    let elf = ElfFile32::<Endianness>::parse(&*file);
    let elf = elf.with_context(|| image.display().to_string())?;
    let loaded = elf.elf_program_headers().iter();
    let loaded = loaded.filter(|header| header.p_type(elf.endian()) == PT_LOAD);
    Ok(loaded.map(|header| header.p_filesz(elf.endian())).sum())
}
