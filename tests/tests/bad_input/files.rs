//! Files that are of another kind, or cannot be written.

use std::ffi::OsStr;

use super::Desk;

#[test]
fn files_that_are_not_what_they_should_be() {
    let desk = Desk::new();
    for wrong in ["folder", "binary", "nowhere"] {
        for arguments in [
            &["check", wrong][..],
            &["compare", wrong, "log.csv"],
            &["compare", "model.toml", wrong],
            &["compare", wrong],
            &["fit", wrong, "log.csv"],
            &["fit", "model.toml", wrong],
            &["fit", "model.toml", "log.csv", "--test", wrong],
            &["simulate", wrong, "experiment.toml", "-o", "new.csv"],
            &["simulate", "model.toml", wrong, "-o", "new.csv"],
            &["run", wrong],
        ] {
            desk.refused_saying(arguments, &[wrong]);
        }
    }
    for extension in ["toml", "csv", "json"] {
        let name = format!("binary.{extension}");
        std::fs::copy(desk.path("binary"), desk.path(&name)).unwrap();
        desk.refused_saying(&["check", &name], &[&name]);
    }
}

#[test]
fn places_that_cannot_be_written() {
    let desk = Desk::new();
    for wrong in ["folder", "nowhere/new", "log.csv/new", ""] {
        for arguments in [
            &["simulate", "model.toml", "experiment.toml", "-o", wrong][..],
            &["compare", "model.toml", "log.csv", "--html", wrong],
            &["fit", "model.toml", "log.csv", "-o", wrong],
            &["fit", "model.toml", "log.csv", "--html", wrong],
            &["run", "loop.toml", "-o", wrong],
            &["run", "loop.toml", "--html", wrong],
        ] {
            let words: Vec<&OsStr> = arguments.iter().map(OsStr::new).collect();
            let output = desk.output(&words);
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {text}");
            assert!(text.contains(wrong), "{arguments:?}: {text}");
            // Refused before the work, not after it.
            assert!(output.stdout.is_empty(), "{arguments:?}");
        }
    }
    let left: Vec<String> = std::fs::read_dir(desk.0.path())
        .unwrap()
        .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.contains("tmp") || name.contains("part"))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}
