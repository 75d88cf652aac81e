//! Files through which the kernel is talked to: one number each.

use std::fmt;
use std::fs::{File, OpenOptions};
use std::io::{self, Write as _};
use std::os::unix::fs::FileExt as _;
use std::path::{Path, PathBuf};

/// What went wrong with which file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct FileError {
    pub(crate) path: PathBuf,
    pub(crate) why: String,
}

impl FileError {
    pub(crate) fn new(path: &Path, why: impl fmt::Display) -> Self {
        Self {
            path: path.to_owned(),
            why: why.to_string(),
        }
    }
}

impl fmt::Display for FileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.path.display(), self.why)
    }
}

impl embedded_hal::pwm::Error for FileError {
    fn kind(&self) -> embedded_hal::pwm::ErrorKind {
        embedded_hal::pwm::ErrorKind::Other
    }
}

/// A file that stays open and is read or written from its beginning each time; neither allocates.
#[derive(Debug)]
pub(crate) struct KernelFile {
    path: PathBuf,
    file: File,
}

impl KernelFile {
    /// Opens a file that exists.
    pub(crate) fn open(path: PathBuf, write: bool) -> Result<Self, FileError> {
        let opened = OpenOptions::new().read(!write).write(write).open(&path);
        match opened {
            Ok(file) => Ok(Self { path, file }),
            Err(error) => Err(FileError::new(&path, error)),
        }
    }

    /// Writes a number as a line, in one piece: the kernel takes each write as a whole.
    pub(crate) fn write(&self, number: u64) -> Result<(), FileError> {
        let mut line = [0u8; 24];
        let mut rest = &mut line[..];
        let written = writeln!(rest, "{number}").map(|()| 24 - rest.len());
        written
            .and_then(|n| self.file.write_all_at(&line[..n], 0))
            .map_err(|error| FileError::new(&self.path, error))
    }

    /// The number in the first line.
    pub(crate) fn read<N: std::str::FromStr>(&self) -> Result<N, FileError> {
        let mut bytes = [0u8; 64];
        let read = self.file.read_at(&mut bytes, 0);
        let n = read.map_err(|error| FileError::new(&self.path, error))?;
        let text = std::str::from_utf8(&bytes[..n]).unwrap_or_default();
        let line = text.lines().next().unwrap_or_default().trim();
        line.parse()
            .map_err(|_| FileError::new(&self.path, format!("found `{line}`, expected a number")))
    }
}

/// Reads a number once; `None` where there is no such file.
pub(crate) fn number(path: PathBuf) -> Result<Option<u64>, FileError> {
    match KernelFile::open(path.clone(), false) {
        Ok(file) => file.read().map(Some),
        Err(_) if !path.exists() => Ok(None),
        Err(error) => Err(error),
    }
}

/// Writes a text once.
pub(crate) fn put(path: &Path, text: &str) -> Result<(), FileError> {
    let done = OpenOptions::new()
        .write(true)
        .truncate(true)
        .open(path)
        .and_then(|mut file| file.write_all(text.as_bytes()));
    done.map_err(|error: io::Error| FileError::new(path, error))
}
