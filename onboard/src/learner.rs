//! Learning aboard: one guarded estimator per controlled state.

use core::marker::PhantomData;

use heapless::Vec;
use loopsight_core::learning::{Guarded, Guards, Lesson, Range, Withheld};
use loopsight_core::{AffineModel, ControlAffine, Innovation, Observation, Observer, Plant, Real};
use loopsight_estimators::{Rls, RlsSettings};
use loopsight_link::{Learning, Unusable};
use nalgebra::{Const, SVector};

use crate::Efforts;

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
/// Each parameter belongs to the one row whose rate it moves, `R` of them to each. Effects are known
/// aboard, not learned.
///
/// Reference: Alves, Lages, Henriques (2018), (38)–(47); Hairer, Lubich, Wanner (2006), "Geometric Numerical
/// Integration", II.1 (midpoint rule).
pub struct Learner<
    S: Real,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> {
    rows: [Row<S, R>; NU],
    values: [S; NP],
    /// What is learned is zero, the rest as it is known.
    base: [S; NP],
    /// The same with the `k`-th parameter of every row at one: no parameter moves the rate of another row
    /// than its own, so one of each is tried at a time.
    probes: [[S; NP]; R],
    efforts: Efforts<S, NU>,
    rate: S,
    means: bool,
    certainty_equivalence: bool,
    before: Option<[S; NU]>,
    input: Option<[S; NU]>,
    plant: PhantomData<P>,
}

struct Row<S: Real, const R: usize> {
    estimator: Guarded<S, Rls<S, Const<R>>, Const<R>>,
    parameters: [usize; R],
    lesson: Lesson<S>,
}

/// `r(p)` at `y` with the inputs `u` and the efforts `w`.
#[inline]
fn rates<
    S,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
>(
    y: &[S; NU],
    u: &[S; NU],
    w: &[S; NW],
    p: &[S; NP],
) -> [S; NU]
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    let (f, push, g) = (P::drift(y, p), P::push(y, w, p), P::input_matrix(y, p));
    core::array::from_fn(|i| {
        let drives = g[i].iter().zip(u).map(|(g, u)| *g * *u);
        drives.fold(f[i] + push[i], |sum, drive| sum + drive)
    })
}

impl<
    S,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> Learner<S, P, NX, NU, NW, NP, NY, R>
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    /// Learns from `values` on, `period` in s.
    pub fn new(
        settings: &Learning,
        values: [S; NP],
        efforts: Efforts<S, NU>,
        means: bool,
        period: f64,
    ) -> Result<Self, Unusable> {
        let lists = [&settings.low, &settings.high, &settings.scale];
        let sized = lists.iter().all(|l| l.len() == NP)
            && settings.dead_zone.len() == NU
            && settings.least_excitation.len() == NU;
        if !sized {
            return Err(Unusable::Learning);
        }
        let rls = RlsSettings {
            forgetting: settings.forgetting,
            initial_covariance: settings.initial_covariance,
            covariance_limit: Some(settings.covariance_limit),
            ..RlsSettings::default()
        };
        let wide = |v: &f32| f64::from(*v);
        let mut base = values;
        let mut rows: Vec<Row<S, R>, NU> = Vec::new();
        for i in 0..NU {
            let parameters = parameters_of::<P, NX, NU, NW, NP, NY, R>(i).ok_or(Unusable::Plant)?;
            let ranges = parameters.map(|j| Range {
                low: S::of(wide(&settings.low[j])),
                high: S::of(wide(&settings.high[j])),
                scale: S::of(wide(&settings.scale[j])),
            });
            let guards = Guards {
                dead_zone: wide(&settings.dead_zone[i]),
                least_excitation: wide(&settings.least_excitation[i]),
                window: settings.window,
            };
            let start = parameters.map(|j| values[j]);
            let estimator = Rls::new(SVector::zeros(), &rls).map_err(|_| Unusable::Learning)?;
            let estimator = Guarded::new(estimator, SVector::from(start), &ranges, guards)
                .ok_or(Unusable::Learning)?;
            for j in parameters {
                base[j] = S::zero();
            }
            let row = Row {
                estimator,
                parameters,
                lesson: Lesson::none(Withheld::NoRegressor),
            };
            rows.push(row).map_err(|_| Unusable::Plant)?;
        }
        let rows = rows.into_array().map_err(|_| Unusable::Plant)?;
        let mut probes = [base; R];
        for (k, probe) in probes.iter_mut().enumerate() {
            for row in &rows {
                probe[row.parameters[k]] = S::one();
            }
        }
        Ok(Self {
            rows,
            probes,
            values,
            base,
            efforts,
            rate: S::of(1.0 / period),
            means,
            certainty_equivalence: settings.certainty_equivalence,
            before: None,
            input: None,
            plant: PhantomData,
        })
    }

    /// The plant's parameters: the learned ones as they are estimated, the others as they were.
    pub fn values(&self) -> &[S; NP] {
        &self.values
    }

    /// Rows that the last tick taught, one bit each.
    pub fn learned(&self) -> u8 {
        (self.rows.iter().enumerate())
            .filter(|(_, row)| row.lesson.withheld.is_none())
            .fold(0, |bits, (i, _)| bits | 1 << i)
    }

    fn learn(&mut self, before: &[S; NU], now: &[S; NU], u: &[S; NU], why: Option<Withheld>) {
        let half = S::of(0.5);
        let middle: [S; NU] = core::array::from_fn(|i| half * (before[i] + now[i]));
        let w = self.efforts.at(&middle);
        let rate = |p: &[S; NP]| rates::<S, P, NX, NU, NW, NP, NY>(&middle, u, &w, p);
        let zero = rate(&self.base);
        let moved: [[S; NU]; R] = core::array::from_fn(|k| rate(&self.probes[k]));
        for (i, row) in self.rows.iter_mut().enumerate() {
            let phi: [S; R] = core::array::from_fn(|k| moved[k][i] - zero[i]);
            let y = (now[i] - before[i]) * self.rate - zero[i];
            row.lesson = row.estimator.update(&phi, y, why);
            for (j, value) in row.parameters.iter().zip(row.estimator.theta()) {
                self.values[*j] = *value;
            }
        }
    }
}

