//! The table of theorems in `proofs/README.md`: every link of it leads somewhere.

use std::collections::BTreeSet;
use std::fs;

use anyhow::{Context as _, Result, ensure};

use super::harness::Harness;
use crate::workspace::Workspace;

const TABLE: &str = "proofs/README.md";
const CLAUSES: &str = "docs/protocol.md";
const TESTS: &str = "core/tests";
const FUZZ_TARGETS: &str = "fuzz/fuzz_targets";

/// Fails if the table names a clause, harness, test or fuzz target that does not exist, if a theorem has
/// no harness or no test, or if a harness proves a theorem that the table does not have.
pub(crate) fn check(workspace: &Workspace, harnesses: &[Harness]) -> Result<()> {
    let read =
        |path: &str| fs::read_to_string(workspace.root.join(path)).with_context(|| path.to_owned());
    let dead = dead_links(
        &read(TABLE)?,
        &read(CLAUSES)?,
        harnesses,
        |file| read(&format!("{TESTS}/{file}")).ok(),
        |target| read(&format!("{FUZZ_TARGETS}/{target}.rs")).is_ok(),
    );
    ensure!(dead.is_empty(), "{TABLE}: {}", dead.join("; "));
    Ok(())
}

fn dead_links(
    table: &str,
    clauses: &str,
    harnesses: &[Harness],
    test_file: impl Fn(&str) -> Option<String>,
    is_fuzz_target: impl Fn(&str) -> bool,
) -> Vec<String> {
    let mut dead = Vec::new();
    let mut listed = BTreeSet::new();
    for row in table.lines().filter(|line| line.starts_with("| ")) {
        let cells: Vec<&str> = row.split('|').map(str::trim).collect();
        let [
            _,
            theorem,
            _,
            of_clauses,
            of_harnesses,
            of_tests,
            of_targets,
            ..,
        ] = cells.as_slice()
        else {
            continue;
        };
        if !theorem.starts_with(|first: char| first.is_ascii_digit()) {
            continue;
        }
        listed.insert(*theorem);
        for clause in of_clauses.split(", ") {
            if !clauses.contains(&format!("**{clause}.**")) {
                dead.push(format!(
                    "theorem {theorem}: {CLAUSES} has no clause {clause}"
                ));
            }
        }
        for name in quoted(of_harnesses) {
            let proves = harnesses.iter().any(|harness| {
                let module = harness.name.split("::").next();
                (harness.name == name || module == Some(name))
                    && harness.theorem.split(", ").any(|proved| proved == *theorem)
            });
            if !proves {
                dead.push(format!("theorem {theorem}: no harness {name} proves it"));
            }
        }
        for name in quoted(of_tests) {
            let (file, function) = name.split_once("::").unwrap_or((name, ""));
            let exists =
                test_file(file).is_some_and(|text| text.contains(&format!("fn {function}")));
            if !exists {
                dead.push(format!("theorem {theorem}: {TESTS} has no {name}"));
            }
        }
        for name in quoted(of_targets).filter(|name| !is_fuzz_target(name)) {
            dead.push(format!("theorem {theorem}: {FUZZ_TARGETS} has no {name}"));
        }
        if quoted(of_harnesses).next().is_none() || quoted(of_tests).next().is_none() {
            dead.push(format!("theorem {theorem} has no harness or no test"));
        }
    }
    for harness in harnesses {
        for theorem in harness.theorem.split(", ") {
            if !listed.contains(theorem) {
                dead.push(format!(
                    "{} proves {theorem}, which is not listed",
                    harness.name
                ));
            }
        }
    }
    dead
}

/// What stands in backquotes.
fn quoted(cell: &str) -> impl Iterator<Item = &str> {
    cell.split('`').skip(1).step_by(2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(row: &str) -> Vec<String> {
        dead_links(
            row,
            "**R1.** It.",
            &[Harness::example("a::b", "3")],
            |file| (file == "x.rs").then(|| "fn y() {}".to_owned()),
            |target| target == "parser",
        )
    }

    #[test]
    fn a_link_that_leads_nowhere_is_found() {
        assert!(check("| 3 | It. | R1 | `a` | `x.rs::y` | none | any |").is_empty());
        assert!(check("| 3 | It. | R1 | `a::b` | `x.rs` | `parser` | any |").is_empty());
        for wrong in [
            "| 3 | It. | R2 | `a` | `x.rs::y` | none | any |",
            "| 3 | It. | R1 | `c` | `x.rs::y` | none | any |",
            "| 3 | It. | R1 | `a` | `x.rs::z` | none | any |",
            "| 3 | It. | R1 | `a` | `z.rs` | none | any |",
            "| 3 | It. | R1 | `a` | `x.rs` | `parsers` | any |",
            "| 3 | It. | R1 | | `x.rs::y` | none | any |",
            "| 4 | It. | R1 | `a` | `x.rs::y` | none | any |",
        ] {
            assert!(!check(wrong).is_empty(), "{wrong}");
        }
    }
}
