//! A record that tests passed. If the outcome of tests depends only on some files, and these files are as they were when
//! the tests passed, the tests are not repeated.

use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::path::PathBuf;
use std::{env, fs};

use anyhow::{Context as _, Result};

pub(crate) struct PassedBefore {
    /// This file records the tests that passed: a hash of their inputs, and their number.
    record: PathBuf,
    inputs: String,
}

/// Returns whether every check must be repeated, even if nothing has changed. Hosted machines set `CI`, and keep the
/// build folder between runs.
pub(crate) fn must_repeat() -> bool {
    env::var_os("CI").is_some()
}

impl PassedBefore {
    /// The tests depend on these files, and on all environment variables of this project.
    pub(crate) fn new(record: PathBuf, files: &[PathBuf]) -> Result<Self> {
        let mut hasher = DefaultHasher::new();
        for file in files {
            let content = fs::read(file).with_context(|| file.display().to_string())?;
            (file, content).hash(&mut hasher);
        }
        let mut variables: Vec<_> = env::vars_os()
            .filter(|(name, _)| name.to_string_lossy().starts_with("FRAMELOCK_"))
            .collect();
        variables.sort();
        variables.hash(&mut hasher);
        let inputs = format!("{:016x}", hasher.finish());
        Ok(Self { record, inputs })
    }

    /// Returns the number of tests that passed with these inputs, or `None` if the tests must run.
    pub(crate) fn count(&self) -> Option<usize> {
        let record = fs::read_to_string(&self.record).ok()?;
        let (inputs, count) = record.split_once(' ')?;
        let counts = !must_repeat() && inputs == self.inputs;
        counts.then(|| count.parse().ok())?
    }

    /// Records that this number of tests passed.
    pub(crate) fn write(&self, count: usize) -> Result<()> {
        let text = format!("{} {count}", self.inputs);
        fs::write(&self.record, text).with_context(|| self.record.display().to_string())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use xshell::Shell;

    #[test]
    fn tests_are_repeated_after_a_change_of_any_file() {
        let shell = Shell::new().expect("a working directory");
        let folder = shell.create_temp_dir().expect("a folder");
        let [record, image, figures] =
            ["record", "image", "figures"].map(|it| folder.path().join(it));
        fs::write(&image, "1").expect("a file");
        fs::write(&figures, "2").expect("a file");
        let files = [image.clone(), figures];
        let before = || PassedBefore::new(record.clone(), &files).expect("the files can be read");
        assert_eq!(before().count(), None);
        before().write(71).expect("a record");
        assert_eq!(before().count(), (!must_repeat()).then_some(71));
        fs::write(&image, "3").expect("a file");
        assert_eq!(before().count(), None);
    }
}
