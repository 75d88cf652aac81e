//! The supervisor in motion.

use super::models::Models;
use super::{Action, Cause, Event, Supervise};
use crate::{AffineModel, Observation, Observer, Real};

/// A relapse counts for this long, s.
const REMEMBERED: f64 = 60.0;

/// Change, relative to the largest speed asked for, below which a shaft keeps its speed.
const STILL: f64 = 1e-6;

/// Share of the largest speed asked for below which a shaft may well stand.
const MATTERS: f64 = 0.1;

/// Counts of an encoder by which a speed may change within a period and still have changed as little as can be seen: one,
/// and a half for what rounding adds.
const COUNTS: f64 = 1.5;

/// Times as long a shaft may keep its speed that has a reason to: one that turns the right way with all there is (a
/// constant voltage gives a constant speed, and a coarse encoder the same count), and one that came to rest
/// gradually, which dry friction holds until the integrator has wound up that far.
const PATIENCE: f64 = 4.0;

/// When a supervisor acts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thresholds<S> {
    /// Window over which predictions are judged, s.
    pub window: S,
    /// Times worse than the last good model at which the learned one is left.
    pub worse: S,
    /// Times its usual size at which an innovation says that no model is right.
    pub innovation: S,
    /// How long that may last, s.
    pub innovation_for: S,
    /// Largest tracking error where no limit is given, as a share of the largest reference so far.
    pub tracking_share: S,
    /// How long a tracking error may be beyond its limit, s.
    pub tracking_for: S,
    /// How long a shaft that should turn otherwise may keep its speed, s; four times as long where it turns the
    /// right way while an actuator saturates, or came to rest gradually.
    pub frozen: S,
    /// How long there may be no fresh sample, s.
    pub stale: S,
    /// How long the learned model must have been good, while it learned, before it is handed over, s.
    pub calm: S,
    /// How often in a minute the learned model may be left until it is not used again for a minute.
    pub falls: u32,
}

/// Watches over a loop that learns: the learned model has to predict as well as the last good one.
///
/// ```text
/// E <- E + (T/τ)(e² - E),   G <- G + (T/τ)(g² - G)        e = y - φ·θ learned,  g = y - φ·θ good
/// left:      √(E/G) > worse                               handed over: E ≤ G for `calm`
/// stopped:   √(min(E, G)/U) > innovation for `innovation_for`     U: mean of min(E, G) over 20 τ
///            |r - y| > limit for `tracking_for`, once the good model is in place
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `e`, `g` | what the learned and the last good model leave unexplained | of the regression |
/// | `T`, `τ` | period, window | s |
/// | `r`, `y` | reference, measurement | of the signal |
///
/// A learned model is handed to the controller only after it has predicted no worse than the model
/// file for a while in which it learned (at rest all models are alike); from then on it becomes the good one whenever it has been no worse for as
/// long. A first guess that does not track is left for what predicts better at once. Where the learned
/// model predicts worse, or the loop does not track, the controller gets the last good
/// model back and the observer starts again from it. If that does not help, if no sample comes, if
/// a signal freezes or leaves its range, or if no model explains what is measured, the loop stops.
/// Two models whose innovations differ by less than a hundredth of the measured rates predict alike;
/// an innovation below three tenths of them is not unusual.
///
/// Nothing is allocated after construction; `B` is the buffer type, as in [`crate::Loop`].
///
/// Reference: K. S. Narendra, J. Balakrishnan (1997), "Adaptive control using multiple models",
/// IEEE Transactions on Automatic Control 42(2), 171–187, (6): models compared by their errors over
/// a window; J. P. Hespanha, D. Liberzon, A. S. Morse (2003), "Hysteresis-based switching algorithms
/// for supervisory control of uncertain systems", Automatica 39(2), 263–272.
#[derive(Clone, Debug)]
pub struct Supervisor<S, B> {
    thresholds: Thresholds<S>,
    models: Models<S, B>,
    controlled: usize,
    /// Largest tracking error by controlled signal; infinite: the share of the reference.
    tracking: B,
    low: B,
    high: B,
    largest_reference: B,
    off_for: B,
    /// Speed of each shaft from the controlled signals, row by row.
    shafts: B,
    /// Angle of one count of each shaft's encoder; 0 where there is none.
    counts: B,
    /// By shaft: how long it has kept its speed, that speed, by how much it changed last within a period, and
    /// the largest one asked for so far.
    frozen_for: B,
    last: B,
    change: B,
    largest_speed: B,
    reference: B,
    stale_for: S,
    unusual_for: S,
    calm_for: S,
    fallen_since: S,
    fallen: bool,
    /// Handed over at least once: what is left from now on is left for a reason.
    proved: bool,
    falls: u32,
    now: S,
}

