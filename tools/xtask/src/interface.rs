//! Lists the public interface of a package.

use std::fs;
use std::path::PathBuf;

use anyhow::{Result, ensure};
use public_api::Builder;

/// The format of rustdoc's JSON with which this version of `public-api` was tested. Rust 1.95
/// writes it.
const FORMAT: u64 = 57;

/// Print the public interface of a package
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// The package's documentation as JSON, which rustdoc has written
    json: PathBuf,
}

pub(crate) fn interface(Arguments { json }: &Arguments) -> Result<()> {
    let value: serde_json::Value = serde_json::from_slice(&fs::read(json)?)?;
    let format = value.get("format_version");
    let format = format.and_then(serde_json::Value::as_u64).unwrap_or(0);
    ensure!(
        format == FORMAT,
        "rustdoc writes JSON in format {format}, and this check reads format {FORMAT}. Run \
         `cargo +1.95.0 xtask verify --only interface`, or update `public-api` and FORMAT in tools/xtask"
    );
    let builder = Builder::from_rustdoc_json(json).omit_blanket_impls(true);
    print!("{}", builder.omit_auto_trait_impls(true).build()?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use crate::tests::links;
    use crate::workspace::{Workspace, files};

    /// crates.io and docs.rs show the texts of published packages without the repository, so relative links to files
    /// would not work. Links between items are allowed; they contain neither a slash nor a dot.
    #[test]
    fn published_texts_have_no_relative_links() {
        let workspace = Workspace::load().expect("cargo knows this workspace");
        let mut relative = Vec::new();
        let packages = workspace.packages.iter();
        for package in packages.filter(|package| package.publish.is_none()) {
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
