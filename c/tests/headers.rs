//! Tests that the headers in `c/headers`, except `failsafe.h`, equal the output of `framelock generate`, and that no
//! compiler warns about any header. Also tests that `failsafe.h` and the Arduino library state the workspace's version.
//!
//! `FRAMELOCK_WRITE_HEADERS=1 cargo test -p framelock-c headers` writes the headers and the version.

use std::fs;
use std::path::{Path, PathBuf};

use framelock_description::{Description, SHIPPED};
use framelock_generate::{CrcTable, c};
use tempfile::TempDir;

use crate::compilers::ALL;

/// The descriptions for which users generate a header, because no header is shipped.
const WITHOUT_HEADER: &[&str] = &["hdlc", "kiss", "dmx512", "dsmr-p1", "vedirect", "sbus-any"];

/// Returns the descriptions whose headers are shipped.
fn shipped() -> impl Iterator<Item = &'static (&'static str, &'static str)> {
    SHIPPED
        .iter()
        .filter(|(name, _)| !WITHOUT_HEADER.contains(name))
}

/// Returns the folder of the shipped headers.
pub(crate) fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("headers")
}

/// Returns the name of a description's header.
pub(crate) fn header_name(name: &str) -> String {
    name.replace('-', "_")
}

/// Asserts that the file has this text, or writes the text.
fn check(path: &Path, text: &str) {
    if std::env::var_os("FRAMELOCK_WRITE_HEADERS").is_some() {
        fs::write(path, text).unwrap();
    }
    let is_same = fs::read_to_string(path).unwrap_or_default() == text;
    let path = path.display();
    assert!(
        is_same,
        "{path} differs: FRAMELOCK_WRITE_HEADERS=1 writes it"
    );
}

#[test]
fn headers_are_what_generate_writes() {
    for (name, text) in shipped() {
        let description = Description::parse(name, text).unwrap();
        let command = format!("framelock generate --frame {name} --language c");
        let header = c(&description, name, &command, CrcTable::Nibbles);
        check(&folder().join(header_name(name) + ".h"), &header);
    }
}

/// Returns a header's text without the prefixes of its names.
fn without_prefixes(name: &str, prefixes: &[&str]) -> String {
    let text = fs::read_to_string(folder().join(name).with_extension("h")).unwrap();
    let remove = |text: String, prefix: &&str| {
        let text = text.replace(prefix, "");
        text.replace(&prefix.to_uppercase(), "")
    };
    prefixes.iter().fold(text, remove)
}

/// The lines of `gnss.h` that `nmea.h` does not need, because the receiver of `nmea.h` never has more bytes than the
/// longest sentence.
const LONGEST_SENTENCE: &str = "    if (count > 515U) {\n        count = 515U;\n    }\n";

/// If this test passes, the proofs about the classification in the headers of single protocols also hold for `gnss.h`
/// and `mavlink.h`.
#[test]
fn headers_for_several_protocols_classify_as_the_header_of_each() {
    for (several, each) in [
        ("gnss", &["ubx", "nmea", "rtcm"][..]),
        ("mavlink", &["mavlink2", "mavlink1"]),
    ] {
        for name in each {
            let own = without_prefixes(name, &[&format!("{name}_")]);
            let (first, last) = ("static inline bool starts(", "    return FRAME;\n}\n");
            let (_, from_first) = own.split_once(first).unwrap();
            let (classifier, _) = from_first.split_once(last).unwrap();
            assert!(classifier.contains("static inline outcome classify("));
            let prefixes = [&*format!("{several}_{name}_"), &format!("{several}_")];
            let all = without_prefixes(several, &prefixes).replace(LONGEST_SENTENCE, "");
            assert!(
                all.contains(&format!("{first}{classifier}{last}")),
                "{several}.h classifies {name} in another way"
            );
        }
    }
}

#[test]
fn failsafe_and_arduino_library_state_the_version() {
    for (file, before, after) in [
        (
            "headers/failsafe.h",
            " * This is version ",
            " of framelock.",
        ),
        ("arduino/library.properties", "version=", ""),
        ("arduino/library.json", "  \"version\": \"", "\","),
    ] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let text = fs::read_to_string(&path).unwrap();
        let (first, rest) = text.split_once(before).unwrap();
        let (_, last) = rest.split_once(&format!("{after}\n")).unwrap();
        let version = env!("CARGO_PKG_VERSION");
        check(&path, &format!("{first}{before}{version}{after}\n{last}"));
    }
}

/// Compiles all headers in one source file, in four ways: as static functions, as definitions, as declarations, and
/// with a failsafe for six axes of 16 bits.
#[test]
fn no_compiler_warns_of_headers() {
    let here = TempDir::new().unwrap();
    let mut names: Vec<String> = shipped().map(|(name, _)| header_name(name)).collect();
    names.push("failsafe".to_owned());
    let each = |line: &dyn Fn(&str) -> String| names.iter().map(|name| line(name)).collect();
    let folder = folder();
    let included: String = each(&|name| format!("#include \"{}/{name}.h\"\n", folder.display()));
    let [declared, defined]: [String; 2] = [0, 1].map(|value| {
        each(&|name| format!("#define {}_DEFINITIONS {value}\n", name.to_uppercase()))
    });
    let tables = "#define FAILSAFE_AXES 6\n#define FAILSAFE_DEMAND uint16_t\n";
    for compiler in &ALL {
        for (variant, first) in ["", &defined, &declared, tables].iter().enumerate() {
            let source = format!("headers{variant}.c");
            fs::write(here.path().join(&source), format!("{first}{included}")).unwrap();
            compiler.compile(
                source.as_ref(),
                &["-Os", "-c"],
                &here.path().join("headers.o"),
            );
        }
    }
}
