//! Files under a temporary name, and what killed programs left of theirs.
//!
//! A temporary file is locked while its program lives: the operating system takes the lock away with the process, however that ends. So
//! one whose lock can be taken belongs to nobody. Where a file system knows no locks, nothing is locked and nothing is removed.

use std::fs::{File, Permissions, TryLockError};
use std::io;
use std::path::Path;

use tempfile::{Builder, NamedTempFile};

const SUFFIX: &str = ".tmp";
/// Letters between the name of the file that is to be and the suffix.
const LETTERS: usize = 6;
/// Bytes of the name of the file that is to be: names have 255 at most, and the temporary one is longer.
const LONGEST: usize = 200;
/// How often another program may take a new file for an abandoned one.
const TRIES: usize = 100;

/// A temporary file in `folder` for `path`, locked; removes those for the same file that are nobody's.
pub(super) fn create(
    path: &Path,
    folder: &Path,
    permissions: Option<Permissions>,
) -> io::Result<NamedTempFile> {
    let prefix = prefix(path);
    remove_abandoned(&prefix, folder);
    let mut builder = Builder::new();
    builder.prefix(&prefix).suffix(SUFFIX).rand_bytes(LETTERS);
    if let Some(permissions) = permissions {
        builder.permissions(permissions);
    }
    for _ in 0..TRIES {
        let file = builder.tempfile_in(folder)?;
        match file.as_file().try_lock() {
            // Between the two lines above another program may have found it unlocked, and removed it.
            Ok(()) if !file.path().exists() => {}
            // It is just about to.
            Err(TryLockError::WouldBlock) => {}
            Ok(()) | Err(TryLockError::Error(_)) => return Ok(file),
        }
    }
    Err(io::Error::other("other programs remove its temporary file"))
}

/// What the temporary names for a file begin with. Long names that begin alike share it.
fn prefix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    format!(".loopsight-{}.", &name[..name.floor_char_boundary(LONGEST)])
}

/// Removes the temporary files of programs that are gone. What cannot be removed stays: it is in nobody's way.
fn remove_abandoned(prefix: &str, folder: &Path) {
    let Ok(entries) = folder.read_dir() else {
        return;
    };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let letters = name.to_str().and_then(|name| {
            let rest = name.strip_prefix(prefix)?;
            rest.strip_suffix(SUFFIX)
        });
        // No link, pipe or folder either, whatever its name.
        let ours = letters.is_some_and(|l| l.len() == LETTERS && !l.contains('.'))
            && entry.file_type().is_ok_and(|kind| kind.is_file());
        if !ours {
            continue;
        }
        if let Ok(file) = File::open(entry.path())
            && file.try_lock().is_ok()
        {
            // While the lock is held: nobody who has just made it takes it for their own.
            let _ = std::fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::names;
    use super::super::{OutputFile, save};
    use super::*;

    #[test]
    fn what_a_killed_program_left_is_removed_and_what_lives_stays() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let others = [
            // Of another file, and not of this program.
            ".loopsight-b.csv.aaaaaa.tmp",
            ".loopsight-a.csv.b.aaaaaa.tmp",
            ".loopsight-a.csv.tmp",
            "a.csv.part",
        ];
        for name in others.into_iter().chain([".loopsight-a.csv.aaaaaa.tmp"]) {
            std::fs::write(at(name), "half").unwrap();
        }
        // Another program that writes the same file, or one that looks so.
        let living = File::create_new(at(".loopsight-a.csv.bbbbbb.tmp")).unwrap();
        living.lock().unwrap();
        std::fs::create_dir(at(".loopsight-a.csv.cccccc.tmp")).unwrap();
        save(&at("a.csv"), b"whole").unwrap();
        let mut stays: Vec<&str> = others.to_vec();
        stays.extend([
            ".loopsight-a.csv.bbbbbb.tmp",
            ".loopsight-a.csv.cccccc.tmp",
            "a.csv",
        ]);
        stays.sort_unstable();
        assert_eq!(names(folder.path()), stays);
        // It is killed as well.
        drop(living);
        save(&at("a.csv"), b"whole").unwrap();
        stays.retain(|name| !name.contains("bbbbbb"));
        assert_eq!(names(folder.path()), stays);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_pipes_with_such_a_name_stay() {
        let folder = tempfile::tempdir().unwrap();
        let precious = folder.path().join("precious");
        std::fs::write(&precious, "x").unwrap();
        let link = folder.path().join(".loopsight-a.csv.aaaaaa.tmp");
        std::os::unix::fs::symlink(&precious, &link).unwrap();
        let socket = folder.path().join(".loopsight-a.csv.bbbbbb.tmp");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        save(&folder.path().join("a.csv"), b"whole").unwrap();
        assert!(precious.exists() && link.is_symlink() && socket.exists());
    }

    /// Many at once for one file: each takes what the others made for abandoned only where it is.
    #[test]
    fn nobody_loses_a_file_that_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.csv");
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..200 {
                        save(&path, b"whole").unwrap();
                    }
                });
            }
        });
        assert_eq!(std::fs::read(&path).unwrap(), b"whole");
        assert_eq!(names(folder.path()), ["a.csv"]);
    }

    #[test]
    fn long_names_are_cut() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["a".repeat(255), "ä".repeat(127)] {
            let path = folder.path().join(&name);
            let file = OutputFile::create(&path).unwrap();
            assert!(file.finish().is_ok(), "{name}");
        }
        assert_eq!(names(folder.path()).len(), 2);
    }
}
