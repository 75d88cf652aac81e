//! Logs.

use std::ffi::OsStr;

use super::{Desk, edit_fields, log_text, model_text, with_field};

#[test]
fn spoilt_logs() {
    let desk = Desk::new();
    let log = log_text();
    let header = log.lines().next().unwrap().to_owned();
    let truncated = log.trim_end().rsplit_once(',').unwrap().0.to_owned();
    let without = |field: usize| -> String {
        let keep = |row: &str| {
            let all = row.split(',').enumerate();
            let kept: Vec<&str> = all.filter(|(i, _)| *i != field).map(|(_, f)| f).collect();
            format!("{}\n", kept.join(","))
        };
        log.lines().map(keep).collect()
    };
    for (spoilt, words) in [
        (truncated, &["spoilt.csv:202", "5 fields", "found 4"][..]),
        (
            with_field(5, 1, "NaN"),
            &["spoilt.csv:5:1", "time_s", "missing"],
        ),
        (
            with_field(5, 2, "NaN"),
            &["spoilt.csv:5:", "voltage_right_V", "missing"],
        ),
        (
            with_field(5, 2, ""),
            &["spoilt.csv:5:", "voltage_right_V", "missing"],
        ),
        (
            with_field(5, 4, "fast"),
            &["spoilt.csv:5:", "linear_velocity", "`fast`"],
        ),
        (
            with_field(5, 2, "1e9"),
            &["spoilt.csv:5:", "voltage_right_V", "absurd"],
        ),
        (with_field(5, 1, "inf"), &["spoilt.csv:5:1", "time_s"]),
        (
            edit_fields(|line, i| (line > 1 && i == 3).then_some("NaN")),
            &["linear_velocity", "no sample"],
        ),
        (
            edit_fields(|line, i| (line > 1 && i == 3).then_some("1e9")),
            &["linear_velocity", "no sample"],
        ),
        (
            log.replacen("voltage_right_V", "voltage_right_kg", 1),
            &["voltage_right_kg", "kg", "V"],
        ),
        (
            log.replacen("linear_velocity_m_per_s", "linear_velocity_rad_per_s", 1),
            &["linear_velocity_rad_per_s", "m/s"],
        ),
        (without(0), &["time"]),
        (without(1), &["voltage_right", "did you mean"]),
        (without(3), &["linear_velocity"]),
        (
            log.replacen("voltage_left_V", "voltage_right_V", 1),
            &["columns 2 and 3", "voltage_right_V"],
        ),
        (String::new(), &["empty"]),
        ("\n\n".to_owned(), &["empty"]),
        (format!("{header}\n"), &["no row"]),
        (
            log.replacen(&format!("{header}\n"), "", 1),
            &[
                "no column for the input `voltage_right`",
                "column = \"column 2\"",
            ],
        ),
        (model_text(), &["spoilt.csv"]),
        (
            "{\"sysid\": true, \"test\": ".to_owned(),
            &["spoilt.csv:1:", "truncated"],
        ),
        ("{\"sysid\": true}".to_owned(), &["\"test\""]),
        ("[1, 2".to_owned(), &["spoilt.csv"]),
    ] {
        desk.write("spoilt.csv", spoilt);
        desk.refused_saying(&["compare", "model.toml", "spoilt.csv"], words);
        desk.refused_saying(&["fit", "model.toml", "spoilt.csv"], words);
        desk.refused(&["fit", "model.toml", "log.csv", "--test", "spoilt.csv"]);
    }
}

/// A few samples that are missing or absurd are no reason to refuse a log: they are named.
#[test]
fn a_missing_measurement_is_named_and_left_out() {
    let desk = Desk::new();
    for (value, kind) in [
        ("NaN", "not_a_number"),
        ("", "not_a_number"),
        ("1e9", "absurd_value"),
    ] {
        desk.write("holes.csv", with_field(5, 4, value));
        let words = ["compare", "model.toml", "holes.csv", "--json"].map(OsStr::new);
        let output = desk.output(&words);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(output.status.code(), Some(0), "{text}");
        assert!(
            text.contains(kind) && text.contains("line 5"),
            "{value}: {text}"
        );
        let said: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert!(said["nrmse"].as_f64().unwrap() < 0.1, "{value}: {text}");
    }
}

/// Milliseconds in a column that says seconds: named with the remedy, which then reads the log.
#[test]
fn milliseconds_taken_for_seconds() {
    let desk = Desk::new();
    let stretched = |text: &str| -> String {
        let row = |line: &str| match line.split_once(',') {
            Some((time, rest)) if time != "time_s" => {
                let stamp: f64 = time.parse().unwrap();
                format!("{},{rest}\n", (1e3 * stamp).round())
            }
            _ => format!("{line}\n"),
        };
        text.lines().map(row).collect()
    };
    desk.write("ms.csv", stretched(&log_text()));
    let remedy = "`time = { column = \"time_s\", unit = \"ms\" }`";
    for words in [
        &["compare", "model.toml", "ms.csv"],
        &["fit", "model.toml", "ms.csv"],
    ] {
        desk.refused_saying(words, &["seem to be ms, not s", remedy]);
    }
    for (unit, right) in [("ms", true), ("s", false)] {
        let map = format!("[log]\ntime = {{ column = \"time_s\", unit = \"{unit}\" }}\n");
        let (head, rest) = model_text()
            .split_once("[log.")
            .map(|(a, b)| (a.to_owned(), b.to_owned()))
            .unwrap();
        desk.write("said.toml", format!("{head}{map}[log.{rest}"));
        let words = ["compare", "said.toml", "ms.csv", "--json"].map(OsStr::new);
        let output = desk.output(&words);
        let said: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        // Whoever says seconds is believed.
        assert_eq!(
            said["fit_percent"].as_f64().unwrap() > 95.0,
            right,
            "{unit}: {said}"
        );
    }
}
