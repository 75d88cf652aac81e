//! Feedback-linearising PI control.

use loopsight_core::{AffineModel, Command, ControlError, Controller, Real, Tick};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use crate::clipped::Clipped;
use crate::{SampledPi, solve};

mod design_error;
#[cfg(feature = "std")]
mod settings;
pub use design_error::DesignError;
#[cfg(feature = "std")]
pub use settings::FeedbackLinearizingPiSettings;

/// State feedback that makes each controlled state one integrator, and a PI law around each.
///
/// ```text
/// u   = G(ȳ)⁻¹ (ν - f(ȳ)),  ȳ = y + ν T/2     makes  y' = f + G u  into  y' = ν      (48)
/// V   = E⁻¹(u)                                 undoes what lies between command and plant
/// ν_k = k_p (β r_k - y_k) + z_k  [+ (r_k - r_{k-1})/T]                                (49)
/// z_{k+1} = z_k + k_i T (r_k - y_k) + k_i T/(k_p β) (ν_a - ν_k)
/// V_a = clamp(V, -V_max, V_max),  ν_a = f(ȳ) + G(ȳ) E(V_a),  ȳ = y + ν_a T/2
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `r` | controlled states and their references | unit of the state |
/// | `V`, `V_max` | commands and their limits | unit of the input |
/// | `u`, `E` | inputs at the plant, and what makes them of commands ([`AffineModel::pass`]) | unit of the input |
/// | `ν`, `ν_a` | acceleration asked for; achieved after the limits | of `y` per s |
/// | `f`, `G` | drift and input matrix of the model ([`AffineModel`]) | of `y` per s (per `V`) |
/// | `k_p`, `k_i`, `β` | gains and reference weight of [`SampledPi`] | 1/s, 1/s², 1 |
/// | `T` | period | s |
///
/// **The period.** The input is constant over the period, but the drift is not: linearised at the
/// start of the period, a robot with a damping of 15 s⁻¹ falls short of `ν` by 7 % at 100 Hz. So `f` and `G`
/// are taken at the middle `ȳ` of the period, where `y` will be if `y' = ν` (the implicit midpoint rule). The
/// shortfall is then `(A T)²/12`, 0.2 %, and the model is still evaluated only once. What is left is
/// `y_{k+1} = y_k + T ν_k`, for which [`SampledPi`] equals `H(s)` at every sample.
///
/// **Feedforward.** With [`FeedbackLinearizingPi::feeding_forward`] the rate of the reference is added
/// to `ν` (in brackets above): a smooth reference is then followed without waiting for an error, and
/// what is left says how wrong the model is. A step has no rate: with steps leave it out.
///
/// **Limits.** Each input is clipped by itself, as an amplifier does it. The last term of `z` is
/// Hanus' conditioning (back-calculation with the time constant `K_p/K_i`): the integral runs as if
/// the reference had been the one that the clipped inputs can follow, so it cannot wind up.
///
/// **When no command can be computed** (a measurement or reference that is not a number, a model
/// that became singular while it was being learned) the last command is repeated, the integral stays,
/// and [`Command::held`] is true.
///
/// **Effects** in the model file are in `f`, `G` and `E`. So friction, drag, gravity, dead zone, sag and
/// the like are compensated without any setting here, and delays and lags are predicted over.
/// [`loopsight_core::AffineModel`] describes how; the notes of a loop list what of it applies.
///
/// Assumptions: as many inputs as controlled states, `G` invertible, measurements without delay but
/// for what the model predicts over (a velocity taken from encoder counts is the mean over the last
/// period, half a period old: without a predictor the loop behaves as if the plant had that delay).
///
/// Reference: Alves, Lages, Henriques (2018), (48)–(52); A. Isidori (1995), "Nonlinear Control
/// Systems", ch. 5; R. Hanus, M. Kinnaert, J.-L. Henrotte (1987), "Conditioning technique, a
/// general anti-windup and bumpless transfer method", Automatica 23(6), 729–739; Hairer, Lubich,
/// Wanner (2006), "Geometric Numerical Integration", II.1 (midpoint rule).
///
/// ```
/// use loopsight_controllers::FeedbackLinearizingPi;
/// use nalgebra::Vector2;
///
/// let controller = FeedbackLinearizingPi::<f32, _>::new(
///     &Vector2::repeat(17.78),
///     &Vector2::repeat(79.01),
///     &Vector2::repeat(12.0),
///     0.01,
/// );
/// assert!(controller.is_ok());
/// ```
#[derive(Clone, Debug)]
pub struct FeedbackLinearizingPi<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    law: Law<S, D>,
    inputs: Clipped<S, D>,
    period: S,
    /// Where the rate of the reference is fed forward, the last reference; NaN at the start.
    forward: Option<OVector<S, D>>,
    demand: OVector<S, D>,
    middle: OVector<S, D>,
    aim: OVector<S, D>,
    felt: OVector<S, D>,
    drift: OVector<S, D>,
    scale: OVector<S, D>,
    matrix: OMatrix<S, D, D>,
}

