//! ROS 2 bags: a folder with `metadata.yaml` and one or more files in MCAP or SQLite.

use std::path::{Path, PathBuf};

use super::mcap::Reader;
use crate::detect::Format;
use crate::error::FormatError;
use crate::input::Input;
use crate::sink::Sink;

/// Reads all files of a bag, in their order.
pub(crate) fn read(input: &Input, sink: &mut dyn Sink) -> Result<(), FormatError> {
    let folder = input.folder().unwrap_or(Path::new(""));
    let mut reader = Reader::new(input.name());
    let files = files(folder)?;
    if files.is_empty() {
        return Err(FormatError::NotRead {
            log: input.name().into(),
            what: "a folder without metadata.yaml, .mcap or .db3".into(),
            remedy: "name a log file, or the folder of a ROS 2 bag".into(),
        });
    }
    for file in files {
        let mut part = match Input::open(&file) {
            Ok(part) => part,
            // A recorder that was killed leaves an empty file behind.
            Err(FormatError::Empty { log }) => {
                sink.note(format!("{log} is empty"));
                continue;
            }
            Err(error) => return Err(error),
        };
        reader.next_file();
        match part.format() {
            Format::Mcap => reader.records(&mut part, sink)?,
            Format::Sqlite => super::sqlite(part, &mut reader, sink)?,
            other => {
                return Err(FormatError::NotRead {
                    log: part.name().into(),
                    what: format!("a {other} file within a ROS 2 bag").into(),
                    remedy: "record with storage `mcap` or `sqlite3`".into(),
                });
            }
        }
    }
    reader.finish(sink);
    Ok(())
}

/// The files that `metadata.yaml` lists, or else all MCAP and SQLite files by name.
fn files(folder: &Path) -> Result<Vec<PathBuf>, FormatError> {
    let listed = std::fs::read_to_string(folder.join("metadata.yaml"))
        .map(|text| listed(&text))
        .unwrap_or_default();
    let mut files: Vec<PathBuf> = listed
        .iter()
        .filter_map(|name| Some(folder.join(Path::new(name).file_name()?)))
        .filter(|path| path.is_file())
        .collect();
    if files.is_empty() {
        let entries = std::fs::read_dir(folder).map_err(|e| FormatError::Io {
            path: folder.to_owned(),
            message: e.to_string().into(),
        })?;
        for entry in entries.flatten() {
            let name = entry.file_name().to_string_lossy().into_owned();
            let base = name.trim_end_matches(".zstd").trim_end_matches(".zst");
            if base.ends_with(".mcap") || base.ends_with(".db3") {
                files.push(entry.path());
            }
        }
        files.sort();
    }
    Ok(files)
}

/// The list under `relative_file_paths:`.
fn listed(yaml: &str) -> Vec<String> {
    let mut lines = yaml.lines().map(str::trim);
    let found = lines.any(|line| line == "relative_file_paths:");
    if !found {
        return Vec::new();
    }
    lines
        .map_while(|line| line.strip_prefix("- "))
        .map(|name| name.trim().trim_matches(['"', '\'']).to_owned())
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_of_a_bag_in_their_order() {
        let yaml = "rosbag2_bagfile_information:\n  version: 5\n  relative_file_paths:\n    - b_0.mcap\n    - \"a_1.mcap\"\n  duration:\n    nanoseconds: 1\n";
        assert_eq!(listed(yaml), ["b_0.mcap", "a_1.mcap"]);
        assert_eq!(listed("version: 5"), [] as [&str; 0]);
    }
}
