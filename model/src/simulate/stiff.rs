//! Steps for a model that is stiff beside its samples.

use crate::model::pseudo_inverse;
use crate::registry::HostReal;
use nalgebra::DMatrix;

/// `1 - 1/√2`: the smaller of the two values with which the method is L-stable.
const GAMMA: f64 = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
/// Difference for the Jacobian, relative to a state: the root of the rounding error.
const DIFFERENCE: f64 = 1e-8;
/// Size of a state that is nearly zero.
const LEAST: f64 = 1e-3;
/// Difference for a state at rest.
pub(super) const FROM_REST: f64 = LEAST * DIFFERENCE;
/// Share by which a slope may differ between a small and a large difference and still be that of a straight line: rounding
/// of the small one makes less.
const CURVED: f64 = 0.1;
/// Squarings for the spectral radius: what the units of the states distort, shows in it by its 32nd root.
const SQUARINGS: usize = 5;
/// Radius of the half disc in which the classical method of Runge and Kutta is stable.
pub(super) const STABLE: f64 = 2.5;

/// What a step does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Way {
    /// A step of Runge and Kutta's method.
    #[default]
    Explicit,
    /// A step of the method for stiff models.
    Implicit,
    /// The state stays, and the Jacobian of its rates is kept for such steps.
    Linearise,
}

/// The Rosenbrock method ROS2, for `x' = f(x)`:
///
/// ```text
/// (I - γhA) k1 = h f(x)       (I - γhA) k2 = h f(x + k1) - 2 k1       x <- x + 3/2 k1 + 1/2 k2
/// ```
///
/// It is of second order whatever matrix `A` is, and L-stable where `A` is the Jacobian of `f`: what is faster than
/// the step settles at once, as it does in the machine. So one Jacobian, by differences, serves a whole interval.
///
/// Derivatives by parameters are those of the method itself: `A` has derivatives of its own, and where `k` solves
/// `M k = b` its derivative solves `M k' = b' - M' k`.
///
/// (J. G. Verwer, E. J. Spee, J. G. Blom, W. Hundsdorfer, 1999, "A second-order Rosenbrock method applied to
/// photochemical dispersion problems", SIAM J. Sci. Comput. 20, 1456–1480, equation 2.6.)
#[derive(Clone, Debug)]
pub(super) struct Implicit<S> {
    /// `A`.
    jacobian: DMatrix<f64>,
    /// The derivatives of `A` alone, row by row: numbers whose value is zero.
    slopes: Vec<S>,
    /// `γh` of the present step.
    weight: f64,
    /// `(I - γhA)⁻¹` of the present step.
    inverse: DMatrix<f64>,
    k1: Vec<S>,
    k2: Vec<S>,
    stage: Vec<S>,
    rate: Vec<S>,
}

impl Way {
    /// Whether steps of `h` seconds are stable where the fastest rates are these, at the start of the interval, whose
    /// Jacobian the method has, and at its end.
    ///
    /// An error that grows from rounding stays below any tolerance for a while, and the derivatives by parameters, which
    /// nothing checks, do not.
    pub(super) fn is_stable(self, h: f64, fastest: [f64; 2]) -> bool {
        let [start, end] = fastest.map(|rate| h * rate);
        if self == Self::Explicit {
            return start.max(end) <= STABLE;
        }
        // The method's factor for `x' = -end x` with the matrix of `start`.
        let q = 1.0 / (1.0 + GAMMA * start);
        let s = -end * q;
        (1.0 + 2.0 * s + 0.5 * s * s - s * q).abs() <= 1.0
    }
}

impl<S: HostReal> Implicit<S> {
    /// Nothing is kept before a model is stiff.
    pub(super) fn new() -> Self {
        Self {
            jacobian: DMatrix::zeros(0, 0),
            slopes: Vec::new(),
            weight: 0.0,
            inverse: DMatrix::zeros(0, 0),
            k1: Vec::new(),
            k2: Vec::new(),
            stage: Vec::new(),
            rate: Vec::new(),
        }
    }

