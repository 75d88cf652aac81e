//! The command as a user has it: what it prints, what it writes, how it ends.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a command that breaks its word is how this program fails"
)]

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::{Child, Output, Stdio};
use std::time::{Duration, Instant};

use assert_cmd::Command;
use loopsight_model::model::Model;
use loopsight_model::registry::{effects, parts, plants};
use loopsight_tests::{repository, twil_path};
use serde_json::Value;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

/// A folder with the files of the Twil, in which commands are run.
struct Desk(TempDir);

const EXPERIMENT: &str = "duration_s = 10.0\nperiod_s = 0.01\n\n[inputs]\n\
    voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.5, seed = 3 } }\n\
    voltage_left = { prbs = { amplitude = 9.0, hold_s = 0.5, seed = 3 } }\n";

const LOOP: &str = "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 6.0\nlog = \"run.csv\"\n\n\
    [driver.simulated]\nlimit = 12.0\n\n\
    [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n\n\
    [estimator.rls]\n\n\
    [reference]\nlinear_velocity = { steps = { at = [[0.5, 0.1], [3.0, -0.1]] } }\n";

impl Desk {
    fn new() -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        std::fs::copy(twil_path(), desk.path("model.toml")).unwrap();
        desk.write("experiment.toml", EXPERIMENT);
        desk.write("loop.toml", LOOP);
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn run(&self, arguments: &[&str]) -> Output {
        Command::new(PROGRAM)
            .current_dir(self.0.path())
            .args(arguments)
            .timeout(Duration::from_secs(120))
            .output()
            .unwrap()
    }

    /// Runs what must succeed; returns standard output.
    fn done(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).unwrap()
    }

    fn json(&self, arguments: &[&str]) -> Value {
        let text = self.done(arguments);
        serde_json::from_str(&text).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {text}"))
    }

    /// Starts a command that runs until it is stopped.
    fn start(&self, arguments: &[&str]) -> Child {
        std::process::Command::new(PROGRAM)
            .current_dir(self.0.path())
            .args(arguments)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }
}

fn keys(value: &Value) -> BTreeSet<&str> {
    value
        .as_object()
        .unwrap()
        .keys()
        .map(String::as_str)
        .collect()
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("not a number: {value}"))
}

/// Everything a page needs is inside.
fn opens_offline(path: &Path) {
    let html = std::fs::read_to_string(path).unwrap();
    assert!(html.starts_with("<!DOCTYPE html>") || html.starts_with("<!doctype html>"));
    // The charts' library is one script; its own strings (map servers, licences) load nothing.
    let outside_scripts: String = html
        .split("<script")
        .map(|piece| {
            piece
                .split_once("</script>")
                .map_or(piece, |(_, after)| after)
        })
        .collect();
    for load in [
        "src=",
        "href=\"http",
        "url(http",
        "@import",
        "<iframe",
        "<link",
    ] {
        assert!(
            !outside_scripts.contains(load),
            "{}: {load}",
            path.display()
        );
    }
    for tag in html.match_indices("<script").map(|(at, _)| &html[at..]) {
        let tag = tag.split('>').next().unwrap();
        assert!(!tag.contains("src="), "{}: {tag}", path.display());
    }
}

#[test]
fn a_list_names_everything_that_is_linked() {
    let desk = Desk::new();
    let text = desk.done(&["list"]);
    let mut ids: Vec<&str> = plants().iter().map(|m| m.id).collect();
    ids.extend(effects().iter().map(|m| m.id));
    ids.extend(parts().iter().map(|m| m.id));
    for id in &ids {
        assert!(
            text.lines().any(|l| l.trim_start().starts_with(id)),
            "{id}: {text}"
        );
    }
    let fitting = desk.done(&["list", "effects", "--for", "dc_axis"]);
    assert!(fitting.contains("coulomb_friction") && fitting.contains("  at shaft\n"));
    assert!(!fitting.contains("scrub_friction"), "it is about turning");
    let wrong = desk.run(&["list", "--for", "dc_axes"]);
    assert_eq!(wrong.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("did you mean `dc_axis`?"));
    assert_eq!(
        desk.run(&["list", "drivers", "--for", "ddmr"])
            .status
            .code(),
        Some(2)
    );
    let only = desk.done(&["list", "plants"]);
    assert!(
        only.contains("ddmr") && !only.contains("coulomb_friction"),
        "{only}"
    );
    let json = desk.json(&["list", "--json"])["parts"].to_string();
    for id in ids {
        assert!(json.contains(&format!("\"{id}\"")), "{id}: {json}");
    }
}

