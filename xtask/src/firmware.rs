//! Building the firmware: `cargo xtask firmware`, and for the stages that run it.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, ensure};
use framelock_firmware_inspect::Sizes;

use crate::bare_metal::Source;
use crate::command::{cargo_in, run};
use crate::stage::Report;
use crate::workspace::Workspace;

/// The nRF52840's processor: a Cortex-M4F.
pub(crate) const TARGET: &str = "thumbv7em-none-eabihf";

const PROGRAM: &str = "framelock-firmware";
const STEPS: &str = "parser-steps";

/// What the image may take of the flash, in bytes: with its log, and without.
const MOST_WITH_LOG: u64 = 16 * 1024;
const MOST_WITHOUT_LOG: u64 = 6_656;

/// What the firmware can be built as. The name is also the image's.
#[derive(Clone, Copy)]
pub(crate) struct Build {
    pub(crate) name: &'static str,
    /// What cargo is told about features.
    pub(crate) arguments: &'static [&'static str],
    most: u64,
    /// Whether the tests that find seeded bugs run it.
    pub(crate) tested_for_bugs: bool,
}

/// All that the tests run.
pub(crate) const BUILDS: [Build; 4] = [
    Build {
        name: "default",
        arguments: &[],
        most: MOST_WITH_LOG,
        tested_for_bugs: true,
    },
    Build {
        name: "megabaud",
        arguments: &["--features", "megabaud"],
        most: MOST_WITH_LOG,
        tested_for_bugs: true,
    },
    Build {
        name: "discard",
        arguments: &["--features", "discard"],
        most: MOST_WITH_LOG,
        tested_for_bugs: false,
    },
    Build {
        name: "small",
        arguments: &["--no-default-features"],
        most: MOST_WITHOUT_LOG,
        tested_for_bugs: false,
    },
];

const EXAMPLES: &str = "\
Examples:
  cargo xtask firmware                 the image that `cargo run --release` in firmware/ flashes
  cargo xtask firmware --all           with every set of features that is tested
  cargo xtask firmware --seeded-bugs   whether the tests find what was put in to be found";

/// Build the firmware for the nRF52840, and tell how large it is.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Build it with every set of features that is tested.
    #[arg(long)]
    all: bool,

    /// Put each seeded bug into a copy, and run the tests that are to find it.
    #[arg(long, conflicts_with = "all")]
    seeded_bugs: bool,
}

/// `cargo xtask firmware`.
pub(crate) fn build_and_tell(arguments: &Arguments) -> Result<ExitCode> {
    let workspace = Workspace::load()?;
    if arguments.seeded_bugs {
        crate::firmware_seeded_bugs::run_all(&workspace)?;
        return Ok(ExitCode::SUCCESS);
    }
    let source = Source::of(&[TARGET])?;
    println!("The target's libraries: {}", source.describe()?);
    for build in BUILDS
        .iter()
        .take(if arguments.all { BUILDS.len() } else { 1 })
    {
        let image = build_image(&workspace, &workspace.root, &source, build)?;
        println!("{}: {}", image.display(), sizes_of(&image)?);
    }
    Ok(ExitCode::SUCCESS)
}

/// The stage: the firmware builds, without warnings, and fits.
pub(crate) fn every_build(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let source = Source::of(&[TARGET])?;
    report.engine = source.describe()?;
    println!("The target's libraries: {}", report.engine);
    let folder = workspace.root.join("firmware");
    run(cargo_in(&folder).args(["fmt", "--check"]))?;
    if !matches!(source, Source::Debian(_)) {
        // Clippy belongs to the toolchain, and goes with no other compiler.
        run(cargo_in(&folder)
            .args(["clippy", "--locked", "--release", "--target-dir"])
            .arg(workspace.target_directory.join("firmware"))
            .args(["--", "-Dwarnings"]))?;
    }
    let mut sizes = Vec::new();
    for build in &BUILDS {
        let image = build_image(workspace, &workspace.root, &source, build)?;
        let size = sizes_of(&image)?;
        println!("{}: {size}", build.name);
        ensure!(
            size.flash() <= build.most,
            "the image `{}` takes {} bytes of flash, more than {}",
            build.name,
            size.flash(),
            build.most
        );
        sizes.push(format!("{} {}", build.name, size.flash()));
    }
    report.extent = format!("bytes of flash: {}", sizes.join(", "));
    Ok(())
}

/// The release image with those features (`discard`, `megabaud`, or none), built if need be.
pub(crate) fn firmware_elf(workspace: &Workspace, features: &[&str]) -> Result<PathBuf> {
    let source = Source::of(&[TARGET])?;
    eprintln!("The target's libraries: {}", source.describe()?);
    let features = features.join(",");
    let arguments = ["--features", features.as_str()];
    compile(workspace, &workspace.root, &source, PROGRAM, &arguments)
}

/// Builds one, and keeps the image under the build's own name: the next would overwrite it.
pub(crate) fn build_image(
    workspace: &Workspace,
    root: &Path,
    source: &Source,
    build: &Build,
) -> Result<PathBuf> {
    let program = compile(workspace, root, source, PROGRAM, build.arguments)?;
    let folder = images(workspace, root);
    std::fs::create_dir_all(&folder)?;
    let image = folder.join(format!("{}.elf", build.name));
    std::fs::copy(&program, &image)
        .with_context(|| format!("{} could not be copied", program.display()))?;
    Ok(image)
}

/// Builds the image with single steps of the parsers, for the figures.
pub(crate) fn build_parser_steps(workspace: &Workspace, source: &Source) -> Result<()> {
    let root = &workspace.root;
    let program = compile(workspace, root, source, STEPS, &["--no-default-features"])?;
    let image = images(workspace, root).join(format!("{STEPS}.elf"));
    std::fs::copy(&program, &image)
        .with_context(|| format!("{} could not be copied", program.display()))?;
    Ok(())
}

fn sizes_of(image: &Path) -> Result<Sizes> {
    let unreadable = || format!("{} could not be read", image.display());
    let bytes = std::fs::read(image).with_context(unreadable)?;
    Sizes::of(&bytes).map_err(|error| anyhow!("{}: {error}", image.display()))
}

/// Where the images of the workspace at `root`, which may be a copy, are kept.
pub(crate) fn images(workspace: &Workspace, root: &Path) -> PathBuf {
    if root == workspace.root {
        workspace.target_directory.join("firmware/images")
    } else {
        root.join("images")
    }
}

fn compile(
    workspace: &Workspace,
    root: &Path,
    source: &Source,
    program: &str,
    arguments: &[&str],
) -> Result<PathBuf> {
    let target_directory = workspace.target_directory.join("firmware");
    let mut command = cargo_in(&root.join("firmware"));
    command
        // Its own `rustflags` and linker arguments count, not those of whoever runs this.
        .env_remove("RUSTFLAGS")
        .args(["build", "--locked", "--release", "--target", TARGET])
        .args(["--bin", program])
        .args(arguments)
        .arg("--target-dir")
        .arg(&target_directory);
    source.use_in(&mut command);
    run(&mut command)?;
    Ok(target_directory.join(TARGET).join("release").join(program))
}
