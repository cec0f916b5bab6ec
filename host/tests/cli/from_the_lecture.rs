//! The commands in `docs/from-the-lecture.md` show what it says; its code is tested in `c/tests/pages.rs`.

use std::path::Path;
use std::process::Command;

const PAGE: &str = include_str!("../../../docs/from-the-lecture.md");

#[test]
#[cfg(unix)]
fn the_commands_show_what_the_page_says() {
    let program = Path::new(env!("CARGO_BIN_EXE_framelock")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let blocks: Vec<&str> = PAGE.split("\n```sh\n").skip(1).collect();
    assert_eq!(blocks.len(), 2);
    for block in blocks {
        let (command, behind) = block.split_once("```\n```text\n").unwrap();
        let (expected, _) = behind.split_once("```\n").unwrap();
        let mut shell = Command::new("sh");
        let output = shell.args(["-c", command]).env("PATH", &path).output();
        let shown = String::from_utf8(output.unwrap().stdout).unwrap();
        assert_eq!(shown, expected, "{command}");
    }
}
