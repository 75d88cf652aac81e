//! A new folder that comes into being whole or not at all.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::{Error, Result};

/// Files on their way into a new folder: they lie in a temporary one beside it until
/// [`Folder::finish`].
pub(super) struct Folder {
    target: PathBuf,
    name: String,
    temporary: TempDir,
    written: Vec<String>,
}

impl Folder {
    /// Begins the folder `target`, which must not exist.
    pub(super) fn new(target: &Path) -> Result<Self> {
        let refuse = |why: &str| {
            let shown = target.display();
            Error::request(format!("cannot make the folder `{shown}`: {why}"))
        };
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
        // A temporary folder is readable by its owner alone: the new one lies inside of it.
        std::fs::create_dir(folder.inside()).map_err(|e| refuse(&e.to_string()))?;
        Ok(folder)
    }

    /// The name of the new folder.
    pub(super) fn name(&self) -> &str {
        &self.name
    }

    /// Where the files lie until all are there.
    pub(super) fn inside(&self) -> PathBuf {
        self.temporary.path().join("new")
    }

    /// Writes a file of the new folder.
    pub(super) fn write(&mut self, name: &str, text: &str) -> Result<PathBuf> {
        let path = self.inside().join(name);
        let made = match path.parent() {
            Some(parent) => std::fs::create_dir_all(parent),
            None => Ok(()),
        };
        made.and_then(|()| std::fs::write(&path, text))
            .map_err(|e| {
                let shown = self.target.join(name);
                Error::request(format!("cannot write `{}`: {e}", shown.display()))
            })?;
        self.written.push(name.to_owned());
        Ok(path)
    }

    /// Puts the folder in its place; the files that lie in it.
    pub(super) fn finish(self) -> Result<Vec<PathBuf>> {
        std::fs::rename(self.inside(), &self.target).map_err(|e| {
            let shown = self.target.display();
            Error::request(format!("cannot make the folder `{shown}`: {e}"))
        })?;
        let names = self.written.iter();
        Ok(names.map(|name| self.target.join(name)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_there_whole_or_not_at_all() {
        let desk = tempfile::tempdir().unwrap();
        let target = desk.path().join("robot");
        let mut folder = Folder::new(&target).unwrap();
        folder.write("src/a.rs", "// a\n").unwrap();
        assert!(!target.exists());
        folder.finish().unwrap();
        assert_eq!(
            std::fs::read_to_string(target.join("src/a.rs")).unwrap(),
            "// a\n"
        );
        assert!(Folder::new(&target).is_err());
        drop(Folder::new(&desk.path().join("other")).unwrap());
        let left: Vec<_> = std::fs::read_dir(desk.path()).unwrap().collect();
        assert_eq!(left.len(), 1, "{left:?}");
    }
}
