//! Gives the linker its scripts: this chip's memory map, cortex-m-rt's and embassy-rp's sections, and defmt's.

fn main() {
    println!("cargo:rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    println!("cargo:rerun-if-changed=memory.x");
    for argument in ["-Tlink.x", "-Tlink-rp.x", "-Tdefmt.x", "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
