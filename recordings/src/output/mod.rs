//! The one place that writes files.
//!
//! Pages, answers, tables, models, logs that grow and new folders: all get a temporary name beside their own, and their own only when they are
//! whole. Nothing is replaced but a regular file, and who asked is told: [`Written`] says what was replaced, and where the file really lies
//! if its folder is reached through a symbolic link.

mod error;
mod folder;
mod growing;
mod temporary;

use std::fmt;
use std::fs::{Metadata, Permissions};
use std::io::{BufWriter, Write};
use std::path::{Component, Path, PathBuf};

pub use error::OutputError;
pub use folder::NewFolder;
pub(crate) use growing::Growing;
use tempfile::NamedTempFile;

/// What was written.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Written {
    /// The file, as it was named.
    pub path: PathBuf,
    /// Whether it stands in the place of an older one.
    pub replaced: bool,
    /// Where it really lies, if its folder is reached through a symbolic link.
    pub really: Option<PathBuf>,
}

impl fmt::Display for Written {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "wrote {}", self.path.display())?;
        if self.replaced {
            write!(f, " in place of the file that was there")?;
        }
        match &self.really {
            Some(place) => write!(f, " (through a link: it lies at {})", place.display()),
            None => Ok(()),
        }
    }
}

/// Writes bytes to `path`, whole or not at all.
///
/// ```
/// use loopsight_recordings::output;
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("page.html");
/// assert!(!output::save(&path, b"old")?.replaced);
/// assert!(output::save(&path, b"new")?.replaced);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// As [`check`], and [`OutputError::Io`] where the disk is full.
pub fn save(path: &Path, bytes: &[u8]) -> Result<Written, OutputError> {
    let mut file = OutputFile::create(path)?;
    file.write_all(bytes)
        .map_err(|e| OutputError::io(path, "write", &e))?;
    file.finish()
}

/// Refuses a place that cannot be written: before the work whose result is to stand there.
///
/// # Errors
///
/// [`OutputError::Place`]: it is a folder, a link, a device, a pipe or a socket, lies in no folder, or the operating system refuses.
pub fn check(path: &Path) -> Result<(), OutputError> {
    OutputFile::create(path).map(drop)
}

/// Refuses an output that is one of the inputs, by whatever name: another path, a link, or a hard link.
///
/// # Errors
///
/// [`OutputError::Input`].
pub fn apart<'p>(
    output: &Path,
    inputs: impl IntoIterator<Item = &'p Path>,
) -> Result<(), OutputError> {
    let Ok(place) = output.canonicalize() else {
        return Ok(());
    };
    for input in inputs {
        if input.canonicalize().is_ok_and(|input| input == place) || one_file(input, output) {
            return Err(OutputError::Input {
                path: output.to_owned(),
                input: input.to_owned(),
            });
        }
    }
    Ok(())
}

/// Refuses one place for two outputs, by whatever names: the second would replace the first.
///
/// # Errors
///
/// [`OutputError::Place`].
pub fn distinct<'p>(outputs: impl IntoIterator<Item = &'p Path>) -> Result<(), OutputError> {
    let mut places = Vec::new();
    for output in outputs {
        let folder = folder_of(output)?;
        let place = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
        let place = place.join(output.file_name().unwrap_or_default());
        if places.contains(&place) {
            let why = "another output of this command goes to the same file; give them two names";
            return Err(OutputError::place(output, why));
        }
        places.push(place);
    }
    Ok(())
}

/// A file on its way: it has a temporary name in the folder of its own until [`OutputFile::finish`], and is gone if it is dropped before. What
/// a program that was killed left of it is removed by the next one that writes the same file.
pub struct OutputFile {
    path: PathBuf,
    out: BufWriter<NamedTempFile>,
}

