//! A flood at the door of a run: what it costs a tick, and how long Ctrl-C takes.

#![cfg(unix)]
#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

#[path = "../../onboard/tests/desk/mod.rs"]
mod desk;
#[path = "../../onboard/tests/twil/mod.rs"]
mod twil;

use std::io::Write as _;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use desk::Desk;
use loopsight_link::{Hello, Request, VERSION};

/// What a flood did.
struct Flooded {
    /// Steps that the robot heard, and the longest time between two of them beyond a period.
    steps: usize,
    latest: Duration,
    /// Bytes and visitors at the door.
    bytes: u64,
    visitors: u64,
    /// From Ctrl-C to the end of the command.
    ended: Duration,
    /// From the first step that it heard to the last.
    drove: Duration,
    rows: usize,
    said: String,
}

/// Bytes that are nothing, and greetings, as fast as the door takes them.
fn pour(door: &Path, over: &AtomicBool, bytes: &AtomicU64, visitors: &AtomicU64) {
    let greeting = twil::frame(&Request::Hello(Hello {
        version: VERSION,
        session: 1,
    }));
    let mut wave = vec![0xa5; 4096];
    for _ in 0..100 {
        wave.extend_from_slice(&greeting);
    }
    while !over.load(Ordering::Relaxed) {
        let Ok(mut stream) = UnixStream::connect(door) else {
            std::thread::sleep(Duration::from_millis(1));
            continue;
        };
        visitors.fetch_add(1, Ordering::Relaxed);
        // A door that takes no more must not hold up the end of this.
        let patience = Some(Duration::from_millis(20));
        stream.set_write_timeout(patience).unwrap();
        while !over.load(Ordering::Relaxed) {
            match stream.write(&wave) {
                Ok(length) => bytes.fetch_add(length as u64, Ordering::Relaxed),
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => continue,
                Err(_) => break,
            };
        }
    }
}

/// A run of so many seconds with so many who pour; then Ctrl-C, while they go on.
fn flooded(seconds: u64, pouring: usize) -> Flooded {
    let folder = tempfile::tempdir().unwrap();
    let example =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/twil-firmware/model.toml");
    std::fs::copy(example, folder.path().join("model.toml")).unwrap();
    let mut desk = Desk::with_body();
    desk.by_clock = true;
    let heard = std::sync::Arc::clone(&desk.heard);
    let (line, thread) = desk.at_port();
    let door = folder.path().join("door");
    let text = format!(
        "model = \"model.toml\"\nperiod_s = 0.01\nlog = \"log.csv\"\n[driver.serial]\nline = \"{}\"\n\
         [controller.aboard]\ndoor = \"{}\"\nlaw = {{ settling_time_s = 0.45, limit = 12.0 }}\n\
         [controller.aboard.safety]\nwatchdog_s = 5.0\n\
         [reference]\nlinear_velocity = {{ sine = {{ amplitude = 0.1, frequency_hz = 0.5 }} }}\n",
        line.display(),
        door.display()
    );
    std::fs::write(folder.path().join("loop.toml"), text).unwrap();
    let (bytes, visitors) = (AtomicU64::new(0), AtomicU64::new(0));
    let over = AtomicBool::new(false);
    let (ended, output) = std::thread::scope(|scope| {
        let run = Command::new(env!("CARGO_BIN_EXE_loopsight"))
            .current_dir(folder.path())
            .args(["run", "loop.toml"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        for _ in 0..pouring {
            scope.spawn(|| pour(&door, &over, &bytes, &visitors));
        }
        std::thread::sleep(Duration::from_secs(seconds));
        let from = Instant::now();
        let told = Command::new("kill")
            .args(["-INT", &run.id().to_string()])
            .status();
        assert!(told.unwrap().success());
        let output = run.wait_with_output().unwrap();
        let ended = from.elapsed();
        over.store(true, Ordering::Relaxed);
        (ended, output)
    });
    thread.join().unwrap();
    let heard = heard.lock().unwrap();
    let period = Duration::from_micros(twil::PERIOD_US.into());
    let gaps = heard.windows(2).map(|two| two[1] - two[0]);
    let log = std::fs::read_to_string(folder.path().join("log.csv")).unwrap();
    Flooded {
        steps: heard.len(),
        latest: gaps.max().unwrap().saturating_sub(period),
        bytes: bytes.into_inner(),
        visitors: visitors.into_inner(),
        ended,
        drove: heard[heard.len() - 1] - heard[0],
        rows: log.lines().filter(|l| !l.starts_with('#')).count(),
        said: String::from_utf8_lossy(&output.stderr).into_owned()
            + &String::from_utf8_lossy(&output.stdout),
    }
}

/// How late a tick is depends on what else the machine does: the figures are said, beside those without a flood. What
/// must hold anywhere: every period has its tick, and nothing but Ctrl-C ends the run.
fn floods(seconds: u64) {
    for pouring in [0, 4] {
        let of = flooded(seconds, pouring);
        println!(
            "{pouring} who pour, {seconds} s: {} steps, the latest {:.1} ms late; {:.1} MB, {} visitors; ended {:.0} ms after Ctrl-C",
            of.steps,
            of.latest.as_secs_f64() * 1e3,
            of.bytes as f64 / 1e6,
            of.visitors,
            of.ended.as_secs_f64() * 1e3
        );
        assert!(of.said.contains("Ctrl-C"), "{}", of.said);
        // One row for each of the robot's periods, however long the machine took to begin and to end; one of them may be on its way.
        let periods = of.drove.as_micros() as f64 / f64::from(twil::PERIOD_US);
        assert!(
            (of.rows as f64 - periods).abs() <= 0.1 * periods + 4.0,
            "{} rows in {periods:.0} periods",
            of.rows
        );
        assert!(pouring == 0 || of.bytes > 1000, "{} bytes", of.bytes);
    }
}

#[test]
fn a_flood_ends_no_run() {
    floods(2);
}

#[test]
#[ignore = "two minutes, and figures that depend on what else the machine does"]
fn a_flood_of_a_minute() {
    floods(60);
}
