//! Reads C files. They contain harnesses in C, and functions in C that harnesses in Rust call.
//!
//! A harness in C is a function `void proof_NAME_BOUND(void)`. No loop in the harness may run more than `BOUND - 1`
//! times. The files declare harnesses with the macro `PROOF(NAME, BOUND)`. Each harness is checked twice, once for an
//! `int` of 32 bits and once for an `int` of 16 bits.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context as _, Result};

use crate::child_processes::output;
use crate::harness::{Harness, Language};
use crate::translate::END;

const HARNESS: &str = "void proof_";

/// A C file after the preprocessor.
pub(crate) struct CFile {
    /// The file's name without its ending.
    name: String,
    /// The text for an `int` of 32 bits, and the text for an `int` of 16 bits.
    texts: [String; 2],
}

/// Reads the C files of the folder, if one is given.
pub(crate) fn read(folder: Option<&Path>) -> Result<Vec<CFile>> {
    let Some(folder) = folder else {
        return Ok(Vec::new());
    };
    let files = fs::read_dir(folder).with_context(|| folder.display().to_string())?;
    let paths = files.map(|file| Ok(file?.path()));
    let mut paths: Vec<_> = paths.collect::<Result<_>>()?;
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "c"));
    paths.sort();
    paths.iter().map(|path| CFile::read(folder, path)).collect()
}

impl CFile {
    fn read(folder: &Path, path: &Path) -> Result<Self> {
        let name = path.file_stem().context("a file has a name")?;
        // With an `int` of 16 bits, use other headers, because the system's headers assume 32 bits.
        let int16 = ["-nostdinc", "-I", &folder.join("int16").to_string_lossy()].map(str::to_owned);
        let text = |more: &[String]| {
            let mut cc = Command::new("cc");
            // On AVR, headers include `<avr/pgmspace.h>`. The folder contains a replacement for this file.
            cc.args(["-E", "-std=c99", "-I"]).arg(folder);
            cc.args(more).arg(path);
            output(&mut cc).with_context(|| format!("the preprocessor, for {}", path.display()))
        };
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            texts: [text(&[])?, text(&int16)?],
        })
    }

    pub(crate) fn text(&self, has_int16: bool) -> &str {
        let [int32, int16] = &self.texts;
        if has_int16 { int16 } else { int32 }
    }

    /// Returns the harnesses of the file.
    pub(crate) fn harnesses(&self) -> impl Iterator<Item = Harness> {
        let starts = self.text(false).split(HARNESS).skip(1);
        let names = starts.filter_map(|rest| rest.split_once("(void)")?.0.rsplit_once('_'));
        names.flat_map(|(name, bound)| {
            [false, true].map(|has_int16| Harness {
                name: format!(
                    "{}::{name}{}",
                    self.name,
                    if has_int16 { "_int16" } else { "" }
                ),
                symbol: format!("proof_{name}_{bound}"),
                unwind: bound.parse().ok(),
                covers: BTreeSet::new(),
                ends_with_cover: true,
                language: Language::C { has_int16 },
            })
        })
    }
}

/// Returns the C file of a harness. The file's name is the name of one of the harness's modules.
pub(crate) fn file_of<'a>(harness: &Harness, files: &'a [CFile]) -> Result<&'a CFile> {
    let mut modules = harness.name.split("::");
    let file = modules.find_map(|module| files.iter().find(|file| file.name == module));
    file.context("no C file has the name of one of the harness's modules; see --c")
}

/// Returns the program that runs a harness in C.
pub(crate) fn program(harness: &Harness, files: &[CFile]) -> Result<String> {
    let has_int16 = harness.language == Language::C { has_int16: true };
    let text = file_of(harness, files)?.text(has_int16);
    let symbol = &harness.symbol;
    Ok(format!(
        "{text}\nint main(void) {{\n  {symbol}();\n  __CPROVER_assert(0, \"{END}\");\n}}\n"
    ))
}
