//! What stands between a loop and a robot, one file per driver.
//!
//! Host drivers (feature `std`): [`Simulated`], any plant as the robot, [`Replay`], a recording
//! as the robot, and, on Linux, `LinuxGpio`, the pins of a board. They are parts of a loop file,
//! `[driver.<id>]`, and are found in the registry by whoever says `use loopsight_drivers as _;`.
//!
//! Without `std`: [`twil_motor`], motors and encoders on the pins of a board.

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
pub use linux_gpio::{BridgeKind, Line, LinuxGpio, Motor, SupplySetting};
#[cfg(feature = "std")]
pub use replay::Replay;
#[cfg(feature = "std")]
pub use simulated::{Limit, Simulated};
