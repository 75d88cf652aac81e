//! `loopsight bringup` as a person has it: what it asks, what it refuses, which wire it blames.

#![allow(
    clippy::unwrap_used,
    reason = "a command that breaks its word is how this program fails"
)]

use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::process::{Child, Command, Output, Stdio};

use loopsight_tests::twil_path;
use tempfile::TempDir;

const PROGRAM: &str = env!("CARGO_BIN_EXE_loopsight-under-test");

const LIMITS: &str = "[limits]\nvoltage_right = { magnitude = 12.0 }\nvoltage_left = { magnitude = 12.0, rate = 400.0 }\n";

/// What a careful person says of a robot that is wired right; the last line is the tape's.
const RIGHT: [&str; 8] = ["yes", "yes", "", "forwards", "", "forwards", "", "go"];

/// Bring-up of a robot that is the Twil but for what `change` does to its file, `top` standing above its
/// loop file's tables.
fn begin(
    desk: &TempDir,
    change: impl FnOnce(String) -> String,
    (top, limits): (&str, &str),
    options: &[&str],
) -> Child {
    let model = std::fs::read_to_string(twil_path()).unwrap();
    std::fs::write(desk.path().join("model.toml"), &model).unwrap();
    std::fs::write(desk.path().join("robot.toml"), change(model)).unwrap();
    let file = format!(
        "model = \"model.toml\"\nperiod_s = 0.01\n{top}\n[driver.simulated]\nmodel = \"robot.toml\"\nlimit = 12.0\n\n\
         [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n\n{limits}"
    );
    std::fs::write(desk.path().join("loop.toml"), file).unwrap();
    Command::new(PROGRAM)
        .current_dir(desk.path())
        .args(["bringup", "loop.toml"])
        .args(options)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

fn walk(
    change: impl FnOnce(String) -> String,
    limits: &str,
    options: &[&str],
    answers: &[&str],
) -> (Output, String) {
    let desk = tempfile::tempdir().unwrap();
    let mut child = begin(&desk, change, ("", limits), options);
    let mut hand = child.stdin.take().unwrap();
    // A robot that was stopped asks no more questions, and reads no more answers.
    let _ = hand.write_all((answers.join("\n") + "\n").as_bytes());
    drop(hand);
    let output = child.wait_with_output().unwrap();
    let said = [&output.stdout[..], &output.stderr[..]].concat();
    (output, String::from_utf8(said).unwrap())
}

fn same(model: String) -> String {
    model
}

/// The effect makes of the commands what crossed or turned wires would.
fn rewired(right: &str, left: &str) -> impl FnOnce(String) -> String {
    let entry = |at: &str, force: &str| {
        format!("\n[[effect]]\n[effect.expression]\nat = [\"input.{at}\"]\nforce = \"{force}\"\n")
    };
    let (right, left) = (entry("right", right), entry("left", left));
    move |model| model + &right + &left
}

fn fails(output: &(Output, String), with: i32, part: &str) {
    assert_eq!(output.0.status.code(), Some(with), "{}", output.1);
    assert!(output.1.contains(part), "{part} is not in: {}", output.1);
}

#[test]
fn a_robot_that_is_wired_right_is_walked_through() {
    let skipped = [&RIGHT[..7], &["skip"]].concat();
    let walked = walk(same, LIMITS, &[], &skipped);
    fails(&walked, 0, "The robot is as the files say");
    for step in [
        "rest    ok",
        "signs   ok    `voltage_right`: motor and encoder turn forwards",
        "signs   ok    `voltage_left`",
        "limits  ok    `voltage_left`: 12 V of 12 V applied",
        "stop    ok",
        "scale   left out",
    ] {
        assert!(walked.1.contains(step), "{step} is not in: {}", walked.1);
    }
}

#[test]
fn without_a_clear_yes_a_person_or_limits_nothing_moves() {
    let refused = walk(same, LIMITS, &[], &["yes", "y"]);
    fails(&refused, 1, "nothing was moved");
    fails(&walk(same, LIMITS, &[], &["yes"]), 1, "no answer");
    let half = "[limits]\nvoltage_right = { magnitude = 12.0 }\n";
    let unlimited = walk(same, half, &[], &RIGHT);
    fails(&unlimited, 2, "`voltage_left` has no limit");
    let refused = walk(same, LIMITS, &["--volts", "13"], &RIGHT);
    fails(
        &refused,
        2,
        "--volts is 13, expected a number above 0 and up to 12",
    );
    // Somebody who goes away in the middle leaves a robot that stands.
    let gone = walk(same, LIMITS, &[], &RIGHT[..3]);
    fails(&gone, 1, "no answer");
    assert!(gone.1.contains("rest    ok") && !gone.1.contains("signs   ok"));
}

#[test]
fn each_wrong_wire_is_blamed() {
    let answers = |seen| [&RIGHT[..3], &[seen]].concat();
    let reversed = || rewired("-2*nominal", "0");
    let motor = walk(reversed(), LIMITS, &[], &answers("backwards"));
    fails(&motor, 1, "the motor of `voltage_right` turns backwards");
    let encoder = walk(reversed(), LIMITS, &[], &answers("forwards"));
    fails(
        &encoder,
        1,
        "the encoder of `voltage_right` counts backwards",
    );
    let both = walk(same, LIMITS, &[], &answers("backwards"));
    fails(&both, 1, "both reversed");
    let dead = || rewired("-nominal", "0");
    let off = walk(dead(), LIMITS, &[], &answers("nothing"));
    fails(&off, 1, "`voltage_right` moves nothing");
    let unplugged = walk(dead(), LIMITS, &[], &answers("forwards"));
    fails(&unplugged, 1, "nothing is counted");
    // The second motor is looked at as well.
    let left = walk(
        rewired("0", "-2*nominal"),
        LIMITS,
        &[],
        &[&RIGHT[..5], &["backwards"]].concat(),
    );
    fails(&left, 1, "the motor of `voltage_left` turns backwards");
    assert!(left.1.contains("signs   ok    `voltage_right`"));
}

#[test]
fn a_robot_that_creeps_or_runs_away_is_stopped() {
    let creeps = walk(rewired("1.0", "0"), LIMITS, &[], &RIGHT);
    fails(&creeps, 1, "at 0 V: look for a motor that creeps");
    let runs_away = walk(rewired("20*nominal", "0"), LIMITS, &[], &RIGHT);
    fails(&runs_away, 1, "more than the");
    assert!(runs_away.1.contains("the robot was stopped"));
}

#[test]
fn the_scale_is_that_of_the_tape() {
    let said = |metres: &str| walk(same, LIMITS, &[], &[&RIGHT[..], &[metres]].concat());
    // What the counts say is in the message of a tape that shows something else.
    let far = said("2");
    fails(&far, 1, "scale: 2 m by hand, ");
    let counted = far.1.split("2 m by hand, ").nth(1).unwrap();
    let counted: f64 = counted.split(' ').next().unwrap().parse().unwrap();
    // 3 V at both motors: K_C/K_A of the model is 9.0 mm/s per volt and motor.
    let steady = 2.0 * 3.0 * 0.136 / 15.146;
    assert!(
        counted > 0.7 * steady * 2.4 && counted < steady * 2.4,
        "{counted} m"
    );
    let ratio = 2.0 / counted;
    assert!(
        far.1
            .contains(&format!("the wheel radius) by {}", &ratio.to_string()[..4])),
        "{}",
        far.1
    );
    // 8192/(2 π 0.05 m)
    assert!(far.1.contains("26075.9 in the model file"), "{}", far.1);
    let right = said(&format!("{counted}"));
    fails(&right, 0, "scale   ok");
}

#[test]
fn a_polite_kill_stops_a_robot_that_waits_for_an_answer() {
    let desk = tempfile::tempdir().unwrap();
    let mut child = begin(&desk, same, ("real_time = true\n", LIMITS), &[]);
    // Held open: nobody has gone away.
    let mut hand = child.stdin.take().unwrap();
    hand.write_all(b"yes\nyes\n").unwrap();
    let mut said = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    while !line.starts_with("Watch the motor") {
        line.clear();
        assert!(said.read_line(&mut line).unwrap() > 0);
    }
    let id = child.id().to_string();
    assert!(Command::new("kill").arg(id).status().unwrap().success());
    let mut rest = String::new();
    said.read_to_string(&mut rest).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(1), "{rest}");
    assert!(
        rest.contains("stopped by Ctrl-C; the robot was stopped"),
        "{rest}"
    );
}

