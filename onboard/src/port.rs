//! What stands between a loop aboard and its robot: values put in, values taken out.

use loopsight_core::{Clock, Driver, DriverFault, Real, Sample};

/// A driver whose measurements are put in before a tick, and whose inputs are taken out after it.
///
/// What is not finite is refused, what the supply cannot give is cut; at rest its inputs are zero.
#[derive(Clone, Debug)]
pub struct Port<S, const N: usize> {
    /// What the next tick measures.
    pub measured: [S; N],
    /// The measurement is young enough to learn from.
    pub fresh: bool,
    /// Largest magnitude of an input that the supply can give.
    pub most: S,
    /// What the last tick applied.
    pub applied: [S; N],
}

impl<S: Real, const N: usize> Default for Port<S, N> {
    fn default() -> Self {
        Self {
            measured: [S::of(f64::NAN); N],
            fresh: false,
            most: S::of(f64::INFINITY),
            applied: [S::zero(); N],
        }
    }
}

impl<S: Real, const N: usize> Driver<S> for Port<S, N> {
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
        for ((own, to), from) in self.applied.iter_mut().zip(applied).zip(command) {
            *own = from.held(-self.most, self.most);
            *to = *own;
        }
        Ok(())
    }

    fn safe_stop(&mut self) -> Result<(), DriverFault> {
        self.applied = [S::zero(); N];
        Ok(())
    }
}

/// A clock that never waits: someone else says when a tick is.
#[derive(Clone, Copy, Debug, Default)]
pub struct Prompted;

impl Clock for Prompted {
    fn now(&mut self) -> f64 {
        0.0
    }
    fn wait_until(&mut self, _deadline: f64) {}
}
