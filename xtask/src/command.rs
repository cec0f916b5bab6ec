//! Running other programs: shown before they run, their output passed on, their failure told
//! in full.

use std::ffi::OsStr;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::time::Duration;

use anyhow::{Context, Result, bail};
use wait_timeout::ChildExt;

use crate::workspace::Workspace;

/// The cargo that runs this program, in the workspace's root.
pub(crate) fn cargo(workspace: &Workspace) -> Command {
    cargo_in(&workspace.root)
}

/// The cargo that runs this program, in the given folder.
pub(crate) fn cargo_in(folder: &Path) -> Command {
    // `cargo xtask` says in CARGO which cargo it is, so that all stages use the same.
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.current_dir(folder);
    command
}

/// Runs it with its output passed on. Anything but success is an error.
pub(crate) fn run(command: &mut Command) -> Result<()> {
    announce(command);
    let status = command.status().with_context(|| cannot_start(command))?;
    expect_success(command, status)
}

/// As [`run`], but nothing is shown unless it fails: then all that it wrote is in the error.
pub(crate) fn run_quietly(command: &mut Command) -> Result<()> {
    let output = command.output().with_context(|| cannot_start(command))?;
    if !output.status.success() {
        bail!(
            "`{}` ended with {}:\n{}{}",
            describe(command),
            output.status,
            String::from_utf8_lossy(&output.stdout),
            String::from_utf8_lossy(&output.stderr).trim_end()
        );
    }
    Ok(())
}

/// As [`run`], but ends it after `limit`.
pub(crate) fn run_within(limit: Duration, command: &mut Command) -> Result<()> {
    announce(command);
    match status_within(limit, command)? {
        Some(status) => expect_success(command, status),
        None => bail!(
            "`{}` was not done after {} s and was ended",
            describe(command),
            limit.as_secs()
        ),
    }
}

/// Runs it without a word and returns how it ended; `None` if it was not done within `limit` and
/// was ended.
pub(crate) fn status_within(limit: Duration, command: &mut Command) -> Result<Option<ExitStatus>> {
    let mut child = command.spawn().with_context(|| cannot_start(command))?;
    let status = child.wait_timeout(limit)?;
    if status.is_none() {
        child.kill()?;
        child.wait()?;
    }
    Ok(status)
}

/// As [`run`], and shows each line of standard output to `see` as well.
pub(crate) fn run_and_read(command: &mut Command, mut see: impl FnMut(&str)) -> Result<()> {
    announce(command);
    let mut child = command
        .stdout(Stdio::piped())
        .spawn()
        .with_context(|| cannot_start(command))?;
    if let Some(output) = child.stdout.take() {
        let mut reader = BufReader::new(output);
        let mut line = Vec::new();
        while reader.read_until(b'\n', &mut line)? > 0 {
            let text = String::from_utf8_lossy(&line);
            print!("{text}");
            see(text.trim_end());
            line.clear();
        }
    }
    let status = child.wait()?;
    expect_success(command, status)
}

/// What it writes to standard output, without the space at the end. Not shown.
pub(crate) fn output(command: &mut Command) -> Result<String> {
    let output = command.output().with_context(|| cannot_start(command))?;
    if !output.status.success() {
        bail!(
            "`{}` ended with {}: {}",
            describe(command),
            output.status,
            String::from_utf8_lossy(&output.stderr).trim_end()
        );
    }
    Ok(String::from_utf8_lossy(&output.stdout)
        .trim_end()
        .to_owned())
}

/// Name and version out of what a program answers to `--version`: its first two words.
pub(crate) fn version(command: &mut Command) -> Result<String> {
    let answer = output(command.arg("--version"))?;
    Ok(first_two_words(&answer))
}

fn first_two_words(answer: &str) -> String {
    answer
        .split_whitespace()
        .take(2)
        .collect::<Vec<_>>()
        .join(" ")
}

/// Shows the command as one would type it.
pub(crate) fn announce(command: &Command) {
    // Standard output is for what was asked for: `emulate --format json`.
    eprintln!("$ {}", describe(command));
}

fn expect_success(command: &Command, status: ExitStatus) -> Result<()> {
    if !status.success() {
        bail!("`{}` ended with {status}", describe(command));
    }
    Ok(())
}

/// Says that it did not even start.
pub(crate) fn cannot_start(command: &Command) -> String {
    format!("`{}` could not be started", describe(command))
}

/// The command as one would type it: the variables it sets, the program without its folder,
/// the arguments.
fn describe(command: &Command) -> String {
    let set = command
        .get_envs()
        .filter_map(|(name, value)| Some((name, value?)));
    let variables = set.map(|(name, value)| {
        format!(
            "{}={}",
            name.to_string_lossy(),
            quoted(&value.to_string_lossy())
        )
    });
    let program = Path::new(command.get_program());
    let program = program.file_name().unwrap_or(program.as_os_str());
    let words = std::iter::once(program)
        .chain(command.get_args())
        .map(OsStr::to_string_lossy)
        .map(|word| quoted(&word));
    variables.chain(words).collect::<Vec<_>>().join(" ")
}

/// In quotes where a shell would otherwise see more than one word.
fn quoted(word: &str) -> String {
    if word.is_empty() || word.contains(char::is_whitespace) {
        format!("'{word}'")
    } else {
        word.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_shown_as_one_would_type_it() {
        let mut command = Command::new("/some/where/cargo");
        command
            .args(["doc", "two words"])
            .env("RUSTDOCFLAGS", "-Dwarnings")
            .env_remove("UNWANTED");
        assert_eq!(
            describe(&command),
            "RUSTDOCFLAGS=-Dwarnings cargo doc 'two words'"
        );
    }

    #[test]
    fn the_version_is_the_first_two_words() {
        assert_eq!(
            first_two_words("cargo 1.95.0 (f2d3ce0bd 2026-03-21)\n"),
            "cargo 1.95.0"
        );
    }

    #[test]
    fn a_failure_tells_the_command_and_its_exit_code() {
        let error = run(Command::new("sh").args(["-c", "exit 7"])).expect_err("it exits with 7");
        assert_eq!(
            error.to_string(),
            "`sh -c 'exit 7'` ended with exit status: 7"
        );
    }

    #[test]
    fn a_program_that_does_not_exist_is_named() {
        let error = run(&mut Command::new("no-such-program")).expect_err("there is none");
        assert!(
            error
                .to_string()
                .contains("`no-such-program` could not be started")
        );
    }

    #[test]
    fn what_takes_too_long_is_ended() {
        let error = run_within(Duration::from_millis(50), Command::new("sleep").arg("60"))
            .expect_err("it sleeps for longer");
        assert!(error.to_string().contains("was ended"));
    }

    #[test]
    fn each_line_is_shown_to_the_reader() {
        let mut lines = Vec::new();
        run_and_read(Command::new("printf").arg("one\ntwo"), |line| {
            lines.push(line.to_owned());
        })
        .expect("printf succeeds");
        assert_eq!(lines, ["one", "two"]);
    }
}
