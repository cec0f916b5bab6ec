//! Every input of the committed corpus: a bug that was found once stays fixed. Needs the images:
//! `cargo xtask verify --only fuzz` builds them and says where they are.

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;

#[test]
fn firmware() {
    let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("../corpus/firmware");
    let mut count = 0;
    let mut failed = Vec::new();
    for entry in fs::read_dir(&corpus).expect("there is a corpus") {
        let path = entry.expect("it can be listed").path();
        let input = fs::read(&path).expect("it can be read");
        count += 1;
        if catch_unwind(|| framelock_fuzz_firmware::firmware(&input)).is_err() {
            failed.push(path);
        }
    }
    assert!(count > 0, "{} is empty", corpus.display());
    assert!(failed.is_empty(), "the firmware fails for {failed:?}");
}
