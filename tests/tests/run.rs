//! `loopsight run` as a user has it: what it shows, what it logs, how it ends.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a command that breaks its word is how this program fails"
)]

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};

use loopsight_tests::{opened, twil_path};
use serde_json::Value;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

const LOOP: &str = "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 6.0\nlog = \"run.csv\"\n\n\
    [driver.simulated]\nlimit = 12.0\n\n\
    [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n\n\
    [estimator.rls]\ninitial_covariance = 1.0\n\n\
    [reference]\nlinear_velocity = { steps = { at = [[0.5, 0.1], [3.0, -0.1]] } }\n";

/// A folder with the model of the Twil, in which loops are run.
struct Desk(TempDir);

impl Desk {
    fn with(text: &str) -> Self {
        let desk = Self(tempfile::tempdir().unwrap());
        std::fs::copy(twil_path(), desk.path("model.toml")).unwrap();
        std::fs::write(desk.path("loop.toml"), text).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(PROGRAM);
        command.current_dir(self.0.path()).args(arguments);
        command
    }

    fn run(&self) -> (Output, Value) {
        let output = self
            .command(&["run", "loop.toml", "--json", "--html", "run.html"])
            .output()
            .unwrap();
        let said = serde_json::from_slice(&output.stdout)
            .unwrap_or_else(|e| panic!("{e}: {}", String::from_utf8_lossy(&output.stderr)));
        (output, said)
    }

    /// Starts a loop in real time, without an end.
    fn start(&self) -> Child {
        self.command(&["run", "loop.toml", "--json"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// The rows of a log by column.
    fn column(&self, log: &str, name: &str) -> Vec<f64> {
        let text = self.read(log);
        let mut lines = text.lines().filter(|l| !l.starts_with('#'));
        let header: Vec<&str> = lines.next().unwrap().split(',').collect();
        let at = header.iter().position(|h| *h == name);
        let at = at.unwrap_or_else(|| panic!("no {name} in {header:?}"));
        lines
            .map(|l| l.split(',').nth(at).unwrap().parse().unwrap_or(f64::NAN))
            .collect()
    }
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("no number: {value}"))
}

fn endless() -> String {
    LOOP.replace("duration_s = 6.0\n", "real_time = true\n")
}

fn signal(child: &Child, name: &str) {
    let status = Command::new("kill")
        .args([name, &child.id().to_string()])
        .status()
        .unwrap();
    assert!(status.success());
}

#[test]
fn a_run_says_how_it_tracked_what_it_learned_and_how_sure_it_is() {
    let desk = Desk::with(LOOP);
    let (output, said) = desk.run();
    assert!(output.status.success());
    let velocity = &said["tracking"][0];
    assert!(number(&velocity["rms_error"]) < number(&velocity["largest_error"]));
    let estimate = &said["estimates"][0];
    let [low, high] = [0, 1].map(|i| number(&estimate["interval95"][i]));
    let value = number(&estimate["value"]);
    assert_eq!(estimate["name"], "K_A");
    assert!(low < value && value < high, "{estimate}");
    assert_eq!(number(&said["parameters"]["K_A"]), value);
    assert!(number(&said["innovation"][0]["rms"]) > 0.0);
    assert!(number(&said["excitation"][0]["rms"]) > 0.0);
    assert!(number(&said["learning"][0]["taught_share"]) > 0.0);
    assert!(said["timing"].is_null(), "simulated time has no jitter");
    // The log has the same: its last estimate is the one that was said.
    let learned = desk.column("run.csv", "learned_K_A_per_s");
    assert_eq!(learned.len(), 600);
    // As text: a number that is read from JSON may be off by its last bit.
    let told = String::from_utf8(output.stdout).unwrap();
    let last = format!("\"value\": {}", learned.last().unwrap());
    assert!(told.contains(&last), "{last}: {told}");
    assert_eq!(desk.column("run.csv", "fresh_1"), vec![1.0; 600]);
    let page = opened(&desk.read("run.html"));
    assert!(page.contains("\"spread\":["), "estimates have bands");
    assert!(page.contains("excitation of linear_velocity"));
}

#[test]
fn limits_hold_inputs_and_references() {
    let limits = "[limits]\nvoltage_right = { magnitude = 3.0, rate = 50.0 }\n\
                  linear_velocity = { rate = 0.2 }\n";
    let desk = Desk::with(&format!("{LOOP}\n{limits}"));
    let (_, said) = desk.run();
    let right = desk.column("run.csv", "voltage_right_V");
    let left = desk.column("run.csv", "voltage_left_V");
    assert!(right.iter().all(|u| u.abs() <= 3.0) && right.contains(&3.0));
    assert!(right.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.5 + 1e-9));
    assert!(left.iter().any(|u| u.abs() > 3.0), "the left one is free");
    let wanted = desk.column("run.csv", "reference_linear_velocity_m_per_s");
    assert!(
        wanted
            .windows(2)
            .all(|w| (w[1] - w[0]).abs() <= 0.002 + 1e-9)
    );
    assert!(number(&said["saturated_share"]) > 0.0);
}

#[test]
fn a_reference_comes_from_a_file_in_its_own_unit() {
    let from_file = LOOP.replace(
        "{ steps = { at = [[0.5, 0.1], [3.0, -0.1]] } }",
        "{ file = { path = \"wave.csv\", column = \"way\" } }",
    );
    let desk = Desk::with(&from_file);
    std::fs::write(
        desk.path("wave.csv"),
        "time_ms,way_mm_per_s\n0,0\n2000,200\n",
    )
    .unwrap();
    let (output, _) = desk.run();
    assert!(output.status.success());
    let wanted = desk.column("run.csv", "reference_linear_velocity_m_per_s");
    assert!((wanted[100] - 0.1).abs() < 1e-9 && (wanted[599] - 0.2).abs() < 1e-9);
    std::fs::write(desk.path("wave.csv"), "time_s,wey\n0,0\n").unwrap();
    let refused = desk.command(&["run", "loop.toml"]).output().unwrap();
    let error = String::from_utf8_lossy(&refused.stderr);
    assert_eq!(refused.status.code(), Some(2));
    assert!(error.contains("did you mean `wey`?"), "{error}");
}

#[test]
fn a_run_without_a_tick_has_no_error() {
    let desk = Desk::with(&LOOP.replace("duration_s = 6.0", "duration_s = 0.001"));
    let (output, said) = desk.run();
    assert!(output.status.success());
    assert!(said["tracking"][0]["rms_error"].is_null());
    let text = desk.command(&["run", "loop.toml"]).output().unwrap();
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.contains("did not complete a single tick"), "{text}");
    assert!(!text.contains("-0"), "{text}");
}

