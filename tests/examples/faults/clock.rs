//! A wall clock that is set while a loop runs in real time.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use crate::{Desk, Row};

/// libfaketime (Debian: `faketime`), which shows one process another wall clock.
fn library() -> Option<PathBuf> {
    let folders = std::fs::read_dir("/usr/lib").ok()?.flatten();
    let found = folders.map(|folder| folder.path().join("faketime/libfaketimeMT.so.1"));
    found.into_iter().find(|path| path.exists())
}

/// Seconds of the wall clock that a process with `library` and the offset in `file` sees.
fn seen(library: &Path, file: &Path) -> i64 {
    let mut date = Command::new("date");
    let said = under(date.arg("+%s"), library, file).output().unwrap();
    String::from_utf8(said.stdout)
        .unwrap()
        .trim()
        .parse()
        .unwrap()
}

/// A command that sees that clock, and the true monotonic one.
fn under<'c>(command: &'c mut Command, library: &Path, file: &Path) -> &'c mut Command {
    command
        .env("LD_PRELOAD", library)
        .env("FAKETIME_TIMESTAMP_FILE", file)
        .env("FAKETIME_NO_CACHE", "1")
        .env("FAKETIME_DONT_FAKE_MONOTONIC", "1")
        .env("DONT_FAKE_MONOTONIC", "1")
}

/// A run of 4 s whose wall clock is set a day forward after a second, and two days back a second later.
pub(crate) fn stepped(program: &Path) -> Vec<Row> {
    let Some(library) = library() else {
        eprintln!("no stepped clock here: libfaketime (Debian's `faketime`) is not installed");
        return Vec::new();
    };
    let desk = Desk::new(program);
    let clock = desk.path("clock");
    let set = |offset: &str| {
        // Whole or not at all: it is read at every look at the clock.
        desk.write("next", offset);
        std::fs::rename(desk.path("next"), &clock).unwrap();
    };
    set("+0");
    let before = seen(&library, &clock);
    let mut command = desk.command(&["run", "loop.toml", "-o", "run.csv"]);
    let from = Instant::now();
    let mut child = under(&mut command, &library, &clock).spawn().unwrap();
    let mut steps = Vec::new();
    for offset in ["+1d", "-1d"] {
        std::thread::sleep(Duration::from_secs(1));
        set(offset);
        steps.push((seen(&library, &clock) - before) as f64 / 86400.0);
    }
    let status = child.wait().unwrap();
    let took = from.elapsed().as_secs_f64();
    let text = std::fs::read_to_string(desk.path("run.csv")).unwrap_or_default();
    let mut rows = text.lines().filter(|l| !l.starts_with('#'));
    let names: Vec<&str> = rows.next().unwrap_or_default().split(',').collect();
    let late = names.iter().position(|n| *n == "late_s");
    let rows: Vec<Vec<f64>> = rows
        .map(|l| {
            l.split(',')
                .map(|v| v.parse().unwrap_or(f64::NAN))
                .collect()
        })
        .collect();
    let latest = rows.iter().filter_map(|row| row.get(late?));
    let latest = latest.fold(0.0f64, |most, late| most.max(*late));
    let ordered = rows.windows(2).all(|two| two[0][0] < two[1][0]);
    let gone = steps
        .iter()
        .zip([1.0, -1.0])
        .all(|(s, t)| (s - t).abs() < 0.01);
    vec![Row {
        what: format!(
            "a wall clock that is set {:.0} day forward, then {:.0} days back, in a run of 4 s in real time",
            steps[0],
            steps[0] - steps[1]
        ),
        happened: format!(
            "status {} after {took:.2} s, {} rows, the latest step {:.1} ms late",
            status.code().unwrap_or(-1),
            rows.len(),
            latest * 1e3
        ),
        promised: "nothing of it: a loop counts by the monotonic clock",
        kept: gone
            && status.success()
            && ordered
            && rows.len() == 400
            && (3.9..6.0).contains(&took),
    }]
}
