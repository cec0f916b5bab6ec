//! Compiles packages that depend on the crates framelock and framelock-formats. A package may rename the crates. If a
//! package gives a format to the wrong receiver, the compiler's error must name the right receiver.

use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// Compiles a package with this source, in which the crates are named `receiver` and `frames`. Returns whether the
/// package compiles, and the compiler's output.
fn checked(name: &str, source: &str) -> (bool, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let package = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(package.join("src")).expect("a folder for the package");
    let crates = root.display();
    let manifest = format!(
        "[package]\nname = {name:?}\nedition = \"2024\"\n[dependencies]\n\
         receiver = {{ package = \"framelock\", path = \"{crates}/core\" }}\n\
         frames = {{ package = \"framelock-formats\", path = \"{crates}/formats\" }}\n\
         [workspace]\n"
    );
    fs::write(package.join("Cargo.toml"), manifest).expect("a manifest");
    fs::write(package.join("src/lib.rs"), source).expect("a source");
    // The package uses the workspace's lock file, so that Cargo downloads nothing.
    fs::copy(root.join("Cargo.lock"), package.join("Cargo.lock")).expect("a lock file");
    let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args(["check", "--quiet", "--offline"])
        .env("CARGO_TARGET_DIR", package.join("target"))
        .current_dir(&package);
    let output = cargo.output().expect("cargo");
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.success(), said)
}

#[test]
fn a_format_may_be_declared_where_the_crates_have_other_names() {
    let (is_right, said) = checked(
        "renamed",
        "#[derive(Clone, Copy)] pub struct Short;
         impl receiver::Format for Short {
             frames::classify_by!(frames::ibus::LAYOUT);
             type Message<'a> = &'a [u8];
             fn decode<'a>(&self, frame: &'a [u8]) -> &'a [u8] { frame }
         }",
    );
    assert!(is_right, "{said}");
}

#[test]
fn the_wrong_receiver_is_an_error_that_names_the_right_one() {
    let (is_right, said) = checked(
        "wrong-receiver",
        "pub type Short = receiver::Receiver<frames::sbus::Sbus>;
         pub fn long(_: receiver::BufferedReceiver<receiver::motion::Bin, [u8; 14]>) {}
         pub fn new() { let _ = receiver::BufferedReceiver::<_, [u8; 14]>::new(frames::sbus::Sbus); }
         pub fn of_bin() { let _ = receiver::Receiver::<frames::sbus::Sbus>::new(); }
         pub fn of_any<F: receiver::Format>(_: F) {}
         pub fn wrong(bin: receiver::motion::Bin) { of_any(bin) }",
    );
    assert!(!is_right, "it compiled");
    for part in [
        "`Sbus` is no format of fixed length",
        "the receiver of a `Format` is `BufferedReceiver<F, B>`",
        "`Bin` is no `Format`",
        "the receiver of a `FixedFormat` is `Receiver<F>`",
    ] {
        assert!(said.contains(part), "no {part:?} in {said}");
    }
}
