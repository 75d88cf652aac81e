//! An estimator under guard.

use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use super::excitation::Information;
use super::projection::into_box;
use super::{Lesson, Range, Withheld};
use crate::{Estimator, Real};

/// When an estimator learns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Guards {
    /// Innovations up to this size teach nothing, larger ones only by what is beyond it; unit of `y`.
    pub dead_zone: f64,
    /// A direction is excited when a change of its parameters by their scales changes `y` by at least
    /// this much (rms); unit of `y`. 0: every direction is.
    pub least_excitation: f64,
    /// Samples over which excitation and noise are averaged, at least 1.
    pub window: f64,
}

impl Default for Guards {
    /// No dead zone, every direction excited, two hundred samples.
    fn default() -> Self {
        Self {
            dead_zone: 0.0,
            least_excitation: 0.0,
            window: 200.0,
        }
    }
}

/// An estimator that works in scaled parameters, learns only when a sample is worth it, and stays
/// in range.
///
/// ```text
/// θ_i = s_i ϑ_i      ψ_i = s_i φ_i      y = ψᵀϑ      e = y - ψᵀϑ̂
/// M ← M + (ψψᵀ - M)/W      QᵀM Q ≈ diag(m)                               excitation
/// ψ' = Σ q_i q_iᵀψ over the i with √m_i ≥ m₀; nothing is learned where |ψ'| < m₀
/// e' = e - δ sign e where |e| > δ, else nothing is learned              dead zone
/// the estimator takes  ψ'  and  e';  of the change of ϑ̂, the part along q_i with √m_i ≥ m₀/10
/// ϑ' = arg min (ϑ - ϑ̂')ᵀ P⁻¹ (ϑ - ϑ̂')  subject to  low ≤ s ϑ ≤ high     projection of what that gives, ϑ̂'
/// d = ψᵀ(ϑ' - ϑ̂)     ϑ̂ ← ϑ̂ + ρ (ϑ' - ϑ̂)                               restraint
/// ρ = 1 where 0 ≤ d/e ≤ 2,  e/d where d/e > 2,  0 where d/e < 0
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `e` | left-hand side of the regression, innovation | unit of `y` |
/// | `θ_i`, `s_i` | parameter and its declared scale | of the parameter |
/// | `M`, `m_i`, `W` | information per sample, its eigenvalues to some percent, window | unit of `y²`, samples |
/// | `m₀`, `δ` | least excitation, dead zone | unit of `y` |
/// | `P` | covariance of `ϑ̂` over the variance of the noise | 1/unit of `y²` |
/// | `d`, `ρ` | by how much the update moves the prediction, the share of it that is kept | unit of `y`; 1 |
///
/// **Law.** For any estimator, any sample and any state of the guard, the new estimate lies in the box
/// `low ≤ θ ≤ high`, and explains the sample no worse than the one before, `|y - ψᵀϑ̂⁺| ≤ |y - ψᵀϑ̂|` (up to the
/// rounding of these two sums).
///
/// Proof. The start lies in the box, `ϑ'` does, and the box is convex, so with `0 ≤ ρ ≤ 1` every estimate does. The
/// error after the update is `e - ρ d`: of the size `|e - d| ≤ |e|` where `0 ≤ d/e ≤ 2`, zero where `ρ = e/d`, `|e|`
/// where `ρ = 0`. A sample that is not finite or not learned from leaves the estimate as it is.
///
/// Without the restraint the law does not hold: least squares explain the sample that they are given no worse, but that
/// is `ψ'`, whose innovation is that of the whole `ψ`. Through its correlation with what is excited the
/// estimate also moves along `ψ - ψ'`, and over-corrects by `(ψ - ψ')ᵀPψ'/(1 + ψ'ᵀPψ')`, which has no bound: an estimate that
/// alternates in sign and grows with every sample. The box bounds what one sample after the other may still do.
///
/// **Excitation.** `√m_i` is by how much `y` changes, rms over the window, when the parameters change
/// along `q_i` by one scale in all. The least of them is [`Guarded::excitation`]. What is not excited is
/// taken as known: noise in a regressor of a robot that stands, or drives straight ahead, teaches
/// nothing, and the other directions go on learning. A sample that is itself that small teaches nothing
/// either, however lively the window before it was. Through its correlation with what is excited, the
/// estimate still moves along a direction that is not; along one that is as good as absent
/// (`√m_i < m₀/10`) it does not move at all, and the prediction is none the worse for it.
///
/// **Projection** is in the metric of the covariance: the parameters that are
/// correlated with a bounded one make up for what the bound takes from it. Taking each to its bound on its own would spoil a good
/// prediction, and a proof of convergence with it. An estimator whose covariance is not finite has
/// each parameter taken to its bound.
///
/// Assumptions: disturbances of `y` up to about `δ`; scales of about the size by which parameters
/// may be wrong.
///
/// Reference: G. C. Goodwin, K. S. Sin (1984), "Adaptive Filtering, Prediction and Control", section
/// 3.6 (dead zone) and 3.7 (projection); B. Egardt (1979), "Stability of Adaptive Controllers", ch. 3
/// (dead zone); A. Goel, A. L. Bruce, D. S. Bernstein (2020), "Recursive Least Squares With
/// Variable-Direction Forgetting", IEEE Control Systems Magazine 40(4), 80–102 (information by direction);
/// K. J. Åström, B. Wittenmark (2008), "Adaptive Control", section 2.4 (persistent excitation); G. C. Goodwin, K. S. Sin
/// (1984), lemma 3.3.1 (what the restraint keeps: a step that takes the error of a sample down by a factor from 0 to 2).
#[derive(Clone, Debug)]
pub struct Guarded<S: Real, E, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    estimator: E,
    information: Information<S, D>,
    dead_zone: S,
    window: S,
    scale: OVector<S, D>,
    /// In the parameters' units.
    bounds: [OVector<S, D>; 2],
    /// In scales.
    scaled_bounds: [OVector<S, D>; 2],
    theta: OVector<S, D>,
    noise: S,
    lessons: S,
    /// `ψ`, then `ψ'`, changes or `ϑ`; `ϑ` before the update; scratch.
    work: [OVector<S, D>; 3],
    /// Scratch: the covariance of `ϑ`.
    covariance: OMatrix<S, D, D>,
}