/// The driver for boards is opened after the questions, and says what this machine has not.
#[cfg(target_os = "linux")]
#[test]
fn a_board_that_is_not_there_is_named_after_the_questions() {
    let desk = tempfile::tempdir().unwrap();
    let motor = |side: &str, channel: u32| {
        format!(
            "[driver.linux_gpio.motor.voltage_{side}]\npwm = [0, {channel}]\ndirection = 5\nenable = 6\n\
             counter = [{channel}, 0]\nshaft = \"shaft_angle_{side}\"\nlimit_v = 12.0\n"
        )
    };
    let encoder = |right: f64, left: f64| {
        format!(
            "sensor = {{ encoder_counts = {{ counts_per_revolution = 8192.0, \
             of = {{ shaft_angle_right = {right:?}, shaft_angle_left = {left:?} }} }} }}\n"
        )
    };
    let model = format!(
        "[plant.ddmr]\nK_A = -15.0\nK_B = 0.0\nK_C = 0.136\nK_D = -9.6\nK_E = 0.0\nK_F = 0.66\nhalf_track = 0.131\n\
         wheel_radius = 0.05\n[log.measured.linear_velocity]\n{}[log.measured.angular_velocity]\n{}",
        encoder(0.025, 0.025),
        encoder(0.19, -0.19)
    );
    std::fs::write(desk.path().join("model.toml"), model).unwrap();
    let file = format!(
        "model = \"model.toml\"\nperiod_s = 0.01\n[driver.linux_gpio]\nsupply = 12.0\nchip = \"gpiochip_nowhere\"\n\
         {}{}[controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n{LIMITS}",
        motor("right", 0),
        motor("left", 1)
    );
    std::fs::write(desk.path().join("loop.toml"), file).unwrap();
    let run = |command: &str| {
        let mut child = Command::new(PROGRAM)
            .current_dir(desk.path())
            .args([command, "loop.toml"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let _ = child.stdin.take().unwrap().write_all(b"yes\nyes\n\n");
        let output = child.wait_with_output().unwrap();
        let said = String::from_utf8(output.stderr.clone()).unwrap();
        (output, said)
    };
    assert!(run("check").0.status.success());
    let opened = run("bringup");
    fails(
        &opened,
        1,
        "the motor of `voltage_right`: line 6 of gpiochip_nowhere",
    );
}
