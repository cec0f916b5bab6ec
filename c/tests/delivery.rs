//! Tests that the programs in `docs/c.md` and the Arduino examples compile without a warning, and that a project can
//! use the `CMake` target.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tempfile::TempDir;

use crate::compilers::{AVR, CLANGXX, GCC, M4, beside, cached, succeeds};
use crate::headers;

pub(crate) const PAGE: &str = include_str!("../../docs/c.md");

/// Returns the code blocks of the page that are in this language.
pub(crate) fn blocks(page: &'static str, language: &str) -> Vec<&'static str> {
    let fence = format!("\n```{language}\n");
    let blocks = page.split(&fence).skip(1);
    blocks
        .map(|block| block.split_once("```\n").unwrap().0)
        .collect()
}

#[test]
fn programs_of_the_page_compile() {
    let here = TempDir::new().unwrap();
    let include = format!("-I{}", headers::folder().display());
    let stand_ins = format!("-I{}", beside("stm32").display());
    let programs = blocks(PAGE, "c");
    assert_eq!(programs.len(), 4);
    for program in programs {
        fs::write(here.path().join("page.c"), program).unwrap();
        for compiler in [&GCC, &CLANGXX, &M4, &AVR] {
            compiler.compile(
                "page.c".as_ref(),
                &["-Os", "-c", &include, &stand_ins],
                &here.path().join("page.o"),
            );
        }
    }
}

/// Debian's core for Arduino boards, from the package arduino-core-avr.
const ARDUINO: &str = "/usr/share/arduino/hardware/arduino/avr";

fn for_arduino(mut command: Command) -> Command {
    command.args(["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DARDUINO=10819"]);
    command.args(["-DARDUINO_AVR_UNO", "-DARDUINO_ARCH_AVR", "-Os"]);
    command.args(["-ffunction-sections", "-fdata-sections"]);
    for folder in ["cores/arduino", "variants/standard"] {
        command.arg("-I").arg(Path::new(ARDUINO).join(folder));
    }
    command
}

#[test]
fn arduino_examples_compile() {
    let core = Path::new(ARDUINO).join("cores/arduino");
    assert!(
        core.exists(),
        "no {ARDUINO}; on Debian: apt-get install arduino-core-avr"
    );
    let here = TempDir::new().unwrap();
    let mut objects: Vec<PathBuf> = Vec::new();
    for entry in fs::read_dir(&core).unwrap() {
        let source = entry.unwrap().path();
        let compiler = match source.extension().and_then(|it| it.to_str()) {
            Some("c") => "avr-gcc",
            Some("cpp") => "avr-g++",
            _ => continue,
        };
        let object = here
            .path()
            .join(source.file_name().unwrap())
            .with_extension("o");
        let mut command = for_arduino(cached(compiler));
        if compiler == "avr-g++" {
            // This compiler's float.h has no DECIMAL_DIG for C++.
            command.args(["-std=gnu++11", "-DDECIMAL_DIG=__DECIMAL_DIG__"]);
        }
        command
            .arg("-w")
            .arg("-c")
            .arg(&source)
            .arg("-o")
            .arg(&object);
        succeeds(&mut command, &[], AVR.package);
        objects.push(object);
    }
    let library = Path::new(env!("CARGO_MANIFEST_DIR")).join("arduino");
    for example in ["MotionPlatform", "CrsfReceiver"] {
        let sketch = library
            .join("examples")
            .join(example)
            .join(format!("{example}.ino"));
        let mut command = for_arduino(Command::new("avr-g++"));
        command.args([
            "-std=gnu++11",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-include",
            "Arduino.h",
        ]);
        command
            .arg("-I")
            .arg(library.join("src"))
            .arg("-xc++")
            .arg(sketch);
        command
            .arg("-xnone")
            .args(&objects)
            .args(["-Wl,--gc-sections", "-lm", "-o"]);
        command.arg(here.path().join("sketch.elf"));
        succeeds(&mut command, &[], AVR.package);
    }
}

#[test]
fn the_cmake_target_has_the_headers() {
    let here = TempDir::new().unwrap();
    let write = |name: &str, text: &str| fs::write(here.path().join(name), text).unwrap();
    let folder = env!("CARGO_MANIFEST_DIR");
    write(
        "CMakeLists.txt",
        &format!(
            "cmake_minimum_required(VERSION 3.13)\nproject(firmware LANGUAGES C)\n\
             add_subdirectory({folder} framelock)\nadd_library(firmware STATIC firmware.c)\n\
             target_link_libraries(firmware PRIVATE framelock_headers)\n"
        ),
    );
    write(
        "firmware.c",
        "#include \"crsf.h\"\nvoid start(crsf_receiver *it);\nvoid start(crsf_receiver *it) { crsf_init(it); }\n",
    );
    let mut configure = Command::new("cmake");
    configure
        .args(["-S", ".", "-B", "build"])
        .current_dir(here.path());
    succeeds(&mut configure, &[], "cmake");
    let mut build = Command::new("cmake");
    build.args(["--build", "build"]).current_dir(here.path());
    succeeds(&mut build, &[], "cmake");
}
