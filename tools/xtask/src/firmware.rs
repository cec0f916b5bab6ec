//! `cargo xtask firmware`: builds the firmware's images, as ELF for probe-rs and as Intel HEX for other programs. Also
//! checks that contradictory settings do not compile.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context as _, Result, ensure};
use ihex::Record;
use object::Endianness;
use object::elf::{PT_LOAD, ProgramHeader32};
use object::read::elf::{ElfFile32, ProgramHeader as _};
use serde::Deserialize;

use crate::workspace::{Workspace, run};

/// The package that tests the images.
pub(crate) const TESTS: &str = "framelock-firmware-tests";

const EXAMPLES: &str = "\
Examples:
  cargo xtask firmware                 the image that `cargo run --release` in firmware/ flashes
  cargo xtask firmware --all           every image that is tested";

/// Build the firmware for the nRF52840 as ELF and Intel HEX, in target/firmware/images, and print its size
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Arguments {
    /// Build every image that is tested
    #[arg(long)]
    all: bool,
}

impl Workspace {
    /// Builds the images with these names, or all if there is no name, from the sources at `root`. Returns the images'
    /// folder. A copy of the sources has its own folder, because cargo would otherwise mistake the copy's packages for
    /// those of the workspace.
    pub(crate) fn images(&self, root: &Path, names: &[&str]) -> Result<PathBuf> {
        let of_copy = (root != self.root).then(|| root.join("target"));
        let built = of_copy.unwrap_or_else(|| self.target.join("firmware"));
        run(self.script(&["images"]).arg(root).arg(&built).args(names))?;
        Ok(built.join("images"))
    }
}

/// Runs `cargo xtask firmware`.
pub(crate) fn build(workspace: &Workspace, arguments: &Arguments) -> Result<()> {
    let names: &[&str] = if arguments.all { &[] } else { &["default"] };
    let folder = workspace.images(&workspace.root, names)?;
    let images = fs::read_dir(&folder)?.map(|entry| Ok(entry?.path()));
    for image in images.collect::<Result<Vec<_>>>()? {
        let name = image.file_stem().and_then(OsStr::to_str);
        let Some(name) = name.filter(|_| image.extension() == Some("elf".as_ref())) else {
            continue;
        };
        if arguments.all || name == "default" {
            let segments =
                flashed(&fs::read(&image)?).with_context(|| image.display().to_string())?;
            let hex = folder.join(format!("framelock-nrf52840-{name}.hex"));
            fs::write(
                &hex,
                ihex::create_object_file_representation(&records(&segments))?,
            )?;
            let bytes: usize = segments.iter().map(|(_, bytes)| bytes.len()).sum();
            println!("{}: {bytes} bytes of flash", image.display());
            println!("{}", hex.display());
        }
    }
    Ok(())
}

/// Checks that settings which contradict each other do not compile.
pub(crate) fn contradictions(workspace: &Workspace) -> Result<()> {
    let sources = workspace.target.join("contradictions");
    workspace.copy(&sources)?;
    let accepted = accepted_contradictions(workspace, &sources)?;
    ensure!(
        accepted.is_empty(),
        "these settings must not compile, and the error must state the reason: {accepted:#?}"
    );
    Ok(())
}

/// The name by which a seeded bug refers to [`accepted_contradictions`].
pub(crate) const CONTRADICTIONS: &str = "contradictions";

/// The content of `firmware/contradictions.toml`.
#[derive(Deserialize)]
struct Contradictions {
    contradiction: Vec<Contradiction>,
}

/// A replacement in the settings, and the error that it must cause.
#[derive(Deserialize)]
struct Contradiction {
    right: String,
    wrong: String,
    message: String,
}