/// Where the acceleration comes from.
#[derive(Clone, Debug)]
enum Law<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D>,
{
    Pi {
        proportional: OVector<S, D>,
        /// `k_i T`.
        integral: OVector<S, D>,
        weight: OVector<S, D>,
        z: OVector<S, D>,
    },
    OpenLoop(OVector<S, D>),
}

impl<S: Real, D: Dim> FeedbackLinearizingPi<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// A velocity loop with the gains of `H(s)` (1/s and 1/s², one per controlled state), limits
    /// (one per input, in its unit; infinity for none) and period (s).
    ///
    /// # Errors
    ///
    /// Lists of different lengths, or a gain, limit or period out of its range: see [`DesignError`].
    pub fn new(
        proportional: &OVector<f64, D>,
        integral: &OVector<f64, D>,
        limit: &OVector<f64, D>,
        period: f64,
    ) -> Result<Self, DesignError> {
        let (dim, one) = limit.shape_generic();
        let n = limit.len();
        if proportional.len() != n || integral.len() != n {
            return Err(DesignError::Lengths);
        }
        let zero = OVector::<S, D>::zeros_generic(dim, one);
        let (mut k_p, mut k_i, mut weight) = (zero.clone(), zero.clone(), zero.clone());
        for i in 0..n {
            let (kp, ki) = (proportional[i], integral[i]);
            if !(kp > 0.0 && kp.is_finite()) {
                return Err(DesignError::Proportional(i, kp));
            }
            if !(ki >= 0.0 && ki.is_finite()) {
                return Err(DesignError::Integral(i, ki));
            }
            let sampled = SampledPi::new(kp, ki, period).ok_or(DesignError::Period(period))?;
            k_p[i] = S::of(sampled.proportional);
            k_i[i] = S::of(sampled.integral * period);
            weight[i] = S::of(sampled.reference_weight);
        }
        let law = Law::Pi {
            proportional: k_p,
            integral: k_i,
            weight,
            z: zero,
        };
        Self::with_law(law, limit, period)
    }

    /// The linearisation alone: a constant acceleration (one per controlled state, in its unit per
    /// second), whatever the reference.
    ///
    /// # Errors
    ///
    /// As [`FeedbackLinearizingPi::new`].
    pub fn open_loop(
        acceleration: &OVector<f64, D>,
        limit: &OVector<f64, D>,
        period: f64,
    ) -> Result<Self, DesignError> {
        if acceleration.len() != limit.len() {
            return Err(DesignError::Lengths);
        }
        if let Some(i) = acceleration.iter().position(|a| !a.is_finite()) {
            return Err(DesignError::Acceleration(i, acceleration[i]));
        }
        Self::with_law(Law::OpenLoop(acceleration.map(S::of)), limit, period)
    }

    fn with_law(law: Law<S, D>, limit: &OVector<f64, D>, period: f64) -> Result<Self, DesignError> {
        if let Some(i) = limit.iter().position(|l| l.is_nan() || *l <= 0.0) {
            return Err(DesignError::Limit(i, limit[i]));
        }
        if !(period > 0.0 && period.is_finite()) {
            return Err(DesignError::Period(period));
        }
        let (dim, one) = limit.shape_generic();
        let zero = OVector::<S, D>::zeros_generic(dim, one);
        Ok(Self {
            law,
            inputs: Clipped::within(limit.map(S::of)),
            period: S::of(period),
            forward: None,
            demand: zero.clone(),
            middle: zero.clone(),
            aim: zero.clone(),
            felt: zero.clone(),
            drift: zero.clone(),
            scale: zero,
            matrix: OMatrix::zeros_generic(dim, dim),
        })
    }

    /// The same, with the rate of the reference fed forward.
    #[must_use]
    pub fn feeding_forward(mut self) -> Self {
        let (dim, one) = self.demand.shape_generic();
        self.forward = Some(OVector::from_element_generic(dim, one, S::of(f64::NAN)));
        self
    }

    /// The last term of `z`, for a clipped `command`: the reference that it can follow is another one.
    #[cold]
    fn condition(&mut self, measured: &[S], model: &mut dyn AffineModel<S>, command: &[S]) {
        let half = self.period * S::of(0.5);
        let achieved = &mut self.scale;
        let felt = self.felt.as_mut_slice();
        felt.copy_from_slice(command);
        model.pass(self.middle.as_slice(), felt);
        // First where the middle of the period was thought to lie; clipped, it lies elsewhere.
        for _ in 0..2 {
            let (drift, matrix) = (self.drift.as_mut_slice(), self.matrix.as_mut_slice());
            model.evaluate(self.middle.as_slice(), drift, matrix);
            accelerate(&self.drift, &self.matrix, felt, achieved);
            for (i, middle) in self.middle.iter_mut().enumerate() {
                *middle = measured[i] + half * achieved[i];
            }
        }
        if let Law::Pi {
            proportional,
            integral,
            weight,
            z,
        } = &mut self.law
        {
            for (i, achieved) in achieved.iter().enumerate() {
                let missing = *achieved - self.demand[i];
                let next = z[i] + integral[i] * missing / (proportional[i] * weight[i]);
                if next.is_finite() {
                    z[i] = next;
                }
            }
        }
    }

    /// The acceleration asked for at the last step, one per controlled state.
    pub fn acceleration(&self) -> &[S] {
        self.demand.as_slice()
    }
}

