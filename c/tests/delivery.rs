//! Tests that the programs in `docs/c.md` and in the README compile without a warning, and that a project can use the
//! `CMake` target.

use std::fs;
use std::process::Command;

use tempfile::TempDir;

use crate::compilers::{AVR, CLANGXX, GCC, M4, beside, include_headers, succeeds};

pub(crate) const PAGE: &str = include_str!("../../docs/c.md");
const README: &str = include_str!("../../README.md");

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
    let include = include_headers();
    let stand_ins = format!("-I{}", beside("stm32").display());
    let programs = [blocks(PAGE, "c"), blocks(README, "c")].concat();
    assert_eq!(programs.len(), 6);
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

#[test]
fn the_pages_first_test_passes() {
    let here = TempDir::new().unwrap();
    let [source, program] = ["page.c", "page"].map(|name| here.path().join(name));
    fs::write(&source, blocks(PAGE, "c")[0]).unwrap();
    GCC.compile(&source, &[&include_headers()], &program);
    succeeds(&mut Command::new(program), &[], "gcc");
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