    /// Keeps the Jacobian of `f` at `x`.
    pub(super) fn linearise(&mut self, x: &[S], mut f: impl FnMut(usize, &[S], &mut [S])) {
        let n = x.len();
        if self.jacobian.nrows() != n {
            self.jacobian = DMatrix::zeros(n, n);
            for buffer in [&mut self.k1, &mut self.k2, &mut self.stage, &mut self.rate] {
                buffer.clear();
                buffer.resize(n, S::zero());
            }
            self.slopes.clear();
            self.slopes.resize(n * n, S::zero());
        }
        f(0, x, &mut self.rate);
        self.stage.copy_from_slice(x);
        for (j, at) in x.iter().enumerate() {
            let size = at.value().abs().max(LEAST);
            self.column(j, *at, DIFFERENCE * size, &mut f);
            // Far from where it settles, and near zero, a state's rate is a difference of large terms. Their rounding must
            // be small beside the change as well.
            let slope = self.jacobian[(j, j)];
            let way = (self.rate[j].value() / slope).abs();
            if way.is_finite() && way > size {
                self.column(j, *at, DIFFERENCE * way, &mut f);
                // Not where the rate is curved.
                if (self.jacobian[(j, j)] - slope).abs() > CURVED * slope.abs() {
                    self.column(j, *at, DIFFERENCE * size, &mut f);
                }
            }
        }
    }

    /// The Jacobian's column of the state `j`, which is `at` a value, by a difference.
    fn column(&mut self, j: usize, at: S, change: f64, f: &mut impl FnMut(usize, &[S], &mut [S])) {
        let n = self.rate.len();
        self.stage[j] = at + S::of(change);
        f(0, &self.stage, &mut self.k1);
        self.stage[j] = at;
        for (i, (moved, rate)) in self.k1.iter().zip(&self.rate).enumerate() {
            let slope = (*moved - *rate).times(S::of(1.0 / change));
            self.jacobian[(i, j)] = (moved.value() - rate.value()) / change;
            self.slopes[i * n + j] = slope - S::of(slope.value());
        }
    }

    /// The rates where the Jacobian was made.
    pub(super) fn rates(&self) -> &[S] {
        &self.rate
    }

    /// The fastest rate at the Jacobian: its spectral radius, by Gelfand's formula `‖Aⁿ‖^(1/n)`.
    pub(super) fn fastest(&self) -> f64 {
        let mut power = self.jacobian.clone();
        let (mut radius, mut share) = (1.0, 1.0);
        for _ in 0..=SQUARINGS {
            let norm = power.norm();
            if norm == 0.0 || !norm.is_finite() {
                return norm;
            }
            radius *= norm.powf(share);
            share *= 0.5;
            power /= norm;
            power = &power * &power;
        }
        radius
    }

    /// Makes ready for steps of `h` seconds; the Jacobian must be known.
    pub(super) fn prepare(&mut self, h: f64) {
        let n = self.jacobian.nrows();
        self.weight = GAMMA * h;
        let matrix = DMatrix::identity(n, n) - &self.jacobian * self.weight;
        self.inverse = matrix
            .clone()
            .try_inverse()
            .or_else(|| pseudo_inverse(&matrix))
            .unwrap_or_else(|| DMatrix::from_element(n, n, f64::NAN));
    }

    /// Advances `x` by `h`. `f(stage, x, dx)` is called at the stages 0 and 3, the start and the end of the step.
    pub(super) fn step(&mut self, x: &mut [S], h: f64, mut f: impl FnMut(usize, &[S], &mut [S])) {
        f(0, x, &mut self.rate);
        for rate in &mut self.rate {
            *rate = rate.times(S::of(h));
        }
        self.solve(|this| &mut this.k1);
        for ((stage, x), k1) in self.stage.iter_mut().zip(x.iter()).zip(&self.k1) {
            *stage = *x + *k1;
        }
        f(3, &self.stage, &mut self.rate);
        for (rate, k1) in self.rate.iter_mut().zip(&self.k1) {
            *rate = rate.times(S::of(h)) - k1.times(S::of(2.0));
        }
        self.solve(|this| &mut this.k2);
        for ((x, k1), k2) in x.iter_mut().zip(&self.k1).zip(&self.k2) {
            *x += k1.times(S::of(1.5)) + k2.times(S::of(0.5));
        }
    }

    /// Solves `(I - γhA) k = rate`, where `rate` is no longer needed afterwards.
    fn solve(&mut self, k: impl Fn(&mut Self) -> &mut Vec<S>) {
        let mut found = std::mem::take(k(self));
        multiply(&self.inverse, &self.rate, &mut found);
        let n = found.len();
        for (rate, slopes) in self.rate.iter_mut().zip(self.slopes.chunks_exact(n.max(1))) {
            for (slope, found) in slopes.iter().zip(&found) {
                *rate += slope.times(S::of(self.weight * found.value()));
            }
        }
        multiply(&self.inverse, &self.rate, &mut found);
        *k(self) = found;
    }
}

