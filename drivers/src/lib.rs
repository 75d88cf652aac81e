//! Drivers: what stands between a control loop and a robot.
//!
//! A driver reads a sample, writes a command, and returns what was applied, because an estimator must learn from
//! the inputs that the plant had. Each implements [`loopsight_core::Driver`].
//!
//! | driver | what | where |
//! |---|---|---|
//! | [`twil_motor::TwilMotor`] | motors with encoders on the pins of a board (embedded-hal 1.0) | anywhere, without `std` |
//! | `Simulated` | any plant as the robot, with noise, encoder counts and faults | host |
//! | `Replay` | a log as the robot | host |
//! | `LinuxGpio` | the motors of `twil_motor` on the pins of a board that runs Linux | Linux |
//!
//! The host's drivers are parts of a loop file, `[driver.<id>]`. A driver of one's own is a few lines; here is one
//! that refuses a command that is not a number and comes to rest:
//!
//! ```
//! use loopsight_core::{Driver, DriverFault, Sample};
//!
//! #[derive(Default)]
//! struct Fan {
//!     volts: f64,
//!     speed: f64,
//!     time: f64,
//! }
//!
//! impl Driver<f64> for Fan {
//!     type Error = DriverFault;
//!
//!     fn read(&mut self, measured: &mut [f64]) -> Result<Sample<f64>, DriverFault> {
//!         self.speed += 0.01 * (20.0 * self.volts - 4.0 * self.speed);
//!         self.time += 0.01;
//!         measured[0] = self.speed;
//!         Ok(Sample { time: self.time, fresh: true })
//!     }
//!
//!     fn write(&mut self, command: &[f64], applied: &mut [f64]) -> Result<(), DriverFault> {
//!         if !command[0].is_finite() {
//!             self.safe_stop()?;
//!             return Err(DriverFault::Rejected);
//!         }
//!         self.volts = command[0].clamp(0.0, 12.0);
//!         applied[0] = self.volts;
//!         Ok(())
//!     }
//!
//!     fn safe_stop(&mut self) -> Result<(), DriverFault> {
//!         self.volts = 0.0;
//!         Ok(())
//!     }
//! }
//!
//! let (mut fan, mut speed, mut applied) = (Fan::default(), [0.0], [0.0]);
//! fan.write(&[15.0], &mut applied)?;
//! fan.read(&mut speed)?;
//! assert_eq!(applied, [12.0], "what the supply gives, not what was asked for");
//! # Ok::<(), DriverFault>(())
//! ```
//!
//! | feature | what it adds |
//! |---|---|
//! | `std` (default) | the host's drivers, their tables in TOML and their lines in the registry of `loopsight-model` |
//! | `defmt` | errors and states of `twil_motor` as `defmt` formats them, for the log of a microcontroller |
//!
//! Without `std` nothing here allocates. A program that wants the drivers in its TOML says
//! `use loopsight_drivers as _;`, unless it depends on the crate `loopsight`, which does.

#![cfg_attr(not(feature = "std"), no_std)]

#[cfg(feature = "std")]
mod batch;
#[cfg(feature = "std")]
mod encoder;
#[cfg(feature = "std")]
mod fault;
#[cfg(test)]
#[cfg(feature = "std")]
mod fixture;
#[cfg(feature = "std")]
#[cfg(target_os = "linux")]
mod linux_gpio;
#[cfg(feature = "std")]
mod replay;
#[cfg(feature = "std")]
mod robot;
#[cfg(feature = "std")]
mod simulated;
pub mod twil_motor;

#[cfg(feature = "std")]
pub use batch::simulate_inputs;
#[cfg(feature = "std")]
pub use encoder::Counter;
#[cfg(feature = "std")]
pub use fault::SensorFault;
#[cfg(feature = "std")]
#[cfg(target_os = "linux")]
pub use linux_gpio::{BridgeKind, GpioLine, LinuxGpio, Motor, SupplySetting};
#[cfg(feature = "std")]
pub use replay::Replay;
#[cfg(feature = "std")]
pub use simulated::{Limit, Simulated};
