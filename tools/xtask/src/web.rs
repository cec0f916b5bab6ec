//! The page that shows the machine in a browser: one file, which holds its style, its script and the
//! machines as WebAssembly, so that it works from a folder and from any static host.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result};
use base64::{Engine as _, engine::general_purpose::STANDARD as BASE64};
use flate2::Compression;
use flate2::write::GzEncoder;
use sha2::{Digest as _, Sha256};
use xshell::{Shell, cmd};

use crate::workspace::Workspace;

const TARGET: &str = "wasm32-unknown-unknown";

/// The command and the library that `host/web/Cargo.toml` names have to be of one version.
const WASM_BINDGEN: &str = "0.2.129";
const WASM_BINDGEN_CLI: &str = "wasm-bindgen-cli";

const EXAMPLES: &str = "\
Examples:
  cargo xtask web                      target/web/index.html, to be put on any web server
  cargo xtask web --open               and show it in the browser

It takes a minute or two. The first time it also downloads a target of rustup's and compiles
wasm-bindgen, which takes some minutes more; it says so before it begins.";

/// Build the page that shows the machine in a browser.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Show it in the browser.
    #[arg(long)]
    open: bool,
}

/// `cargo xtask web`.
pub(crate) fn web(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let page = page(workspace)?;
    if arguments.open {
        let browser = match std::env::consts::OS {
            "macos" => "open",
            "windows" => "explorer",
            _ => "xdg-open",
        };
        // Windows' explorer always says that it failed.
        let sh = Shell::new()?;
        cmd!(sh, "{browser} {page}").ignore_status().run()?;
    }
    Ok(())
}

/// Builds the page; returns its file.
pub(crate) fn page(workspace: &Workspace) -> Result<PathBuf> {
    say_what_it_costs(workspace)?;
    let sh = &workspace.shell_with(WASM_BINDGEN_CLI, WASM_BINDGEN)?;
    let built = build(sh, workspace)?;
    // Nothing but the page is in it, so that the folder can be published.
    let folder = workspace.target_directory.join("web");
    sh.remove_path(&folder)?;
    sh.create_dir(&folder)?;
    let page = folder.join("index.html");
    sh.write_file(&page, assembled(sh, &built)?)?;
    let bytes = std::fs::metadata(&page)?.len();
    println!("{}: {bytes} bytes", page.display());
    Ok(page)
}

/// Before anything is downloaded or compiled.
fn say_what_it_costs(workspace: &Workspace) -> Result<()> {
    let sh = workspace.shell()?;
    let targets = cmd!(sh, "rustup target list --installed").quiet().read()?;
    println!("The page is compiled to WebAssembly, which takes a minute or two.");
    if !targets.lines().any(|target| target == TARGET) {
        println!("Once: rustup downloads its target {TARGET}, some 20 MB and 90 MB on the disk.");
    }
    if !workspace.has_tool(WASM_BINDGEN_CLI, WASM_BINDGEN) {
        println!(
            "Once: {WASM_BINDGEN_CLI} {WASM_BINDGEN} is compiled, 170 crates, in some minutes; it goes into {}.",
            workspace.target_directory.join("tools").display()
        );
    }
    Ok(())
}

/// Compiles the machines, and writes what the page's script needs to call them; returns their folder.
fn build(sh: &Shell, workspace: &Workspace) -> Result<PathBuf> {
    cmd!(sh, "rustup target add {TARGET}").run()?;
    let crate_type = ["--lib", "--crate-type", "cdylib", "--profile", "wasm"];
    cmd!(
        sh,
        "cargo rustc --locked --package framelock-web {crate_type...} --target {TARGET}"
    )
    .run()?;
    let built = workspace.target_directory.join(TARGET).join("wasm");
    let machines = built.join("framelock_web.wasm");
    let to = built.join("bound");
    cmd!(
        sh,
        "wasm-bindgen --target no-modules --no-typescript --out-name machines --out-dir {to} {machines}"
    )
    .run()?;
    Ok(to)
}

/// The page with everything in it. Its security policy allows its own style and script, by their hashes,
/// and nothing else: it can load nothing and send nothing.
fn assembled(sh: &Shell, built: &Path) -> Result<String> {
    let page = Path::new("host/web/page");
    let style = sh.read_file(page.join("style.css"))?;
    let mut machines = GzEncoder::new(Vec::new(), Compression::best());
    machines.write_all(&sh.read_binary_file(built.join("machines_bg.wasm"))?)?;
    let machines = BASE64.encode(machines.finish()?);
    let bindings = sh.read_file(built.join("machines.js"))?;
    let [draw, call] = ["draw.js", "page.js"].map(|file| sh.read_file(page.join(file)));
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
    let mut html = sh.read_file(page.join("index.html"))?;
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
