//! One recording, written in every format by its own ordinary writer: the same numbers from all.
//!
//! `tests/formats/write_all.py RECORDING.csv FOLDER` writes the files.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test may panic"
)]
#![cfg(all(
    feature = "arrow",
    feature = "hdf5",
    feature = "parquet",
    feature = "sqlite"
))]

use std::path::{Path, PathBuf};

use loopsight_formats::{Format, Input, Log, OutColumn, read, write_parquet};

/// Columns by name.
fn recording(folder: &Path) -> Vec<(String, Vec<f64>)> {
    let text = std::fs::read_to_string(folder.join("recording.csv")).unwrap();
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().unwrap().split(',');
    let mut columns: Vec<(String, Vec<f64>)> =
        names.map(|name| (name.to_owned(), Vec::new())).collect();
    for line in lines {
        for ((_, column), field) in columns.iter_mut().zip(line.split(',')) {
            column.push(field.parse().unwrap());
        }
    }
    columns
}

/// The only channel whose path or alias contains a name.
fn channel<'l>(log: &'l Log, name: &str) -> &'l loopsight_formats::Channel {
    let has = |text: &str| text.contains(name);
    let fits = |c: &&loopsight_formats::Channel| {
        c.numbers().is_some() && (has(&c.info.path) || c.info.alias.as_deref().is_some_and(has))
    };
    let found: Vec<_> = log.channels.iter().filter(fits).collect();
    assert_eq!(found.len(), 1, "{}: {name}", log.source);
    found[0]
}

#[test]
#[ignore = "needs the files of tests/formats/write_all.py: LOOPSIGHT_RECORDINGS=FOLDER"]
fn every_writer_gives_the_same_numbers() {
    let folder = std::env::var_os("LOOPSIGHT_RECORDINGS").expect("LOOPSIGHT_RECORDINGS");
    let folder = PathBuf::from(folder);
    let columns = recording(&folder);
    let time = &columns[0].1;
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    files.sort();
    let mut formats = 0;
    for file in files {
        let input = Input::open(&file).unwrap();
        if input.format() == Format::Text {
            let text = std::fs::read(folder.join("recording.csv")).unwrap();
            assert_eq!(input.into_bytes().unwrap(), text, "{}", file.display());
            continue;
        }
        let log = read(input).unwrap();
        formats += 1;
        assert_eq!(log.cut, None, "{}", file.display());
        for (name, expected) in &columns[1..] {
            let channel = channel(&log, name);
            assert_eq!(channel.numbers().unwrap(), expected, "{}", file.display());
            // Formats without stamps have the time as a channel.
            let found = match log.time(channel) {
                Some(found) => found.to_vec(),
                None => self::channel(&log, "time_s").numbers().unwrap().to_vec(),
            };
            // A writer may count from another zero: whole microseconds later.
            let shift = (found[0] - time[0]) * 1e6;
            assert!(
                (shift - shift.round()).abs() < 1e-6,
                "{}: {shift}",
                file.display()
            );
            for (a, b) in found.iter().zip(time) {
                let back = ((a * 1e9).round() - (shift * 1e3).round()) / 1e9;
                assert_eq!(back, *b, "{}", file.display());
            }
        }
        println!("{}: the same", file.display());
    }
    assert!(formats >= 25, "{formats} files");
}

/// The recording as Parquet beside its folder, for `tests/formats/read_back.py`.
#[test]
#[ignore = "needs the files of tests/formats/write_all.py: LOOPSIGHT_RECORDINGS=FOLDER"]
fn a_table_for_other_programs() {
    let folder = std::env::var_os("LOOPSIGHT_RECORDINGS").expect("LOOPSIGHT_RECORDINGS");
    let columns = recording(Path::new(&folder));
    let unit = |name: &str| {
        ["rad_per_s", "m_per_s", "rad", "m", "V", "s"]
            .into_iter()
            .find(|unit| name.ends_with(&format!("_{unit}")))
            .map(|unit| unit.replace("_per_", "/"))
    };
    let out: Vec<OutColumn> = columns
        .iter()
        .map(|(name, _)| OutColumn {
            name: name.clone(),
            unit: unit(name),
        })
        .collect();
    let rows = 0..columns[0].1.len();
    let rows: Vec<f64> = rows
        .flat_map(|k| columns.iter().map(move |c| c.1[k]))
        .collect();
    let file = Path::new(&folder).with_file_name("written.parquet");
    write_parquet(std::fs::File::create(file).unwrap(), &out, &rows).unwrap();
}
