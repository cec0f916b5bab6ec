//! C and C++ compilers, and the packages that they need.

use std::ffi::OsStr;
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::process::Command;

use framelock_limited::RunToEnd as _;
use tempfile::TempDir;

use crate::headers;

/// A compiler with its options, and the Debian package that contains it.
pub(crate) struct Compiler {
    pub(crate) command: &'static str,
    pub(crate) package: &'static str,
}

const fn compiler(package: &'static str, command: &'static str) -> Compiler {
    Compiler { command, package }
}

pub(crate) const GCC: Compiler = compiler("gcc", "gcc -std=c99");
pub(crate) const CLANG: Compiler = compiler("clang", "clang -std=c99");
pub(crate) const GXX: Compiler = compiler("g++", "g++ -std=c++17 -xc++");
pub(crate) const CLANGXX: Compiler = compiler("clang", "clang++ -std=c++17 -xc++");
pub(crate) const M4: Compiler = compiler(
    "gcc-arm-none-eabi",
    "arm-none-eabi-gcc -std=c99 -mcpu=cortex-m4 -mthumb -ffreestanding",
);
pub(crate) const M0: Compiler = compiler(
    "gcc-arm-none-eabi",
    "arm-none-eabi-gcc -std=c99 -mcpu=cortex-m0 -mthumb -ffreestanding",
);
/// A compiler whose `int` has 16 bits.
pub(crate) const AVR: Compiler = compiler("gcc-avr avr-libc", "avr-gcc -std=c99 -mmcu=atmega328p");
/// The same compiler for a larger chip.
pub(crate) const AVR_2560: Compiler =
    compiler("gcc-avr avr-libc", "avr-gcc -std=c99 -mmcu=atmega2560");
pub(crate) const ALL: [Compiler; 7] = [GCC, CLANG, GXX, CLANGXX, M4, M0, AVR];

const WARNINGS: &str = "-Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -pedantic -Werror";

/// A compiled program, and the temporary folder that contains it.
pub(crate) struct Program(TempDir);

impl Program {
    /// Runs the program, which must succeed. Returns its output.
    pub(crate) fn run(&self, input: &[u8]) -> String {
        succeeds(&mut Command::new(self.0.path().join("program")), input, "")
    }
}

impl Compiler {
    /// Compiles a program so that it exits with an error at undefined behaviour. With gcc, it also exits with an error
    /// at an access outside of an object. The program is not optimised, because compiling takes longer than running.
    /// Other tests optimise the same headers for microcontrollers. `source` is one of the `files`, which are written
    /// beside the program, or a file in the folder of these tests. The program may include the `files` and the shipped
    /// headers.
    pub(crate) fn program(
        &self,
        source: &str,
        files: &[(&str, &str)],
        options: &[&str],
    ) -> Program {
        // Debian's package of clang lacks the sanitizers' library, so a program that clang compiles traps instead.
        let sanitizers = if self.package == "clang" {
            ["-fsanitize=undefined", "-fsanitize-trap=undefined"]
        } else {
            ["-fsanitize=undefined,address", "-fno-sanitize-recover=all"]
        };
        let folder = TempDir::new().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        let is_written = files.iter().any(|(name, _)| *name == source);
        let source = if is_written {
            source.into()
        } else {
            beside(source)
        };
        let headers = include_headers();
        let options = [&sanitizers[..], &["-O0", "-I.", &headers], options].concat();
        self.compile(&source, &options, &folder.path().join("program"));
        Program(folder)
    }

    /// Compiles a source file. The current folder is that of the output. Unless `-c` is one of the options, also links
    /// a program. A warning is an error.
    pub(crate) fn compile(&self, source: &Path, options: &[&str], output: &Path) {
        let (name, own) = self.command.split_once(' ').unwrap();
        let folder = output.parent().unwrap();
        let run = |mut command: Command, files: [&OsStr; 4]| {
            command
                .args(own.split(' '))
                .args(WARNINGS.split(' '))
                .args(options)
                .args(files);
            let package = format!("{} ccache", self.package);
            succeeds(command.current_dir(folder), &[], &package);
        };
        let object = output.with_extension("o").into_os_string();
        run(
            cached(name),
            ["-c".as_ref(), source.as_ref(), "-o".as_ref(), &object],
        );
        if !options.contains(&"-c") {
            run(
                Command::new(name),
                ["-xnone".as_ref(), &object, "-o".as_ref(), output.as_ref()],
            );
        }
    }
}

/// Returns the option with which the compiler finds the shipped headers.
pub(crate) fn include_headers() -> String {
    format!("-I{}", headers::folder().display())
}

/// Returns a command that compiles with this compiler, or copies the output from the build folder if the same command
/// has compiled the same source before. If the source lies in a temporary folder, give a relative path, so that the
/// command is the same in each temporary folder.
pub(crate) fn cached(compiler: &str) -> Command {
    let mut command = Command::new("ccache");
    command.arg(compiler);
    command.env(
        "CCACHE_DIR",
        concat!(env!("CARGO_TARGET_TMPDIR"), "/ccache"),
    );
    command
}

/// Runs a program that must exit successfully within the time limit. Returns its standard output, followed by its
/// standard error. `package` is the Debian package that contains the program.
pub(crate) fn succeeds(command: &mut Command, input: &[u8], package: &str) -> String {
    let output = match command.run_to_end(input) {
        Err(error) if error.kind() == ErrorKind::NotFound => {
            let name = command.get_program().display();
            panic!("there is no {name}; on Debian: apt-get install {package}")
        }
        output => output.unwrap(),
    };
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command:?}: {complaints}");
    String::from_utf8_lossy(&output.stdout).into_owned() + &complaints
}

/// Returns the path of a file in the folder of these tests.
pub(crate) fn beside(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests")
        .join(name)
}

/// Asserts that two texts have the same lines.
pub(crate) fn assert_same(found: &str, expected: &str) {
    for (number, (found, expected)) in found.lines().zip(expected.lines()).enumerate() {
        assert_eq!(found, expected, "line {number}");
    }
    assert_eq!(found.lines().count(), expected.lines().count());
}
