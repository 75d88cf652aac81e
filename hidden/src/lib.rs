//! Recordings of machines that hide a physical effect, and the truth about them.
//!
//! A test that simulates a model and then finds that very model proves little. The machines here
//! are built from parts (masses, inertias, torques in N m, currents in windings of some
//! inductance, dry friction that really sticks, gears with teeth, encoders with marks) and share
//! neither equations nor integrator with the models that are compared with them. Without an effect
//! and without inductance those of motors and wheels obey the lumped equations of the paper exactly,
//! by construction: [`Driven::parts`] says how. Every other shipped plant has a machine of its own
//! ([`Robot`]), with one command; [`catalogue`] says what is hidden where.
//!
//! ```
//! use loopsight_hidden::{Experiment, Hidden, Robot, record};
//! let log = record(
//!     Robot::Twil,
//!     &[(Hidden::DeadZone, 1.0), (Hidden::BatterySag, 0.5)],
//!     Experiment::MultiLevel,
//!     7,
//! )?;
//! assert!(log.floor() < 0.05);
//! # Ok::<(), loopsight_hidden::HiddenError>(())
//! ```

mod amplifier;
mod bristles;
mod contact;
mod delay;
mod driven;
mod effect;
mod error;
mod experiment;
mod friction;
mod hide;
mod hysteresis;
mod library;
mod live;
mod machine;
mod machines;
mod model_file;
mod motor;
mod odometry;
mod physics;
mod random;
mod recording;
mod refit;
mod robot;
mod truth;

pub use driven::{Body, Driven, Lumped, Motor};
pub use effect::{Hidden, catalogue};
pub use error::HiddenError;
pub use experiment::{DURATION, Experiment, PERIOD};
pub use library::{visibility, write_library};
pub use live::Live;
pub use machines::{Parts, hysteretic_benchmark};
pub use recording::{Recording, nrmse, overall, record, record_along, record_with};
pub use refit::{Refit, refit};
pub use robot::Robot;
pub use truth::{Concealed, Quantity, Truth};
