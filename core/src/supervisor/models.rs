//! The learned model and the last good one, and how well each of them predicts.

use crate::{AffineModel, Observation, Observer, Real};

/// Windows over which the usual innovation is a mean.
const USUAL: f64 = 20.0;

/// Share of the size of the measured rates below which two models predict alike.
const ALIKE: f64 = 0.01;

/// Share of the size of the measured rates below which an innovation is not unusual: a robot that
/// moves for the first time after a rest has nothing to be compared with.
const MOVING: f64 = 0.3;

/// How much worse a model may predict that still counts as no worse (in power).
const NO_WORSE: f64 = 1.21;

/// Three sets of values for the parameters of one model: what is learned, what was good last, and where it
/// began.
#[derive(Clone, Debug)]
pub(super) struct Models<S, B> {
    /// What the observer taught last; where it never did, the model's own values.
    learned: B,
    /// What the controller is given when the learned model is left.
    good: B,
    /// What the controller's model was built with.
    first: B,
    /// The good one is the first one.
    pub(super) is_first: bool,
    /// Above 0 where the observer ever taught a value.
    taught: B,
    /// Mean squares over the window, by regression: of the learned model's innovation, of what the good
    /// one and the first one leave unexplained, and of the measured rate; the last one's recent peak.
    now: B,
    past: B,
    origin: B,
    rate: B,
    peak: B,
    /// Mean square of the smallest of the first three over a long time.
    usual: B,
    last: B,
    age: S,
    /// The last sample taught the observer something.
    pub(super) taught_now: bool,
}

/// Takes what an observer teaches, and passes it on to a model if there is one.
struct Ledger<'a, 'm, S> {
    learned: &'a mut [S],
    taught: &'a mut [S],
    model: Option<&'a mut (dyn AffineModel<S> + 'm)>,
}

impl<S: Real> AffineModel<S> for Ledger<'_, '_, S> {
    fn size(&self) -> usize {
        self.model.as_ref().map_or(0, |m| m.size())
    }

    fn evaluate(&mut self, y: &[S], drift: &mut [S], input_matrix: &mut [S]) {
        if let Some(model) = &mut self.model {
            model.evaluate(y, drift, input_matrix);
        }
    }

    fn learn(&mut self, parameter: usize, value: S) {
        if !value.is_finite() {
            return;
        }
        if let (Some(to), Some(taught)) = (
            self.learned.get_mut(parameter),
            self.taught.get_mut(parameter),
        ) {
            *to = value;
            *taught = S::one();
        }
        if let Some(model) = &mut self.model {
            model.learn(parameter, value);
        }
    }
}

impl<S: Real, B: AsRef<[S]> + AsMut<[S]> + Clone> Models<S, B> {
    /// `values` are those the controller's model was built with; buffers come from `zeros`.
    pub(super) fn new(values: B, rows: usize, zeros: impl Fn(usize) -> B) -> Self {
        Self {
            taught: zeros(values.as_ref().len()),
            learned: values.clone(),
            good: values.clone(),
            first: values,
            is_first: true,
            now: zeros(rows),
            past: zeros(rows),
            origin: zeros(rows),
            rate: zeros(rows),
            peak: zeros(rows),
            usual: zeros(rows),
            last: zeros(rows),
            age: S::zero(),
            taught_now: false,
        }
    }

    /// True once the observer has taught anything: the loop adapts.
    pub(super) fn adapts(&self) -> bool {
        self.taught.as_ref().iter().any(|t| *t > S::zero())
    }

    /// Takes what the observer teaches, and hands it to `model` if there is one.
    pub(super) fn take(
        &mut self,
        observer: &dyn Observer<S>,
        model: Option<&mut dyn AffineModel<S>>,
    ) {
        observer.teach(&mut Ledger {
            learned: self.learned.as_mut(),
            taught: self.taught.as_mut(),
            model,
        });
    }

