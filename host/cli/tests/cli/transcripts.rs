//! Runs the commands of pages and help texts in a shell. Compares the output with the guides and `tests/cases`.
//!
//! `SNAPSHOTS=overwrite cargo test -p framelock-host` writes the current output into the pages. In a page, `[..]`
//! stands for any part of a line. The pages in `tests/cases` have the format of the tool trycmd. The guides need a
//! shell for files and pipes, which trycmd does not provide.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::Command;

use framelock_limited::RunToEnd as _;
use snapbox::{Assert, Data};
use tempfile::TempDir;

/// The pages whose commands run in order and must print the output that the page shows.
const GUIDES: [&str; 4] = [
    "docs/protocol.md",
    "docs/motion-software.md",
    "docs/own-frame.md",
    "docs/recordings.md",
];

/// Commands that these tests do not run, in pages other than [`GUIDES`]: their first words, and the reason.
const NOT_RUN: [(&str, &str); 9] = [
    (
        "cargo",
        "builds, tests or measures: the stages of verify do",
    ),
    ("SNAPSHOTS=overwrite cargo", "changes the pages"),
    ("(cd firmware", "firmware/tests/examples.rs runs it"),
    ("printf", "firmware/tests/examples.rs runs it"),
    ("cd", "cargo follows"),
    ("git clone", "needs the network"),
    ("rustup", "changes the computer"),
    ("sha256sum", "needs a release"),
    ("chmod", "needs a release"),
];

/// Shell commands that run before each block. They send errors to standard output, leave standard input empty,
/// define `hex`, and replace the viewers `xxd` and `less` by `cat`.
const PRELUDE: &str = "exec 2>&1 < /dev/null
hex() { od -An -v -tx1 \"$@\" | xargs; }
xxd() { cat; }
less() { cat; }
";

/// The ports in examples. Tests replace these ports by a port that no computer has, so that no test moves a real board.
const PORTS: [&str; 4] = [
    "/dev/ttyACM0",
    "/dev/ttyUSB0",
    "COM3",
    "/dev/cu.usbmodem0010501234561",
];
const NO_PORT: &str = "no-such-port";

#[test]
fn guides_and_cases_show_what_their_commands_print() {
    let guides = GUIDES.map(|page| root().join(page));
    let cases = fs::read_dir(root().join("host/cli/tests/cases")).unwrap();
    let cases = cases.map(|entry| entry.unwrap().path());
    let mut commands = 0;
    for path in guides.into_iter().chain(cases) {
        let folder = Folder::new();
        let page = fs::read_to_string(&path).unwrap();
        let (printed, count) = folder.print(&page);
        compare(printed, &path, &comparison().action_env("SNAPSHOTS"));
        commands += count;
        if path.ends_with("own-frame.md") {
            // The first block of this page shows the bytes that the page's commands produce.
            let (_, block) = page.split_once("```text\n").unwrap();
            let (captured, _) = block.split_once("```").unwrap();
            let made = fs::read(folder.0.path().join("capture.bin")).unwrap();
            assert_eq!(
                framelock_description::hex::glued(&made),
                captured.replace([' ', '\n'], "")
            );
        }
    }
    assert!(commands >= 200, "{commands}");
}

fn comparison() -> Assert {
    // Do not replace backslashes in the output, because they do not separate parts of paths.
    Assert::new().normalize_paths(false)
}

/// Panics if the page differs from the page with the current output.
fn compare(printed: String, page: &Path, comparison: &Assert) {
    comparison.eq(printed, Data::read_from(page, None));
}

#[test]
fn a_page_that_shows_another_output_fails() {
    let folder = Folder::new();
    let path = folder.0.path().join("page.md");
    for (shown, is_right) in [
        ("one\ntwo", true),
        ("one\n[..]", true),
        ("one", false),
        ("one\nthree", false),
        ("one\ntwo\nthree", false),
    ] {
        let page = format!("```sh\nprintf 'one\\ntwo\\n'\n```\n```text\n{shown}\n```\n");
        fs::write(&path, &page).unwrap();
        let (printed, _) = folder.print(&page);
        let compared = catch_unwind(AssertUnwindSafe(|| compare(printed, &path, &comparison())));
        assert_eq!(compared.is_ok(), is_right, "{page}");
    }
}

#[test]
fn examples_in_help_texts_and_in_other_pages_run() {
    let help = files("host/cli/src/help", "txt");
    let pages = ["README.md", "firmware/README.md"].map(|page| root().join(page));
    let docs = files("docs", "md").into_iter();
    let docs = docs.filter(|path| !GUIDES.iter().any(|guide| path.ends_with(guide)));
    let mut examples = 0;
    for path in help.into_iter().chain(docs).chain(pages) {
        let text = fs::read_to_string(&path).unwrap();
        let is_help = path.extension().is_some_and(|extension| extension == "txt");
        let commands = if is_help {
            of_help(&text)
        } else {
            of_page(&text)
        };
        let folder = Folder::with_files();
        for command in commands {
            let (printed, code) = folder.run(&command);
            if command.contains(NO_PORT) {
                assert!(printed.contains(NO_PORT), "{command}: {printed}");
            }
            // The options must be valid, even if a port or a terminal is missing.
            assert!(!printed.contains("error: "), "{command}: {printed}");
            let fails = command.contains(NO_PORT);
            assert_eq!(code, if fails { 2 } else { 0 }, "{command}: {printed}");
            examples += 1;
        }
    }
    assert!(examples >= 55, "{examples}");
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).unwrap();
    let files = entries.map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.extension().is_some_and(|own| own == extension))
        .collect()
}

