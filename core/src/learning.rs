//! Guards of an estimator: excitation, dead zone, projection. They are the same for every estimator, on a desk and on
//! a robot.

mod excitation;
mod guarded;
mod lesson;
mod projection;
mod range;

pub use guarded::{Guarded, Guards};
pub use lesson::{Lesson, Withheld};
pub use range::Range;
