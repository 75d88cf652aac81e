//! The driver against fakes of the kernel's files, and of its GPIO lines.

mod drives;
mod refuses;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use embedded_hal::digital::{ErrorKind, ErrorType, OutputPin, PinState};
use loopsight_core::{Clock, Driver as _, DriverFault};
use loopsight_model::config::TomlSource;
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use tempfile::TempDir;

use super::board::{Board, Plan};
use super::bridge::Lines;
use super::*;
use crate::fixture::{HALF_TRACK, WHEEL, twil, twil_encoders, within};

/// A board with two PWM channels at 20 kHz, two 16-bit counters and some lines.
struct Fake {
    folder: TempDir,
    lines: FakeLines,
    now: Arc<Mutex<f64>>,
}

/// What happened to the lines, in order, and which of them fail from now on.
#[derive(Clone, Default)]
struct FakeLines {
    levels: Arc<Mutex<BTreeMap<u32, bool>>>,
    journal: Arc<Mutex<Vec<String>>>,
    broken: Arc<Mutex<Option<u32>>>,
}

struct FakePin(FakeLines, u32);

#[derive(Debug)]
struct Broken(u32);

impl std::fmt::Display for Broken {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {} is broken", self.0)
    }
}

impl embedded_hal::digital::Error for Broken {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for FakePin {
    type Error = Broken;
}

impl FakePin {
    fn set(&mut self, high: bool) -> Result<(), Broken> {
        if *self.0.broken.lock().unwrap() == Some(self.1) {
            return Err(Broken(self.1));
        }
        self.0.levels.lock().unwrap().insert(self.1, high);
        let level = if high { "high" } else { "low" };
        let said = format!("{} {level}", self.1);
        self.0.journal.lock().unwrap().push(said);
        Ok(())
    }
}

impl OutputPin for FakePin {
    fn set_low(&mut self) -> Result<(), Broken> {
        self.set(false)
    }
    fn set_high(&mut self) -> Result<(), Broken> {
        self.set(true)
    }
}

impl Lines for FakeLines {
    type Pin = FakePin;
    fn open(&self, chip: &str, line: u32, level: PinState) -> Result<FakePin, String> {
        assert_eq!(chip, "/dev/gpiochip0");
        let mut pin = FakePin(self.clone(), line);
        pin.set(level == PinState::High)
            .map_err(|e| e.to_string())?;
        Ok(pin)
    }
}

/// A clock that a test turns.
#[derive(Clone)]
struct Hand(Arc<Mutex<f64>>);

impl Clock for Hand {
    fn now(&mut self) -> f64 {
        *self.0.lock().unwrap()
    }
    fn wait_until(&mut self, deadline: f64) {
        *self.0.lock().unwrap() = deadline;
    }
}

fn put(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

impl Fake {
    fn new() -> Self {
        let fake = Self {
            folder: tempfile::tempdir().unwrap(),
            lines: FakeLines::default(),
            now: Arc::default(),
        };
        fake.set("class/pwm/pwmchip0/npwm", "2\n");
        fake.set("class/pwm/pwmchip0/export", "");
        for channel in 0..2 {
            for (file, text) in [("period", "0\n"), ("duty_cycle", "0\n"), ("enable", "0\n")] {
                fake.set(&format!("class/pwm/pwmchip0/pwm{channel}/{file}"), text);
            }
        }
        for device in 0..2 {
            for (file, text) in [
                ("count", "0\n"),
                ("ceiling", "65535\n"),
                ("function", "increase\n"),
                ("enable", "0\n"),
            ] {
                fake.set(
                    &format!("bus/counter/devices/counter{device}/count0/{file}"),
                    text,
                );
            }
        }
        fake
    }

    fn path(&self, file: &str) -> PathBuf {
        self.folder.path().join(file)
    }

    fn set(&self, file: &str, text: &str) {
        put(&self.path(file), text);
    }

    /// The first line of a file: shorter numbers are written over longer ones, as to the kernel.
    fn get(&self, file: &str) -> String {
        let text = fs::read_to_string(self.path(file)).unwrap();
        text.lines().next().unwrap_or_default().to_owned()
    }

    /// Duties of both channels, ns.
    fn duties(&self) -> [u64; 2] {
        [0, 1].map(|c| {
            let duty = self.get(&format!("class/pwm/pwmchip0/pwm{c}/duty_cycle"));
            duty.parse().unwrap()
        })
    }

    fn count(&self, counts: [u32; 2]) {
        for (device, count) in counts.iter().enumerate() {
            let file = format!("bus/counter/devices/counter{device}/count0/count");
            self.set(&file, &format!("{count}\n"));
        }
        *self.now.lock().unwrap() += 0.01;
    }

    fn journal(&self) -> Vec<String> {
        std::mem::take(&mut *self.lines.journal.lock().unwrap())
    }

    fn level(&self, line: u32) -> bool {
        self.lines.levels.lock().unwrap()[&line]
    }

    /// Settings of the example, with this board's files and a watchdog that does not bark by itself.
    fn settings(&self) -> LinuxGpio {
        let mut settings = example();
        settings.sysfs = self.folder.path().to_owned();
        settings.coast_after = 1_000_000;
        settings
    }

    fn board(&self, settings: &LinuxGpio) -> Board<FakeLines, Hand> {
        let plan = plan(settings, &twil_encoders()).unwrap();
        Board::new(plan, self.lines.clone(), Hand(self.now.clone()))
    }
}

#[derive(Debug, Deserialize)]
struct File {
    driver: Only,
}

#[derive(Debug, Deserialize)]
struct Only {
    linux_gpio: LinuxGpio,
}

fn example() -> LinuxGpio {
    let source = TomlSource::parse("loop.toml", META.example).unwrap();
    source.read::<File>().unwrap().driver.linux_gpio
}

fn plan(settings: &LinuxGpio, model: &Model) -> Result<Plan, BuildError> {
    within(model, None, &[], |context| settings.plan(context))
}
