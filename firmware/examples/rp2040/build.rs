//! Passes the linker scripts to the linker: this chip's memory map, and the sections of cortex-m-rt, embassy-rp and
//! defmt.

fn main() {
    println!("cargo:rustc-link-search={}", env!("CARGO_MANIFEST_DIR"));
    println!("cargo:rerun-if-changed=memory.x");
    for argument in ["-Tlink.x", "-Tlink-rp.x", "-Tdefmt.x", "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
