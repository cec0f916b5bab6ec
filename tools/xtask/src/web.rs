//! Builds the page that shows the machines in a browser. The page is one file, which contains its style, its script and
//! the machines as WebAssembly. So the page works from a folder and from any static host.

use std::fs;
use std::io::Write as _;
use std::process::Command;

use anyhow::{Context as _, Result};
use base64::{Engine as _, engine::general_purpose::STANDARD as BASE64};
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest as _, Sha256};

use crate::workspace::{Workspace, run};

const EXAMPLES: &str = "\
Examples:
  cargo xtask web                      build target/web/index.html, for any web server
  cargo xtask web --open               build it and show it in the browser

On two idle cores the build takes a minute. The first build also downloads a rustup target and compiles
wasm-bindgen, which takes three to five more minutes. The command announces this before it begins.";

/// Build the page that shows the machines in a browser
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Show the page in the browser
    #[arg(long)]
    open: bool,
}

/// Runs `cargo xtask web`.
pub(crate) fn web(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    run(&mut workspace.script(&["page"]))?;
    let page = assembled(workspace)?;
    // Write only the page into this folder, so that the folder can be published.
    let folder = workspace.target.join("web");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder)?;
    let file = folder.join("index.html");
    fs::write(&file, &page)?;
    println!("{}: {} bytes", file.display(), page.len());
    if arguments.open {
        let browser = match std::env::consts::OS {
            "macos" => "open",
            "windows" => "explorer",
            _ => "xdg-open",
        };
        // Ignore the exit status, because Windows' explorer always reports a failure.
        Command::new(browser).arg(file).status()?;
    }
    Ok(())
}

/// Returns the page with all its parts in one file. Its security policy allows only its own style
/// and script, by their hashes. The page can therefore load nothing and send nothing.
fn assembled(workspace: &Workspace) -> Result<String> {
    let page = workspace.root.join("host/web/page");
    let built = workspace.target.join("wasm32-unknown-unknown/wasm/bound");
    let style = fs::read_to_string(page.join("style.css"))?;
    let mut machines = GzEncoder::new(Vec::new(), Compression::best());
    machines.write_all(&fs::read(built.join("machines_bg.wasm"))?)?;
    let machines = BASE64.encode(machines.finish()?);
    let bindings = fs::read_to_string(built.join("machines.js"))?;
    let [draw, call] = ["draw.js", "page.js"].map(|file| fs::read_to_string(page.join(file)));
    let script = [
        &bindings,
        "const MACHINES = '",
        &machines,
        "';\n",
        &draw?,
        &call?,
    ]
    .concat();
    let policy = format!(
        "default-src 'none'; img-src data:; style-src '{}'; script-src '{}' 'wasm-unsafe-eval'; \
         base-uri 'none'; form-action 'none'",
        hash(&style),
        hash(&script)
    );
    let mut html = fs::read_to_string(page.join("index.html"))?;
    for (place, content) in [
        ("{policy}", policy),
        ("{style}", style),
        ("{script}", script),
    ] {
        let (before, behind) = html
            .split_once(place)
            .with_context(|| format!("host/web/page/index.html has no {place}"))?;
        html = [before, &content, behind].concat();
    }
    Ok(html)
}

fn hash(text: &str) -> String {
    format!("sha256-{}", BASE64.encode(Sha256::digest(text)))
}
