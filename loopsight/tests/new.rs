//! `loopsight new`: what it writes runs at once, for every plant there is.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a command that breaks its word is how this program fails"
)]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use loopsight_model::registry::plants;
use loopsight_plants as _;
use tempfile::TempDir;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_loopsight"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

/// Runs what must succeed; returns standard output.
fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs what must be refused; returns standard error.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    said
}

fn files(folder: &Path) -> Vec<String> {
    let mut open = vec![folder.to_owned()];
    let mut found = Vec::new();
    while let Some(next) = open.pop() {
        for entry in std::fs::read_dir(next).unwrap() {
            let path: PathBuf = entry.unwrap().path();
            if path.is_dir() {
                open.push(path);
            } else {
                let name = path.strip_prefix(folder).unwrap();
                found.push(name.to_string_lossy().into_owned());
            }
        }
    }
    found.sort();
    found
}

fn desk() -> TempDir {
    tempfile::tempdir().unwrap()
}

#[test]
fn every_plant_has_a_starting_point_that_runs() {
    let desk = desk();
    assert!(plants().len() >= 2);
    for plant in plants() {
        let said = done(desk.path(), &["new", plant.id, "--plant", plant.id]);
        let folder = desk.path().join(plant.id);
        // The commands it names are those that work.
        let named: Vec<Vec<&str>> = said
            .lines()
            .filter_map(|l| l.trim().strip_prefix("loopsight "))
            .map(|l| l.split(' ').collect())
            .collect();
        assert_eq!(named.len(), 3, "{said}");
        for command in &named {
            if command[0] != "fit" {
                done(&folder, command);
            }
        }
        let readme = std::fs::read_to_string(folder.join("README.md")).unwrap();
        for command in &named {
            assert!(readme.contains(&command.join(" ")), "{readme}");
        }
        // A machine that is driven, and seen to be.
        let log = std::fs::read_to_string(folder.join("log.csv")).unwrap();
        let rows: Vec<Vec<f64>> = log
            .lines()
            .skip(1)
            .map(|l| l.split(',').map(|v| v.parse().unwrap()).collect())
            .collect();
        assert!((500..=21_000).contains(&rows.len()), "{} rows", rows.len());
        let last = rows[0].len() - 1;
        let largest = rows.iter().fold(0.0f64, |a, r| a.max(r[last].abs()));
        assert!(largest > 0.0 && largest.is_finite(), "{}", plant.id);

        // Every parameter with its unit and its sentence.
        let model = std::fs::read_to_string(folder.join("model.toml")).unwrap();
        let sets = plant.parameterizations.iter().flat_map(|s| s.parameters);
        for parameter in plant.parameters.iter().chain(sets) {
            let head = format!(
                "# {}, {}: {}; ",
                parameter.symbol, parameter.unit, parameter.doc
            );
            let line = format!("{} =", parameter.id);
            assert!(
                model.contains(&head) && model.contains(&line),
                "{head}\n{model}"
            );
        }
        let looped = folder.join("loop.toml").is_file();
        assert_eq!(looped, !plant.controlled.is_empty(), "{}", plant.id);
        if looped {
            done(&folder, &["check", "loop.toml"]);
            let said = done(&folder, &["run", "loop.toml"]);
            assert!(said.contains("the run lasted"), "{said}");
        }
    }
}

#[test]
fn the_fit_of_a_starting_point_finds_the_values_it_was_made_with() {
    let desk = desk();
    done(desk.path(), &["new", "axis", "--plant", "dc_axis"]);
    let folder = desk.path().join("axis");
    done(
        &folder,
        &["simulate", "model.toml", "experiment.toml", "-o", "log.csv"],
    );
    let said = done(&folder, &["fit", "model.toml", "log.csv", "--json"]);
    let fit: serde_json::Value = serde_json::from_str(&said).unwrap();
    for (name, value) in [("K_A", -2.0), ("K_C", 8.0)] {
        let found = fit["parameters"][name]["value"].as_f64().unwrap();
        assert!((found / value - 1.0).abs() < 0.01, "{name}: {found}");
    }
}

#[test]
fn nothing_is_written_over() {
    let desk = desk();
    std::fs::create_dir(desk.path().join("mine")).unwrap();
    std::fs::write(desk.path().join("mine/notes.txt"), "keep\n").unwrap();
    for kind in [&["--plant", "dc_axis"][..], &["--rust"]] {
        let said = refused(desk.path(), &[&["new", "mine"], kind].concat());
        assert!(said.contains("exists already"), "{said}");
    }
    let said = refused(desk.path(), &["new", "no/such/robot", "--plant", "ddmr"]);
    assert!(said.contains("no directory no/such"), "{said}");
    // Nor does a refusal leave anything behind.
    assert_eq!(files(desk.path()), ["mine/notes.txt"]);
}

#[test]
fn wrong_requests_name_the_right_one() {
    let desk = desk();
    let said = refused(desk.path(), &["new", "robot", "--plant", "dmr"]);
    assert!(said.contains("did you mean `ddmr`?"), "{said}");
    for plant in plants() {
        assert!(said.contains(plant.id), "{said}");
    }
    let said = refused(desk.path(), &["new", "robot"]);
    assert!(
        said.contains("--plant") && said.contains("--rust"),
        "{said}"
    );
    refused(desk.path(), &["new", "robot", "--plant", "ddmr", "--rust"]);
    let said = refused(desk.path(), &["new", "my ship", "--rust"]);
    assert!(said.contains("`my-ship` would do"), "{said}");
    let said = refused(desk.path(), &["new", "ship", "--rust", "--loopsight", "."]);
    assert!(said.contains("no checkout of loopsight"), "{said}");
    assert_eq!(files(desk.path()), Vec::<String>::new());
}

/// The CI builds one; here it is what it should be.
#[test]
fn a_crate_has_all_its_files_and_knows_where_loopsight_is() {
    let desk = desk();
    let said = done(desk.path(), &["new", "my-crate", "--rust"]);
    assert!(said.contains("cargo run"), "{said}");
    let folder = desk.path().join("my-crate");
    assert_eq!(
        files(&folder),
        [
            ".gitignore",
            "Cargo.lock",
            "Cargo.toml",
            "README.md",
            "model.toml",
            "ship.toml",
            "src/main.rs",
            "src/norrbin_damping.rs",
            "src/ship_heading.rs",
            "turns.toml",
            "zigzag.toml",
        ]
    );
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    assert_eq!(manifest["package"]["name"].as_str(), Some("my-crate"));
    for package in ["loopsight-core", "loopsight-model", "loopsight"] {
        let path = &manifest["dependencies"][package]["path"];
        let path = Path::new(path.as_str().unwrap());
        assert!(path.join("Cargo.toml").is_file(), "{}", path.display());
    }
}
