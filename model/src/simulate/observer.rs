//! A free run that an observer corrects by the measurements.

use crate::registry::HostReal;

use super::Simulator;
use super::state_observer::StateObserver;

impl<S: HostReal> Simulator<'_, S> {
    /// Corrects the plant state by sample `k`: `measured` against what was `predicted`. Missing
    /// measurements correct nothing.
    pub fn correct(
        &mut self,
        observer: &StateObserver,
        k: usize,
        measured: &[f64],
        predicted: &[S],
    ) {
        let gain = observer.gain(k);
        let columns = measured.len().max(1);
        for (x, row) in self.state_mut().iter_mut().zip(gain.chunks_exact(columns)) {
            for ((gain, y), p) in row.iter().zip(measured).zip(predicted) {
                if y.is_finite() && *gain != 0.0 {
                    *x += S::of(*gain) * (S::of(*y) - *p);
                }
            }
        }
    }
}
