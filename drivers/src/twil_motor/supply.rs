//! The voltage that a bridge switches.

use core::convert::Infallible;
use core::fmt;

use loopsight_core::Real;

/// Measures the supply of the bridges, V: a battery behind a divider, or a number that is known.
pub trait Supply<S: Real> {
    /// The meter's own error.
    type Error: fmt::Debug;
    /// The present voltage, V.
    ///
    /// # Errors
    ///
    /// The supply cannot be measured.
    fn volts(&mut self) -> Result<S, Self::Error>;
}

/// A supply whose voltage is known and does not change.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FixedSupply<S>(pub S);

impl<S: Real> Supply<S> for FixedSupply<S> {
    type Error = Infallible;
    fn volts(&mut self) -> Result<S, Infallible> {
        Ok(self.0)
    }
}
