//! Model reference adaptive control.

use loopsight_core::{AffineModel, Command, ControlError, Controller, Real, Tick};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use crate::Mixing;
use crate::clipped::Clipped;

#[cfg(feature = "std")]
mod settings;
#[cfg(feature = "std")]
pub use settings::MracSettings;

/// Direct model reference adaptive control with σ-modification, one law per controlled state.
///
/// ```text
/// reference model   y_m' = a_m (r - y_m)
/// law               s = θᵀ φ      φ = (y/Y, r/Y, 1)      V = M s, clipped
/// adaptation        θ' = -γ (a_m/g) (y - y_m) φ/(1 + φᵀφ) - σ (θ - θ_0)
/// clipped           y_m = y where (y - y_m) s <= 0: only the leakage is left of the adaptation
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `r`, `y_m` | controlled states, references, what the reference model does with them | of the states |
/// | `Y` | size of a state | of the state |
/// | `s`, `M`, `g` | demand per state, directions and gains of [`Mixing`] | of the inputs |
/// | `θ`, `θ_0` | adapted gains, and those it starts from: right for the model at rest | of the inputs |
/// | `a_m` | rate of the reference model | 1/s |
/// | `γ` | adaptation rate | 1/s |
/// | `σ` | leakage | 1/s |
///
/// For a plant `y' = -a y + g s + d` there is a `θ` with which it moves as the reference model does;
/// the adaptation is steepest descent of `(y - y_m)²` along Lyapunov's function
/// `e² + |θ - θ*|²`, which never grows while the plant is of that form. What is not of that form
/// (friction, delay) drives the gains away: the leakage pulls them back to where they began, at the
/// price of a small error at rest. The normalisation keeps the rate of adaptation from growing with the
/// signals, in single precision, too.
///
/// **Clipped inputs** tell nothing about the gains where the plant is behind the reference model. The
/// reference model is then set to the plant, so that it never demands the impossible. Where the inputs are
/// clipped and drive the plant away from the reference model, the gains are wrong and adapt.
///
/// **When no command can be computed** the last one is repeated, all states stay, and
/// [`Command::held`] is true.
///
/// Assumptions: each demand moves mostly its own state, the sign of `g` is known and its size within
/// a factor of a few; the plant answers as one of first order.
///
/// Reference: P. A. Ioannou, J. Sun (1996), "Robust Adaptive Control", Prentice Hall, sections 6.2
/// (scalar MRAC), 8.4.1 (leakage, fixed σ); P. A. Ioannou, P. V. Kokotović (1984), "Instability
/// analysis and improvement of robustness of adaptive control", Automatica 20(5), 583–594.
#[derive(Clone, Debug)]
pub struct Mrac<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// `exp(-a_m T)`.
    decay: OVector<S, D>,
    /// `γ T a_m/g`.
    step: OVector<S, D>,
    /// `σ T`, at most 1.
    leak: S,
    size: OVector<S, D>,
    mixing: Mixing<S, D>,
    inputs: Clipped<S, D>,
    start: [OVector<S, D>; 3],
    theta: [OVector<S, D>; 3],
    model: OVector<S, D>,
    started: bool,
    demand: OVector<S, D>,
}

/// The design of [`Mrac`]; lists hold one number per controlled state.
#[derive(Clone, Debug, PartialEq)]
pub struct MracDesign<D: Dim>
where
    DefaultAllocator: Allocator<D>,
{
    /// `a_m`, 1/s.
    pub rate: OVector<f64, D>,
    /// `a` of the model, 1/s.
    pub damping: OVector<f64, D>,
    /// `Y`, in the unit of the state.
    pub size: OVector<f64, D>,
    /// `γ`, 1/s.
    pub adaptation: f64,
    /// `σ`, 1/s.
    pub leakage: f64,
}

