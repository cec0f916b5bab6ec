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

mod frame;
mod line;
mod machine;
mod places;
mod run;
mod scenario;
mod view;

use framelock_receiving::{AnyLine, Policy};

pub use run::Run;

/// The scenarios that are one click away, as JSON: name, explanation, address.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn presets() -> String {
    include_str!("../presets.json").to_owned()
}

/// The names of the frames that there are, and what each is, as JSON.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn frames() -> String {
    let frames = framelock_description::SHIPPED.iter().map(|(name, text)| {
        let about = text.trim_start_matches("# ").split([':', '.', '\n']).next();
        (*name, about.unwrap_or_default())
    });
    let own = (scenario::OWN, "a frame of your own");
    serde_json::json!(frames.chain([own]).collect::<Vec<_>>()).to_string()
}

/// What is wrong with a description, with its line and column; nothing if it describes frames.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn problem(description: &str) -> String {
    let protocol = frame::described(scenario::OWN, description);
    let line = protocol.and_then(|protocol| AnyLine::new(&protocol, Policy::Framelock));
    line.err().unwrap_or_default()
}
