//! A free run that an observer corrects by the measurements.

use crate::registry::HostReal;

use loopsight_core::{NoPast, Place};

use super::Simulator;
use super::bound::Bound;
use super::state_observer::StateObserver;

impl<S: HostReal> Simulator<'_, S> {
    /// What the sensor of a `signal` reads in the end for a signal of 1 more.
    pub fn slope(&self, signal: usize) -> S {
        let place = Place::Output(self.sensors[signal].index);
        let scene = self.scene();
        let mut slope = S::one();
        // A lag only delays it.
        let at_once = |b: &&Bound| b.place == place && b.n_z == 0;
        for bound in self.bounds.outputs.iter().filter(at_once) {
            let of = |nominal: S| scene.contribution(bound, nominal, &NoPast);
            slope += slope * (of(S::one()) - of(S::zero()));
        }
        slope
    }

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
        for (signal, (y, p)) in measured.iter().zip(predicted).enumerate() {
            if !y.is_finite() {
                continue;
            }
            let mut difference = S::of(*y) - *p;
            let slope = self.slope(signal) / S::of(observer.slope(signal));
            // One that turns the signal round, or reads nothing, has no gains that suit it.
            if slope > S::zero() {
                difference /= slope;
            }
            for (x, row) in self.state_mut().iter_mut().zip(gain.chunks_exact(columns)) {
                if row[signal] != 0.0 {
                    *x += S::of(row[signal]) * difference;
                }
            }
        }
    }
}
