//! `cargo xtask board`: examines the report of the self-test on a board.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context as _, Result};

use crate::workspace::Workspace;

/// The report's first line and last line.
const FIRST: &str = "--- framelock board report ---";
const LAST: &str = "--- end ---";

/// List the lines of a board's report that are not fine, are missing, or differ from the emulator's in docs/board.md
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The file with the report, which may have other lines before and after it
    file: PathBuf,
}

/// Prints the differences. Returns true if each line is there and none is marked as not fine.
pub(crate) fn board(workspace: &Workspace, Arguments { file }: &Arguments) -> Result<bool> {
    let guide = fs::read_to_string(workspace.root.join("docs/board.md"))?;
    let report = fs::read_to_string(file)?;
    let differences = differences(&report, &guide)?;
    for (kind, line) in &differences {
        println!("{kind}: {line}");
    }
    Ok(differences.iter().all(|(kind, _)| *kind == DIFFERENT))
}

const NOT_FINE: &str = "not fine";
const MISSING: &str = "missing";
const DIFFERENT: &str = "different";

/// Returns each line of the report that is not fine or differs from the emulator's line, and each line that the report
/// lacks.
fn differences<'a>(report: &'a str, emulators: &'a str) -> Result<Vec<(&'static str, &'a str)>> {
    let report = lines(report)?;
    let differences = lines(emulators)?.into_iter().filter_map(|expected| {
        let begins_alike = |line: &&&str| key(line) == key(expected);
        match report.iter().find(begins_alike) {
            None => Some((MISSING, expected)),
            Some(line) if line.ends_with("NOT FINE") => Some((NOT_FINE, *line)),
            Some(line) => (*line != expected).then_some((DIFFERENT, *line)),
        }
    });
    Ok(differences.collect())
}

/// Returns the lines of the report in a text, without the prefixes and the locations of probe-rs's log.
fn lines(text: &str) -> Result<Vec<&str>> {
    let mut lines = text.lines().skip_while(|line| !line.contains(FIRST));
    let first = lines
        .next()
        .with_context(|| format!("there is no line {FIRST}"))?;
    let prefix = first.find(FIRST).unwrap_or(0);
    let lines = lines.filter_map(|line| line.get(prefix..)?.split(" (self_test").next());
    let mut lines: Vec<&str> = lines.map(str::trim_end).collect();
    // If the last line is missing, the report was cut off. Its other lines are still useful.
    if let Some(last) = lines.iter().position(|line| *line == LAST) {
        lines.truncate(last + 1);
    }
    Ok(lines)
}

/// Returns the beginning of a line, which distinguishes the line from all others.
fn key(line: &str) -> &str {
    let end = [" | ", ": ", " "].iter().find_map(|end| line.find(end));
    end.map_or(line, |end| &line[..end])
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::indexing_slicing, reason = "tests")]

    use super::*;

    /// The guide, which contains the emulator's report. A test of the firmware compares this report with the emulator.
    const GUIDE: &str = include_str!("../../../docs/board.md");

    /// Returns the report as probe-rs shows it, in which `new` replaces `text`.
    fn pasted(text: &str, new: &str) -> String {
        let report = lines(GUIDE)
            .unwrap()
            .join(" (self_test src/self-test.rs:1)\n[INFO ] ");
        let report = format!("Finished\n[INFO ] {FIRST}\n[INFO ] {report}\n```\n9 cycles");
        assert_eq!(report.matches(text).count(), 1, "{text}");
        report.replace(text, new)
    }

    #[test]
    fn the_emulators_report_is_fine() {
        let end = pasted(LAST, LAST);
        assert_eq!(differences(&end, GUIDE).unwrap(), []);
        assert!(differences("no report", GUIDE).is_err());
    }

    #[test]
    fn each_line_with_another_number_and_each_missing_line_is_listed() {
        for (text, new, kind, found) in [
            (
                "16 shown, 0 stored",
                "15 shown, 0 stored",
                DIFFERENT,
                "15 shown, 0 stored | fine",
            ),
            ("AAF0", "AAC0", DIFFERENT, "AAC0"),
            ("frames 80", "frames 79", DIFFERENT, "frames 79"),
            (
                "oldest lost 0 times | fine",
                "oldest lost 0 times | NOT FINE",
                NOT_FINE,
                "5 of 16",
            ),
            ("9 cycles of the parser for a byte", "", MISSING, "9 cycles"),
            (LAST, "", MISSING, LAST),
        ] {
            let report = pasted(text, new);
            let differences = differences(&report, GUIDE).unwrap();
            assert_eq!(differences.len(), 1, "{text}: {differences:?}");
            assert_eq!(differences[0].0, kind, "{text}");
            assert!(differences[0].1.contains(found), "{text}: {differences:?}");
        }
    }

    #[test]
    fn the_issue_template_asks_for_the_report() {
        let template = include_str!("../../../.github/ISSUE_TEMPLATE/board.yml");
        assert!(template.contains(FIRST) && template.contains(LAST));
        assert!(template.contains("cargo run --release --bin self-test"));
    }
}