impl OutputFile {
    /// Begins a file.
    ///
    /// # Errors
    ///
    /// As [`check`].
    pub fn create(path: &Path) -> Result<Self, OutputError> {
        let there = replaceable(path)?;
        let folder = folder_of(path)?;
        let file = temporary::create(path, folder, permissions(there.as_ref()))
            .map_err(|e| OutputError::place(path, e.to_string()))?;
        Ok(Self {
            path: path.to_owned(),
            out: BufWriter::new(file),
        })
    }

    /// Gives the file its name.
    ///
    /// # Errors
    ///
    /// [`OutputError::Io`] where the disk is full, and as [`check`] where something else came into its place meanwhile.
    pub fn finish(self) -> Result<Written, OutputError> {
        let Self { path, out } = self;
        let failed = |e: &std::io::Error| OutputError::io(&path, "write", e);
        let file = out.into_inner().map_err(|e| failed(e.error()))?;
        let written = take_place(&path)?;
        file.persist(&path).map_err(|e| failed(&e.error))?;
        Ok(written)
    }
}

impl Write for OutputFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.out.flush()
    }
}

/// What will be said of a file that is about to take its place.
fn take_place(path: &Path) -> Result<Written, OutputError> {
    Ok(Written {
        path: path.to_owned(),
        replaced: replaceable(path)?.is_some(),
        really: through_a_link(path),
    })
}

/// What stands at a place and may be replaced: a regular file, or nothing.
fn replaceable(path: &Path) -> Result<Option<Metadata>, OutputError> {
    if path.is_dir() {
        return Err(OutputError::place(
            path,
            "it is a directory, expected a file",
        ));
    }
    // Of the name itself: what a link points to would stay, and the link be lost.
    let Ok(there) = std::fs::symlink_metadata(path) else {
        return Ok(None);
    };
    let why = if there.is_symlink() {
        "it is a symbolic link, which is not replaced; give the file it points to"
    } else if !there.is_file() {
        "it is a device, a pipe or a socket, which is not replaced"
    } else {
        return Ok(Some(there));
    };
    Err(OutputError::place(path, why))
}

/// The folder of a file, which must be there.
fn folder_of(path: &Path) -> Result<&Path, OutputError> {
    let folder = match (path.parent(), path.file_name()) {
        (Some(parent), Some(_)) if !parent.as_os_str().is_empty() => parent,
        (Some(_), Some(_)) => Path::new("."),
        _ => return Err(OutputError::place(path, "expected the name of a file")),
    };
    if folder.is_dir() {
        return Ok(folder);
    }
    let why = format!("there is no directory {}", folder.display());
    Err(OutputError::place(path, why))
}

/// Where a file lies whose folder, as it is named, goes through a symbolic link. Links above the folder in which the program stands are not
/// of the name.
fn through_a_link(path: &Path) -> Option<PathBuf> {
    let folder = path.parent()?;
    let mut so_far = PathBuf::new();
    let linked = folder.components().any(|part| {
        so_far.push(part);
        matches!(part, Component::Normal(_)) && so_far.is_symlink()
    });
    let folder = linked.then(|| folder.canonicalize().ok()).flatten()?;
    Some(folder.join(path.file_name()?))
}

/// Whether two names, links followed, are of one file.
#[cfg(unix)]
fn one_file(a: &Path, b: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let number = |path: &Path| path.metadata().map(|m| (m.dev(), m.ino()));
    matches!((number(a), number(b)), (Ok(a), Ok(b)) if a == b)
}

#[cfg(not(unix))]
fn one_file(_: &Path, _: &Path) -> bool {
    false
}

/// Those of the file that is replaced; without one as any other new file, not readable by its owner alone.
#[cfg(unix)]
fn permissions(there: Option<&Metadata>) -> Option<Permissions> {
    use std::os::unix::fs::PermissionsExt;
    Some(there.map_or_else(|| Permissions::from_mode(0o666), Metadata::permissions))
}

#[cfg(not(unix))]
fn permissions(_: Option<&Metadata>) -> Option<Permissions> {
    None
}

#[cfg(test)]
mod tests;