/// `to = matrix · from`.
fn multiply<S: HostReal>(matrix: &DMatrix<f64>, from: &[S], to: &mut [S]) {
    for (i, to) in to.iter_mut().enumerate() {
        *to = S::zero();
        for (j, from) in from.iter().enumerate() {
            *to += from.times(S::of(matrix[(i, j)]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{derivative, variable};

    /// A slow and a fast state, 2 ms beside 5 s: the fast one follows `sin` of time through the slow one.
    fn ends(steps: usize) -> [f64; 2] {
        let mut x = [1.0, 0.0];
        let f = |_: usize, x: &[f64], dx: &mut [f64]| {
            dx[0] = -0.3 * x[0] * x[0];
            dx[1] = 500.0 * (x[0].sin() - x[1]);
        };
        let mut method = Implicit::new();
        let h = 5.0 / steps as f64;
        for _ in 0..steps {
            method.linearise(&x, f);
            method.prepare(h);
            method.step(&mut x, h, f);
        }
        x
    }

    /// A heater of 50 J/K that starts at 0 K beside an oven of 965 J/K at 294 K, and gives heat to it quickly.
    #[test]
    fn a_state_at_zero_beside_a_large_one_settles() {
        let mut x = [0.0, 294.0];
        let f = |_: usize, x: &[f64], dx: &mut [f64]| {
            let heat = 3e4 * (x[0] - x[1]);
            dx[0] = -heat / 50.0;
            dx[1] = heat / 965.0;
        };
        let mut method = Implicit::new();
        method.linearise(&x, f);
        method.prepare(0.05);
        for _ in 0..100 {
            method.step(&mut x, 0.05, f);
        }
        let settled = 294.0 * 965.0 / 1015.0;
        assert!(x.iter().all(|x| (x / settled - 1.0).abs() < 1e-6), "{x:?}");
    }

    #[test]
    fn what_is_fast_settles_and_the_order_is_two() {
        // x' = -0.3 x² has the solution x = 1/(1 + 0.3 t).
        let exact = 1.0 / 2.5;
        let [coarse, fine] = [40, 80].map(|n| ends(n)[0] - exact);
        assert!((coarse / fine - 4.0).abs() < 0.3, "{coarse} {fine}");
        let [slow, fast] = ends(40);
        assert!((fast - slow.sin()).abs() < 1e-3, "{slow} {fast}");
    }

    #[test]
    fn a_jacobian_that_is_old_keeps_the_order() {
        let f = |_: usize, x: &[f64], dx: &mut [f64]| dx[0] = -x[0] * x[0];
        let error = |steps: usize| {
            let mut x = [1.0];
            let mut method = Implicit::new();
            method.linearise(&[0.5], f);
            method.prepare(1.0 / steps as f64);
            for _ in 0..steps {
                method.step(&mut x, 1.0 / steps as f64, f);
            }
            x[0] - 0.5
        };
        let ratio = error(50) / error(100);
        assert!((ratio - 4.0).abs() < 0.3, "{ratio}");
    }

    /// A fast state whose speed, and whose goal, depend on a parameter: beside differences of two simulations.
    #[test]
    fn derivatives_are_those_of_the_values() {
        fn end<S: HostReal>(p: S) -> S {
            let mut x = [S::one(), S::zero()];
            let f = |_: usize, x: &[S], dx: &mut [S]| {
                dx[0] = -x[0];
                let speed = S::of(2000.0) * p * (S::of(0.2) + x[0]);
                dx[1] = speed * (p.sin() * x[0] - x[1]);
            };
            let mut method = Implicit::new();
            for _ in 0..40 {
                method.linearise(&x, f);
                method.prepare(0.05);
                method.step(&mut x, 0.05, f);
            }
            x[1]
        }
        let found = derivative(&end(variable(0.7, 0)), 0);
        let by_difference = (end(0.7 + 1e-5) - end(0.7 - 1e-5)) / 2e-5;
        assert!(
            (found - by_difference).abs() < 1e-5,
            "{found} {by_difference}"
        );
        // It follows sin(p) e^-2 and, as it is a little late, a little more.
        let exact = 0.7f64.cos() * (-2.0f64).exp();
        assert!((found - exact).abs() < 0.02 * exact, "{found} {exact}");
    }
}
