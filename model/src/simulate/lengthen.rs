//! Steps as long as the motion allows, with an estimate of their error.

use super::Simulator;
use super::stiff::Way;
use crate::registry::HostReal;

/// Steps per sample up to which the usual ones are taken: they cost little, and keep their digits.
const MANY: usize = 100;
/// Points of the past that a sensor needs in an interval.
const PAST: usize = 8;
/// Difference between a step and two of half its length, relative to the largest value of a state so far.
/// The two are off by a fifteenth of it.
const TOLERANCE: f64 = 1e-5;
/// Steps per sample from which the model may be stiff, and the method for that is tried, too.
const STIFF: usize = 64;
/// Steps of that method beyond which the other one is tried again: then the motion is fast, but not stiff.
const NOT_STIFF: usize = 4 * STIFF;

/// What is kept for steps of a length that suits the motion.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lengthened<S> {
    /// Steps of the last interval.
    steps: usize,
    /// How they were made.
    way: Way,
    /// The fastest rate at its end, 1/s.
    fastest: f64,
    /// Largest magnitude of each state so far.
    size: Vec<f64>,
    before: Vec<S>,
    coarse: Vec<S>,
    explicit: Vec<S>,
}

impl<S: HostReal> Lengthened<S> {
    pub(crate) fn new(states: usize) -> Self {
        Self {
            steps: 1,
            way: Way::Explicit,
            fastest: 0.0,
            size: vec![0.0; states],
            before: vec![S::zero(); states],
            coarse: vec![S::zero(); states],
            explicit: vec![S::zero(); states],
        }
    }

    /// Whether two steps of half the length come to the same place, `now`.
    fn agrees(&self, now: &[S]) -> bool {
        // Steps that are too long for a stiff model leave every measure, and what is not finite agrees with nothing.
        let mut states = self.size.iter().zip(&self.coarse).zip(now);
        states.all(|((size, coarse), now)| {
            let (coarse, now) = (coarse.value(), now.value());
            now.is_finite() && (coarse - now).abs() <= TOLERANCE * size.max(now.abs())
        })
    }

    /// The states that are kept: the largest so far are the measure of what follows.
    fn keep(&mut self, now: &[S]) {
        for (size, now) in self.size.iter_mut().zip(now) {
            *size = size.max(now.value().abs());
        }
    }
}

impl<S: HostReal> Simulator<'_, S> {
    /// Whether an interval of so many usual steps is integrated with longer ones where they do.
    pub(crate) fn lengthens(&self, usual: usize) -> bool {
        usual > MANY && self.lengthened.is_some()
    }

    /// Integrates over `span` with as few steps as the motion allows and no more than `most`: as few that
    /// twice as many come to the same place, by a method for stiff models where that needs far fewer.
    ///
    /// An oven with a fastest time constant of 50 s, sampled every 5 s, needs two steps per sample; a robot's step
    /// would make two thousand. Halving is the error estimate of L. F. Richardson (E. Hairer, S. P. Nørsett, G.
    /// Wanner, 1993, "Solving Ordinary Differential Equations I", section II.4). It uses values alone, so that a
    /// simulation and its derivatives take the same steps.
    pub(crate) fn advance_lengthened(&mut self, input: &[f64], span: f64, most: usize) {
        let Some(mut kept) = self.lengthened.take() else {
            return self.integrate(input, span, most, true);
        };
        if self.x.iter().any(|x| !x.value().is_finite()) {
            // What has run away does not come back: no number of steps would do.
            self.lengthened = Some(kept);
            return self.integrate(input, span, 1, true);
        }
        kept.before.clone_from(&self.x);
        let mut way = match kept.way {
            Way::Implicit if kept.steps < NOT_STIFF => Way::Implicit,
            _ => Way::Explicit,
        };
        let mut linearised = false;
        if self.time == 0.0 {
            kept.fastest = self.fastest(input, 0.0);
        }
        let mut end = None;
        let mut steps = (kept.steps / 4).clamp(1, most);
        self.integrate_by(way, input, span, steps, &mut linearised);
        while steps < most {
            kept.coarse.clone_from(&self.x);
            self.x.clone_from(&kept.before);
            steps = (2 * steps).min(most);
            self.integrate_by(way, input, span, steps, &mut linearised);
            end = self.holds(way, &kept, input, span, steps, &mut linearised);
            if end.is_some() {
                break;
            }
            if way == Way::Explicit && steps >= STIFF {
                kept.explicit.clone_from(&self.x);
                self.x.clone_from(&kept.before);
                self.integrate_by(Way::Implicit, input, span, steps / 2, &mut linearised);
                kept.coarse.clone_from(&self.x);
                self.x.clone_from(&kept.before);
                self.integrate_by(Way::Implicit, input, span, steps, &mut linearised);
                end = self.holds(Way::Implicit, &kept, input, span, steps, &mut linearised);
                if end.is_some() {
                    way = Way::Implicit;
                    break;
                }
                self.x.clone_from(&kept.explicit);
            }
        }
        kept.way = way;
        kept.steps = steps;
        kept.fastest = end.unwrap_or_else(|| self.fastest(input, span));
        kept.keep(&self.x);
        if !self.bounds.output_memory.is_empty() {
            // The past of a sensor needs some points, too.
            self.x.clone_from(&kept.before);
            let steps = steps.max(PAST).min(most);
            if way == Way::Implicit {
                self.fastest(input, 0.0);
                self.implicit.prepare(span / steps as f64);
            }
            self.way = way;
            self.integrate(input, span, steps, true);
        }
        self.way = Way::Explicit;
        self.lengthened = Some(kept);
    }

    /// Integrates over `span` in so many steps made one `way`. The Jacobian of the interval's start is made once.
    fn integrate_by(
        &mut self,
        way: Way,
        input: &[f64],
        span: f64,
        steps: usize,
        linearised: &mut bool,
    ) {
        let h = span / steps as f64;
        if way == Way::Implicit {
            if !*linearised {
                self.apply(input, 0.0);
                self.way = Way::Linearise;
                self.step(self.time, h, 1);
                *linearised = true;
            }
            self.implicit.prepare(h);
        }
        self.way = way;
        self.integrate(input, span, steps, false);
    }

    /// Whether so many steps will do: half as many came to the same place, and they are stable. The fastest rate at
    /// the end then; the Jacobian is the one there if that was asked.
    fn holds(
        &mut self,
        way: Way,
        kept: &Lengthened<S>,
        input: &[f64],
        span: f64,
        steps: usize,
        linearised: &mut bool,
    ) -> Option<f64> {
        if !kept.agrees(&self.x) {
            return None;
        }
        let fastest = self.fastest(input, span);
        *linearised = false;
        way.is_stable(span / steps as f64, [kept.fastest, fastest])
            .then_some(fastest)
    }

    /// The fastest rate of the model where it is now, `elapsed` seconds after the start of the interval: 1/s. The
    /// Jacobian is the one there afterwards.
    pub(super) fn fastest(&mut self, input: &[f64], elapsed: f64) -> f64 {
        self.apply(input, elapsed);
        self.linearise(self.time + elapsed);
        self.implicit.fastest()
    }

    /// Keeps the rates of the model where it is now, at a `time`, and their Jacobian.
    pub(super) fn linearise(&mut self, time: f64) {
        self.way = Way::Linearise;
        // What an input does later is no part of it, and nothing is to be remembered.
        let slopes = std::mem::take(&mut self.slopes);
        self.step(time, 0.0, 1);
        self.slopes = slopes;
    }
}
