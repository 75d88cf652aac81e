//! Adaptive control you can see into: the library, and the command built on it.

#[cfg(feature = "cli")]
pub mod cli;

use loopsight_controllers as _;
use loopsight_drivers as _;
use loopsight_estimators as _;
use loopsight_plants as _;
