//! A recording: the bytes of the line in a file, as they came.

use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// How many names are tried.
const MOST_NAMES: u32 = 9_999;

/// An open recording.
pub(super) struct Recording {
    path: PathBuf,
    file: BufWriter<File>,
    bytes: u64,
}

impl Recording {
    /// Begins one in a new file: a recording never replaces anything.
    pub(super) fn begin(path: &Path) -> io::Result<Self> {
        let file = File::create_new(path)?;
        Ok(Self {
            path: path.to_owned(),
            file: BufWriter::new(file),
            bytes: 0,
        })
    }

    /// Begins one in `directory`, in the first of `framelock-1.bin`, `framelock-2.bin` and so on
    /// that is not there yet.
    pub(super) fn begin_numbered(directory: &Path) -> io::Result<Self> {
        for number in 1..=MOST_NAMES {
            match Self::begin(&directory.join(format!("framelock-{number}.bin"))) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                outcome => return outcome,
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.file.write_all(bytes)?;
        self.bytes += bytes.len() as u64;
        Ok(())
    }

    /// From then on others find all of it in the file.
    pub(super) fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }

    /// Its file's name.
    pub(super) fn name(&self) -> String {
        self.path.display().to_string()
    }

    /// Bytes recorded.
    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a panic fails the test")]

    use super::*;

    #[cfg(target_os = "linux")]
    impl Recording {
        /// One on a disk without room.
        pub(in super::super) fn full() -> Self {
            let path = PathBuf::from("/dev/full");
            Self {
                file: BufWriter::new(File::options().write(true).open(&path).unwrap()),
                path,
                bytes: 0,
            }
        }
    }

    #[test]
    fn a_recording_replaces_nothing() {
        let directory = tempfile::tempdir().unwrap();
        let taken = directory.path().join("framelock-1.bin");
        std::fs::write(&taken, "precious").unwrap();
        let outcome = Recording::begin(&taken).map(|_| ());
        assert_eq!(outcome.unwrap_err().kind(), ErrorKind::AlreadyExists);

        for (number, text) in [(2, "one"), (3, "two")] {
            let mut recording = Recording::begin_numbered(directory.path()).unwrap();
            recording.write(text.as_bytes()).unwrap();
            recording.flush().unwrap();
            let expected = directory.path().join(format!("framelock-{number}.bin"));
            assert_eq!(recording.name(), expected.display().to_string());
            assert_eq!(recording.bytes(), 3);
            assert_eq!(std::fs::read_to_string(expected).unwrap(), text);
        }
        assert_eq!(std::fs::read_to_string(taken).unwrap(), "precious");
    }
}
