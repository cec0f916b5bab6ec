//! Tests of MAVLink's definitions. The file `mavlink/own.xml` has each feature of a definition that the conversion
//! supports.

use std::path::{Path, PathBuf};

use framelock_description::{Description, hex, read};

use crate::keys::shown;

/// Frames that pymavlink 2.4.50 made from `own.xml`, the names of their messages, and their values. In the second
/// frame, which is MAVLink 1, pymavlink also packed the extensions.
const FRAMES: &str = include_str!("../mavlink/frames.txt");

fn file(name: &str) -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/mavlink");
    tests.join(name)
}

#[test]
fn a_definition_describes_the_frames_of_pymavlink() {
    let text = read(&file("own.xml")).unwrap();
    let description = Description::parse("own.xml", &text).unwrap();
    let mut count = 0;
    for line in FRAMES.lines() {
        let (digits, values) = line.split_once(": ").unwrap();
        let frame = hex::parse(&[digits]).unwrap();
        assert!(description.is_frame(&frame), "{digits}");
        let name = description.name(&frame).unwrap();
        assert_eq!(format!("{name} {}", shown(&description, &frame)), values);
        count += 1;
    }
    assert_eq!(count, 6);
    // Files that include each other in a circle are read once, and any of them may be the first.
    let other = read(&file("more/base.xml")).unwrap();
    let (_, views) = text.split_once("[[kinds]]").unwrap();
    assert!(other.contains(views));
}

#[test]
fn a_mistake_in_a_definition_is_told() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    for (number, (elements, told)) in [
        ("", "without a message"),
        ("<message id='1' name='A'>", "expected 'message' tag"),
        ("<include>none.xml</include>", "none.xml: "),
        (
            "<message name='A'><field type='char' name='b'/></message>",
            "message \"A\": ",
        ),
        (
            "<message id='1' name='A'><field type='int' name='b'/></message>",
            "message \"A\": ",
        ),
        (
            "<message id='1' name='A'><field type='char[300]' name='b'/></message>",
            "message \"A\": ",
        ),
        (
            "<message id='1' name='A'><field type='double[32]' name='b'/></message>",
            "message \"A\": ",
        ),
        (
            "<message id='1' name='A'><field type='char'/></message>",
            "message \"A\": ",
        ),
        (
            "<message id='1' name='A'/><message id='1' name='B'/>",
            "message \"B\": ",
        ),
    ]
    .into_iter()
    .enumerate()
    {
        let path = folder.join(format!("wrong{number}.xml"));
        std::fs::write(&path, format!("<mavlink>{elements}</mavlink>")).unwrap();
        let problem = read(&path).unwrap_err().to_string();
        assert!(problem.contains(told), "{elements}: {problem}");
        assert!(
            told.starts_with("none") || problem.contains(&format!("wrong{number}.xml")),
            "{problem}"
        );
    }
}
