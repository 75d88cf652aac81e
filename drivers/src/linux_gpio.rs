//! Motors with encoders on a board that runs Linux.

mod board;
mod bridge;
mod counter;
mod file;
mod pwm;
mod settings;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::PathBuf;

use loopsight_core::SystemClock;
use loopsight_model::declare_part;
use loopsight_model::registry::{
    BuildError, DriverContext, DriverPart, HostDriver, PartMeta, Setting,
};
use serde::{Deserialize, Serialize};

use board::{Board, Plan};
use bridge::CharacterDevices;
pub use settings::{BridgeKind, GpioLine, Motor, SupplySetting};

/// Motors and encoders of a board that runs Linux: pins of the kernel's GPIO character devices, PWM
/// outputs of `/sys/class/pwm`, quadrature counters of `/sys/bus/counter`.
///
/// What it does with them is [`TwilMotor`](crate::twil_motor::TwilMotor), with a motor for each input of
/// the model. Measured signals are made of the counts as the model's `encoder_counts` say:
///
/// ```text
/// y_i = Σ_j g_ij Δ_i n_j/t      Δ = 2 π/N
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `g_ij` | gain from the rate of shaft `j` to signal `i`, in the model's `of` | of the signal per rad/s |
/// | `N` | counts per turn | 1 |
/// | `n_j`, `t` | counts since the last reading, and how long ago that was by the clock | 1, s |
///
/// A reading more than half a period early or late is not fresh: what is learned supposes one period.
///
/// A thread of its own ticks the watchdog once per period, so that the motors coast, and then brake,
/// also when the loop hangs. Nothing can stop a PWM of the kernel after the program was killed: the page
/// `docs/bring-up.md` says what to do about that.
///
/// `check` touches no hardware: everything is opened at the first reading, enable pins first.
///
/// Reference: the Linux kernel's documentation, userspace-api/gpio/chardev, driver-api/pwm,
/// driver-api/generic-counter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LinuxGpio {
    /// Device file of the GPIO chip.
    #[serde(default = "chip")]
    pub chip: String,
    /// Frequency of the PWM, Hz.
    #[serde(default = "pwm_hz")]
    pub pwm_hz: f64,
    /// The voltage behind the bridges.
    pub supply: SupplySetting,
    /// The least supply that the motors are driven with, V.
    #[serde(default)]
    pub least_supply_v: f64,
    /// Ticks without a command until the motors coast.
    #[serde(default = "coast_after")]
    pub coast_after: u32,
    /// Ticks from there until they brake.
    #[serde(default = "then_brake")]
    pub then_brake: u32,
    /// A motor for each input of the model.
    pub motor: BTreeMap<String, Motor>,
    /// Where the kernel's files are.
    #[serde(default = "sysfs")]
    pub sysfs: PathBuf,
}

fn chip() -> String {
    "/dev/gpiochip0".to_owned()
}
fn pwm_hz() -> f64 {
    20_000.0
}
fn coast_after() -> u32 {
    5
}
fn then_brake() -> u32 {
    20
}
fn sysfs() -> PathBuf {
    PathBuf::from("/sys")
}

/// Declaration of the driver.
pub(crate) const META: PartMeta = PartMeta {
    id: "linux_gpio",
    role: "driver",
    summary: "motors and encoders on a board that runs Linux: GPIO lines, PWM outputs and quadrature counters of the kernel",
    equation: "duty = u/U (sign-magnitude) or (1 + u/U)/2 (locked antiphase); y = sum of gain 2 π/N n/t over the shafts; no command for coast_after ticks: coast, then_brake later: brake",
    reference: "The Linux kernel's documentation: userspace-api/gpio/chardev, driver-api/pwm, driver-api/generic-counter; Mohan, Undeland, Robbins (2003), Power Electronics, 3rd ed., section 7-7",
    example: "[driver.linux_gpio]\nsupply = 12.0\n\n\
        [driver.linux_gpio.motor.voltage_right]\npwm = [0, 0]\ndirection = 5\nenable = 6\ncounter = [0, 0]\n\
        shaft = \"shaft_angle_right\"\nlimit_v = 12.0\n\n\
        [driver.linux_gpio.motor.voltage_left]\npwm = [0, 1]\ndirection = 13\nenable = 19\ncounter = [1, 0]\n\
        shaft = \"shaft_angle_left\"\nlimit_v = 12.0\nmotor_reversed = true\n",
    settings: &[
        Setting::new(
            "chip",
            "",
            "device file of the GPIO chip; default: /dev/gpiochip0",
        ),
        Setting::new("pwm_hz", "Hz", "frequency of the PWM; default: 20000"),
        Setting::new(
            "supply",
            "V",
            "voltage behind the bridges: a number, or a file with a number and volts per unit of it, `{ file, scale }`; no default",
        ),
        Setting::new(
            "least_supply_v",
            "V",
            "least supply that the motors are driven with; default: 0",
        ),
        Setting::new(
            "coast_after",
            "1",
            "ticks without a command until the motors coast; default: 5",
        ),
        Setting::new(
            "then_brake",
            "1",
            "ticks from there until they brake; default: 20",
        ),
        Setting::new(
            "motor",
            "",
            "table by input of the model: `pwm` [chip, channel], `counter` [device, count], `shaft` as in the model's sensors, `limit_v`; `bridge` \"sign_magnitude\" (default) or \"locked_antiphase\"; lines `direction`, `enable`, `brake` (a number, or `{ line, active_low }`); `slew` (V/s), `dead_ticks`, `motor_reversed`, `encoder_reversed`",
        ),
        Setting::new("sysfs", "", "where the kernel's files are; default: /sys"),
    ],
};

impl LinuxGpio {
    fn plan(&self, context: &DriverContext<'_>) -> Result<Plan, BuildError> {
        let positive = |key: &str, value: f64| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            let message = format!("`{key}` is {value}, expected a number above 0");
            Err(BuildError::at(key, message))
        };
        positive("pwm_hz", self.pwm_hz)?;
        match &self.supply {
            SupplySetting::Fixed(volts) => positive("supply", *volts)?,
            SupplySetting::Measured { scale, .. } => positive("supply.scale", *scale)?,
        }
        if !(self.least_supply_v >= 0.0 && self.least_supply_v.is_finite()) {
            let message = format!(
                "`least_supply_v` is {} V, expected a number from 0 V upwards",
                self.least_supply_v
            );
            return Err(BuildError::at("least_supply_v", message));
        }
        if self.coast_after == 0 {
            let message = "`coast_after` is 0, expected at least one tick";
            return Err(BuildError::at("coast_after", message));
        }
        let motors = settings::in_order(&self.motor, context.model)?;
        Ok(Plan {
            gains: settings::gains(&motors, context.model, context.period)?,
            motors: motors
                .into_iter()
                .map(|(id, motor)| (id, motor.clone()))
                .collect(),
            period: context.period,
            settings: self.clone(),
        })
    }
}

#[typetag::serde(name = "linux_gpio")]
impl DriverPart for LinuxGpio {
    fn meta(&self) -> &'static PartMeta {
        &META
    }

    fn build(&self, context: &DriverContext<'_>) -> Result<HostDriver, BuildError> {
        let plan = self.plan(context)?;
        Ok(Box::new(Board::new(
            plan,
            CharacterDevices,
            SystemClock::default(),
        )))
    }

    /// Each motor has its `limit_v`.
    fn is_limited(&self) -> bool {
        true
    }

    fn is_simulated(&self) -> bool {
        false
    }
}

declare_part!(&META);