impl<S: Real, E: Estimator<S>, D: Dim> Guarded<S, E, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// Guards `estimator`, whose parameters are those of `ranges` over their scales; it starts over
    /// from `theta`, in the parameters' units. `None` when there are no parameters, the lengths differ, a
    /// scale is not above 0, a range is empty or a guard is negative.
    pub fn new(
        estimator: E,
        theta: OVector<S, D>,
        ranges: &[Range<S>],
        guards: Guards,
    ) -> Option<Self> {
        let n = theta.len();
        let fits = n > 0 && n == ranges.len() && n == estimator.theta().len();
        let guards_hold =
            guards.dead_zone >= 0.0 && guards.least_excitation >= 0.0 && guards.window >= 1.0;
        let usable = ranges.iter().all(Range::is_usable) && theta.iter().all(|v| v.is_finite());
        if !fits || !guards_hold || !usable {
            return None;
        }
        let (dim, one) = theta.shape_generic();
        let of = |value: &dyn Fn(&Range<S>) -> S| {
            OVector::from_iterator_generic(dim, one, ranges.iter().map(value))
        };
        let zero = OVector::zeros_generic(dim, one);
        let mut guarded = Self {
            estimator,
            information: Information::new(dim, guards.window, guards.least_excitation),
            dead_zone: S::of(guards.dead_zone),
            window: S::of(guards.window),
            scale: of(&|r| r.scale),
            bounds: [of(&|r| r.low), of(&|r| r.high)],
            scaled_bounds: [of(&|r| r.low / r.scale), of(&|r| r.high / r.scale)],
            theta: zero.clone(),
            noise: S::zero(),
            lessons: S::zero(),
            work: [zero.clone(), zero.clone(), zero],
            covariance: OMatrix::zeros_generic(dim, dim),
        };
        guarded.reset(theta.as_slice());
        Some(guarded)
    }

    /// Takes one regressor and its measurement, unless the sample is `withheld` for a reason of the
    /// loop's. Allocates nothing.
    #[inline(never)]
    pub fn update(
        &mut self,
        regressor: &[S],
        measurement: S,
        withheld: Option<Withheld>,
    ) -> Lesson<S> {
        if regressor.len() != self.theta.len() {
            return Lesson::none(Withheld::NotFinite);
        }
        let [psi, before, _] = &mut self.work;
        let (psi, theta) = (psi.as_mut_slice(), self.estimator.theta());
        let mut innovation = measurement;
        for (i, theta) in theta.iter().enumerate() {
            psi[i] = regressor[i] * self.scale[i];
            innovation -= psi[i] * *theta;
        }
        // What is not finite in the regressor leaves nothing finite here.
        if !innovation.is_finite() {
            return Lesson::none(Withheld::NotFinite);
        }
        let mut lesson = Lesson {
            innovation,
            withheld,
            ..Lesson::none(Withheld::NotFinite)
        };
        if withheld.is_some() {
            return lesson;
        }
        let Some(square) = self.information.take(psi) else {
            lesson.withheld = Some(Withheld::NotFinite);
            return lesson;
        };
        let masked = self.information.masks();
        let square = if masked {
            self.information.excited(psi)
        } else {
            square
        };
        if square < self.information.floor() || square == S::zero() {
            lesson.withheld = Some(Withheld::Unexcited);
            return lesson;
        }
        let zone = self.dead_zone;
        if innovation.abs() <= zone && zone > S::zero() {
            lesson.withheld = Some(Withheld::DeadZone);
            return lesson;
        }
        let side = if innovation < S::zero() { -zone } else { zone };
        let beyond = innovation - side;
        before.as_mut_slice().copy_from_slice(theta);
        let told = self.estimator.correct(psi, beyond);
        if !told.accepted {
            lesson.withheld = Some(Withheld::NotFinite);
            return lesson;
        }
        if masked && self.information.hides() {
            self.turn_back();
        }
        lesson.relative_variance = told.relative_variance;
        self.lessons = (self.lessons + S::one()).min(self.window);
        let square = innovation * innovation / told.relative_variance;
        self.noise += (square - self.noise) / self.lessons;
        lesson.projected = self.settle(regressor, measurement, innovation);
        lesson
    }

    /// Undoes what the update moved along directions that are as good as absent.
    fn turn_back(&mut self) {
        let [change, before, scratch] = &mut self.work;
        for (i, now) in self.estimator.theta().iter().enumerate() {
            change[i] = *now - before[i];
        }
        let change = change.as_mut_slice();
        self.information.present(change, scratch.as_mut_slice());
        let now = scratch.as_mut_slice();
        for ((now, before), by) in now.iter_mut().zip(before.iter()).zip(change.iter()) {
            *now = *before + *by;
        }
        self.estimator.set_theta(now);
    }

    /// Shows the estimate in the parameters' units. One that left its range, or explains the sample worse than
    /// the one before, is restrained; true where it left its range.
    fn settle(&mut self, regressor: &[S], measurement: S, innovation: S) -> bool {
        let [low, high] = &self.bounds;
        let (mut within, mut left) = (true, measurement);
        for (i, value) in self.estimator.theta().iter().enumerate() {
            let value = *value * self.scale[i];
            within &= value >= low[i] && value <= high[i];
            left -= regressor[i] * value;
            self.theta[i] = value;
        }
        if within && left.abs() <= innovation.abs() {
            return false;
        }
        self.restrain(regressor, innovation, within)
    }

    /// Projects an update into the box, and keeps as much of it as explains the sample no worse; true where it had
    /// left the box.
    #[cold]
    #[inline(never)]
    fn restrain(&mut self, regressor: &[S], innovation: S, within: bool) -> bool {
        let projected = !within && self.bring_back();
        let [next, before, _] = &mut self.work;
        next.as_mut_slice().copy_from_slice(self.estimator.theta());
        let mut moved = S::zero();
        for (i, (next, before)) in next.iter().zip(before.iter()).enumerate() {
            moved += regressor[i] * self.scale[i] * (*next - *before);
        }
        let share = share(moved, innovation);
        if share < S::one() {
            for (next, before) in next.iter_mut().zip(before.iter()) {
                let change = share * (*next - *before);
                *next = *before;
                if share > S::zero() {
                    *next += change;
                }
            }
            self.estimator.set_theta(next.as_slice());
            self.hold();
        }
        projected
    }

    /// Shows the estimate in the parameters' units, and brings it into its range where it is not.
    fn hold(&mut self) {
        if !self.show() {
            self.bring_back();
        }
    }

    /// Brings an estimate that does not show within its range into it; true where it was outside, and not
    /// only by rounding.
    #[cold]
    fn bring_back(&mut self) -> bool {
        self.estimator
            .covariance_into(self.covariance.as_mut_slice());
        let [theta, _, multipliers] = &mut self.work;
        theta.as_mut_slice().copy_from_slice(self.estimator.theta());
        let [low, high] = &self.scaled_bounds;
        let projected = into_box(
            theta.as_mut_slice(),
            self.covariance.as_slice(),
            low.as_slice(),
            high.as_slice(),
            multipliers.as_mut_slice(),
        );
        if projected {
            // An estimate beyond what the scalar can multiply goes to its bounds one by one.
            if !theta.iter().all(|v| v.is_finite()) {
                for (i, value) in self.estimator.theta().iter().enumerate() {
                    theta[i] = value.clamp(low[i], high[i]);
                }
            }
            self.estimator.set_theta(theta.as_slice());
        }
        self.show();
        // The product with the scale may round across the bound.
        let [low, high] = &self.bounds;
        for (value, (low, high)) in self.theta.iter_mut().zip(low.iter().zip(high.iter())) {
            *value = value.clamp(*low, *high);
        }
        projected
    }

    /// Shows the estimate in the parameters' units; whether that is within its range.
    fn show(&mut self) -> bool {
        let [low, high] = &self.bounds;
        let mut within = true;
        for (i, value) in self.estimator.theta().iter().enumerate() {
            let value = *value * self.scale[i];
            within &= value >= low[i] && value <= high[i];
            self.theta[i] = value;
        }
        within
    }

    /// The estimate, in the parameters' units, within its range.
    pub fn theta(&self) -> &[S] {
        self.theta.as_slice()
    }

    /// Covariance of two parameters over the variance of the noise, in their units; NaN where the
    /// estimator has none.
    pub fn covariance(&self, row: usize, column: usize) -> S {
        self.estimator.covariance(row, column) * self.scale[row] * self.scale[column]
    }

    /// Variance of the noise in `y`, from the innovations of the window that taught something.
    pub fn noise_variance(&self) -> S {
        self.noise
    }

    /// Standard deviation of the `i`-th parameter, as far as the noise is white; NaN where the estimator
    /// has no covariance.
    pub fn deviation(&self, i: usize) -> S {
        (self.noise * self.covariance(i, i)).sqrt()
    }

    /// By how much `y` changes, rms over the window, when the parameters change by one scale in the
    /// direction in which that shows least. Persistent excitation is when it stays away from zero.
    pub fn excitation(&self) -> S {
        self.information.least()
    }

    /// The least excitation over the greatest: 1 when all directions are excited alike, 0 when one is
    /// not at all.
    pub fn balance(&self) -> S {
        self.information.balance()
    }

    /// What is guarded; its parameters are scaled.
    pub fn estimator(&self) -> &E {
        &self.estimator
    }

    /// Moves the estimate (in the parameters' units) without a change of what is known of its
    /// uncertainty: for who falls back to values that were better. Ignored unless all are finite.
    pub fn set_theta(&mut self, theta: &[S]) {
        if self.scale_into_work(theta) {
            self.estimator.set_theta(self.work[0].as_slice());
            self.hold();
        }
    }

    /// Starts over from `theta`, in the parameters' units. Ignored unless all are finite.
    pub fn reset(&mut self, theta: &[S]) {
        if self.scale_into_work(theta) {
            self.estimator.reset(self.work[0].as_slice());
            self.information.clear();
            (self.noise, self.lessons) = (S::zero(), S::zero());
            self.hold();
        }
    }

    fn scale_into_work(&mut self, theta: &[S]) -> bool {
        let usable = theta.len() == self.theta.len() && theta.iter().all(|v| v.is_finite());
        if usable {
            for (i, value) in theta.iter().enumerate() {
                self.work[0][i] = *value / self.scale[i];
            }
        }
        usable
    }
}

/// How much of a change of the estimate is kept that changes the prediction by `moved`, where it was wrong by
/// `error`: all of it where the prediction is no worse for it, up to the measurement where it is beyond, and
/// none where it goes the wrong way.
fn share<S: Real>(moved: S, error: S) -> S {
    let (zero, one) = (S::zero(), S::one());
    if moved == zero {
        return one;
    }
    // What is not finite is not above zero.
    let along = moved / error;
    if !(along > zero && moved.is_finite()) {
        zero
    } else if along > S::of(2.0) {
        one / along
    } else {
        one
    }
}
