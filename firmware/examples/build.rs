//! Gives the linker its scripts: the firmware's memory map, cortex-m-rt's sections and defmt's.

fn main() {
    println!(
        "cargo:rustc-link-search={}/../..",
        env!("CARGO_MANIFEST_DIR")
    );
    println!("cargo:rerun-if-changed=../../memory.x");
    println!("cargo:rerun-if-changed=../build.rs");
    for argument in ["-Tlink.x", "-Tdefmt.x", "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