    /// Compares both models with what was seen; `calm`: what is seen now counts as usual.
    pub(super) fn compare(
        &mut self,
        seen: &Observation<'_, S>,
        observer: &dyn Observer<S>,
        window: S,
        calm: bool,
    ) {
        let share = (seen.tick.period / window).min(S::one());
        if self.age == S::zero() {
            // There is no rate before the second sample.
            for (last, y) in self.last.as_mut().iter_mut().zip(seen.measured) {
                *last = *y;
            }
        }
        self.age += seen.tick.period;
        self.taught_now = false;
        // A plain mean until there is a long time to look back on.
        let slow = (share / S::of(USUAL)).max(seen.tick.period / self.age);
        for row in 0..self.now.as_ref().len() {
            if let Some(y) = seen.measured.get(row) {
                let rate = (*y - self.last.as_ref()[row]) / seen.tick.period;
                blend(&mut self.rate.as_mut()[row], rate * rate, share);
                self.last.as_mut()[row] = *y;
                let peak = &mut self.peak.as_mut()[row];
                *peak = (*peak * (S::one() - share / S::of(USUAL))).max(self.rate.as_ref()[row]);
            }
            let Some(innovation) = observer.innovation(row) else {
                continue;
            };
            self.taught_now |= innovation.accepted;
            let e = innovation.innovation;
            let left = |values: &B| observer.residual(row, values.as_ref()).unwrap_or(e);
            let g = left(&self.good);
            let f = if self.is_first { g } else { left(&self.first) };
            blend(&mut self.now.as_mut()[row], e * e, share);
            blend(&mut self.past.as_mut()[row], g * g, share);
            blend(&mut self.origin.as_mut()[row], f * f, share);
            if calm {
                let best = self.best(row);
                blend(&mut self.usual.as_mut()[row], best, slow);
            }
        }
    }

    /// Mean square of what the best of the three leaves unexplained.
    fn best(&self, row: usize) -> S {
        let of = |means: &B| means.as_ref()[row];
        of(&self.now).min(of(&self.past)).min(of(&self.origin))
    }

    /// Mean square of a share of the measured rate.
    fn floor(&self, row: usize, share: f64) -> S {
        self.peak.as_ref()[row] * S::of(share * share)
    }

    /// How many times worse than the good model the learned one predicts, where it is worst.
    pub(super) fn worse(&self) -> Option<(usize, S)> {
        self.largest(|models, row| {
            let by = models.past.as_ref()[row] + models.floor(row, ALIKE);
            models.now.as_ref()[row] / by
        })
    }

    /// How many times as large as usual the innovation of the best model is, where it is largest.
    pub(super) fn unusual(&self) -> Option<(usize, S)> {
        self.largest(|models, row| {
            models.best(row) / models.usual.as_ref()[row].max(models.floor(row, MOVING))
        })
    }

    /// The row with the largest ratio of powers, and the ratio's root.
    fn largest(&self, ratio: impl Fn(&Self, usize) -> S) -> Option<(usize, S)> {
        let mut largest = None;
        for row in 0..self.now.as_ref().len() {
            let ratio = ratio(self, row);
            if ratio.is_finite() && largest.is_none_or(|(_, most)| ratio > most) {
                largest = Some((row, ratio));
            }
        }
        largest.map(|(row, power)| (row, power.sqrt()))
    }

    /// True where the learned model predicts no worse than the good one.
    pub(super) fn learned_is_good(&self) -> bool {
        self.no_worse(&self.now, &self.past)
    }

    /// True where the first model predicts better than the good one.
    pub(super) fn first_is_better(&self) -> bool {
        !self.is_first && !self.no_worse(&self.past, &self.origin)
    }

    /// True where the good model is not the first one, which predicts no worse.
    pub(super) fn first_is_good(&self) -> bool {
        !self.is_first && self.no_worse(&self.origin, &self.past)
    }

    /// Whether the model with the mean squares `of` predicts no worse than the one with those `by`.
    fn no_worse(&self, of: &B, by: &B) -> bool {
        let (of, by) = (of.as_ref(), by.as_ref());
        (0..of.len()).all(|row| of[row] <= by[row] * S::of(NO_WORSE) + self.floor(row, ALIKE))
    }

    /// The learned model becomes the good one.
    pub(super) fn promote(&mut self) {
        self.good.as_mut().copy_from_slice(self.learned.as_ref());
        self.past.as_mut().copy_from_slice(self.now.as_ref());
        self.is_first = false;
    }

    /// The first model becomes the good one.
    pub(super) fn begin_again(&mut self) {
        self.good.as_mut().copy_from_slice(self.first.as_ref());
        self.past.as_mut().copy_from_slice(self.origin.as_ref());
        self.is_first = true;
    }

    /// The good model takes the place of the learned one, with the controller and the observer.
    pub(super) fn restore(
        &mut self,
        observer: &mut dyn Observer<S>,
        model: &mut dyn AffineModel<S>,
    ) {
        let values = self.good.as_ref();
        for (parameter, taught) in self.taught.as_ref().iter().enumerate() {
            if *taught > S::zero() {
                model.learn(parameter, values[parameter]);
            }
        }
        observer.restart(values);
        self.learned.as_mut().copy_from_slice(values);
        self.now.as_mut().copy_from_slice(self.past.as_ref());
    }
}

/// Moves `mean` by a share of its way towards `value`; a value that is no number moves nothing.
fn blend<S: Real>(mean: &mut S, value: S, share: S) {
    if value.is_finite() {
        *mean += (value - *mean) * share;
    }
}
