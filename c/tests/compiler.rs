//! Compiles C programs against the header and the library, and runs them.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use std::thread;

use tempfile::TempDir;

use crate::pages::IN_C;

pub(crate) const C: [&str; 4] = ["cc", "-std=c99", "-Wpedantic", "-Wconversion"];
pub(crate) const CPP: [&str; 4] = ["c++", "-std=c++17", "-xc++", "-Wconversion"];

/// Compiles the sources as one program, runs it, and returns its output. The program must compile without a warning and
/// exit successfully.
pub(crate) fn run(compiler: &[&str], sources: &[&Path], input: &[u8]) -> String {
    let folder = TempDir::new().unwrap();
    let program = folder.path().join("program");
    let links = ["-lpthread", "-ldl", "-lm"];
    let install = "on Debian: apt-get install g++; on macOS: xcode-select --install";
    compile(compiler, sources, library(), &links, &program, install);
    succeeds(&mut Command::new(program), input, "")
}

/// Compiles the sources and a library to one program, without a warning. `install` says how to install the compiler.
pub(crate) fn compile(
    compiler: &[&str],
    sources: &[&Path],
    library: &Path,
    links: &[&str],
    program: &Path,
    install: &str,
) {
    let (name, options) = compiler.split_first().unwrap();
    let mut compile = Command::new(name);
    compile
        .args(["-Wall", "-Wextra", "-Werror"])
        .args(options)
        .arg("-I")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("include"))
        .arg("-I")
        .arg(self::program(""))
        .args(sources)
        // The library is not a source file of this language.
        .arg("-xnone")
        .arg(library)
        .args(links)
        .arg("-o")
        .arg(program);
    succeeds(&mut compile, &[], install);
}

/// Runs a program that must exit successfully, and returns its output. `install` says how to install the program.
pub(crate) fn succeeds(command: &mut Command, input: &[u8], install: &str) -> String {
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut running = match command.spawn() {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            panic!("there is no {}; {install}", command.get_program().display())
        }
        running => running.unwrap(),
    };
    let mut stdin = running.stdin.take().unwrap();
    let output = thread::scope(|scope| {
        scope.spawn(move || stdin.write_all(input));
        running.wait_with_output().unwrap()
    });
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {complaints}");
    String::from_utf8(output.stdout).unwrap()
}

/// Returns the path of a program in the tests' folder.
pub(crate) fn program(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    folder.join("tests/programs").join(name)
}

/// Builds the library with the page's commands, but for this computer instead of the chip.
pub(crate) fn library() -> &'static Path {
    static LIBRARY: OnceLock<PathBuf> = OnceLock::new();
    LIBRARY.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("library");
        let mut lines = IN_C.lines();
        let build = lines.find(|line| line.starts_with("cargo build")).unwrap();
        let (build, _) = build.split_once(" --target ").unwrap();
        let mut cargo = Command::new(env!("CARGO"));
        cargo
            .args(build.split(' ').skip(1))
            .arg("--target-dir")
            .arg(&folder)
            .current_dir(env!("CARGO_MANIFEST_DIR"));
        succeeds(&mut cargo, &[], "");
        folder.join("firmware/libframelock_c.a")
    })
}
