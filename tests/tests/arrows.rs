//! Who may look into whom, and the rules of the house that a program can check.

#![allow(
    clippy::unwrap_used,
    reason = "a workspace that cannot be read is how this program fails"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use cargo_metadata::{DependencyKind, Edition, Metadata, MetadataCommand};
use loopsight_tests::repository;

/// Each room, and the rooms it may depend on. Siblings do not stand in each other's line.
const ARROWS: [(&str, &[&str]); 15] = [
    ("core", &[]),
    ("model", &["core"]),
    ("link", &[]),
    ("plants", &["core", "model"]),
    ("estimators", &["core", "model"]),
    ("controllers", &["core", "model"]),
    ("drivers", &["core", "model"]),
    // What runs on a robot is composed at build time, of everything that runs there.
    (
        "onboard",
        &[
            "core",
            "model",
            "link",
            "plants",
            "estimators",
            "controllers",
        ],
    ),
    // Knows files and channels, and no model.
    ("formats", &[]),
    ("recordings", &["core", "model", "formats"]),
    // Machines that hide an effect share no equations with the plants they are held against.
    ("hidden", &["core", "model", "recordings"]),
    ("diagnosis", &["core", "model", "recordings"]),
    ("report", &["core", "model", "recordings", "diagnosis"]),
    (
        "loopsight",
        &[
            "core",
            "model",
            "plants",
            "estimators",
            "controllers",
            "drivers",
            "onboard",
            "recordings",
            "diagnosis",
            "report",
        ],
    ),
    (
        "tests",
        &[
            "core",
            "model",
            "plants",
            "estimators",
            "controllers",
            "drivers",
            "recordings",
            "diagnosis",
            "report",
            "hidden",
            "loopsight",
        ],
    ),
];

/// Lines of a file from which on it must be split.
const LONGEST: usize = 500;

fn metadata() -> Metadata {
    MetadataCommand::new()
        .manifest_path(repository().join("Cargo.toml"))
        .no_deps()
        .exec()
        .unwrap()
}

fn room(package: &str) -> Option<&str> {
    match package {
        "loopsight" => Some(package),
        _ => package.strip_prefix("loopsight-"),
    }
}

/// The rooms each room depends on, by kind of dependency.
fn rooms(kind: DependencyKind) -> BTreeMap<String, BTreeSet<String>> {
    metadata()
        .packages
        .iter()
        .map(|package| {
            let name = room(&package.name).unwrap_or(&package.name).to_owned();
            let on = package
                .dependencies
                .iter()
                .filter(|d| d.kind == kind)
                .filter_map(|d| room(&d.name))
                .map(str::to_owned)
                .collect();
            (name, on)
        })
        .collect()
}

#[test]
fn every_room_is_known() {
    let known: BTreeSet<String> = ARROWS.iter().map(|(name, _)| (*name).to_owned()).collect();
    let found: BTreeSet<String> = rooms(DependencyKind::Normal).into_keys().collect();
    assert_eq!(found, known);
}

#[test]
fn arrows_run_one_way() {
    for kind in [DependencyKind::Normal, DependencyKind::Build] {
        for (name, on) in rooms(kind) {
            let (_, allowed) = ARROWS.iter().find(|(n, _)| *n == name).unwrap();
            for other in on {
                assert!(
                    allowed.contains(&other.as_str()),
                    "{name} depends on {other}, expected at most {allowed:?}"
                );
            }
        }
    }
}

/// A crate may test itself with the help of others, as long as none of them is built on it.
#[test]
fn tests_make_no_circles() {
    let normal = rooms(DependencyKind::Normal);
    for (name, on) in rooms(DependencyKind::Development) {
        for other in on {
            let mut below: BTreeSet<&str> = BTreeSet::new();
            let mut open = vec![other.as_str()];
            while let Some(next) = open.pop() {
                if below.insert(next) {
                    open.extend(normal[next].iter().map(String::as_str));
                }
            }
            assert!(
                !below.contains(name.as_str()),
                "{name} is tested with {other}, which is built on {name}"
            );
        }
    }
}

