//! Mistakes in descriptions, whose errors name their positions. Also files that are no descriptions, and descriptions
//! of too many values or kinds.

use std::path::Path;

use framelock_description::{Description, read};

/// One description per line, and its error.
const WRONG: &str = include_str!("../wrong.txt");

#[test]
fn what_is_wrong_with_a_description_is_told_with_its_place() {
    for case in WRONG.lines().skip(1) {
        let (text, told) = case.split_once(" => ").unwrap();
        let problem = Description::parse("my.toml", &text.replace("\\n", "\n")).err();
        let problem = problem
            .unwrap_or_else(|| panic!("nothing is wrong with {text}"))
            .to_string();
        assert!(
            problem.starts_with(&format!("my.toml:{told}")),
            "{text}:\n {problem}\n not {told}"
        );
    }
}

#[test]
fn a_file_without_end_or_of_other_things_is_no_description() {
    if cfg!(unix) {
        let told = read(Path::new("/dev/zero")).unwrap_err().to_string();
        assert!(
            told.contains("/dev/zero is longer than 1048576 bytes"),
            "{told}"
        );
    }
    let told = read(&std::env::current_exe().unwrap())
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("is longer than") || told.contains("is not text"),
        "{told}"
    );
    let told = read(Path::new("nowhere.toml")).unwrap_err().to_string();
    assert!(told.starts_with("cannot read nowhere.toml: "), "{told}");
}

#[test]
fn more_than_a_row_can_have_is_refused_before_it_is_made() {
    let field =
        |name: usize| format!("{{ name = \"a{name}_\", at = 1, type = \"u8\", count = 60000 }}");
    let kinds = (0..99).map(|number| {
        format!(
            "[[kinds]]\nname = \"k{number}\"\nfields = [{}]\n",
            field(number)
        )
    });
    let text = format!(
        "sync = \"24\"\nlength = 60001\n{}",
        kinds.collect::<Vec<_>>().concat()
    );
    let told = Description::parse("my.toml", &text)
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("the number of values in a row must be from 1 to 40000"),
        "{told}"
    );
    let kinds = (0..3000).map(|number| format!("[[kinds]]\nname = \"k{number}\"\n"));
    let text = format!(
        "sync = \"24\"\nlength = 3\n{}",
        kinds.collect::<Vec<_>>().concat()
    );
    let told = Description::parse("my.toml", &text)
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("the number of kinds must be from 1 to 100"),
        "{told}"
    );
}