impl<S: Real, D: Dim> Controller<S> for FeedbackLinearizingPi<S, D>
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
        model: &mut dyn AffineModel<S>,
        command: &mut [S],
    ) -> Result<Command, ControlError> {
        let n = self.inputs.len();
        let sizes = [reference.len(), measured.len(), command.len(), model.size()];
        if sizes.iter().any(|size| *size != n) {
            return Err(ControlError::Sizes);
        }
        let half = self.period * S::of(0.5);
        match &self.law {
            Law::Pi {
                proportional,
                weight,
                z,
                ..
            } => {
                for i in 0..n {
                    self.demand[i] =
                        proportional[i] * (weight[i] * reference[i] - measured[i]) + z[i];
                }
            }
            Law::OpenLoop(acceleration) => self.demand.copy_from(acceleration),
        }
        if let Some(before) = &mut self.forward {
            for i in 0..n {
                let rate = (reference[i] - before[i]) / self.period;
                before[i] = reference[i];
                if rate.is_finite() {
                    self.demand[i] += rate;
                }
            }
        }
        let mut sum = S::zero();
        for (i, middle) in self.middle.iter_mut().enumerate() {
            *middle = measured[i] + half * self.demand[i];
            sum += *middle;
        }
        // A sum is finite where all of it is: signals that are no numbers end up here.
        if !sum.is_finite() {
            return Ok(self.inputs.hold(command));
        }
        match &self.law {
            Law::Pi { .. } => model.aim(reference),
            Law::OpenLoop(acceleration) => {
                // Ever further in this direction.
                for i in 0..n {
                    self.aim[i] = measured[i] + S::of(1e6) * acceleration[i];
                }
                model.aim(self.aim.as_slice());
            }
        }
        // A model that writes nothing must not go unnoticed.
        self.drift.fill(S::of(f64::NAN));
        self.matrix.fill(S::of(f64::NAN));
        model.evaluate(
            self.middle.as_slice(),
            self.drift.as_mut_slice(),
            self.matrix.as_mut_slice(),
        );
        for (i, value) in command.iter_mut().enumerate() {
            *value = self.demand[i] - self.drift[i];
        }
        if solve(
            self.matrix.as_mut_slice(),
            command,
            self.scale.as_mut_slice(),
        )
        .is_err()
        {
            return Ok(self.inputs.hold(command));
        }
        let mut saturated = !model.invert(self.middle.as_slice(), command);
        saturated |= self.inputs.clip(command);
        if let Law::Pi { integral, z, .. } = &mut self.law {
            for i in 0..n {
                let next = z[i] + integral[i] * (reference[i] - measured[i]);
                if next.is_finite() {
                    z[i] = next;
                }
            }
            if saturated {
                self.condition(measured, model, command);
            }
        }
        Ok(Command {
            saturated,
            held: false,
        })
    }

    fn reset(&mut self) {
        if let Law::Pi { z, .. } = &mut self.law {
            z.fill(S::zero());
        }
        if let Some(before) = &mut self.forward {
            before.fill(S::of(f64::NAN));
        }
        self.inputs.reset();
        self.demand.fill(S::zero());
    }
}

/// `ν = f + G V`.
fn accelerate<S: Real, D: Dim>(
    drift: &OVector<S, D>,
    matrix: &OMatrix<S, D, D>,
    input: &[S],
    acceleration: &mut OVector<S, D>,
) where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    let (n, matrix) = (input.len(), matrix.as_slice());
    for i in 0..n {
        let mut sum = drift[i];
        for j in 0..n {
            sum += matrix[i * n + j] * input[j];
        }
        acceleration[i] = sum;
    }
}

#[cfg(test)]
mod tests;