/// Returns the examples of a help text. An example is two blanks, a command, and two or more blanks before its comment.
fn of_help(help: &str) -> Vec<String> {
    let examples = help.strip_prefix("Examples:\n").unwrap_or_default();
    let lines = examples.lines().take_while(|line| !line.is_empty());
    let lines = lines.filter_map(|line| {
        line.strip_prefix("  ")
            .filter(|line| !line.starts_with(' '))
    });
    lines
        .map(|line| runnable(line.split("  ").next().unwrap()))
        .collect()
}

/// Returns the `framelock` commands in a page's blocks. Every other line of a `sh` block must be in [`NOT_RUN`].
fn of_page(page: &str) -> Vec<String> {
    let mut commands = Vec::new();
    let mut block = None;
    for line in page.replace("\\\n", "").lines().map(str::trim) {
        match (line.strip_prefix("```"), block) {
            (Some(_), Some(_)) => block = None,
            (Some(language), None) => block = Some(language == "sh"),
            (None, Some(is_shell)) => {
                let line = line.split(" #").next().unwrap();
                let line = line.replace("cargo run --release -- ", "framelock ");
                if line.starts_with("framelock ") {
                    commands.push(runnable(&line));
                } else if is_shell {
                    let why = NOT_RUN.iter().find(|(first, _)| line.starts_with(first));
                    assert!(why.is_some() || line.is_empty(), "is this run? {line}");
                }
            }
            _ => {}
        }
    }
    commands
}

/// Rewrites an example so that it runs on any computer, in a short time.
fn runnable(example: &str) -> String {
    let mut command = PORTS.iter().fold(example.to_owned(), |command, port| {
        command.replace(port, NO_PORT)
    });
    // Waiting for the missing port would never end.
    command = command.replace(" --wait", "");
    // Otherwise this motion would never end.
    command = command.replace("send - ", "send - --seconds 0.1 ");
    if command.contains("framelock simulate") {
        let mut words: Vec<&str> = command.split_whitespace().collect();
        let is_count = |word: &&str| ["--trials", "--frames"].contains(word);
        while let Some(at) = words.iter().position(is_count) {
            words.drain(at..at + 2);
        }
        command = words.join(" ") + " --trials 2 --frames 2";
    }
    command
}

/// A folder in which commands run.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// Makes a folder with the files that examples read.
    fn with_files() -> Self {
        let folder = Self::new();
        let motor = "printf 'sync = \"AA 55\"\\nlength = 3\\nfields = []' > motor.toml";
        let recordings = "printf 'AB\\000\\177\\310J\\r' | tee capture.bin a.bin | hex > log.txt";
        let moves = "echo 127,200,74 > moves.csv";
        let channels = "framelock encode --frame ibus | framelock decode --frame ibus --format csv > channels.csv";
        for command in [motor, recordings, moves, channels] {
            let (printed, code) = folder.run(command);
            assert_eq!(code, 0, "{command}: {printed}");
        }
        folder
    }

    /// Runs commands. Returns their output, including errors, and the exit code.
    fn run(&self, commands: &str) -> (String, i32) {
        let program = Path::new(env!("CARGO_BIN_EXE_framelock")).parent().unwrap();
        let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
        let mut shell = Command::new("sh");
        shell.args(["-e", "-c", &format!("{PRELUDE}{commands}")]);
        let output = shell
            .current_dir(&self.0)
            .env("PATH", path)
            .run_to_end(b"")
            .unwrap();
        (
            String::from_utf8_lossy(&output.stdout).into_owned(),
            output.status.code().unwrap(),
        )
    }

    /// Returns the text that a page shows for commands: their output, preceded by the exit code if it is not 0.
    fn shown(&self, commands: &str) -> String {
        match self.run(commands) {
            (printed, 0) => printed,
            (printed, code) => format!("? {code}\n{printed}"),
        }
    }

    /// Returns the page with the current output of its commands, and the number of blocks and commands.
    ///
    /// A `sh` block runs as a whole. If a `text` block follows directly, it contains the output of the `sh` block. In a
    /// `console` block, a command follows each `$`, continues after `>`, and is followed by its output.
    fn print(&self, page: &str) -> (String, usize) {
        let mut lines = page.lines().peekable();
        let (mut printed, mut count) = (Vec::new(), 0);
        while let Some(line) = lines.next() {
            printed.push(line.to_owned());
            if !["```sh", "```console"].contains(&line) {
                continue;
            }
            let block = lines.by_ref().take_while(|line| *line != "```");
            let block: Vec<&str> = block.collect();
            if line == "```sh" {
                count += 1;
                let commands = block.join("\n");
                let shown = self.shown(&commands);
                printed.extend([commands, "```".to_owned()]);
                if lines.next_if_eq(&"```text").is_some() {
                    lines.by_ref().find(|line| *line == "```");
                }
                if !shown.is_empty() {
                    printed.extend(["```text".to_owned(), shown + "```"]);
                }
                continue;
            }
            let mut block = block.into_iter().peekable();
            while let Some(line) = block.next() {
                let Some(first) = line.strip_prefix("$ ") else {
                    continue;
                };
                count += 1;
                printed.push(line.to_owned());
                let mut command = first.to_owned();
                while let Some(more) = block.next_if(|line| line.starts_with("> ")) {
                    printed.push(more.to_owned());
                    command += &more.replacen("> ", "\n", 1);
                }
                printed.extend(self.shown(&command).lines().map(str::to_owned));
            }
            printed.push("```".to_owned());
        }
        (printed.join("\n") + "\n", count)
    }
}
