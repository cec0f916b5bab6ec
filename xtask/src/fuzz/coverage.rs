//! Which regions of the core the committed corpora reach, and why the others are not.

use std::collections::BTreeMap;
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, bail};
use comfy_table::Table;
use serde::Deserialize;

use super::replay;
use super::session::files;
use crate::command::{cargo, output, run, run_quietly};
use crate::table::with_header;
use crate::workspace::Workspace;

const GAPS: &str = "fuzz/coverage-gaps.toml";
const SOURCES: &str = "core/src";

/// Replays the committed corpora on a build that counts. Not the firmware's: it is not this
/// machine's code, so there are no counters in it.
///
/// # Errors
/// If a region of the core is not reached and the list does not say why, or the list explains what
/// is reached.
pub(crate) fn coverage(workspace: &Workspace) -> Result<()> {
    let folder = workspace.target_directory.join("fuzz-coverage");
    let answer = regions_counted(workspace, &folder)?;
    let mut regions = Region::all(&answer)?;
    let text = fs::read_to_string(workspace.root.join(GAPS)).context(GAPS)?;
    let Gaps { gap: gaps } = toml::from_str(&text).context(GAPS)?;

    let mut problems = Vec::new();
    for gap in &gaps {
        let lines = gap.lines(&workspace.root)?;
        let mut there = regions
            .iter_mut()
            .filter(|region| region.file == gap.file && lines.contains(&region.line))
            .peekable();
        // The compiler does not always list what nobody calls.
        let is_listed = there.peek().is_some();
        let mut explains = false;
        for region in there.filter(|region| region.count == 0) {
            region.explained = true;
            explains = true;
        }
        if is_listed && !explains {
            problems.push(format!(
                "{GAPS}: reached, delete it: {}: {}",
                gap.file, gap.line
            ));
        }
    }
    let missed = regions.iter().filter(|region| region.is_unexplained());
    problems.extend(missed.map(|region| format!("not reached: {region}")));
    println!("\n{}", table(&regions));
    println!("Line by line: {}", folder.join("lines.txt").display());
    if !problems.is_empty() {
        bail!("{}", problems.join("\n"));
    }
    Ok(())
}

/// What LLVM says of the replay, as JSON.
fn regions_counted(workspace: &Workspace, folder: &Path) -> Result<String> {
    let profiles = folder.join("profiles");
    if profiles.exists() {
        fs::remove_dir_all(&profiles)?;
    }
    let tools = llvm_tools()?;
    let mut replay = cargo(workspace);
    replay
        .args(["test", "--package", replay::PACKAGE, "--test", "replay"])
        .arg("--target-dir")
        .arg(folder)
        .env("RUSTFLAGS", "-Cinstrument-coverage")
        .env("LLVM_PROFILE_FILE", profiles.join("%p-%m.profraw"));
    run(&mut replay)?;
    let answer = output(replay.args(["--no-run", "--message-format=json"]))?;
    let program = executable(&answer).context("cargo does not say what it has built")?;

    let merged = folder.join("all.profdata");
    let mut merge = Command::new(tools.join("llvm-profdata"));
    merge.args(["merge", "--sparse", "--output"]).arg(&merged);
    run_quietly(merge.args(files(&profiles)?))?;
    let ask = |what: &str| {
        let mut command = Command::new(tools.join("llvm-cov"));
        command
            .arg(what)
            .arg(&program)
            .arg(format!("--instr-profile={}", merged.display()))
            .arg(workspace.root.join(SOURCES));
        output(&mut command)
    };
    fs::write(folder.join("lines.txt"), ask("show")?)?;
    ask("export")
}

/// A piece of the source that runs as a whole or not at all.
#[derive(PartialEq, Eq, Debug)]
struct Region {
    /// From the project's root.
    file: String,
    line: usize,
    column: usize,
    /// How often it ran, in all instances of a generic function.
    count: usize,
    explained: bool,
}

impl Region {
    /// All of the core, from what `llvm-cov export` says.
    fn all(answer: &str) -> Result<Vec<Self>> {
        let Export { data } = serde_json::from_str(answer).context("llvm-cov export")?;
        let mut counts = BTreeMap::<(String, [usize; 4]), usize>::new();
        for function in data.into_iter().flat_map(|data| data.functions) {
            for [line, column, last_line, last_column, count, file, _, kind] in function.regions {
                let file = function.filenames.get(file);
                let inside = file.and_then(|file| file.split_once(SOURCES));
                let (Some((_, name)), 0) = (inside, kind) else {
                    continue;
                };
                let place = [line, column, last_line, last_column];
                let most = counts
                    .entry((format!("{SOURCES}{name}"), place))
                    .or_default();
                *most = count.max(*most);
            }
        }
        let regions = counts.into_iter();
        Ok(regions
            .map(|((file, [line, column, ..]), count)| Self {
                file,
                line,
                column,
                count,
                explained: false,
            })
            .collect())
    }

    fn is_unexplained(&self) -> bool {
        self.count == 0 && !self.explained
    }
}

impl fmt::Display for Region {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}:{}", self.file, self.line, self.column)
    }
}

#[derive(Deserialize)]
struct Export {
    data: Vec<Data>,
}

