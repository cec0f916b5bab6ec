//! Tests of the guides (links, and tables of measured figures) and of the archives for C and Arduino.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::workspace::{Workspace, files};

/// Returns the targets of `[text](target)` and of `[text]: target`, without fragments.
pub(crate) fn links(text: &str) -> impl Iterator<Item = &str> {
    let inline = text.split("](").skip(1);
    let inline = inline.filter_map(|rest| rest.split([')', ' ', '\n']).next());
    let named = text.lines().filter_map(|line| line.strip_prefix('['));
    let named = named.filter_map(|line| line.split_once("]: ")?.1.split(' ').next());
    let all = inline.chain(named);
    all.filter_map(|link| link.split('#').next())
}

#[test]
fn every_relative_link_leads_to_a_file() {
    let root = Workspace::load().expect("cargo knows this workspace").root;
    let mut broken = Vec::new();
    for entry in fs::read_dir(&root).expect("a folder").flatten() {
        let name = entry.file_name().into_string().expect("a plain name");
        if name.starts_with('.') || name == "target" {
            continue;
        }
        for file in files(&entry.path()).expect("readable folders") {
            if file.extension().is_none_or(|extension| extension != "md") {
                continue;
            }
            let text = fs::read_to_string(&file).expect("text");
            let folder = file.parent().expect("a file is in a folder");
            let relative = links(&text).filter(|link| !link.contains(':'));
            let missing = relative.filter(|link| !folder.join(link).exists());
            broken.extend(missing.map(|link| format!("{}: {link}", file.display())));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Replaces the rows of each table that follows a line such as `<!-- figures: NAME -->` with the rows of this name in
/// the figures. A line of the figures has the name and the cells, separated by tabs.
fn with_figures(page: &str, figures: &str) -> String {
    let mut text = Vec::new();
    let (mut name, mut is_replaced) = (None, false);
    for line in page.lines() {
        is_replaced &= line.starts_with('|');
        if is_replaced {
            continue;
        }
        text.push(line.to_owned());
        let begins = line.strip_prefix("<!-- figures: ");
        name = begins.and_then(|rest| rest.strip_suffix(" -->")).or(name);
        if line.starts_with("| ---")
            && let Some(name) = name.take()
        {
            let rows = figures.lines().filter_map(|row| row.split_once('\t'));
            let rows = rows.filter(|(table, _)| *table == name);
            let rows: Vec<String> = rows.map(|(_, cells)| cells.replace('\t', " | ")).collect();
            assert!(!rows.is_empty(), "there are no figures of {name}");
            text.push(format!("| {} |", rows.join(" |\n| ")));
            is_replaced = true;
        }
    }
    text.join("\n") + "\n"
}

/// Write the tables with `SNAPSHOTS=overwrite cargo test -p xtask figures`.
#[test]
fn the_tables_of_figures_are_those_that_were_measured() {
    let root = Workspace::load().expect("cargo knows this workspace").root;
    let text = |file: &Path| fs::read_to_string(file).expect("text");
    let figures = text(&root.join("formats/benches/rivals/figures.tsv"));
    let page = root.join("docs/rivals.md");
    let (written, expected) = (text(&page), with_figures(&text(&page), &figures));
    if std::env::var("SNAPSHOTS").is_ok_and(|value| value == "overwrite") {
        fs::write(&page, &expected).expect("written");
    } else {
        assert!(
            written == expected,
            "docs/rivals.md differs from the figures"
        );
    }
}

#[test]
fn a_table_gets_the_rows_of_its_name() {
    let page = "<!-- figures: a -->\n| x | y |\n| --- | --- |\n| old | row |\n\nText\n\n| z |\n| --- |\n| kept |\n";
    let made = with_figures(page, "a\t1\t2\nb\t3\na\t4\t\n");
    let expected = page.replace("| old | row |", "| 1 | 2 |\n| 4 |  |");
    assert_eq!(made, expected);
}

#[test]
fn the_archives_for_c_and_arduino_contain_every_header() {
    let workspace = Workspace::load().expect("cargo knows this workspace");
    let output = workspace.script(&["archives"]).output().expect("sh");
    assert!(output.status.success(), "{output:?}");
    let headers = files(&workspace.root.join("c/headers")).expect("readable folders");
    let unpacked = workspace.target.join("archives/unpacked");
    for (archive, folder, also) in [
        ("framelock-c.zip", "headers", "CMakeLists.txt"),
        (
            "framelock-arduino.zip",
            "framelock/src",
            "framelock/library.properties",
        ),
    ] {
        let mut unzip = Command::new("python3");
        unzip.args(["-m", "zipfile", "-e"]);
        unzip.arg(workspace.target.join("archives").join(archive));
        assert!(unzip.arg(&unpacked).status().expect("python3").success());
        assert!(unpacked.join(also).is_file(), "{archive} has no {also}");
        for header in &headers {
            let name = header.file_name().expect("a file has a name");
            let copy = fs::read(unpacked.join(folder).join(name)).expect("in the archive");
            assert!(
                copy == fs::read(header).expect("readable"),
                "{archive}: {name:?}"
            );
        }
    }
}
