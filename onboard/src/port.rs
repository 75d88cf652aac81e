//! The driver of a loop aboard: values are put in before a tick and taken out after it.

use loopsight_core::{Array, Clock, Driver, DriverFault, Real, Sample};

/// A driver whose measurements are put in before a tick, and whose inputs are taken out after it.
///
/// Commands that are not finite are refused, and what the supply cannot give is cut off. At rest the inputs
/// are zero. `A` is the array `[S; N]`.
#[derive(Clone, Debug)]
pub struct Port<S, A> {
    /// The measurement of the next tick.
    pub measured: A,
    /// The measurement is fresh enough to learn from.
    pub fresh: bool,
    /// Largest magnitude of an input that the supply can give.
    pub most: S,
    /// The inputs that the last tick applied.
    pub applied: A,
}

impl<S: Real, A: Array<S>> Default for Port<S, A> {
    fn default() -> Self {
        Self {
            measured: A::filled(S::of(f64::NAN)),
            fresh: false,
            most: S::of(f64::INFINITY),
            applied: A::filled(S::zero()),
        }
    }
}

impl<S: Real, A: Array<S> + Copy + Send> Driver<S> for Port<S, A> {
    type Error = DriverFault;

    fn read(&mut self, measured: &mut [S]) -> Result<Sample<S>, DriverFault> {
        for (to, from) in measured.iter_mut().zip(self.measured) {
            *to = from;
        }
        // Times are those of the host: aboard, one period follows the other.
        Ok(Sample {
            time: S::zero(),
            fresh: self.fresh,
        })
    }

    fn write(&mut self, command: &[S], applied: &mut [S]) -> Result<(), DriverFault> {
        if command.iter().any(|v| !v.is_finite()) {
            return Err(DriverFault::Rejected);
        }
        let own = self.applied.as_mut().iter_mut();
        for ((own, to), from) in own.zip(applied).zip(command) {
            *own = from.clamp(-self.most, self.most);
            *to = *own;
        }
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), DriverFault> {
        self.applied = A::filled(S::zero());
        Ok(())
    }
}

/// A clock that never waits: the board's timer starts each tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Prompted;

impl Clock for Prompted {
    fn now(&mut self) -> f64 {
        0.0
    }
    fn wait_until(&mut self, _deadline: f64) {}
}