#[derive(Deserialize)]
struct Data {
    functions: Vec<Function>,
}

#[derive(Deserialize)]
struct Function {
    filenames: Vec<String>,
    /// First line and column, last line and column, count, file, and two more, the latter of which
    /// is 0 for code.
    regions: Vec<[usize; 8]>,
}

#[derive(Deserialize)]
struct Gaps {
    gap: Vec<Gap>,
}

/// What the corpora cannot or need not reach.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Gap {
    file: String,
    /// The text of the line, which stands once in the file. One that opens a block stands for all
    /// of the block.
    line: String,
    /// Why.
    #[expect(dead_code, reason = "for the reader of the list; it must be there")]
    reason: String,
}

impl Gap {
    /// The lines it stands for, counted from 1.
    fn lines(&self, root: &Path) -> Result<std::ops::RangeInclusive<usize>> {
        let text = fs::read_to_string(root.join(&self.file)).context(GAPS)?;
        self.lines_of(&text)
            .with_context(|| format!("{GAPS}: not once in {}: {}", self.file, self.line))
    }

    fn lines_of(&self, text: &str) -> Option<std::ops::RangeInclusive<usize>> {
        let mut lines = text.lines().enumerate();
        let (first, line) = lines.find(|(_, line)| line.trim() == self.line)?;
        let indented = line.len() - line.trim_start().len();
        let closing = format!("{:indented$}}}", "");
        let last = if self.line.ends_with('{') {
            lines.find(|(_, line)| **line == closing)?.0
        } else {
            first
        };
        let again = lines.any(|(_, line)| line.trim() == self.line);
        (!again).then_some(first + 1..=last + 1)
    }
}

fn table(regions: &[Region]) -> Table {
    let mut files = BTreeMap::<&str, [usize; 4]>::new();
    for region in regions {
        let [all, reached, explained, missed] = files.entry(&region.file).or_default();
        *all += 1;
        *reached += usize::from(region.count > 0);
        *explained += usize::from(region.explained);
        *missed += usize::from(region.is_unexplained());
    }
    let mut table = with_header(["source", "regions", "reached", "explained", "missed"]);
    for (file, counts) in files {
        let counts = counts.map(|count| count.to_string());
        table.add_row([file.to_owned()].into_iter().chain(counts));
    }
    table
}

/// The program of the tests, out of what cargo says about its build.
fn executable(answer: &str) -> Option<PathBuf> {
    let messages = answer
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok());
    let mut programs =
        messages.filter_map(|message| message.get("executable")?.as_str().map(PathBuf::from));
    programs.next_back()
}

/// LLVM's tools of the compiler that runs this: no others read what it writes.
fn llvm_tools() -> Result<PathBuf> {
    let libraries = output(Command::new("rustc").args(["--print", "target-libdir"]))?;
    let folder = Path::new(&libraries)
        .parent()
        .context("the compiler has libraries")?
        .join("bin");
    if !folder.join("llvm-cov").exists() {
        run(Command::new("rustup").args(["component", "add", "llvm-tools"]))
            .context("coverage needs LLVM's tools: rustup component add llvm-tools")?;
    }
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_program_is_found_in_what_cargo_says() {
        let answer = r#"{"reason": "compiler-artifact", "executable": null}
{"reason": "compiler-artifact", "executable": "/t/replay-1"}
{"reason": "build-finished"}"#;
        assert_eq!(executable(answer), Some("/t/replay-1".into()));
    }

    #[test]
    fn a_region_is_reached_if_any_instance_of_its_function_is() {
        let answer = r#"{"data": [{"functions": [
            {"filenames": ["/f/core/src/scan.rs"], "regions": [[3, 5, 3, 9, 0, 0, 0, 0]]},
            {"filenames": ["/f/core/src/scan.rs"], "regions": [[3, 5, 3, 9, 2, 0, 0, 0], [4, 1, 4, 2, 0, 0, 0, 0]]},
            {"filenames": ["/f/host/src/main.rs"], "regions": [[3, 5, 3, 9, 0, 0, 0, 0]]}]}]}"#;
        let regions = Region::all(answer).expect("as llvm-cov writes it");
        let found: Vec<_> = regions
            .iter()
            .map(|region| (region.to_string(), region.count))
            .collect();
        assert_eq!(
            found,
            [
                ("core/src/scan.rs:3:5".to_owned(), 2),
                ("core/src/scan.rs:4:1".to_owned(), 0)
            ]
        );
    }

    fn lines(line: &str, text: &str) -> Option<std::ops::RangeInclusive<usize>> {
        let gap = Gap {
            file: String::new(),
            line: line.to_owned(),
            reason: String::new(),
        };
        gap.lines_of(text)
    }

    #[test]
    fn a_gap_is_a_line_or_the_block_that_it_opens() {
        let text = "fn a() {\n    if b {\n        c?;\n    }\n}\nfn d() {\n    c;\n}\n";
        assert_eq!(lines("c?;", text), Some(3..=3));
        assert_eq!(lines("if b {", text), Some(2..=4));
        assert_eq!(lines("fn a() {", text), Some(1..=5));
        assert_eq!(lines("}", text), None, "it is not one line");
        assert_eq!(lines("e", text), None);
    }
}
