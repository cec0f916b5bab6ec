//! Builds the page that shows the machines in a browser. The page is one file, which contains its style, its script and
//! the machines as WebAssembly. So the page works from a folder and from any static host.

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

/// The version of `wasm-bindgen`. It must equal the library's version in `host/web/Cargo.toml`.
const WASM_BINDGEN: &str = "0.2.129";
const WASM_BINDGEN_CLI: &str = "wasm-bindgen-cli";

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
    let page = page(workspace)?;
    if arguments.open {
        let browser = match std::env::consts::OS {
            "macos" => "open",
            "windows" => "explorer",
            _ => "xdg-open",
        };
        // Ignore the exit status, because Windows' explorer always reports a failure.
        let sh = Shell::new()?;
        cmd!(sh, "{browser} {page}").ignore_status().run()?;
    }
    Ok(())
}

/// Builds the page. Returns its path.
pub(crate) fn page(workspace: &Workspace) -> Result<PathBuf> {
    say_what_it_costs(workspace)?;
    let sh = &workspace.shell_with(WASM_BINDGEN_CLI, WASM_BINDGEN)?;
    let built = build(sh, workspace)?;
    // Write only the page into this folder, so that the folder can be published.
    let folder = workspace.target_directory.join("web");
    sh.remove_path(&folder)?;
    sh.create_dir(&folder)?;
    let page = folder.join("index.html");
    sh.write_file(&page, assembled(sh, &built)?)?;
    let bytes = std::fs::metadata(&page)?.len();
    println!("{}: {bytes} bytes", page.display());
    Ok(page)
}

/// Prints the time and space that the build takes, before anything is downloaded or compiled.
fn say_what_it_costs(workspace: &Workspace) -> Result<()> {
    let sh = workspace.shell()?;
    let targets = cmd!(sh, "rustup target list --installed").quiet().read()?;
    println!("The page is compiled to WebAssembly, which takes about a minute on two idle cores.");
    if !targets.lines().any(|target| target == TARGET) {
        println!(
            "First build only: rustup downloads its target {TARGET} (about 20 MB, 90 MB on disk)."
        );
    }
    if !workspace.has_tool(WASM_BINDGEN_CLI, WASM_BINDGEN) {
        println!(
            "First build only: {WASM_BINDGEN_CLI} {WASM_BINDGEN} (170 crates) is compiled into {}, which takes three to five minutes on two idle cores.",
            workspace.target_directory.join("tools").display()
        );
    }
    Ok(())
}

/// Compiles the machines and generates the script that calls them. Returns their folder.
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

/// Returns the page with all its parts in one file. Its security policy allows only its own style
/// and script, by their hashes. The page can therefore load nothing and send nothing.
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
