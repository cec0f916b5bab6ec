//! The web page that shows the machines on a line. If the user breaks a byte, the lecture's machine may go deaf, but
//! framelock's receiver does not.
//!
//! ```text
//!  address ◄─► Scenario ─► line ─► Run: machines and failsafes ─► JSON that the page draws
//! ```
//!
//! The page's address alone determines what the page shows. The page's script calls the functions of
//! this crate, and draws what they return. `cargo xtask web` builds the page.
//!
//! ```
//! // The payload contains sync bytes, and the first byte of the fourth frame is lost.
//! let run = framelock_web::Run::open("payload=00414200&edits=21d")?;
//! assert!(run.view(280, 0, 0).contains("DEAF"));
//! # Ok::<(), String>(())
//! ```

#![forbid(unsafe_code)]
#![allow(
    clippy::indexing_slicing,
    reason = "an index out of range is a bug of this program"
)]

mod line;
mod machine;
mod run;
mod scenario;
mod view;

use anyhow::Error;
use framelock_receiving::{AnyLine, Policy};

pub use run::Run;

/// Returns the presets as JSON: the name, the explanation and the address of each. The page has a
/// button for each preset.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn presets() -> String {
    include_str!("../presets.json").to_owned()
}

/// Returns the name and a short description of each available frame format as JSON.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn frames() -> String {
    let frames = framelock_description::SHIPPED.iter().map(|(name, text)| {
        let about = text.trim_start_matches("# ");
        let end = about.find([':', '.', '\n']).unwrap_or(about.len());
        (*name, &about[..end])
    });
    let own = (scenario::OWN, "a frame of your own");
    serde_json::json!(frames.chain([own]).collect::<Vec<_>>()).to_string()
}

/// Returns the mistake in a description with its line and column, or an empty string if the
/// description is valid.
#[must_use]
#[wasm_bindgen::prelude::wasm_bindgen]
pub fn problem(description: &str) -> String {
    let protocol = scenario::described(scenario::OWN, description);
    let line = protocol.and_then(|protocol| Ok(AnyLine::new(&protocol, Policy::Framelock)?));
    line.err().map_or(String::new(), |error| said(&error))
}

/// Returns the text of an error and of its causes, for the page.
fn said(error: &Error) -> String {
    format!("{error:#}")
}
