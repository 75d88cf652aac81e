//! Learning aboard: one guarded estimator per controlled state.

use heapless::Vec;
use loopsight_core::learning::{Guards, Lesson, Range, Withheld};
use loopsight_core::{
    AffineModel, Array, ControlAffine, Innovation, Observation, Observer, Plant, Real,
};
use loopsight_link::{Learning, PARAMETERS, Unusable};

use crate::Efforts;
use crate::estimator::RowEstimator;
use crate::parts::{Parts, PerEffort, PerInput, PerParameter, PerRow};

/// One recursive estimator per controlled state, fed with the plant's own equations.
///
/// ```text
/// r(p) = f(ȳ; p) + G(ȳ; p) u + H(ȳ; p) w(ȳ)      ȳ = (y_k + y_(k-1))/2
/// φ_j = r(p₀ + e_j) - r(p₀)                  p₀: what is learned is zero, the rest as it is known
/// (y_k - y_(k-1))/T - r(p₀) = φᵀθ
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y` | controlled states, as measured | unit of the state |
/// | `u` | inputs applied in the period; where `y` are means over it, the mean of two periods | of the inputs |
/// | `w` | efforts of the effects ([`Efforts`]) | of the channels |
/// | `e_j` | 1 at the `j`-th parameter | |
/// | `T` | period | s |
///
/// The rates are taken in the middle of the straight line between two samples (midpoint rule), once per tick;
/// a host takes Simpson's rule over the same line. They differ by a twelfth of the second difference of a
/// quadratic regressor, `(Δω)²/12` of `ω²`, and by nothing in linear ones.
///
/// Each parameter belongs to the one row whose rate it moves; each row has as many as the estimator
/// estimates. Effects are known aboard, not learned.
///
/// Reference: Alves, Lages, Henriques (2018), (38)–(47); Hairer, Lubich, Wanner (2006), "Geometric Numerical
/// Integration", II.1 (midpoint rule).
pub struct Learner<R: Parts> {
    rows: <PerInput<R> as Array<R::Scalar>>::Of<Row<R>>,
    values: PerParameter<R>,
    /// What is learned is zero, the rest as it is known.
    base: PerParameter<R>,
    /// The same with the `k`-th parameter of every row at one: no parameter moves the rate of another row
    /// than its own, so one of each is tried at a time.
    probes: PerRow<R, PerParameter<R>>,
    efforts: Efforts<R>,
    rate: R::Scalar,
    means: bool,
    certainty_equivalence: bool,
    before: Option<PerInput<R>>,
    input: Option<PerInput<R>>,
}

struct Row<R: Parts> {
    estimator: R::Estimator,
    parameters: PerRow<R, usize>,
    lesson: Lesson<R::Scalar>,
}

/// `r(p)` at `y` with the inputs `u` and the efforts `w`.
#[inline]
fn rates<P: ControlAffine, S: Real>(
    y: &P::Input<S>,
    u: &P::Input<S>,
    w: &P::Effort<S>,
    p: &P::Parameters<S>,
) -> P::Input<S> {
    let (f, push, g) = (P::drift(y, p), P::push(y, w, p), P::input_matrix(y, p));
    P::Input::from_fn(|i| {
        let drives = g[i].into_iter().zip(u.as_ref()).map(|(g, u)| g * *u);
        drives.fold(f[i] + push[i], |sum, drive| sum + drive)
    })
}

impl<R: Parts> Learner<R> {
    /// Learns from `values` on, `period` in s.
    ///
    /// # Errors
    ///
    /// Settings of other lengths than the plant's, or that the estimator does not take; a plant whose
    /// parameters do not belong to one row each, as many to each row as the estimator has.
    pub fn new(
        settings: &Learning,
        values: PerParameter<R>,
        efforts: Efforts<R>,
        means: bool,
        period: f64,
    ) -> Result<Self, Unusable> {
        let lists = [&settings.low, &settings.high, &settings.scale];
        let sized = (lists.iter()).all(|l| l.len() == PerParameter::<R>::LENGTH)
            && settings.dead_zone.len() == PerInput::<R>::LENGTH
            && settings.least_excitation.len() == PerInput::<R>::LENGTH;
        // A host says how far an estimate may go: without a bound nobody would.
        let bounds = settings.low.iter().chain(&settings.high);
        if !(sized && bounds.into_iter().all(|b| b.is_finite())) {
            return Err(Unusable::Learning);
        }
        let mut wrong = Unusable::Plant;
        let rows = (0..PerInput::<R>::LENGTH)
            .map_while(|i| Row::new(settings, &values, i).map_err(|w| wrong = w).ok());
        let rows = <PerInput<R> as Array<R::Scalar>>::Of::<Row<R>>::collect(rows).ok_or(wrong)?;
        let mut base = values;
        for row in rows.as_ref() {
            for j in row.parameters {
                base[j] = R::Scalar::of(0.0);
            }
        }
        let probes = PerRow::<R, _>::from_fn(|k| {
            let mut probe = base;
            for row in rows.as_ref() {
                probe[row.parameters[k]] = R::Scalar::of(1.0);
            }
            probe
        });
        Ok(Self {
            rows,
            probes,
            values,
            base,
            efforts,
            rate: R::Scalar::of(1.0 / period),
            means,
            certainty_equivalence: settings.certainty_equivalence,
            before: None,
            input: None,
        })
    }

    /// The plant's parameters: the learned ones as they are estimated, the others as they were.
    pub fn values(&self) -> &PerParameter<R> {
        &self.values
    }

    /// Rows that the last tick taught, one bit each.
    pub fn learned(&self) -> u8 {
        (self.rows.as_ref().iter().enumerate())
            .filter(|(_, row)| row.lesson.withheld.is_none())
            .fold(0, |bits, (i, _)| bits | 1 << i)
    }

    fn learn(
        &mut self,
        before: &PerInput<R>,
        now: &PerInput<R>,
        u: &PerInput<R>,
        why: Option<Withheld>,
    ) {
        let half = R::Scalar::of(0.5);
        let middle = PerInput::<R>::from_fn(|i| half * (before[i] + now[i]));
        let w = self.efforts.at(&middle);
        let rate = |p: &PerParameter<R>| rates::<R::Plant, R::Scalar>(&middle, u, &w, p);
        let zero = rate(&self.base);
        let moved = PerRow::<R, PerInput<R>>::from_fn(|k| rate(&self.probes[k]));
        for (i, row) in self.rows.as_mut().iter_mut().enumerate() {
            let phi = PerRow::<R>::from_fn(|k| moved[k][i] - zero[i]);
            let y = (now[i] - before[i]) * self.rate - zero[i];
            row.lesson = row.estimator.update(phi.as_ref(), y, why);
            for (j, value) in row.parameters.as_ref().iter().zip(row.estimator.theta()) {
                self.values[*j] = *value;
            }
        }
    }
}

impl<R: Parts> Row<R> {
    fn new(settings: &Learning, values: &PerParameter<R>, i: usize) -> Result<Self, Unusable> {
        let wide = |v: &f32| f64::from(*v);
        let parameters = parameters_of::<R>(i).ok_or(Unusable::Plant)?;
        let ranges = PerRow::<R, _>::from_fn(|k| {
            let j = parameters[k];
            Range {
                low: R::Scalar::of(wide(&settings.low[j])),
                high: R::Scalar::of(wide(&settings.high[j])),
                scale: R::Scalar::of(wide(&settings.scale[j])),
            }
        });
        let guards = Guards {
            dead_zone: wide(&settings.dead_zone[i]),
            least_excitation: wide(&settings.least_excitation[i]),
            window: settings.window,
        };
        let start = PerRow::<R>::from_fn(|k| values[parameters[k]]);
        let estimator = R::Estimator::new(settings, start, &ranges, guards);
        Ok(Self {
            estimator: estimator.ok_or(Unusable::Learning)?,
            parameters,
            lesson: Lesson::none(Withheld::NoRegressor),
        })
    }
}

/// The parameters that move the rate of the `row`-th controlled state and no other; `None` where these are
/// not as many as the estimator has. Tried at a point without symmetry, as a host does.
fn parameters_of<R: Parts>(row: usize) -> Option<PerRow<R, usize>> {
    let y = PerInput::<R, f64>::from_fn(|i| 0.37 + 0.21 * i as f64);
    let u = PerInput::<R, f64>::from_fn(|i| 1.3 - 0.7 * i as f64);
    let w = PerEffort::<R, f64>::filled(0.0);
    let zero = PerParameter::<R, f64>::filled(0.0);
    let rest = rates::<R::Plant, f64>(&y, &u, &w, &zero);
    let mut found: Vec<usize, PARAMETERS> = Vec::new();
    for (j, parameter) in R::Plant::META.parameters.iter().enumerate() {
        let mut p = zero;
        p[j] = 1.0;
        let moved = rates::<R::Plant, f64>(&y, &u, &w, &p);
        let moves = |i: usize| moved[i] != rest[i];
        if parameter.linear && moves(row) {
            if (0..PerInput::<R>::LENGTH).any(|i| i != row && moves(i)) {
                return None;
            }
            found.push(j).ok()?;
        }
    }
    Array::collect(found)
}

impl<R: Parts> Observer<R::Scalar> for Learner<R> {
    fn observe(&mut self, seen: &Observation<'_, R::Scalar>) {
        let now = PerInput::<R>::from_slice(seen.measured).copied();
        let applied = PerInput::<R>::from_slice(seen.applied).copied();
        let earlier = core::mem::replace(&mut self.input, applied);
        let withheld = Withheld::by(&seen.sample, seen.outcome, false);
        let usable = seen.sample.fresh && seen.measured.iter().all(|v| v.is_finite());
        let before = core::mem::replace(&mut self.before, now.filter(|_| usable));
        // A mean over a period is reached by the inputs of that period and of the one before.
        let input = match (self.means, applied, earlier) {
            (true, Some(now), Some(earlier)) => {
                let half = R::Scalar::of(0.5);
                Some(PerInput::<R>::from_fn(|i| half * (now[i] + earlier[i])))
            }
            (true, ..) => None,
            (false, now, _) => now,
        };
        if let (Some(before), Some(now), Some(input)) = (before, self.before, input) {
            self.learn(&before, &now, &input, withheld);
            return;
        }
        let why = if seen.sample.fresh {
            Withheld::NoRegressor
        } else {
            Withheld::Stale
        };
        for row in self.rows.as_mut() {
            row.lesson = Lesson::none(why);
        }
    }

    fn teach(&self, model: &mut dyn AffineModel<R::Scalar>) {
        if self.certainty_equivalence {
            model.learn_all(self.values.as_ref());
        }
    }

    fn innovation(&self, row: usize) -> Option<Innovation<R::Scalar>> {
        self.rows.as_ref().get(row)?.lesson.innovation()
    }

    fn restart(&mut self, values: &[R::Scalar]) {
        for row in self.rows.as_mut() {
            let start = PerRow::<R>::from_fn(|k| {
                let value = values.get(row.parameters[k]);
                value.copied().unwrap_or(R::Scalar::of(0.0))
            });
            row.estimator.reset(start.as_ref());
            for (j, value) in row.parameters.as_ref().iter().zip(row.estimator.theta()) {
                self.values[*j] = *value;
            }
        }
    }
}