#[test]
fn explanations_hold_the_equation_the_reference_and_the_example() {
    let desk = Desk::new();
    let mut all: Vec<(&str, &str, &str)> = Vec::new();
    all.extend(plants().iter().map(|m| (m.id, m.reference, m.example)));
    all.extend(effects().iter().map(|m| (m.id, m.reference, m.example)));
    all.extend(parts().iter().map(|m| (m.id, m.reference, m.example)));
    for (id, reference, example) in all {
        let text = desk.done(&["explain", id]);
        assert!(text.starts_with(id) && text.contains(reference), "{text}");
        for line in example.lines() {
            assert!(text.contains(line), "{id}: {line}: {text}");
        }
    }
}

#[test]
fn help_is_there_and_fits_a_terminal() {
    let desk = Desk::new();
    let top = desk.done(&["--help"]);
    let (_, commands) = top.split_once("Commands:\n").unwrap();
    let commands = commands.lines().take_while(|l| !l.is_empty());
    let mut pages = vec![vec!["--help"]];
    pages.extend(commands.map(|l| vec![l.split_whitespace().next().unwrap(), "--help"]));
    pages.retain(|page| page[0] != "help");
    assert!(pages.len() > 8, "{pages:?}");
    for page in pages {
        let text = desk.done(&page);
        assert!(text.contains("Usage: loopsight"), "{text}");
        for line in text.lines() {
            assert!(line.chars().count() <= 100, "{page:?}: {line}");
        }
    }
}

#[test]
fn completions_are_there_for_every_shell() {
    let desk = Desk::new();
    for shell in ["bash", "zsh", "fish"] {
        let script = desk.done(&["completions", shell]);
        for word in ["loopsight", "simulate", "compare", "--html"] {
            let found = script.contains(word) || script.contains(word.trim_start_matches('-'));
            assert!(found, "{shell}: {word}");
        }
    }
}

