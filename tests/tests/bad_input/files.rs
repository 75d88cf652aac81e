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

/// A disk that is full, or a file that may not grow, is no mistake in the request: status 1, and what was done is said.
#[cfg(unix)]
#[test]
fn a_disk_that_is_full() {
    let desk = super::Desk::new();
    let long = super::LOOP.replace("duration_s = 1.0", "duration_s = 5.0");
    desk.write("loop.toml", long);
    for (arguments, done) in [
        (
            &["simulate", "model.toml", "experiment.toml", "-o", "new.csv"][..],
            "",
        ),
        (
            &["compare", "model.toml", "log.csv", "--html", "new.html"],
            "Free run: error",
        ),
        (&["run", "loop.toml", "-o", "new.csv"], "The loop ran"),
    ] {
        // A file of 4 kB is the largest; the signal that says so is ignored, and the write fails.
        let output = std::process::Command::new("sh")
            .current_dir(desk.0.path())
            .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
            .arg(super::PROGRAM)
            .args(arguments)
            .output()
            .unwrap();
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        let shown = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
        assert!(text.contains("cannot write"), "{arguments:?}: {text}");
        assert!(shown.contains(done), "{arguments:?}: {shown}");
        assert!(!desk.path("new.csv").exists() && !desk.path("new.html").exists());
    }
}

/// What a file names is read as well: an experiment's inputs, a loop's references and recordings.
#[test]
fn what_a_file_names_is_an_input() {
    let desk = Desk::new();
    let inputs = std::fs::read_to_string(desk.path("log.csv")).unwrap();
    desk.write("inputs.csv", &inputs);
    desk.write(
        "replay.toml",
        "duration_s = 1.0\nperiod_s = 0.01\ninputs_from = \"inputs.csv\"\n",
    );
    let looped = super::LOOP.replace(
        "[driver.simulated]",
        "[driver.simulated]\nmodel = \"robot.toml\"",
    );
    std::fs::copy(desk.path("model.toml"), desk.path("robot.toml")).unwrap();
    desk.write("looped.toml", &looped);
    for (arguments, stays) in [
        (
            &["simulate", "model.toml", "replay.toml", "-o", "inputs.csv"][..],
            "inputs.csv",
        ),
        (&["run", "looped.toml", "-o", "robot.toml"], "robot.toml"),
        (
            &["run", "looped.toml", "--html", "robot.toml"],
            "robot.toml",
        ),
        (
            &["run", "looped.toml", "--svg", "./robot.toml"],
            "robot.toml",
        ),
        (&["inspect", "log.csv", "-o", "log.csv"], "log.csv"),
    ] {
        let before = std::fs::read(desk.path(stays)).unwrap();
        desk.refused_saying(arguments, &[stays, "which this command reads"]);
        assert_eq!(std::fs::read(desk.path(stays)).unwrap(), before);
    }
}

/// Every output says what it replaced, and where it went if its folder is a link.
#[cfg(unix)]
#[test]
fn every_output_says_what_it_replaces() {
    let desk = Desk::new();
    std::fs::create_dir(desk.path("elsewhere")).unwrap();
    std::os::unix::fs::symlink(desk.path("elsewhere"), desk.path("out")).unwrap();
    for arguments in [
        &["simulate", "model.toml", "experiment.toml", "-o"][..],
        &["compare", "model.toml", "log.csv", "--html"],
        &["fit", "model.toml", "log.csv", "-o"],
        &["convert", "model.toml", "log.csv", "-o"],
        &["add", "model.toml", "coulomb_friction", "-o"],
        &["run", "loop.toml", "-o"],
        &["run", "loop.toml", "--svg"],
    ] {
        for said in ["", " in place of the file that was there"] {
            let mut words = arguments.to_vec();
            words.push("out/it.csv");
            let words: Vec<&OsStr> = words.iter().map(OsStr::new).collect();
            let output = desk.output(&words);
            let text = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{arguments:?}: {text}");
            let sentence = format!("wrote out/it.csv{said} (through a link: it lies at ");
            assert!(text.contains(&sentence), "{arguments:?}: {text}");
        }
        std::fs::remove_file(desk.path("elsewhere/it.csv")).unwrap();
    }
}

/// The second would replace the first, whatever it is called.
#[test]
fn two_outputs_of_one_name_are_refused() {
    let desk = Desk::new();
    for arguments in [
        &["fit", "model.toml", "log.csv", "-o", "it", "--html", "./it"][..],
        &["run", "loop.toml", "-o", "it", "--html", "it"],
        &["run", "loop.toml", "--html", "folder/../run.csv"],
    ] {
        desk.refused_saying(arguments, &["another output of this command"]);
    }
    for name in ["it", "run.csv", "run.csv.part"] {
        assert!(!desk.path(name).exists(), "{name}");
    }
}

/// A hard link is the file itself by another name.
#[cfg(unix)]
#[test]
fn a_hard_link_of_an_input_is_an_input() {
    let desk = Desk::new();
    std::fs::hard_link(desk.path("log.csv"), desk.path("hard.csv")).unwrap();
    let arguments = ["convert", "model.toml", "log.csv", "-o", "hard.csv"];
    desk.refused_saying(&arguments, &["hard.csv", "which this command reads"]);
}

/// Nobody reads what is said any more, as behind `2>&1 | head`: the work is done all the same, and no panic follows.
#[cfg(unix)]
#[test]
fn who_does_not_listen_any_more_costs_nothing() {
    let desk = Desk::new();
    for (arguments, status) in [
        ("convert model.toml log.csv -o si.csv", 0),
        ("convert model.toml nowhere -o no.csv", 2),
    ] {
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let mut command = std::process::Command::new(super::PROGRAM);
        let ended = command
            .current_dir(desk.0.path())
            .args(arguments.split(' '))
            .stdout(writer.try_clone().unwrap())
            .stderr(writer)
            .status()
            .unwrap();
        assert_eq!(ended.code(), Some(status), "{arguments}");
    }
    assert!(desk.path("si.csv").exists());
}