#[test]
fn a_supervisor_stops_with_its_reason_in_log_page_and_status() {
    let dead = "limit = 12.0\nfault = [{ dead_encoder = { start_s = 2.0 } }]\n";
    let text = LOOP.replace("limit = 12.0\n", dead);
    let desk = Desk::with(&format!("{text}\n[supervisor]\n"));
    let (output, said) = desk.run();
    assert_eq!(output.status.code(), Some(1));
    let why = "stopped by the supervisor: shaft_angle_";
    assert!(said["end"].as_str().unwrap().starts_with(why), "{said}");
    let ticks = number(&said["ticks"]);
    assert!((230.0..240.0).contains(&ticks), "0.3 s after 2 s: {ticks}");
    assert!(desk.read("run.html").contains(why));
    // The log is finished, readable, and ends with the reason.
    let log = desk.read("run.csv");
    let last = log.lines().last().unwrap();
    assert!(last.starts_with("# 2.3") && last.contains(why), "{last}");
    let compared = desk.command(&["compare", "model.toml", "run.csv"]).output();
    assert!(compared.unwrap().status.success());
}

#[test]
fn a_log_may_be_mcap() {
    let desk = Desk::with(LOOP);
    for log in ["run.csv", "run.mcap"] {
        let run = desk.command(&["run", "loop.toml", "-o", log]).output();
        assert!(run.unwrap().status.success());
    }
    let [csv, mcap] = ["run.csv", "run.mcap"].map(|log| {
        let compared = desk.command(&["compare", "model.toml", log, "--json"]);
        let output = { compared }.output().unwrap();
        assert!(output.status.success(), "{log}");
        let said = serde_json::from_slice::<Value>(&output.stdout).unwrap();
        number(&said["nrmse"])
    });
    assert!((csv - mcap).abs() < 1e-9 * csv, "{csv} {mcap}");
}

/// What was said at a second is on the disk a second later, whatever happens then.
#[test]
#[cfg(unix)]
fn a_killed_run_loses_at_most_a_second() {
    let desk = Desk::with(&endless());
    let mut child = desk.start();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let mut line = String::new();
    for _ in 0..3 {
        line = lines.next().unwrap().unwrap();
    }
    signal(&child, "-KILL");
    child.wait().unwrap();
    assert!(!line.contains('\u{1b}'), "no colours for a pipe: {line}");
    let seen: f64 = line.split(' ').next().unwrap().parse().unwrap();
    assert!(line.contains("linear_velocity"), "{line}");
    let time = desk.column("run.csv.part", "time_s");
    let kept = time.last().unwrap();
    assert!(*kept >= seen - 1.0, "{kept} s of {seen} s");
    assert!(desk.read("run.csv.part").ends_with('\n'));
}

#[test]
#[cfg(unix)]
fn ctrl_c_and_a_polite_kill_stop_the_robot_and_finish_the_log() {
    for name in ["-INT", "-TERM"] {
        let desk = Desk::with(&endless());
        let mut child = desk.start();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        lines.next().unwrap().unwrap();
        signal(&child, name);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{name}");
        let said: Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(said["end"].as_str().unwrap().contains("Ctrl-C"), "{said}");
        let rows = desk.column("run.csv", "time_s").len();
        assert_eq!(rows as f64, number(&said["ticks"]));
        let log = desk.read("run.csv");
        assert!(log.lines().last().unwrap().contains("Ctrl-C"), "{name}");
        // Real time measures itself, and the log has how late each tick was.
        let timing = &said["timing"];
        let late = desk.column("run.csv", "late_s");
        let latest = late.iter().fold(0.0_f64, |a, l| a.max(*l));
        assert!((number(&timing["latest_s"]) - latest).abs() < 1e-9);
        assert!(number(&timing["jitter_s"]) > 0.0);
    }
}
