//! What is kept where steps are watched.

use crate::registry::HostReal;
use loopsight_core::{Bend, Rk4};

/// What is kept for steps of a length that suits the motion.
#[derive(Clone, Debug)]
pub(super) struct Watched<S> {
    /// Whether steps are watched now.
    pub(super) now: bool,
    /// How far the rates bent so far in this interval.
    pub(super) bend: f64,
    /// Steps for the next interval.
    pub(super) steps: usize,
    /// The longest that are stable [at rest](super::Simulator::shorten), and where nothing sticks, s.
    pub(super) stable: [f64; 2],
    /// Speeds, as signals by index, and how fast each must be so that nothing sticks; empty where that is not known.
    pub(super) slow: Vec<(usize, f64)>,
    /// How fast these were at the start of the interval.
    pub(super) speeds: Vec<f64>,
    /// The states at the start of the interval.
    pub(super) before: Vec<S>,
    /// The rate of each state over the present step.
    rates: Vec<Bend>,
}

impl<S> Watched<S> {
    /// Whether a step over `span` might not be stable.
    pub(super) fn steps_are_short(&self, span: f64) -> bool {
        self.stable.iter().any(|longest| span > *longest)
    }

    /// Nothing is known yet.
    pub(super) fn new() -> Self {
        Self {
            now: false,
            bend: 0.0,
            steps: 1,
            stable: [f64::INFINITY; 2],
            slow: Vec::new(),
            speeds: Vec::new(),
            before: Vec::new(),
            rates: Vec::new(),
        }
    }
}

impl<S: HostReal> Watched<S> {
    /// A step of `h` seconds that is watched.
    pub(super) fn step(
        &mut self,
        rk4: &mut Rk4<Vec<S>>,
        x: &mut [S],
        h: f64,
        mut rates: impl FnMut(usize, &[S], &mut [S]),
    ) {
        let kept = &mut self.rates;
        kept.clear();
        kept.resize(x.len(), Bend::default());
        rk4.step(x, S::of(h), |stage, x, dx| {
            rates(stage, x, dx);
            for (kept, rate) in kept.iter_mut().zip(dx) {
                kept.take(stage, rate.value());
            }
        });
        let bends = kept.iter().map(|rate| rate.share());
        self.bend = bends.fold(self.bend, f64::max);
    }
}
