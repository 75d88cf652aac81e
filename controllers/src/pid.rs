//! PID control with two degrees of freedom.

use loopsight_core::{AffineModel, Command, ControlError, Controller, Real, Tick};
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use crate::Mixing;
use crate::clipped::Clipped;

#[cfg(feature = "std")]
mod settings;
#[cfg(feature = "std")]
pub use settings::PidSettings;

/// One PID controller per controlled state, with weights for the reference and anti-windup.
///
/// ```text
/// s = K (b r - y) + I + D                    V = M s, clipped to V_a;  s_a = M⁻¹ V_a
/// I_{k+1} = I_k + K_i T (r - y) + (T/T_t) (s_a - s)
/// D_k = T_f/(T_f + T) D_{k-1} + K_d/(T_f + T) ((c r - y)_k - (c r - y)_{k-1})
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `y`, `r` | controlled states and their references | of the states |
/// | `s`, `M`, `V` | demand per state, [`Mixing`], inputs | of the inputs |
/// | `K`, `K_i`, `K_d` | gains | of the inputs per state, per s, times s |
/// | `b`, `c` | weights of the reference in the proportional and derivative part | 1 |
/// | `T_f` | time constant of the derivative's filter | s |
/// | `T_t` | tracking time of the anti-windup | s |
/// | `T` | period | s |
///
/// The reference enters with weights of its own: `b` and `c` set how a step of it is answered, without
/// touching how disturbances are. The integral is tracked back by what the clipped inputs lack, so it
/// does not wind up. Integral forward, derivative backward: stable for every `T_f`.
///
/// **When no command can be computed** the last one is repeated, the integral stays, and
/// [`Command::held`] is true.
///
/// Assumptions: each demand moves mostly its own state; nothing of the model is used but the
/// directions in `M`.
///
/// Reference: K. J. Åström, T. Hägglund (2006), "Advanced PID Control", ISA, sections 3.4 (set-point
/// weighting), 3.5 (anti-windup by back-calculation) and 13.4 (digital implementation).
#[derive(Clone, Debug)]
pub struct Pid<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    gains: PidGains<S, D>,
    mixing: Mixing<S, D>,
    inputs: Clipped<S, D>,
    period: S,
    integral: OVector<S, D>,
    derivative: OVector<S, D>,
    /// `c r - y` at the last step; NaN at the start.
    before: OVector<S, D>,
    demand: OVector<S, D>,
    achieved: OVector<S, D>,
}

/// The numbers of [`Pid`], one of each per controlled state.
#[derive(Clone, Debug, PartialEq)]
pub struct PidGains<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D>,
{
    /// `K`.
    pub proportional: OVector<S, D>,
    /// `K_i`.
    pub integral: OVector<S, D>,
    /// `K_d`.
    pub derivative: OVector<S, D>,
    /// `T_f`, s.
    pub filter: OVector<S, D>,
    /// `b`.
    pub reference_weight: OVector<S, D>,
    /// `c`.
    pub derivative_weight: OVector<S, D>,
    /// `T_t`, s.
    pub tracking: OVector<S, D>,
}

impl<S: Real, D: Dim> Pid<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// Controllers with these gains, limits (one per input, infinity for none) and period (s).
    ///
    /// `None` where a number is not finite, a gain or time is below 0, or a tracking time, a limit or
    /// the period is not above 0.
    pub fn new(
        gains: PidGains<S, D>,
        mixing: Mixing<S, D>,
        limit: &OVector<S, D>,
        period: f64,
    ) -> Option<Self> {
        let not_below = |v: &OVector<S, D>| v.iter().all(|g| g.is_finite() && *g >= S::zero());
        let above = |v: &OVector<S, D>| v.iter().all(|g| *g > S::zero());
        let weights = gains
            .reference_weight
            .iter()
            .chain(&gains.derivative_weight);
        let fine = [
            &gains.proportional,
            &gains.integral,
            &gains.derivative,
            &gains.filter,
        ];
        if !(fine.into_iter().all(not_below)
            && above(&gains.tracking)
            && above(limit)
            && weights.into_iter().all(|w| w.is_finite())
            && period > 0.0
            && period.is_finite())
        {
            return None;
        }
        let (dim, one) = limit.shape_generic();
        let zero = OVector::<S, D>::zeros_generic(dim, one);
        Some(Self {
            gains,
            mixing,
            inputs: Clipped::within(limit.clone()),
            period: S::of(period),
            integral: zero.clone(),
            derivative: zero.clone(),
            before: OVector::from_element_generic(dim, one, S::of(f64::NAN)),
            demand: zero.clone(),
            achieved: zero,
        })
    }
}

