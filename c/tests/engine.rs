//! Tests that every header with a buffer contains the proved engine, which is in `c/proofs/engine.h`.

use std::fs;
use std::path::Path;

use crate::headers::{folder, header_name};
use framelock_description::SHIPPED;

/// Returns the text without white space, because the two texts may have different line breaks.
fn packed(text: &str) -> String {
    text.split_whitespace().collect()
}

#[test]
fn the_proved_engine_is_in_every_header_with_a_buffer() {
    let engine = Path::new(env!("CARGO_MANIFEST_DIR")).join("proofs/engine.h");
    let engine = fs::read_to_string(engine).unwrap();
    let (_, engine) = engine.split_once("*/").unwrap();
    let mut checked = 0;
    for (description, _) in SHIPPED {
        let name = header_name(description);
        let header = fs::read_to_string(folder().join(name.clone() + ".h")).unwrap();
        let upper = name.to_uppercase();
        if !header.contains(&format!("#define {upper}_ROOM")) {
            continue;
        }
        let is_narrow = header.contains("    uint8_t ask_at;");
        let index = if is_narrow { "uint8_t" } else { "uint16_t" };
        let engine = engine
            .replace("static void any_init", "ANY_FUNCTION void any_init")
            .replace(
                "static uint32_t any_pending",
                "ANY_FUNCTION uint32_t any_pending",
            )
            .replace("static bool any_p", "ANY_FUNCTION bool any_p")
            .replace(
                "static void any_line_event",
                "ANY_FUNCTION void any_line_event",
            )
            .replace("any_index", index)
            .replace("any_", &format!("{name}_"))
            .replace("ANY_", &format!("{upper}_"));
        assert!(
            packed(&header).contains(&packed(&engine)),
            "{name}.h has a different engine"
        );
        checked += 1;
    }
    assert_eq!(checked, 12);
}
