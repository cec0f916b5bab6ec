//! `cargo xtask mutants --by images`: the firmware is changed one place at a time; some test of its images in the
//! emulator must fail.
//!
//! cargo-mutants compiles and tests for the computer, so only its list of changes is taken.

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context as _, Result, ensure};
use cargo_metadata::Message;
use serde::Deserialize;
use xshell::{Shell, cmd};

use crate::firmware;
use crate::workspace::Workspace;

/// Only the self-test has them, and only its tests can notice.
const OF_SELF_TEST: [&str; 2] = ["src/self-test.rs", "src/loopback.rs"];

/// A change, as `cargo mutants --list --json` has it.
#[derive(Deserialize)]
struct Mutant {
    name: String,
    /// In `firmware/`.
    file: String,
    replacement: String,
    span: Span,
}

#[derive(Deserialize)]
struct Span {
    start: Place,
    end: Place,
}

/// Both count from one; a column is a character.
#[derive(Deserialize)]
struct Place {
    line: usize,
    column: usize,
}

impl Mutant {
    fn of(&self, source: &str) -> Result<String> {
        let [start, end] = [&self.span.start, &self.span.end].map(|place| place.of(source));
        let before = source.get(..start.context("it begins nowhere")?);
        let behind = source.get(end.context("it ends nowhere")?..);
        let (before, behind) = before.zip(behind).context("it is no text")?;
        Ok([before, &self.replacement, behind].concat())
    }
}

impl Place {
    /// The byte at which it stands.
    fn of(&self, source: &str) -> Option<usize> {
        let mut lines = source.split_inclusive('\n');
        let above = lines
            .by_ref()
            .take(self.line - 1)
            .map(str::len)
            .sum::<usize>();
        let in_line = lines.next()?.char_indices().map(|(at, _)| at);
        Some(above + in_line.take(self.column).last()?)
    }
}

/// All of them, or those that `more`, which is for cargo-mutants, chooses. What was noticed before, as the file in
/// `output` says, is not tried again.
pub(crate) fn run(workspace: &Workspace, sh: &Shell, output: &Path, more: &[String]) -> Result<()> {
    let config = "firmware/mutants.toml";
    let list = cmd!(
        sh,
        "cargo mutants --dir firmware --config {config} --list --json {more...}"
    );
    let mut mutants: Vec<Mutant> = serde_json::from_str(&list.read()?)?;
    // What both programs have is listed twice.
    let mut listed = BTreeSet::new();
    mutants.retain(|mutant| listed.insert(mutant.name.clone()));
    fs::create_dir_all(output)?;
    let noticed = output.join("noticed.txt");
    let before = fs::read_to_string(&noticed).unwrap_or_default();
    let mut noticed = fs::File::options()
        .create(true)
        .append(true)
        .open(noticed)?;
    let copy = output.join("copy");
    firmware::copy(workspace, &copy)?;
    let images = firmware::build_images(workspace, &copy)?;
    let tests = Tests::of(workspace, &images)?;
    let mut missed = Vec::new();
    for (number, mutant) in mutants.iter().enumerate() {
        if before.lines().any(|name| name == mutant.name) {
            continue;
        }
        firmware::copy(workspace, &copy)?;
        let file = copy.join("firmware").join(&mutant.file);
        let changed = mutant.of(&fs::read_to_string(&file)?);
        fs::write(&file, changed.with_context(|| mutant.name.clone())?)?;
        let of_self_test = OF_SELF_TEST.contains(&mutant.file.as_str());
        let only = if of_self_test { "self_test::" } else { "" };
        let says = if firmware::build_images(workspace, &copy).is_err() {
            "does not compile".to_owned()
        } else if let Some(test) = tests.first_to_fail(only)? {
            writeln!(noticed, "{}", mutant.name)?;
            format!("noticed by {test}")
        } else {
            missed.push(mutant.name.as_str());
            "NOT NOTICED".to_owned()
        };
        let (number, all) = (number + 1, mutants.len());
        println!("{number} of {all}: {}: {says}", mutant.name);
    }
    ensure!(missed.is_empty(), "not noticed:\n{}", missed.join("\n"));
    Ok(())
}

/// The firmware's tests but those of figures: each change changes how many bytes and cycles the firmware takes.
struct Tests {
    program: PathBuf,
    folder: PathBuf,
    images: PathBuf,
    /// The half of them that takes least, a quarter, and the rest.
    names: [Vec<String>; 3],
}

impl Tests {
    /// All have to pass, one after the other.
    fn of(workspace: &Workspace, images: &Path) -> Result<Self> {
        let mut tests = Self {
            program: test_program(workspace)?,
            folder: workspace.root.join("firmware/tests"),
            images: images.to_owned(),
            names: Default::default(),
        };
        let list = tests
            .command()
            .args(["--list", "--format=terse"])
            .output()?;
        let list = String::from_utf8(list.stdout)?;
        let all = list.lines().filter_map(|line| line.strip_suffix(": test"));
        let mut timed = Vec::new();
        for name in all.filter(|name| !name.starts_with("figures::")) {
            let began = Instant::now();
            let passes = first_failed(tests.command().args(["--exact", name]))?.is_none();
            ensure!(passes, "without any change {name} fails");
            timed.push((began.elapsed(), name.to_owned()));
        }
        timed.sort_unstable();
        let mut names = timed.into_iter().map(|(_, name)| name);
        let count = names.len();
        let parts = [count / 2, count / 4, count];
        tests.names = parts.map(|part| names.by_ref().take(part).collect());
        Ok(tests)
    }

    fn command(&self) -> Command {
        let mut command = Command::new(&self.program);
        command.current_dir(&self.folder);
        command.env("FRAMELOCK_IMAGES", &self.images);
        command
    }

    /// Of those whose names begin with `only`.
    fn first_to_fail(&self, only: &str) -> Result<Option<String>> {
        for names in &self.names {
            let names: Vec<_> = names.iter().filter(|name| name.starts_with(only)).collect();
            // Without a name all would run.
            if !names.is_empty() {
                let failed = first_failed(self.command().arg("--exact").args(names))?;
                if failed.is_some() {
                    return Ok(failed);
                }
            }
        }
        Ok(None)
    }
}

/// The first test that fails; the rest is not waited for.
fn first_failed(tests: &mut Command) -> Result<Option<String>> {
    let mut tests = tests.stdout(Stdio::piped()).stderr(Stdio::null()).spawn()?;
    for line in BufReader::new(tests.stdout.take().context("it is piped")?).lines() {
        let line = line?;
        let failed = line
            .strip_prefix("test ")
            .and_then(|line| line.strip_suffix(" ... FAILED"));
        if let Some(test) = failed {
            tests.kill()?;
            tests.wait()?;
            return Ok(Some(test.to_owned()));
        }
    }
    let status = tests.wait()?;
    // An overflowing stack, for one, ends all tests at once.
    Ok((!status.success()).then(|| status.to_string()))
}

/// The program of the firmware's tests.
fn test_program(workspace: &Workspace) -> Result<PathBuf> {
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
