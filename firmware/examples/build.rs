//! Passes the linker scripts to the linker: the firmware's memory map, and the sections of cortex-m-rt and of defmt.

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