impl<S: Real, D: Dim> Controller<S> for Pid<S, D>
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
        let (gains, period) = (&self.gains, self.period);
        for i in 0..n {
            let (r, y) = (reference[i], measured[i]);
            let weighted = gains.derivative_weight[i] * r - y;
            let change = weighted - self.before[i];
            let filter = gains.filter[i];
            if change.is_finite() {
                self.derivative[i] = (filter * self.derivative[i] + gains.derivative[i] * change)
                    / (filter + period);
            }
            self.before[i] = weighted;
            let proportional = gains.proportional[i] * (gains.reference_weight[i] * r - y);
            self.demand[i] = proportional + self.integral[i] + self.derivative[i];
        }
        self.mixing.mix(self.demand.as_slice(), command);
        let saturated = self.inputs.clip(command);
        self.achieved.copy_from(&self.demand);
        if saturated {
            self.mixing.unmix(command, self.achieved.as_mut_slice());
        }
        for i in 0..n {
            let lack = self.achieved[i] - self.demand[i];
            let next = self.integral[i]
                + gains.integral[i] * period * (reference[i] - measured[i])
                + (period / gains.tracking[i]).min(S::one()) * lack;
            if next.is_finite() {
                self.integral[i] = next;
            }
        }
        Ok(Command {
            saturated,
            held: false,
        })
    }

    fn reset(&mut self) {
        self.integral.fill(S::zero());
        self.derivative.fill(S::zero());
        self.before.fill(S::of(f64::NAN));
        self.inputs.reset();
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector1;

    use super::*;

    struct Unseen;
    impl AffineModel<f32> for Unseen {
        fn size(&self) -> usize {
            1
        }
        fn evaluate(&mut self, _y: &[f32], _drift: &mut [f32], _input_matrix: &mut [f32]) {}
    }

    fn tick() -> Tick<f32> {
        Tick {
            index: 0,
            time: 0.0,
            period: 0.01,
        }
    }

    fn pid(
        limit: f32,
        change: impl Fn(&mut PidGains<f32, nalgebra::U1>),
    ) -> Option<Pid<f32, nalgebra::U1>> {
        let one = Vector1::repeat;
        let mut gains = PidGains {
            proportional: one(2.0),
            integral: one(4.0),
            derivative: one(0.0),
            filter: one(0.02),
            reference_weight: one(1.0),
            derivative_weight: one(0.0),
            tracking: one(0.5),
        };
        change(&mut gains);
        let mixing = Mixing::new(&[1.0], &Vector1::zeros()).unwrap();
        Pid::new(gains, mixing, &one(limit), 0.01)
    }

    /// `y' = u` in closed loop: settles on the reference, and against a constant push.
    fn runs(
        mut pid: Pid<f32, nalgebra::U1>,
        push: f32,
        reference: impl Fn(usize) -> f32,
    ) -> Vec<f32> {
        let (mut y, mut u) = ([0.0f32], [0.0f32]);
        (0..2000)
            .map(|k| {
                pid.step(&tick(), &[reference(k)], &y, &mut Unseen, &mut u)
                    .unwrap();
                y[0] += 0.01 * (u[0] + push);
                y[0]
            })
            .collect()
    }

    #[test]
    fn settles_on_the_reference_whatever_pushes() {
        for push in [0.0, -1.5] {
            let y = runs(pid(f32::INFINITY, |_| ()).unwrap(), push, |_| 1.0);
            assert!((y[1999] - 1.0).abs() < 1e-4, "{push}: {}", y[1999]);
        }
    }

    /// `(b K s + K_i)/(s² + K s + K_i)` with damping 0.5: 29.8 % with the zero, 16.3 % without.
    #[test]
    fn the_reference_weight_sets_the_overshoot() {
        for (b, peak) in [(1.0, 1.298), (0.0, 1.163)] {
            let pid = pid(f32::INFINITY, |g| g.reference_weight = Vector1::repeat(b));
            let y = runs(pid.unwrap(), 0.0, |_| 1.0);
            let found = y.into_iter().fold(0.0f32, f32::max);
            assert!((found - peak).abs() < 0.01, "{b}: {found}");
        }
    }

    /// Out of reach for ten seconds; back within reach the wait is not remembered.
    #[test]
    fn nothing_winds_up() {
        let y = runs(pid(0.1, |_| ()).unwrap(), 0.0, |k| {
            if k < 1000 { 50.0 } else { 0.9 }
        });
        assert!((y[999] - 1.0).abs() < 0.01);
        let low = y[1000..].iter().copied().fold(1.0f32, f32::min);
        assert!((y[1999] - 0.9).abs() < 1e-3 && low > 0.85, "{low}");
    }

    #[test]
    fn the_derivative_is_filtered_and_a_gap_is_ridden_out() {
        let mut d = pid(f32::INFINITY, |g| {
            g.proportional = Vector1::repeat(0.0);
            g.integral = Vector1::repeat(0.0);
            g.derivative = Vector1::repeat(3.0);
        })
        .unwrap();
        let mut u = [0.0f32];
        let mut last = 0.0;
        for k in 0..100 {
            let y = if k == 50 { f32::NAN } else { 0.01 * k as f32 };
            let said = d.step(&tick(), &[0.0], &[y], &mut Unseen, &mut u).unwrap();
            assert_eq!(said.held, k == 50);
            if k == 50 {
                assert_eq!(u[0], last);
            }
            last = u[0];
        }
        // The measurement rises by 1 per second.
        assert!((u[0] + 3.0).abs() < 0.05, "{}", u[0]);
        d.reset();
        d.step(&tick(), &[0.0], &[7.0], &mut Unseen, &mut u)
            .unwrap();
        assert_eq!(u[0], 0.0);
        assert!(pid(0.0, |_| ()).is_none());
        assert!(pid(1.0, |g| g.tracking = Vector1::repeat(0.0)).is_none());
        assert!(pid(1.0, |g| g.integral = Vector1::repeat(-1.0)).is_none());
    }
}