/// Puts each contradiction of `firmware/contradictions.toml` into a copy of the sources. Returns those that the
/// compiler does not report with the right message.
pub(crate) fn accepted_contradictions(workspace: &Workspace, copy: &Path) -> Result<Vec<String>> {
    let mut check = workspace.script(&["check_settings"]);
    check.arg(copy);
    run(&mut check)?;
    let folder = copy.join("firmware");
    let list = fs::read_to_string(folder.join("contradictions.toml"))?;
    let list: Contradictions = toml::from_str(&list)?;
    let file = folder.join("src/settings.rs");
    let settings = fs::read_to_string(&file)?;
    let mut accepted = Vec::new();
    for one in list.contradiction {
        let places = settings.matches(&one.right).count();
        ensure!(
            places == 1,
            "\"{}\" occurs {places} times, not once",
            one.right
        );
        fs::write(&file, settings.replace(&one.right, &one.wrong))?;
        let output = check.output()?;
        let errors = String::from_utf8_lossy(&output.stderr);
        if output.status.success() || !says(&errors, &one.message) {
            accepted.push(one.wrong);
        }
    }
    fs::write(&file, settings)?;
    Ok(accepted)
}

/// Returns whether the compiler reports a constant that panics with this message. The message may be a part of a failed
/// assertion without a message of its own. The lines that quote the source do not count.
fn says(errors: &str, message: &str) -> bool {
    errors
        .lines()
        .any(|line| line.starts_with("error[E0080]: ") && line.contains(message))
}

/// Returns what an ELF writes to the flash: code, constants and the initial values of variables. Each segment has its
/// address.
fn flashed(elf: &[u8]) -> Result<Vec<(u32, Vec<u8>)>> {
    let elf = ElfFile32::<Endianness>::parse(elf)?;
    let (endian, data) = (elf.endian(), elf.data());
    let loaded = elf.elf_program_headers().iter();
    let loaded =
        loaded.filter(|header| header.p_type(endian) == PT_LOAD && header.p_filesz(endian) > 0);
    let segment = |header: &ProgramHeader32<Endianness>| {
        let bytes = header.data(endian, data).ok();
        let bytes = bytes.context("a segment lies outside the file")?;
        Ok((header.p_paddr(endian), bytes.to_owned()))
    };
    loaded.map(segment).collect()
}

/// Returns the segments as records of Intel HEX, each with at most 16 bytes, none across a multiple of 64 KiB.
fn records(segments: &[(u32, Vec<u8>)]) -> Vec<Record> {
    let mut records = Vec::new();
    let mut upper = 0;
    for (address, bytes) in segments {
        let (mut address, mut rest) = (*address, bytes.as_slice());
        while !rest.is_empty() {
            let [high @ .., _, _] = address.to_be_bytes();
            let high = u16::from_be_bytes(high);
            if high != upper {
                upper = high;
                records.push(Record::ExtendedLinearAddress(high));
            }
            let room = 16 - address % 16;
            let count = u32::try_from(rest.len()).map_or(room, |rest| room.min(rest));
            let (value, after) = rest.split_at(count as usize);
            records.push(Record::Data {
                offset: (address & 0xFFFF) as u16,
                value: value.to_owned(),
            });
            address += count;
            rest = after;
        }
    }
    records.push(Record::EndOfFile);
    records
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hex_file_has_every_byte_of_the_segments_at_its_address() {
        let segments = [
            (0, (0..=255).collect()),
            (0xFFF3, (0..40).collect()),
            (0x1000_1018, vec![1, 2, 3, 4]),
        ];
        let text = ihex::create_object_file_representation(&records(&segments)).expect("valid");
        assert!(
            text.starts_with(":10000000000102030405060708090A0B0C0D0E0F78\n"),
            "{text}"
        );
        assert!(
            text.ends_with(":020000041000EA\n:0410180001020304CA\n:00000001FF\n"),
            "{text}"
        );
        let (mut upper, mut read) = (0, Vec::new());
        for record in ihex::Reader::new(&text) {
            match record.expect("a record") {
                Record::ExtendedLinearAddress(high) => upper = u32::from(high) << 16,
                Record::Data { offset, value } => {
                    let address = upper + u32::from(offset);
                    assert!(address as usize % 0x1_0000 + value.len() <= 0x1_0000);
                    read.extend((address..).zip(value));
                }
                _ => {}
            }
        }
        let expected = segments
            .into_iter()
            .flat_map(|(address, bytes)| (address..).zip(bytes));
        assert_eq!(read, expected.collect::<Vec<(u32, u8)>>());
    }
}
