//! Processes that are killed, and disks that are full.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use loopsight_tests::Random;

use crate::{Desk, Row};

/// Commands and the files that they write.
const COMMANDS: [(&[&str], &[&str]); 10] = [
    (
        &["simulate", "model.toml", "experiment.toml", "-o", "new.csv"],
        &["new.csv"],
    ),
    (
        &["compare", "model.toml", "log.csv", "--html", "compare.html"],
        &["compare.html"],
    ),
    (
        &[
            "fit",
            "model.toml",
            "log.csv",
            "-o",
            "fit.toml",
            "--html",
            "fit.html",
        ],
        &["fit.toml", "fit.html"],
    ),
    (
        &["convert", "model.toml", "log.csv", "-o", "si.csv"],
        &["si.csv"],
    ),
    (
        &["convert", "model.toml", "log.csv", "-o", "si.mcap"],
        &["si.mcap"],
    ),
    (
        &["add", "model.toml", "coulomb_friction", "-o", "more.toml"],
        &["more.toml"],
    ),
    (
        &["experiment", "model.toml", "-o", "plan.csv"],
        &["plan.csv"],
    ),
    (
        &["diagnose", "model.toml", "log.csv", "--html", "why.html"],
        &["why.html"],
    ),
    (
        &["run", "loop.toml", "-o", "run.csv", "--html", "run.html"],
        &["run.csv", "run.html"],
    ),
    (&["run", "loop.toml", "-o", "run.mcap"], &["run.mcap"]),
];

/// What a whole file ends with; its numbers and times may differ from run to run.
fn is_whole(name: &str, bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let rows = || {
        let mut rows = text.lines().filter(|l| !l.starts_with('#'));
        let width = rows.next().map(|row| row.split(',').count());
        text.ends_with('\n') && rows.all(|row| Some(row.split(',').count()) == width)
    };
    match name.rsplit_once('.').map(|(_, ending)| ending) {
        Some("html") => text.trim_end().ends_with("</html>"),
        Some("csv") => rows(),
        Some("mcap") => bytes.ends_with(b"\x89MCAP0\r\n"),
        _ => text.ends_with('\n') && text.parse::<toml::Table>().is_ok(),
    }
}

/// Newest time stamp in what a killed run left, s.
fn last_time(desk: &Desk, name: &str) -> Option<f64> {
    let part = desk.path(&format!("{name}.part"));
    let log = loopsight::Log::from_bytes(name, &std::fs::read(part).ok()?).ok()?;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rest.csv");
    log.save(&path).ok()?;
    let text = std::fs::read_to_string(path).ok()?;
    text.lines().last()?.split(',').next()?.parse().ok()
}

/// Temporary files that nobody removed.
fn left(desk: &Desk) -> usize {
    let entries = std::fs::read_dir(desk.folder.path()).unwrap();
    let names = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    names.filter(|n| n.starts_with(".loopsight-")).count()
}

/// Removes what killed runs left of their logs, so that each has a `.part` of its own.
fn tidy(desk: &Desk) {
    for entry in std::fs::read_dir(desk.folder.path()).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_some_and(|e| e == "part") {
            std::fs::remove_file(path).unwrap();
        }
    }
}

/// So many processes, at random instants, all commands alike.
pub(crate) fn killed(program: &Path, count: usize) -> Vec<Row> {
    let desk = Desk::new(program);
    let mut random = Random::new(18);
    let (mut half, mut refused, mut finished, mut lost) = (Vec::new(), 0, 0, 0.0f64);
    let (mut logs, mut temporary, mut stayed) = (0, 0, 0);
    for (at, (arguments, files)) in COMMANDS.iter().enumerate() {
        let from = Instant::now();
        refused += usize::from(!desk.command(arguments).status().unwrap().success());
        let whole = from.elapsed();
        let kills = count / COMMANDS.len() + usize::from(at < count % COMMANDS.len());
        for k in 0..kills {
            tidy(&desk);
            // Every second time there is an older file.
            if k % 2 == 0 {
                for file in *files {
                    let _ = std::fs::remove_file(desk.path(file));
                }
            }
            let mut child = desk.command(arguments).spawn().unwrap();
            let from = Instant::now();
            std::thread::sleep(whole.mul_f64(random.share()));
            let alive = child.try_wait().unwrap().is_none();
            let ran = from.elapsed();
            child.kill().unwrap();
            let status = child.wait().unwrap();
            temporary = temporary.max(left(&desk));
            finished += usize::from(!alive);
            refused += usize::from(!alive && !status.success());
            for file in *files {
                if let Ok(bytes) = std::fs::read(desk.path(file))
                    && !is_whole(file, &bytes)
                {
                    half.push(format!("{file} of `{}`", arguments.join(" ")));
                }
            }
            // Counted from the start of the process, which is before that of the loop.
            if arguments[0] == "run" && alive && ran > Duration::from_secs(1) {
                logs += 1;
                let last = last_time(&desk, files[0]).unwrap_or(0.0);
                lost = lost.max(ran.as_secs_f64() - last);
            }
        }
        tidy(&desk);
        refused += usize::from(!desk.command(arguments).status().unwrap().success());
        stayed += left(&desk);
    }
    let mut shown = format!(
        "{} half files; {refused} runs that did not start or failed; {finished} had finished before",
        half.len()
    );
    if let Some(first) = half.first() {
        shown.push_str(&format!("; the first is {first}"));
    }
    vec![
        Row {
            what: format!(
                "kill −9 at {count} random instants of {} commands",
                COMMANDS.len()
            ),
            happened: shown,
            promised: "no half file under a final name; the next run starts",
            kept: half.is_empty() && refused == 0,
        },
        Row {
            what: format!("of them, {logs} in a run in real time, after its first second"),
            happened: format!(
                "at most {lost:.2} s of the log lost, the start of the program included"
            ),
            promised: "less than a second, and what a program takes to start",
            kept: lost < 1.2,
        },
        Row {
            what: "their temporary files".to_owned(),
            happened: format!(
                "at most {temporary} lay there at once, {stayed} after the next run of the same command"
            ),
            promised: "the next command that writes the same file removes them",
            kept: stayed == 0,
        },
    ]
}

/// A disk that takes 4 kB of each file.
pub(crate) fn full(program: &Path) -> Vec<Row> {
    let desk = Desk::new(program);
    let long: Vec<_> = COMMANDS
        .iter()
        .filter(|(arguments, _)| !matches!(arguments[0], "add" | "experiment"))
        .collect();
    let mut wrong = Vec::new();
    for (arguments, files) in &long {
        let output = Command::new("sh")
            .current_dir(desk.folder.path())
            .args(["-c", "trap '' XFSZ; ulimit -f 8; exec \"$0\" \"$@\""])
            .arg(&desk.program)
            .args(*arguments)
            .stdin(Stdio::null())
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let left = files.iter().any(|file| {
            let bytes = std::fs::read(desk.path(file));
            bytes.is_ok_and(|bytes| !is_whole(file, &bytes))
        });
        if output.status.code() != Some(1) || !said.contains("cannot write") || left {
            wrong.push(format!(
                "`{}`: {} {said}",
                arguments.join(" "),
                output.status
            ));
        }
    }
    let mut happened = format!("{} of {} ended otherwise", wrong.len(), long.len());
    if let Some(first) = wrong.first() {
        happened.push_str(&format!("; the first is {first}"));
    }
    vec![Row {
        what: format!("a full disk, {} commands", long.len()),
        happened,
        promised: "status 1, the file that cannot be written, no half file",
        kept: wrong.is_empty(),
    }]
}