#[test]
fn every_crate_keeps_the_rules_of_the_workspace() {
    let read = |path: &Path| -> toml::Table {
        std::fs::read_to_string(path)
            .unwrap()
            .parse::<toml::Table>()
            .unwrap()
    };
    let workspace = read(&repository().join("Cargo.toml"));
    assert_eq!(
        workspace["workspace"]["lints"]["rust"]["unsafe_code"].as_str(),
        Some("forbid")
    );
    for package in metadata().packages {
        let manifest = read(package.manifest_path.as_std_path());
        let lints = manifest.get("lints").and_then(|l| l.get("workspace"));
        assert_eq!(
            lints.and_then(toml::Value::as_bool),
            Some(true),
            "{}: `lints.workspace = true` is missing",
            package.name
        );
        assert_eq!(package.edition, Edition::E2024, "{}", package.name);
    }
}

/// The Rust files of the repository, as it is checked out.
fn sources() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![repository()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            if name.starts_with('.') || name == "target" {
                continue;
            }
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    assert!(found.len() > 50, "{} files", found.len());
    found
}

/// The command line is a door like any other: it goes through the library `loopsight`, and takes its
/// sentences from where they are written.
#[test]
fn the_command_line_looks_through_the_library_alone() {
    let folder = repository().join("loopsight/src/cli");
    let files: Vec<PathBuf> = sources()
        .into_iter()
        .filter(|path| path.starts_with(&folder))
        .collect();
    assert!(files.len() > 15, "{files:?}");
    for path in files {
        let text = std::fs::read_to_string(&path).unwrap();
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            for (at, _) in code.match_indices("loopsight_") {
                assert!(
                    code[at..].starts_with("loopsight_report::words"),
                    "{}:{}: {line}",
                    path.display(),
                    number + 1
                );
            }
        }
    }
}

/// Where files are made and get their names, and who else may, for what that has nothing to do with results.
const WRITERS: [(&str, &str); 2] = [
    ("recordings/src/output/", "the one place that writes files"),
    (
        "drivers/src/linux_gpio/file.rs",
        "files of the kernel, which are pins",
    ),
];

/// What makes, renames or copies a file.
const WRITING: [&str; 12] = [
    "fs::write",
    "fs::rename",
    "fs::copy",
    "fs::hard_link",
    "fs::OpenOptions",
    "{File, OpenOptions",
    "File::create",
    "File::options",
    "persist(",
    "persist_noclobber(",
    "tempfile_in(",
    "tempdir_in(",
];

/// Nothing half written, nothing replaced that is no file: there is one place to look for it.
#[test]
fn one_place_writes_files() {
    let mut looked_at = 0;
    for path in sources() {
        let name = path.strip_prefix(repository()).unwrap();
        let name = name.to_string_lossy().replace('\\', "/");
        // Rooms of the workspace without their tests; examples show what is shown to a person.
        let of_a_room = ARROWS
            .iter()
            .any(|(room, _)| *room != "tests" && name.starts_with(&format!("{room}/src/")));
        let test = name.ends_with("tests.rs") || name.contains("/tests/");
        if !of_a_room || test || WRITERS.iter().any(|(place, _)| name.starts_with(place)) {
            continue;
        }
        looked_at += 1;
        let text = std::fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod ").next().unwrap_or("");
        for (number, line) in code.lines().enumerate() {
            let line = line.split("//").next().unwrap_or("");
            for word in WRITING {
                // `OutputFile::create` is another word than `File::create`.
                let mut found = line.match_indices(word);
                assert!(
                    !found.any(|(at, _)| !line[..at].ends_with(char::is_alphanumeric)),
                    "{name}:{}: `{word}`; files are written by loopsight_recordings::output",
                    number + 1
                );
            }
        }
    }
    assert!(looked_at > 300, "{looked_at} files");
}

#[test]
fn no_file_is_too_long() {
    let long: Vec<String> = sources()
        .iter()
        .map(|path| {
            let lines = std::fs::read_to_string(path).unwrap().lines().count();
            (path, lines)
        })
        .filter(|(_, lines)| *lines >= LONGEST)
        .map(|(path, lines)| format!("{}: {lines} lines", path.display()))
        .collect();
    assert!(
        long.is_empty(),
        "files of {LONGEST} lines or more:\n{}",
        long.join("\n")
    );
}

#[test]
fn nothing_is_left_undone() {
    // In two halves, so that this file does not find itself.
    let words = [
        concat!("to", "do!("),
        concat!("unimple", "mented!("),
        concat!("db", "g!("),
    ];
    for path in sources() {
        let text = std::fs::read_to_string(&path).unwrap();
        for (number, line) in text.lines().enumerate() {
            let code = line.split("//").next().unwrap_or("");
            for word in words {
                assert!(
                    !code.contains(word),
                    "{}:{}: {word}",
                    path.display(),
                    number + 1
                );
            }
        }
    }
}