impl<S: Real, D: Dim> Mrac<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// A controller of this design with limits (one per input, infinity for none) and period (s).
    ///
    /// `None` where rates, sizes, limits or the period are not above 0, the adaptation or the leakage
    /// is below 0, or a number is not finite.
    pub fn new(
        design: &MracDesign<D>,
        mixing: Mixing<S, D>,
        limit: &OVector<f64, D>,
        period: f64,
    ) -> Option<Self> {
        let above = |v: f64| v > 0.0 && v.is_finite();
        let fine = design.rate.iter().chain(&design.size).all(|v| above(*v))
            && limit.iter().all(|l| *l > 0.0)
            && design.damping.iter().all(|v| v.is_finite())
            && design.adaptation >= 0.0
            && design.adaptation.is_finite()
            && design.leakage >= 0.0
            && design.leakage.is_finite()
            && above(period);
        if !fine {
            return None;
        }
        let (dim, one) = limit.shape_generic();
        let zero = OVector::<S, D>::zeros_generic(dim, one);
        let mut made = Self {
            decay: design.rate.map(|a| S::of(libm::exp(-a * period))),
            step: zero.clone(),
            leak: S::of((design.leakage * period).min(1.0)),
            size: design.size.map(S::of),
            inputs: Clipped::within(limit.map(S::of)),
            start: [zero.clone(), zero.clone(), zero.clone()],
            theta: [zero.clone(), zero.clone(), zero.clone()],
            model: zero.clone(),
            started: false,
            demand: zero,
            mixing,
        };
        for i in 0..limit.len() {
            let gain = made.mixing.gain(i);
            let (rate, damping) = (design.rate[i], design.damping[i]);
            made.step[i] = S::of(design.adaptation * period * rate) / gain;
            made.start[0][i] = S::of((damping - rate) * design.size[i]) / gain;
            made.start[1][i] = S::of(rate * design.size[i]) / gain;
        }
        made.theta = made.start.clone();
        Some(made)
    }

    /// The adapted gains `θ` of the `i`-th controlled state, in the unit of the inputs.
    pub fn gains(&self, i: usize) -> [S; 3] {
        [self.theta[0][i], self.theta[1][i], self.theta[2][i]]
    }

    fn phi(&self, i: usize, y: S, r: S) -> [S; 3] {
        [y / self.size[i], r / self.size[i], S::one()]
    }
}

