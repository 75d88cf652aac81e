//! A new folder that is made whole or not at all.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::{OutputError, Written, take_place};

/// Files for a new folder. They lie in a temporary folder beside it until [`NewFolder::finish`].
pub struct NewFolder {
    target: PathBuf,
    name: String,
    temporary: TempDir,
    written: Vec<String>,
}

impl NewFolder {
    /// Begins the folder `target`, which must not exist.
    ///
    /// # Errors
    ///
    /// [`OutputError::Folder`].
    pub fn create(target: &Path) -> Result<Self, OutputError> {
        let refuse = |why: &str| OutputError::folder(target, why);
        if target.symlink_metadata().is_ok() {
            return Err(refuse(
                "it exists already, and nothing is written over; choose another name",
            ));
        }
        let name = target.file_name().map(|n| n.to_string_lossy().into_owned());
        let Some(name) = name else {
            return Err(refuse("expected the name of a new folder"));
        };
        let parent = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        if !parent.is_dir() {
            let why = format!("there is no directory {}", parent.display());
            return Err(refuse(&why));
        }
        let temporary = tempfile::Builder::new()
            .prefix(".loopsight-")
            .suffix(".tmp")
            .tempdir_in(parent)
            .map_err(|e| refuse(&e.to_string()))?;
        let folder = Self {
            target: target.to_owned(),
            name,
            temporary,
            written: Vec::new(),
        };
        // One level deeper than the temporary folder: that one is its owner's alone, and this one becomes the target.
        std::fs::create_dir(folder.inside()).map_err(|e| refuse(&e.to_string()))?;
        Ok(folder)
    }

    /// The name of the new folder.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Where the files lie until all are there.
    pub fn inside(&self) -> PathBuf {
        self.temporary.path().join("new")
    }

    /// Writes a file of the new folder; returns where it lies until then.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`].
    pub fn write(&mut self, name: &str, text: &str) -> Result<PathBuf, OutputError> {
        let path = self.inside().join(name);
        let made = match path.parent() {
            Some(parent) => std::fs::create_dir_all(parent),
            None => Ok(()),
        };
        made.and_then(|()| std::fs::write(&path, text))
            .map_err(|e| OutputError::io(&self.target.join(name), "write", &e))?;
        self.written.push(name.to_owned());
        Ok(path)
    }

    /// Puts the folder in its place; the files that lie in it.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`], and [`OutputError::Folder`] where another one came into its place meanwhile.
    pub fn finish(self) -> Result<Vec<Written>, OutputError> {
        if self.target.symlink_metadata().is_ok() {
            let why = "it was made by another program meanwhile, and nothing is written over";
            return Err(OutputError::folder(&self.target, why));
        }
        std::fs::rename(self.inside(), &self.target)
            .map_err(|e| OutputError::io(&self.target, "make the folder", &e))?;
        let written = self.written.iter().map(|name| {
            take_place(&self.target.join(name)).map(|written| Written {
                replaced: false,
                ..written
            })
        });
        written.collect()
    }
}
