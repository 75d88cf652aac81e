//! Files that are made row by row while something runs.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::{OutputError, Written, folder_of, replaceable, take_place};

/// How many abandoned parts may lie beside a file.
const MAX_PARTS: usize = 1000;

/// A file that grows beside its place as `NAME.part` (`NAME.2.part` and so on when an earlier run left its own there) and takes the
/// place when it is finished. Dropped before that, the part stays and can be read.
pub(crate) struct Growing {
    target: PathBuf,
    part: PathBuf,
}

impl Growing {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// As [`super::check`], and [`OutputError::Io`].
    pub(crate) fn create(target: &Path) -> Result<(Self, File), OutputError> {
        replaceable(target)?;
        folder_of(target)?;
        let mut number = 1;
        loop {
            let mut name = target.as_os_str().to_owned();
            name.push(if number == 1 {
                ".part".to_owned()
            } else {
                format!(".{number}.part")
            });
            let part = PathBuf::from(name);
            // Never an existing one, not even through a link.
            match File::create_new(&part) {
                Ok(file) => {
                    let target = target.to_owned();
                    return Ok((Self { target, part }, file));
                }
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists && number < MAX_PARTS => {
                    number += 1;
                }
                Err(e) => return Err(OutputError::io(&part, "create", &e)),
            }
        }
    }

    /// Where it will stand.
    pub(crate) fn target(&self) -> &Path {
        &self.target
    }

    /// Where it grows.
    pub(crate) fn part(&self) -> &Path {
        &self.part
    }

    /// Brings what was written to the disk and gives the file its name.
    ///
    /// # Errors
    ///
    /// [`OutputError`]; the part then remains.
    pub(crate) fn finish(self) -> Result<Written, OutputError> {
        File::open(&self.part)
            .and_then(|file| file.sync_all())
            .map_err(|e| OutputError::io(&self.part, "write", &e))?;
        let written = take_place(&self.target)?;
        std::fs::rename(&self.part, &self.target)
            .map_err(|e| OutputError::io(&self.target, "rename the finished log to", &e))?;
        Ok(written)
    }
}