impl<S: Real, B: AsRef<[S]> + AsMut<[S]> + Clone> Supervisor<S, B> {
    /// A supervisor for a model with parameters `values`, `rows` regressions and so many controlled
    /// signals. `tracking` has a
    /// limit per controlled signal, `range` the least and greatest values of the measured ones
    /// (infinite: none). `shafts` turns the controlled signals into the speeds of the shafts whose
    /// encoders they come from, row by row, and into themselves; `counts` has the angle of one count of each (0: no
    /// encoder), the least change that its speed can show in a period.
    /// Buffers of a given length or longer come from `zeros`.
    pub fn new(
        thresholds: Thresholds<S>,
        values: B,
        (rows, controlled): (usize, usize),
        tracking: B,
        range: (B, B),
        (shafts, counts): (B, B),
        zeros: impl Fn(usize) -> B,
    ) -> Self {
        let n = controlled.max(1);
        let turning = shafts.as_ref().len() / n;
        Self {
            thresholds,
            controlled: n,
            models: Models::new(values, rows, &zeros),
            largest_reference: zeros(n),
            off_for: zeros(n),
            frozen_for: zeros(turning),
            last: zeros(turning),
            change: zeros(turning),
            largest_speed: zeros(turning),
            shafts,
            counts,
            reference: zeros(n),
            tracking,
            low: range.0,
            high: range.1,
            stale_for: S::zero(),
            unusual_for: S::zero(),
            calm_for: S::zero(),
            fallen_since: S::zero(),
            fallen: true,
            proved: false,
            falls: 0,
            now: S::zero(),
        }
    }

    /// What the measurements alone say: nothing fresh, out of range, frozen.
    fn sensors(&mut self, seen: &Observation<'_, S>) -> Option<Event<S>> {
        let period = seen.tick.period;
        let usable = seen.sample.fresh && seen.measured.iter().all(|y| y.is_finite());
        if !usable {
            self.stale_for += period;
            return over(self.stale_for, self.thresholds.stale, Cause::Stale);
        }
        self.stale_for = S::zero();
        let range = self.low.as_ref().iter().zip(self.high.as_ref());
        for (i, (y, (low, high))) in seen.measured.iter().zip(range).enumerate() {
            if y < low || y > high {
                let limit = if y < low { *low } else { *high };
                return Some(stopped(Cause::Range(i), *y, limit));
            }
        }
        self.frozen(seen.measured, seen.outcome.saturated, period)
    }

    /// A shaft that keeps its speed, far from the one asked for.
    fn frozen(&mut self, measured: &[S], saturated: bool, period: S) -> Option<Event<S>> {
        let rows = self.shafts.as_ref().chunks_exact(self.controlled);
        for (i, row) in rows.enumerate() {
            let speed = |of: &[S]| {
                let pairs = row.iter().zip(of);
                pairs.fold(S::zero(), |sum, (gain, value)| sum + *gain * *value)
            };
            let (is, wanted) = (speed(measured), speed(self.reference.as_ref()));
            let largest = &mut self.largest_speed.as_mut()[i];
            *largest = largest.max(wanted.abs());
            let last = core::mem::replace(&mut self.last.as_mut()[i], is);
            let stands = (is - last).abs() <= *largest * S::of(STILL);
            let slow = *largest * S::of(MATTERS);
            let change = &mut self.change.as_mut()[i];
            if !stands {
                *change = (is - last).abs();
            }
            // A dead encoder drops from its speed to nothing; less than a count is seen of nobody.
            let count = self.counts.as_ref().get(i).copied().unwrap_or(S::zero()) / period;
            let came_to_rest = is.abs() <= slow && *change <= slow.max(count * S::of(COUNTS));
            let flat_out = saturated && is * wanted > S::zero();
            let matters = wanted.abs() > *largest * S::of(MATTERS);
            let should = matters && (wanted - is).abs() > wanted.abs() * S::of(0.5);
            let clock = &mut self.frozen_for.as_mut()[i];
            *clock = if stands && should {
                *clock + period
            } else {
                S::zero()
            };
            let mut limit = self.thresholds.frozen;
            if flat_out || came_to_rest {
                limit *= S::of(PATIENCE);
            }
            if let Some(event) = over(*clock, limit, Cause::Frozen(i)) {
                return Some(event);
            }
        }
        None
    }

    /// The tracking error that has been too large for too long, if any.
    fn off_track(&mut self, seen: &Observation<'_, S>, reference: &[S]) -> Option<(Cause, S, S)> {
        let mut found = None;
        for (i, r) in reference
            .iter()
            .enumerate()
            .take(self.tracking.as_ref().len())
        {
            let Some(y) = seen.measured.get(i) else {
                continue;
            };
            let largest = &mut self.largest_reference.as_mut()[i];
            *largest = largest.max(r.abs());
            let given = self.tracking.as_ref()[i];
            let limit = if given.is_finite() {
                given
            } else {
                self.thresholds.tracking_share * *largest
            };
            let error = (*r - *y).abs();
            // Who asks for more than there is gets less; only what goes the wrong way is lost then.
            let beyond = if seen.outcome.saturated {
                limit.max(r.abs())
            } else {
                limit
            };
            let clock = &mut self.off_for.as_mut()[i];
            *clock = if error > beyond && limit > S::zero() {
                *clock + seen.tick.period
            } else {
                (*clock - seen.tick.period).max(S::zero())
            };
            if *clock > self.thresholds.tracking_for && found.is_none() {
                found = Some((Cause::Tracking(i), error, limit));
            }
        }
        found
    }

