//! What is done to the command and its loops, what happened, and what was promised: the table of `docs/reliability.md`.
//!
//! ```sh
//! cargo build -p loopsight && cargo run -p loopsight-tests --example faults -- 500 10
//! ```
//!
//! The first number is that of the processes that are killed (20 by default), the second that of the millions of ticks without a motion (1
//! by default). The command is looked for where this program was built. Ends with status 1 where a promise was broken. Unix only.

#![allow(
    clippy::unwrap_used,
    reason = "what is set up here is right, and a panic is how this program fails"
)]

mod clock;
mod killed;
mod robots;
mod soak;

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

/// What was done, what happened, what was promised, and whether that was kept.
pub(crate) struct Row {
    pub(crate) what: String,
    pub(crate) happened: String,
    pub(crate) promised: &'static str,
    pub(crate) kept: bool,
}

/// A folder with the files that the commands need.
pub(crate) struct Desk {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) program: PathBuf,
}

const LOOP: &str = "model = \"model.toml\"\nperiod_s = 0.01\nduration_s = 4.0\nreal_time = true\nlog = \"run.csv\"\n\n\
    [driver.simulated]\nlimit = 12.0\n\n\
    [controller.feedback_linearizing_pi]\nsettling_time_s = 0.45\nlimit = 12.0\n\n\
    [reference]\nlinear_velocity = { multi_level = { amplitude = 0.2, hold_s = 1.0, levels = 5, seed = 3 } }\n";

const EXPERIMENT: &str = "duration_s = 10.0\nperiod_s = 0.01\n\n[inputs]\n\
    voltage_right = { prbs = { amplitude = 9.0, hold_s = 0.5, seed = 3 } }\n\
    voltage_left = { prbs = { amplitude = 9.0, hold_s = 0.4, seed = 4 } }\n";

impl Desk {
    pub(crate) fn new(program: &Path) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::copy(
            loopsight_tests::twil_path(),
            folder.path().join("model.toml"),
        )
        .unwrap();
        let desk = Self {
            folder,
            program: program.to_owned(),
        };
        desk.write("loop.toml", LOOP);
        desk.write("experiment.toml", EXPERIMENT);
        let made = desk.command(&["simulate", "model.toml", "experiment.toml", "-o", "log.csv"]);
        assert!({ made }.status().unwrap().success());
        desk
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.program);
        command
            .current_dir(self.folder.path())
            .args(arguments)
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null());
        command
    }
}

fn main() -> ExitCode {
    let number = |at: usize, default: usize| {
        let text = std::env::args().nth(at);
        text.map_or(default, |text| text.parse().unwrap())
    };
    let here = std::env::current_exe().unwrap();
    let program = here.parent().unwrap().with_file_name("loopsight");
    assert!(
        program.exists(),
        "{}: build the command first, with `cargo build -p loopsight`",
        program.display()
    );
    println!("| what was done | what happened | what was promised |");
    println!("|---|---|---|");
    let mut kept = true;
    let mut say = |rows: Vec<Row>| {
        for row in rows {
            let mark = if row.kept { "" } else { " **broken**" };
            println!(
                "| {} | {}{mark} | {} |",
                row.what, row.happened, row.promised
            );
            kept &= row.kept;
        }
    };
    say(killed::killed(&program, number(1, 20)));
    say(killed::full(&program));
    say(clock::stepped(&program));
    say(robots::sensors());
    say(robots::instants());
    say(robots::hidden());
    say(robots::blocks(&program));
    say(soak::unexcited(number(2, 1) * 1_000_000));
    if kept {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}