#[test]
fn from_an_experiment_to_a_better_loop() {
    let desk = Desk::new();
    desk.done(&["simulate", "model.toml", "experiment.toml", "-o", "log.csv"]);
    let said = desk.done(&[
        "check",
        "model.toml",
        "experiment.toml",
        "loop.toml",
        "log.csv",
    ]);
    for what in ["a model", "an experiment", "a loop", "a log"] {
        assert!(said.contains(what), "{said}");
    }

    // Held against the log it made, the model is right up to the counts.
    let good = desk.json(&[
        "compare",
        "model.toml",
        "log.csv",
        "--json",
        "--html",
        "c.html",
    ]);
    assert!(number(&good["nrmse"]) < 0.02, "{good}");
    opens_offline(&desk.path("c.html"));

    // A model that is wrong by half is found out, and mended by a fit.
    let wrong = desk
        .read("model.toml")
        .replace("K_F = 0.656 ", "K_F = 0.4 ");
    let wrong = wrong.replace("K_A = -15.146 ", "K_A = -10.0 ");
    desk.write("guess.toml", &wrong);
    let bad = desk.json(&["compare", "guess.toml", "log.csv", "--json"]);
    assert!(number(&bad["nrmse"]) > 0.2, "{bad}");
    let fit = desk.json(&[
        "fit",
        "guess.toml",
        "log.csv",
        "-o",
        "fitted.toml",
        "--html",
        "f.html",
        "--json",
    ]);
    opens_offline(&desk.path("f.html"));
    let k_a = number(&fit["parameters"]["K_A"]["value"]);
    assert!((k_a / -15.146 - 1.0).abs() < 0.01, "{fit}");

    // The fitted file is the old one with other numbers.
    let fitted = desk.read("fitted.toml");
    let comments = |text: &str| -> Vec<String> {
        let after = text.lines().filter_map(|l| l.split_once('#'));
        after.map(|(_, comment)| comment.to_owned()).collect()
    };
    assert_eq!(comments(&fitted), comments(&wrong));
    let (model, _) = Model::load(&desk.path("fitted.toml")).unwrap();
    for parameter in &model.parameters {
        // Digits far below the standard error are not written.
        let said = number(&fit["parameters"][&parameter.name]["value"]);
        let written = parameter.value.unwrap();
        let off = (written - said).abs();
        assert!(
            off <= 1e-6 * said.abs(),
            "{}: {written}, {said}",
            parameter.name
        );
    }

    // The other method, judged on another log.
    let second = EXPERIMENT.replace("seed = 3", "seed = 4");
    desk.write("second.toml", &second);
    desk.done(&["simulate", "model.toml", "second.toml", "-o", "second.csv"]);
    let rls = desk.json(&[
        "fit",
        "guess.toml",
        "log.csv",
        "--test",
        "second.csv",
        "--method",
        "rls",
        "--json",
    ]);
    assert_eq!(rls["method"], "rls");
    assert!(number(&rls["nrmse"]) < 0.2, "{rls}");

    // The fitted model goes into the loop, and the loop's log is a log like any other.
    desk.write("loop.toml", &LOOP.replace("model.toml", "fitted.toml"));
    let run = desk.json(&["run", "loop.toml", "--json", "--html", "r.html"]);
    assert_eq!(number(&run["ticks"]), 600.0);
    opens_offline(&desk.path("r.html"));
    let again = desk.json(&["compare", "fitted.toml", "run.csv", "--json"]);
    assert!(number(&again["signals"][0]["nrmse"]) < 0.1, "{again}");
}

#[test]
fn the_same_request_gives_the_same_log() {
    let desk = Desk::new();
    for log in ["a.csv", "b.csv"] {
        desk.done(&["simulate", "model.toml", "experiment.toml", "-o", log]);
    }
    assert_eq!(desk.read("a.csv"), desk.read("b.csv"));
    desk.done(&["run", "loop.toml", "-o", "c.csv"]);
    desk.done(&["run", "loop.toml", "-o", "d.csv"]);
    assert_eq!(desk.read("c.csv"), desk.read("d.csv"));
}

#[test]
fn json_has_the_keys_that_were_promised() {
    let desk = Desk::new();
    desk.done(&["simulate", "model.toml", "experiment.toml", "-o", "log.csv"]);
    let compare = [
        "faults",
        "fit_percent",
        "nrmse",
        "schema",
        "signals",
        "summary",
        "where_it_fails",
    ];
    let said = desk.json(&["compare", "model.toml", "log.csv", "--json"]);
    assert_eq!(keys(&said), BTreeSet::from(compare));
    let signal = [
        "fit_percent",
        "id",
        "nrmse",
        "one_step_nrmse",
        "rmse",
        "unit",
    ];
    assert_eq!(keys(&said["signals"][0]), BTreeSet::from(signal));
    assert_eq!(said["signals"][0]["unit"], "m/s");

    let said = desk.json(&["fit", "model.toml", "log.csv", "--json"]);
    let more = [
        "parameters",
        "method",
        "nrmse_before",
        "nrmse_fit",
        "iterations",
        "flat",
        "cancelled",
        "convergence",
        "derived",
    ];
    assert_eq!(keys(&said), compare.into_iter().chain(more).collect());
    let parameters = &said["parameters"];
    let parameter = ["interval95", "std_error", "unit", "value", "verdict"];
    assert_eq!(keys(&parameters["K_A"]), BTreeSet::from(parameter));
    assert_eq!(parameters["K_A"]["unit"], "1/s");
    let interval = parameters["K_A"]["interval95"].as_array().unwrap();
    let value = number(&parameters["K_A"]["value"]);
    assert!(number(&interval[0]) < value && value < number(&interval[1]));
}

