//! Tests of `framelock trace` as a process.

use std::io::{BufRead, BufReader, Write};

use crate::process;

#[test]
fn rows_are_written_as_the_bytes_arrive() {
    let mut child = process::start(&["trace", "-", "--policy", "framelock"]);
    let mut input = child.stdin.take().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap()).lines();
    rows.next().unwrap().unwrap();
    for _ in 0..3 {
        input.write_all(b"A").unwrap();
        // If the program held the row back, this read would never return.
        assert!(rows.next().unwrap().unwrap().contains("41 'A'"));
    }
    drop(input);
    assert!(rows.any(|row| row.unwrap().starts_with("framelock:")));
    assert!(child.wait().unwrap().success());
}
