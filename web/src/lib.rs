//! The machine in a browser: bytes fall on a line, one can be broken, and one machine goes deaf while
//! the other does not.
//!
//! ```text
//!  address ◄─► Scenario ─► line ─► Run: machines and failsafes ─► JSON, which the page draws
//! ```
//!
//! What there is to see is a function of the page's address. The page's script draws and calls;
//! `cargo xtask web` builds the page.
//!
//! ```
//! // The payload holds sync bytes, and the first byte of the fourth frame is lost.
//! let run = framelock_web::Run::open("payload=00414200&edits=21d", &[])?;
//! assert!(run.view(280, 0, 0).contains("DEAF"));
//! # Ok::<(), String>(())
//! ```

#![forbid(unsafe_code)]

mod line;
mod machine;
mod parser;
mod run;
mod scenario;
mod view;

pub use run::Run;

/// The scenarios that are one click away, as JSON: name, explanation, address.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn presets() -> String {
    include_str!("../presets.json").to_owned()
}
