//! Copies of the sources, to put mistakes into.

use std::fs;
use std::path::Path;

use anyhow::{Context as _, Result};

/// A workspace at `to` of these folders alone; `members` of them are packages of it.
pub(crate) fn copy_workspace(
    root: &Path,
    to: &Path,
    folders: &[&str],
    members: &[&str],
) -> Result<()> {
    for folder in folders {
        copy_folder(&root.join(folder), &to.join(folder))?;
    }
    let manifest = fs::read_to_string(root.join("Cargo.toml"))?;
    fs::write(to.join("Cargo.toml"), with_members(&manifest, members)?)?;
    fs::copy(root.join("Cargo.lock"), to.join("Cargo.lock"))?;
    Ok(())
}

/// The workspace's manifest with these members only.
fn with_members(manifest: &str, members: &[&str]) -> Result<String> {
    let mut manifest: toml::Table = toml::from_str(manifest).context("Cargo.toml")?;
    let workspace = manifest
        .get_mut("workspace")
        .and_then(toml::Value::as_table_mut);
    let workspace = workspace.context("Cargo.toml has no [workspace]")?;
    workspace.insert("members".to_owned(), members.to_vec().into());
    workspace.remove("default-members");
    workspace.remove("exclude");
    Ok(toml::to_string(&manifest)?)
}

/// Files that are the same already are left alone, so that they are not compiled again.
fn copy_folder(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (path, copy) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            if entry.file_name() != "target" {
                copy_folder(&path, &copy)?;
            }
            continue;
        }
        let content = fs::read(&path)?;
        if !fs::read(&copy).is_ok_and(|old| old == content) {
            fs::write(&copy, content)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copied_workspace_has_the_members_that_are_named_and_what_they_inherit() {
        let manifest = include_str!("../../Cargo.toml");
        let copy = with_members(manifest, &["core"]).expect("the manifest is TOML");
        let copy: toml::Table = toml::from_str(&copy).expect("so is its copy");
        let workspace = copy.get("workspace").expect("it is a workspace's");
        assert_eq!(
            workspace.get("members"),
            Some(&toml::Value::from(vec!["core"]))
        );
        assert!(workspace.get("default-members").is_none());
        assert!(workspace.get("package").is_some());
    }
}
