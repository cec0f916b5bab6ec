//! Checks the published packages: their public interface, and whether they can be published.

use std::fs;

use anyhow::{Context as _, Result, ensure};
use public_api::Builder;
use xshell::cmd;

use crate::stage_report::Report;
use crate::workspace::Workspace;

/// The format of rustdoc's JSON with which this version of `public-api` was tested. Rust 1.95
/// writes it.
const FORMAT: u64 = 57;

/// The file in a package's folder that lists each item of the package's public interface.
const INTERFACE: &str = "PUBLIC-API.txt";

/// Compares the public interface of each package with the committed one. If the variable SNAPSHOTS is `overwrite`,
/// overwrites the committed interfaces instead.
pub(crate) fn interface(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    // Build in a separate folder. In the common folder, cargo would compile all dependencies again, because
    // RUSTC_BOOTSTRAP changes their build.
    let folder = workspace.target_directory.join("interface");
    let packages = names(workspace);
    cmd!(
        sh,
        "cargo doc --no-deps --lib --all-features {packages...} --target-dir {folder}"
    )
    // rustdoc's JSON is unstable. A stable compiler accepts it only with this variable. The flag `docsrs` is set,
    // because docs.rs sets it, too.
    .env("RUSTC_BOOTSTRAP", "1")
    .env(
        "RUSTDOCFLAGS",
        "-Dwarnings --cfg=docsrs -Zunstable-options --output-format=json",
    )
    .run()?;
    let compiler = cmd!(sh, "rustc --version").read()?;
    let (mut items, mut changed) = (0, Vec::new());
    for package in &workspace.published {
        let json = folder.join(format!("doc/{}.json", package.name.replace('-', "_")));
        let value: serde_json::Value = serde_json::from_str(&fs::read_to_string(&json)?)?;
        let format = value
            .get("format_version")
            .and_then(serde_json::Value::as_u64);
        let format = format.unwrap_or(0);
        ensure!(
            format == FORMAT,
            "{compiler} writes rustdoc's JSON in format {format}, and this check reads format {FORMAT}. Run \
             `cargo +1.95.0 xtask verify --only interface`, or update `public-api` and FORMAT in tools/xtask"
        );
        let builder = Builder::from_rustdoc_json(json).omit_blanket_impls(true);
        let interface = builder.omit_auto_trait_impls(true).build()?;
        items += interface.items().count();
        let committed = package.manifest_path.with_file_name(INTERFACE);
        let overwrites = std::env::var("SNAPSHOTS").is_ok_and(|value| value == "overwrite");
        let new = if overwrites {
            committed.clone().into()
        } else {
            folder.join(package.name.as_str())
        };
        fs::write(&new, interface.to_string())?;
        let diff = cmd!(sh, "git diff --no-index --unified=0 {committed} {new}");
        if diff.run().is_err() {
            changed.push(committed.into_string());
        }
    }
    report.says = format!("{items} items, by {compiler}");
    ensure!(
        changed.is_empty(),
        "the public interface differs from {}: see above. If the change is intended, run: \
         SNAPSHOTS=overwrite cargo xtask verify --only interface",
        changed.join(", ")
    );
    Ok(())
}

/// Compares the public interface with the baseline's, by the rules of semantic versioning.
pub(crate) fn semver(workspace: &Workspace, report: &mut Report) -> Result<()> {
    let sh = workspace.shell_with("cargo-semver-checks", "0.51.0")?;
    let baseline = &workspace.semver_baseline;
    let commit = format!("{baseline}^{{commit}}");
    if cmd!(sh, "git cat-file -e {commit}")
        .quiet()
        .ignore_stderr()
        .run()
        .is_err()
    {
        // A shallow clone lacks the baseline. Fetch only this commit, without its history.
        cmd!(
            sh,
            "git fetch --quiet --no-tags --depth=1 origin {baseline}"
        )
        .run()
        .context("the commit `semver-baseline` of Cargo.toml is not in this repository")?;
    }
    let packages = names(workspace);
    cmd!(
        sh,
        "cargo semver-checks --baseline-rev {baseline} {packages...}"
    )
    .run()
    .context(
        "if the break is intended, see CONTRIBUTING.md, section To change the public interface",
    )?;
    report.says = format!("since {baseline}");
    Ok(())
}

/// Performs all steps of publishing the packages except the upload. Fails on any warning or uncommitted
/// file.
pub(crate) fn publish(workspace: &Workspace, _: &mut Report) -> Result<()> {
    let sh = workspace.shell()?;
    let packages = names(workspace);
    // Cargo orders the packages such that each depends only on earlier ones.
    let cargo = cmd!(sh, "cargo publish --dry-run {packages...}");
    let output = cargo.ignore_status().output()?;
    let said = String::from_utf8_lossy(&output.stderr);
    eprint!("{said}");
    let warns = |line: &&str| line.starts_with("warning") && !line.contains("due to dry run");
    let warning = said.lines().find(warns);
    ensure!(
        output.status.success(),
        "cargo publish ended with {}",
        output.status
    );
    ensure!(warning.is_none(), "{}", warning.unwrap_or_default());
    Ok(())
}

/// Returns cargo's options that name the published packages.
fn names(workspace: &Workspace) -> Vec<&str> {
    let published = workspace.published.iter();
    published
        .flat_map(|one| ["--package", one.name.as_str()])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::workspace::{files, links};

    /// crates.io and docs.rs show these texts without the repository, so relative links to files would not work. Links
    /// between items are allowed; they contain neither a slash nor a dot.
    #[test]
    fn published_texts_have_no_relative_links() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let mut relative = Vec::new();
        for package in &workspace.published {
            let readme = package.readme();
            let mut texts = vec![readme.expect("a published package has a README").into()];
            let sources = package.manifest_path.with_file_name("src");
            texts.extend(files(sources.as_std_path()).expect("readable folders"));
            for file in texts {
                let text = fs::read_to_string(&file).expect("text");
                let is_page = file.extension().is_some_and(|extension| extension == "md");
                let is_text = |line: &&str| is_page || line.starts_with("//");
                let text: Vec<&str> = text.lines().map(str::trim_start).filter(is_text).collect();
                let text = text.join("\n").replace("//! ", "").replace("/// ", "");
                let found = links(&text).filter(|link| !link.contains("://"));
                let found = found.filter(|link| link.contains(['/', '.']));
                relative.extend(found.map(|link| format!("{}: {link}", file.display())));
            }
        }
        assert!(relative.is_empty(), "{}", relative.join("\n"));
    }
}
