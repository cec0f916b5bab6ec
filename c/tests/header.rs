//! Tests that the committed header is the one that cbindgen generates.
//!
//! After an intended change, `FRAMELOCK_WRITE_HEADER=1 cargo test -p framelock-c header` writes the header again.

use std::path::Path;
use std::{env, fs};

#[test]
fn the_header_is_made_from_the_sources() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let config = cbindgen::Config::from_file(folder.join("cbindgen.toml")).unwrap();
    let builder = cbindgen::Builder::new().with_config(config);
    let builder = builder.with_src(folder.join("src/lib.rs"));
    let bindings = builder.generate();
    let mut made = Vec::new();
    bindings.unwrap().write(&mut made);
    let made = String::from_utf8(made).unwrap();
    let file = folder.join("include/framelock.h");
    if env::var_os("FRAMELOCK_WRITE_HEADER").is_some() {
        fs::write(&file, &made).unwrap();
    }
    let committed = fs::read_to_string(file).unwrap_or_default();
    assert!(committed == made, "not include/framelock.h, but:\n{made}");
}