#[test]
fn json_keeps_standard_output_to_itself() {
    let desk = Desk::new();
    desk.done(&["simulate", "model.toml", "experiment.toml", "-o", "log.csv"]);
    for arguments in [
        &[
            "compare",
            "model.toml",
            "log.csv",
            "--json",
            "--html",
            "c.html",
        ][..],
        &["fit", "model.toml", "log.csv", "--json", "-o", "f.toml"],
        &["run", "loop.toml", "--json"],
        &["list", "--json"],
    ] {
        let output = desk.run(arguments);
        assert!(output.status.success());
        serde_json::from_slice::<Value>(&output.stdout).unwrap();
        assert!(!output.stdout.contains(&0x1b), "{arguments:?}: colours");
    }
}

#[test]
fn the_exit_status_says_who_is_to_blame() {
    let desk = Desk::new();
    assert_eq!(desk.run(&["list"]).status.code(), Some(0));
    assert_eq!(desk.run(&["explain", "nothing"]).status.code(), Some(2));
    assert_eq!(desk.run(&["--version"]).status.code(), Some(0));
    assert_eq!(desk.run(&[]).status.code(), Some(2));
    // The files are right, the work fails: the robot leaves the finite numbers.
    let wild = desk
        .read("model.toml")
        .replace("K_B = 0.005", "K_B = 500.0");
    desk.write("wild.toml", &wild.replace("K_E = -3.945", "K_E = 500.0"));
    desk.done(&["simulate", "model.toml", "experiment.toml", "-o", "log.csv"]);
    assert_eq!(
        desk.run(&["compare", "wild.toml", "log.csv"]).status.code(),
        Some(1)
    );
}

/// Every command line and file of the examples that can be checked is right.
#[test]
fn files_of_the_examples_are_right() {
    let desk = Desk::new();
    let folder = repository().join("examples/twil");
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml" || e == "csv") {
            desk.done(&["check", &path.display().to_string()]);
        }
    }
}

/// Waits until `log` has rows that reached the disk.
fn wait_for_rows(log: &Path, rows: usize) {
    let start = Instant::now();
    while std::fs::read_to_string(log).map_or(0, |t| t.lines().count()) <= rows {
        assert!(
            start.elapsed() < Duration::from_secs(30),
            "no {}",
            log.display()
        );
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn signal(child: &Child, name: &str) {
    let status = std::process::Command::new("kill")
        .args([name, &child.id().to_string()])
        .status()
        .unwrap();
    assert!(status.success());
}

fn endless(desk: &Desk) -> Child {
    let text = LOOP.replace("duration_s = 6.0\n", "real_time = true\n");
    desk.write("endless.toml", &text);
    let child = desk.start(&["run", "endless.toml", "--json"]);
    wait_for_rows(&desk.path("run.csv.part"), 50);
    child
}

#[test]
#[cfg(unix)]
fn ctrl_c_ends_a_run_in_order() {
    let desk = Desk::new();
    let child = endless(&desk);
    signal(&child, "-INT");
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0));
    let said: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(said["end"].as_str().unwrap().contains("Ctrl-C"), "{said}");
    assert!(!desk.path("run.csv.part").exists());
    // The log holds all ticks.
    let log = desk.read("run.csv");
    let rows = log.lines().filter(|l| !l.starts_with('#')).count() - 1;
    assert_eq!(rows as f64, number(&said["ticks"]));
    desk.done(&["compare", "model.toml", "run.csv"]);
}

#[test]
#[cfg(unix)]
fn a_killed_run_leaves_a_log_that_can_be_read() {
    let desk = Desk::new();
    let mut child = endless(&desk);
    signal(&child, "-KILL");
    child.wait().unwrap();
    assert!(!desk.path("run.csv").exists());
    std::fs::rename(desk.path("run.csv.part"), desk.path("rest.csv")).unwrap();
    assert!(desk.read("rest.csv").ends_with('\n'));
    desk.json(&["compare", "model.toml", "rest.csv", "--json"]);
}
