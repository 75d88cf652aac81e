//! Work without end is refused before it begins, with the figure and the limit.

use std::time::{Duration, Instant};

use super::{Desk, EXPERIMENT, LOOP, log_text, model_text};

/// As [`Desk::refused_saying`], at once: a second of an idle machine, some more of a busy one.
fn refused_at_once(desk: &Desk, arguments: &[&str], words: &[&str]) {
    let began = Instant::now();
    desk.refused_saying(arguments, words);
    let took = began.elapsed();
    assert!(took < Duration::from_secs(5), "{arguments:?}: {took:?}");
}

#[test]
fn samples_far_apart() {
    let desk = Desk::new();
    let mut far = String::new();
    for (k, row) in log_text().lines().take(61).enumerate() {
        match row.split_once(',') {
            Some((_, rest)) if k > 0 => far += &format!("{},{rest}\n", (k - 1) * 10_000),
            _ => far += &format!("{row}\n"),
        }
    }
    desk.write("far.csv", far);
    // Stamps of which the model file says that they are seconds are believed.
    let model = model_text().replacen(
        "[log.",
        "[log]\ntime = { column = \"time_s\", unit = \"s\" }\n[log.",
        1,
    );
    desk.write("model.toml", model);
    for command in ["compare", "fit", "diagnose"] {
        let words = [
            "far.csv",
            "10000 s apart",
            "integration steps",
            "at most 1e6",
        ];
        refused_at_once(&desk, &[command, "model.toml", "far.csv"], &words);
    }
}

#[test]
fn absurd_durations() {
    let desk = Desk::new();
    let long = EXPERIMENT
        .replace("duration_s = 2.0", "duration_s = 1e7")
        .replace("period_s = 0.01", "period_s = 1.0");
    desk.write("long.toml", long);
    let words = ["long.toml:1", "integration steps", "at most 1e9"];
    let simulate = ["simulate", "model.toml", "long.toml", "-o", "new.csv"];
    refused_at_once(&desk, &simulate, &words);
    let long = LOOP
        .replace("duration_s = 1.0", "duration_s = 1e7")
        .replace("period_s = 0.01", "period_s = 1.0");
    desk.write("long.toml", long);
    let words = ["long.toml:3", "integration steps", "at most 1e9"];
    refused_at_once(&desk, &["run", "long.toml"], &words);
}

#[cfg(unix)]
#[test]
fn files_without_an_end() {
    let desk = Desk::new();
    let zeros = "/dev/zero";
    for (arguments, words) in [
        (
            &["compare", "model.toml", zeros][..],
            ["/dev/zero", "device"],
        ),
        (
            &["compare", zeros, "log.csv"],
            ["/dev/zero", "at most 10 MB"],
        ),
        (&["run", zeros], ["/dev/zero", "at most 10 MB"]),
        (&["check", zeros], ["/dev/zero", ""]),
    ] {
        refused_at_once(&desk, arguments, &words);
    }
}

#[test]
fn expressions_and_tables_without_bottom() {
    let desk = Desk::new();
    let model = |equation: &str| {
        format!(
            "[plant.expression]\nstates = {{ x = \"m\" }}\ninputs = {{ u = \"V\" }}\n\
             parameters = {{ a = {{ unit = \"1/s\" }} }}\nequations = {{ x = \"{equation}\" }}\n"
        )
    };
    for text in [
        model(&format!("{}u{}", "(".repeat(100_000), ")".repeat(100_000))),
        model(&format!("u{}", " + u".repeat(100_000))),
        model(&format!("{}u", "-".repeat(100_000))),
        format!("a = {}{}\n", "[".repeat(100_000), "]".repeat(100_000)),
        format!("[{}x]\n", "a.".repeat(100_000)),
    ] {
        desk.write("deep.toml", text);
        refused_at_once(&desk, &["check", "deep.toml"], &["deep.toml"]);
    }
}
