//! Pages whose commands do what the page says.

use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

#[test]
#[cfg(unix)]
fn the_page_on_motion_software() {
    runs(include_str!("../../../../docs/motion-software.md"));
}

/// Its code is tested in `c/tests/pages.rs`.
#[test]
#[cfg(unix)]
fn from_the_lectures_code() {
    runs(include_str!("../../../../docs/from-the-lecture.md"));
}

/// The blocks of one language in a page, and the text that follows each directly.
pub(crate) fn blocks<'a>(page: &'a str, language: &str) -> Vec<(&'a str, Option<&'a str>)> {
    let fence = format!("\n```{language}\n");
    let parts = page.split(&fence).skip(1);
    let blocks = parts.map(|part| {
        let (block, behind) = part.split_once("\n```\n").unwrap();
        let output = behind.strip_prefix("```text\n");
        (
            block,
            output.map(|text| text.split_once("```\n").unwrap().0),
        )
    });
    blocks.collect()
}

/// Runs the commands of a page, one block after the other in one folder; each must write what the
/// page says. Gives the folder.
pub(crate) fn runs(page: &str) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_framelock")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let blocks = blocks(page, "sh");
    assert!(!blocks.is_empty());
    for (commands, expected) in blocks {
        let mut shell = Command::new("sh");
        shell.args(["-e", "-c", commands]);
        let output = shell.current_dir(&folder).env("PATH", &path).output();
        let output = output.unwrap();
        assert!(output.status.success(), "{commands}: {output:?}");
        let shown = String::from_utf8(output.stdout).unwrap();
        assert_eq!(shown, expected.unwrap_or_default(), "{commands}");
    }
    folder
}