    fn fall_back(
        &mut self,
        (cause, value, limit): (Cause, S, S),
        observer: &mut dyn Observer<S>,
        model: &mut dyn AffineModel<S>,
    ) -> Event<S> {
        let most = self.thresholds.falls;
        self.falls += 1;
        let (cause, value, limit) = if self.falls == most.saturating_add(1) {
            let count = |n: u32| S::of(f64::from(n));
            (Cause::Relapse, count(self.falls), count(most))
        } else {
            (cause, value, limit)
        };
        // The good model had its turn, or never deserved it.
        if self.models.first_is_better() || self.fallen && self.models.first_is_good() {
            self.models.begin_again();
        }
        self.models.restore(observer, model);
        self.fallen = true;
        self.fallen_since = self.now;
        self.calm_for = S::zero();
        self.off_for.as_mut().fill(S::zero());
        Event {
            action: Action::FellBack,
            cause,
            value,
            limit,
        }
    }

    /// Hands the learned model over, or makes it the good one, once it was good for long enough.
    fn trust(&mut self, calm: bool, period: S) -> Option<Event<S>> {
        let patient = self.falls <= self.thresholds.falls;
        if !(calm && patient && self.models.learned_is_good()) {
            self.calm_for = S::zero();
            return None;
        }
        if self.models.taught_now {
            self.calm_for += period;
        }
        if self.calm_for < self.thresholds.calm || !self.models.adapts() {
            return None;
        }
        let event = Event {
            action: Action::Resumed,
            cause: Cause::Calm,
            value: self.calm_for,
            limit: self.thresholds.calm,
        };
        self.hand_over().then_some(event)
    }

    /// The learned model becomes the good one, and is used; false where it was in use already.
    fn hand_over(&mut self) -> bool {
        self.calm_for = S::zero();
        self.off_for.as_mut().fill(S::zero());
        self.models.promote();
        self.proved = true;
        core::mem::replace(&mut self.fallen, false)
    }
}

impl<S: Real, B: AsRef<[S]> + AsMut<[S]> + Clone> Supervise<S> for Supervisor<S, B> {
    fn judge(
        &mut self,
        seen: &Observation<'_, S>,
        reference: &[S],
        observer: &mut dyn Observer<S>,
        model: &mut dyn AffineModel<S>,
    ) -> Option<Event<S>> {
        let period = seen.tick.period;
        self.now = seen.tick.time;
        if self.falls > 0 && self.now - self.fallen_since > S::of(REMEMBERED) {
            self.falls = 0;
        }
        if let Some(event) = self.sensors(seen) {
            return Some(event);
        }
        let t = self.thresholds;
        self.models
            .compare(seen, observer, t.window, self.unusual_for == S::zero());
        let unusual = self
            .models
            .unusual()
            .filter(|(_, times)| *times > t.innovation);
        self.unusual_for = match unusual {
            Some(_) => self.unusual_for + period,
            None => S::zero(),
        };
        if let Some((row, times)) = unusual
            && self.unusual_for > t.innovation_for
        {
            return Some(stopped(Cause::Innovation(row), times, t.innovation));
        }
        let lost = self.off_track(seen, reference);
        for (to, from) in self.reference.as_mut().iter_mut().zip(reference) {
            *to = *from;
        }
        let worse = self.models.worse().filter(|(_, times)| *times > t.worse);
        let worse = worse.map(|(row, times)| (Cause::Worse(row), times, t.worse));
        if !self.fallen
            && let Some(reason) = worse.or(lost)
        {
            return Some(self.fall_back(reason, observer, model));
        }
        if let Some((cause, value, limit)) = lost {
            if self.proved && self.models.first_is_good() {
                return Some(self.fall_back((cause, value, limit), observer, model));
            }
            // A first guess that does not even track has nothing to lose by what predicts better.
            if self.proved || !self.models.adapts() || !self.models.learned_is_good() {
                return Some(stopped(cause, value, limit));
            }
            self.hand_over();
            self.models.take(observer, Some(model));
            return Some(Event {
                action: Action::Resumed,
                cause,
                value,
                limit,
            });
        }
        let event = self.trust(unusual.is_none(), period);
        let to = (!self.fallen).then_some(model);
        self.models.take(observer, to);
        event
    }

    fn fallen(&self) -> bool {
        self.fallen && self.proved
    }
}

fn stopped<S>(cause: Cause, value: S, limit: S) -> Event<S> {
    Event {
        action: Action::Stopped,
        cause,
        value,
        limit,
    }
}

fn over<S: Real>(value: S, limit: S, cause: Cause) -> Option<Event<S>> {
    (value > limit).then(|| stopped(cause, value, limit))
}
