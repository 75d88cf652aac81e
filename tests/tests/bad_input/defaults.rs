//! What a loop does whose file asks for no supervisor and no limits.

use std::ffi::OsStr;

use super::{Desk, LOOP, model_text};

fn run(desk: &Desk) -> (Option<i32>, String) {
    let output = desk.output(&["run", "loop.toml"].map(OsStr::new));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let shown = String::from_utf8_lossy(&output.stdout).into_owned();
    (output.status.code(), said + &shown)
}

/// The robot's motors turn the other way than the model's.
fn reversed(desk: &Desk) -> String {
    let wired = model_text()
        .replace("K_C = 0.136", "K_C = -0.136")
        .replace("K_F = 0.656", "K_F = -0.656");
    desk.write("reversed.toml", wired);
    LOOP.replace("limit = 12.0", "limit = 12.0\nmodel = \"reversed.toml\"")
        .replace("duration_s = 1.0", "duration_s = 30.0")
}

#[test]
fn a_motor_that_turns_the_wrong_way_stops_the_loop() {
    let desk = Desk::new();
    let text = reversed(&desk);
    desk.write("loop.toml", &text);
    let (code, said) = run(&desk);
    assert_eq!(code, Some(1), "{said}");
    for word in [
        "stopped by the supervisor",
        "off its reference",
        "no [supervisor]",
    ] {
        assert!(said.contains(word), "{word}: {said}");
    }
    // Whoever wants nobody to watch says so.
    desk.write("loop.toml", format!("supervisor = false\n{text}"));
    let (code, said) = run(&desk);
    assert_eq!(code, Some(0), "{said}");
}

#[test]
fn a_loop_that_uses_what_it_learns_is_supervised_and_says_so() {
    let desk = Desk::new();
    let learning = "[estimator.rls]\n[learning]\ncertainty_equivalence = true\n";
    desk.write("loop.toml", format!("{LOOP}{learning}"));
    let (code, said) = run(&desk);
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("uses what it learns: one with the defaults is assumed"),
        "{said}"
    );
    let log = std::fs::read_to_string(desk.path("run.csv")).unwrap();
    assert!(
        log.lines().next().unwrap().contains("fallen_back_1"),
        "{log}"
    );
    desk.write("loop.toml", format!("supervisor = false\n{LOOP}{learning}"));
    let (code, said) = run(&desk);
    assert_eq!(code, Some(0), "{said}");
    assert!(!said.contains("assumed"), "{said}");
}

/// What `loopsight check` says of a loop, and what it assumes.
#[test]
fn a_check_says_what_is_assumed() {
    let desk = Desk::new();
    let output = desk.output(&["check", "loop.toml"].map(OsStr::new));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        said.contains("one is assumed that stops the loop"),
        "{said}"
    );
}

#[test]
fn a_robot_is_not_driven_without_a_limit() {
    let desk = Desk::new();
    let hardware = LOOP.replace(
        "[driver.simulated]\nlimit = 12.0\n\n[controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\n",
        "[driver.serial]\nline = \"/dev/ttyNONE7\"\n\n[controller.aboard]\nlaw = { settling_time_s = 0.45 }\n",
    );
    assert!(hardware.contains("driver.serial"));
    desk.write("loop.toml", &hardware);
    let words = ["nothing limits `voltage_right`", "[limits]"];
    desk.refused_saying(&["run", "loop.toml"], &words);
    // With one the line is what is missing.
    desk.write(
        "loop.toml",
        hardware.replace("0.45 }", "0.45, limit = 12.0 }"),
    );
    let (code, said) = run(&desk);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("there is no line `/dev/ttyNONE7`"), "{said}");
}