/// The parameters that move the rate of the `row`-th controlled state and no other; `None` where these are
/// not `R`. Tried at a point without symmetry, like a host does.
fn parameters_of<
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
>(
    row: usize,
) -> Option<[usize; R]>
where
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    let y = core::array::from_fn(|i| 0.37 + 0.21 * i as f64);
    let u = core::array::from_fn(|i| 1.3 - 0.7 * i as f64);
    let zero = [0.0; NP];
    let rest = rates::<f64, P, NX, NU, NW, NP, NY>(&y, &u, &[0.0; NW], &zero);
    let mut found: Vec<usize, R> = Vec::new();
    for (j, parameter) in P::META.parameters.iter().enumerate() {
        let mut p = zero;
        p[j] = 1.0;
        let moved = rates::<f64, P, NX, NU, NW, NP, NY>(&y, &u, &[0.0; NW], &p);
        let moves = |i: usize| moved[i] != rest[i];
        if parameter.linear && moves(row) {
            if (0..NU).any(|i| i != row && moves(i)) {
                return None;
            }
            found.push(j).ok()?;
        }
    }
    found.into_array().ok()
}

impl<
    S,
    P,
    const NX: usize,
    const NU: usize,
    const NW: usize,
    const NP: usize,
    const NY: usize,
    const R: usize,
> Observer<S> for Learner<S, P, NX, NU, NW, NP, NY, R>
where
    S: Real,
    P: Plant<NX, NU, NW, NP, NY> + ControlAffine<NU, NU, NW, NP>,
{
    fn observe(&mut self, seen: &Observation<'_, S>) {
        let now = <[S; NU]>::try_from(seen.measured).ok();
        let applied = <[S; NU]>::try_from(seen.applied).ok();
        let earlier = core::mem::replace(&mut self.input, applied);
        let withheld = Withheld::by(&seen.sample, seen.outcome, false);
        let usable = seen.sample.fresh && seen.measured.iter().all(|v| v.is_finite());
        let before = core::mem::replace(&mut self.before, now.filter(|_| usable));
        // A mean over a period is reached by the inputs of that period and of the one before.
        let input = match (self.means, applied, earlier) {
            (true, Some(now), Some(earlier)) => {
                let half = S::of(0.5);
                Some(core::array::from_fn(|i| half * (now[i] + earlier[i])))
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
        for row in &mut self.rows {
            row.lesson = Lesson::none(why);
        }
    }

    fn teach(&self, model: &mut dyn AffineModel<S>) {
        if self.certainty_equivalence {
            model.learn_all(&self.values);
        }
    }

    fn innovation(&self, row: usize) -> Option<Innovation<S>> {
        self.rows.get(row)?.lesson.innovation()
    }

    fn restart(&mut self, values: &[S]) {
        for row in &mut self.rows {
            let start = row
                .parameters
                .map(|j| values.get(j).copied().unwrap_or(S::zero()));
            row.estimator.reset(&start);
            for (j, value) in row.parameters.iter().zip(row.estimator.theta()) {
                self.values[*j] = *value;
            }
        }
    }
}
