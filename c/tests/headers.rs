//! Tests that the headers in `c/headers` equal the output of `framelock generate`, and that no compiler warns about
//! them.
//!
//! `FRAMELOCK_WRITE_HEADERS=1 cargo test -p framelock-c headers` writes them.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use framelock_description::{Description, SHIPPED};
use framelock_generate::{CrcTable, c};
use tempfile::TempDir;

use crate::compilers::ALL;

/// The folder of the shipped headers.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("headers")
}

/// Returns the name of a description's header.
pub(crate) fn header_name(name: &str) -> String {
    name.replace('-', "_")
}

#[test]
fn headers_are_what_generate_writes() {
    let is_written = std::env::var_os("FRAMELOCK_WRITE_HEADERS").is_some();
    for (name, text) in SHIPPED {
        let description = Description::parse(name, text).unwrap();
        let command = format!("framelock generate --frame {name} --language c");
        let header = c(&description, name, &command, CrcTable::Nibbles);
        let path = folder().join(header_name(name) + ".h");
        if is_written {
            fs::write(&path, &header).unwrap();
        }
        let written = fs::read_to_string(&path).unwrap_or_default();
        assert!(
            written == header,
            "{} differs: FRAMELOCK_WRITE_HEADERS=1 writes it",
            path.display()
        );
    }
}

/// Compiles all headers in one source file, each as static functions and as one definition.
#[test]
fn no_compiler_warns_of_headers() {
    let here = TempDir::new().unwrap();
    let mut names: Vec<String> = SHIPPED.iter().map(|(name, _)| header_name(name)).collect();
    names.push("failsafe".to_owned());
    let mut included = String::new();
    for name in &names {
        let path = folder().join(name.clone() + ".h");
        writeln!(included, "#include \"{}\"", path.display()).unwrap();
    }
    let mut defined = String::new();
    let mut declared = String::new();
    for name in &names {
        writeln!(defined, "#define {}_DEFINITIONS 1", name.to_uppercase()).unwrap();
        writeln!(declared, "#define {}_DEFINITIONS 0", name.to_uppercase()).unwrap();
    }
    let tables = "#define FAILSAFE_AXES 6\n#define FAILSAFE_DEMAND uint16_t\n";
    for compiler in &ALL {
        for (variant, first) in ["", &defined, &declared, tables].iter().enumerate() {
            let source = here.path().join(format!("headers{variant}.c"));
            fs::write(&source, format!("{first}{included}")).unwrap();
            compiler.compile(&source, &["-Os", "-c"], &here.path().join("headers.o"));
        }
    }
}