impl<S: Real, D: Dim> Controller<S> for Mrac<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
    OVector<S, D>: Send,
    OMatrix<S, D, D>: Send,
{
    fn step(
        &mut self,
        _tick: &Tick<S>,
        reference: &[S],
        measured: &[S],
        _model: &mut dyn AffineModel<S>,
        command: &mut [S],
    ) -> Result<Command, ControlError> {
        let n = self.inputs.len();
        if [reference.len(), measured.len(), command.len()] != [n; 3] {
            return Err(ControlError::Sizes);
        }
        if reference.iter().chain(measured).any(|v| !v.is_finite()) {
            return Ok(self.inputs.hold(command));
        }
        if !self.started {
            self.model.as_mut_slice().copy_from_slice(measured);
            self.started = true;
        }
        for i in 0..n {
            let phi = self.phi(i, measured[i], reference[i]);
            self.demand[i] = (0..3).fold(S::zero(), |sum, j| sum + self.theta[j][i] * phi[j]);
        }
        self.mixing.mix(self.demand.as_slice(), command);
        let saturated = self.inputs.clip(command);
        for i in 0..n {
            let (r, y) = (reference[i], measured[i]);
            let mut error = y - self.model[i];
            if saturated && error * self.demand[i] <= S::zero() {
                // The plant is behind because its inputs can do no more.
                self.model[i] = y;
                error = S::zero();
            }
            let phi = self.phi(i, y, r);
            let norm = phi.iter().fold(S::one(), |sum, p| sum + *p * *p);
            for (j, phi) in phi.iter().enumerate() {
                let change = self.step[i] * error * *phi / norm
                    + self.leak * (self.theta[j][i] - self.start[j][i]);
                let next = self.theta[j][i] - change;
                if next.is_finite() {
                    self.theta[j][i] = next;
                }
            }
            self.model[i] = r + self.decay[i] * (self.model[i] - r);
        }
        Ok(Command {
            saturated,
            held: false,
        })
    }

    fn reset(&mut self) {
        self.theta = self.start.clone();
        self.started = false;
        self.inputs.reset();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{U1, Vector1};

    use super::*;

    struct Unseen;
    impl AffineModel<f32> for Unseen {
        fn size(&self) -> usize {
            1
        }
        fn evaluate(&mut self, _y: &[f32], _drift: &mut [f32], _input_matrix: &mut [f32]) {}
    }

    fn mrac(adaptation: f64, leakage: f64, limit: f64) -> Option<Mrac<f32, U1>> {
        let one = Vector1::repeat;
        let design = MracDesign {
            rate: one(5.0),
            damping: one(2.0),
            size: one(1.0),
            adaptation,
            leakage,
        };
        let mixing = Mixing::new(&[3.0], &Vector1::zeros()).unwrap();
        Mrac::new(&design, mixing, &one(limit), 0.01)
    }

    /// `y' = -a y + g u + d` with the reference a square wave of 4 s; errors against the reference
    /// model, the largest of the first and of the last period.
    fn runs(
        mrac: &mut Mrac<f32, U1>,
        a: f32,
        g: f32,
        d: impl Fn(usize) -> f32,
        ticks: usize,
    ) -> [f32; 2] {
        let (mut y, mut u) = ([0.0f32], [0.0f32]);
        let tick = Tick {
            index: 0,
            time: 0.0,
            period: 0.01,
        };
        let mut errors = [0.0f32; 2];
        for k in 0..ticks {
            let r = if k / 200 % 2 == 0 { 1.0 } else { -1.0 };
            mrac.step(&tick, &[r], &y, &mut Unseen, &mut u).unwrap();
            let settled = (g * u[0] + d(k)) / a;
            y[0] = settled + (y[0] - settled) * (-0.01 * a).exp();
            let error = (y[0] - mrac.model[0]).abs();
            assert!(y[0].is_finite() && mrac.gains(0).iter().all(|g| g.is_finite()));
            if k < 400 {
                errors[0] = errors[0].max(error);
            } else if k >= ticks - 400 {
                errors[1] = errors[1].max(error);
            }
        }
        errors
    }

    #[test]
    fn a_right_model_needs_no_adaptation() {
        let mut fixed = mrac(0.0, 0.0, f64::INFINITY).unwrap();
        let start = fixed.gains(0);
        assert_eq!(start, [-1.0, 5.0 / 3.0, 0.0]);
        // What is left is the hold over a period.
        let errors = runs(&mut fixed, 2.0, 3.0, |_| 0.0, 4000);
        assert!(errors[1] < 0.03, "{errors:?}");
        assert_eq!(fixed.gains(0), start);
    }

    #[test]
    fn adapts_to_another_plant_and_a_push() {
        for (a, g, push) in [(0.5, 3.0, 0.0), (4.0, 1.5, 1.0), (2.0, 6.0, -1.0)] {
            let mut adaptive = mrac(10.0, 0.0, f64::INFINITY).unwrap();
            let errors = runs(&mut adaptive, a, g, |_| push, 20_000);
            assert!(errors[1] < 0.25 * errors[0], "{a} {g}: {errors:?}");
        }
    }

    /// A disturbance that no gains explain: without leakage they wander, with it they stay.
    #[test]
    fn leakage_keeps_the_gains() {
        let away = |leakage: f64| {
            let mut adaptive = mrac(10.0, leakage, f64::INFINITY).unwrap();
            let start = adaptive.gains(0);
            let noise = |k: usize| 3.0 * ((k * k % 97) as f32 / 48.0 - 1.0);
            runs(&mut adaptive, 2.0, 3.0, noise, 100_000);
            let gains = adaptive.gains(0);
            (0..3)
                .map(|j| (gains[j] - start[j]).abs())
                .fold(0.0f32, f32::max)
        };
        let (free, held) = (away(0.0), away(0.5));
        assert!(held < 0.3 && held < free, "{free} {held}");
    }

    #[test]
    fn clipped_inputs_teach_nothing() {
        let mut adaptive = mrac(10.0, 0.0, 0.3).unwrap();
        let start = adaptive.gains(0);
        // 0.3 reaches 0.45 of the reference; the plant takes the reference model along.
        runs(&mut adaptive, 2.0, 3.0, |_| 0.0, 4000);
        let gains = adaptive.gains(0);
        assert!(
            (0..3).all(|j| (gains[j] - start[j]).abs() < 0.05),
            "{gains:?}"
        );
        adaptive.reset();
        assert_eq!(adaptive.gains(0), start);
        assert!(mrac(-1.0, 0.0, 1.0).is_none() && mrac(1.0, 0.0, 0.0).is_none());
    }
}
