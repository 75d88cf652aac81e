//! PWM outputs of the kernel.

use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

use embedded_hal::pwm::{ErrorType, SetDutyCycle};

use super::file::{FileError, KernelFile, number, put};

/// How long, and how often, a channel that was just exported is waited for: its files are given to a
/// group by udev.
const TRIES: u32 = 50;
const PAUSE: Duration = Duration::from_millis(20);

/// A channel of `/sys/class/pwm`.
///
/// ```text
/// period_ns = 1e9/f     duty_cycle_ns = d period_ns/max     max = min(period_ns, 65535)
/// ```
///
/// Reference: the kernel's documentation, driver-api/pwm and ABI/testing/sysfs-class-pwm.
#[derive(Debug)]
pub(crate) struct SysfsPwm {
    duty: KernelFile,
    period_ns: u64,
    max: u16,
}

impl SysfsPwm {
    /// Channel `channel` of chip `chip` at `frequency` Hz, enabled with this share of its period.
    pub(crate) fn open(
        sysfs: &Path,
        chip: u32,
        channel: u32,
        frequency: f64,
        share: f64,
    ) -> Result<Self, FileError> {
        let chip = sysfs.join(format!("class/pwm/pwmchip{chip}"));
        let Some(channels) = number(chip.join("npwm"))? else {
            let why = "there is no such PWM chip; is its overlay or driver loaded?";
            return Err(FileError::new(&chip, why));
        };
        if u64::from(channel) >= channels {
            let why = format!("found channel {channel}, expected one below {channels}");
            return Err(FileError::new(&chip, why));
        }
        let folder = chip.join(format!("pwm{channel}"));
        if !folder.exists() {
            put(&chip.join("export"), &channel.to_string())?;
        }
        let mut tries = 0;
        let duty = loop {
            match KernelFile::open(folder.join("duty_cycle"), true) {
                Ok(file) => break file,
                Err(error) if tries == TRIES => return Err(error),
                Err(_) => sleep(PAUSE),
            }
            tries += 1;
        };
        // A period shorter than the duty is refused, and so is any duty while there is no period.
        if number(folder.join("duty_cycle"))?.unwrap_or(0) > 0 {
            duty.write(0)?;
        }
        let period_ns = (1e9 / frequency).round() as u64;
        put(&folder.join("period"), &format!("{period_ns}\n"))?;
        duty.write((share * period_ns as f64).round() as u64)?;
        put(&folder.join("enable"), "1\n")?;
        Ok(Self {
            duty,
            period_ns,
            max: u16::try_from(period_ns).unwrap_or(u16::MAX),
        })
    }
}

impl ErrorType for SysfsPwm {
    type Error = FileError;
}

impl SetDutyCycle for SysfsPwm {
    fn max_duty_cycle(&self) -> u16 {
        self.max
    }
    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), FileError> {
        let duty = u64::from(duty.min(self.max));
        self.duty.write(duty * self.period_ns / u64::from(self.max))
    }
}
