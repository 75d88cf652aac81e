//! The classical fourth-order Runge–Kutta method with a fixed sub-step rule.

use crate::{Array, Real};

/// Number of equal steps, none longer than `longest`, that make up `span` (both s).
///
/// A fixed rule (no error control) keeps a simulation differentiable by its parameters and gives
/// the same steps on every machine. At least one; a non-positive or non-finite `span` gives one.
///
/// ```
/// use loopsight_core::substeps;
/// assert_eq!(substeps(0.01, 0.0025), 4);
/// assert_eq!(substeps(0.0100000001, 0.0025), 4);
/// assert_eq!(substeps(0.011, 0.0025), 5);
/// ```
#[inline]
pub fn substeps(span: f64, longest: f64) -> usize {
    let ratio = span / longest;
    if !(ratio > 1.0 && ratio.is_finite()) {
        return 1;
    }
    // A hair above a whole number is rounding in the time stamps, not a longer interval.
    let ratio = ratio - 1e-6;
    if ratio < 1e6 {
        // Rounded up; cheaper than the library's on a machine that has no instruction for it.
        let whole = ratio as u32;
        (whole + u32::from(ratio > f64::from(whole))).max(1) as usize
    } else {
        1_000_000
    }
}

/// Scratch memory of the method for `N`-dimensional or run-time sized states.
///
/// One step of `dx/dt = f(x)` with step `h` (Hairer, Nørsett, Wanner 1993, table II.1.2):
///
/// ```text
/// k1 = f(x)  k2 = f(x + h k1/2)  k3 = f(x + h k2/2)  k4 = f(x + h k3)
/// x <- x + h (k1 + 2 k2 + 2 k3 + k4)/6
/// ```
///
/// `B` is the buffer: `[S; N]` without an allocator, `Vec<S>` on a host.
///
/// ```
/// use loopsight_core::Rk4;
/// let mut rk4 = Rk4::new([0.0f64; 1]);
/// let mut x = [1.0];
/// for _ in 0..100 {
///     rk4.step(&mut x, 0.01, |_stage, x, dx| dx[0] = -x[0]);
/// }
/// assert!((x[0] - (-1.0f64).exp()).abs() < 1e-10);
/// ```
#[derive(Clone, Debug)]
pub struct Rk4<B> {
    stage: B,
    rate: B,
    sum: B,
}

impl<B: Clone> Rk4<B> {
    /// Scratch for states as long as `zero`.
    pub fn new(zero: B) -> Self {
        Self {
            stage: zero.clone(),
            rate: zero.clone(),
            sum: zero,
        }
    }

    /// Advances `x` by `h`. `f(stage, x, dx)` is called at the stages 0 to 3, which lie at
    /// 0, `h/2`, `h/2` and `h` after the start of the step.
    pub fn step<S: Real>(&mut self, x: &mut [S], h: S, mut f: impl FnMut(usize, &[S], &mut [S]))
    where
        B: AsMut<[S]>,
    {
        let n = x.len();
        let (Some(stage), Some(rate), Some(sum)) = (
            self.stage.as_mut().get_mut(..n),
            self.rate.as_mut().get_mut(..n),
            self.sum.as_mut().get_mut(..n),
        ) else {
            return;
        };
        let half = h * S::of(0.5);
        let two = S::of(2.0);

        f(0, x, rate);
        for i in 0..n {
            sum[i] = rate[i];
            stage[i] = x[i] + rate[i].times(half);
        }
        f(1, stage, rate);
        for i in 0..n {
            sum[i] += rate[i].times(two);
            stage[i] = x[i] + rate[i].times(half);
        }
        f(2, stage, rate);
        for i in 0..n {
            sum[i] += rate[i].times(two);
            stage[i] = x[i] + rate[i].times(h);
        }
        f(3, stage, rate);
        let sixth = h * S::of(1.0 / 6.0);
        for i in 0..n {
            x[i] += (sum[i] + rate[i]).times(sixth);
        }
    }
}

/// One step of [`Rk4`] for a state of known size, to the same digits: everything stays in
/// registers.
///
/// ```
/// use loopsight_core::rk4_step;
/// let mut x = [1.0f64];
/// for _ in 0..100 {
///     rk4_step(&mut x, 0.01, |x| [-x[0]]);
/// }
/// assert!((x[0] - (-1.0f64).exp()).abs() < 1e-10);
/// ```
#[inline]
pub fn rk4_step<S: Real, const N: usize>(x: &mut [S; N], h: S, f: impl Fn(&[S; N]) -> [S; N]) {
    rk4_stages(x, h, |_, x| f(x));
}

/// How far the rates of the states bend over a step of [`Rk4`], by its four stages; the largest of all states.
///
/// ```text
/// |k1 - k2 - k3 + k4| / max |k|
/// ```
///
/// The two stages in the middle are at one time, so a rate that changes evenly bends by nothing. That of a state with the rate
/// `λ` bends by `z²/4`, with `z = h λ`, and the step is off by `z⁵/120`. A force that sets in within the step bends the rate
/// by its share of it, wherever in the step that is.
///
/// It takes the place of the sign that L. Collatz (1960), "The Numerical Treatment of Differential Equations", ch. II, reads
/// from the stages, `|k3 - k2|/|k2 - k1|`, which does not see what happens in the last half of a step.
#[inline(always)]
pub(crate) fn bend<S: Real, A: Array<S>>([k1, k2, k3, k4]: &[A; 4]) -> f64 {
    let mut bend = Bend::default();
    let mut most = 0f64;
    for i in 0..A::LENGTH {
        for (stage, k) in [k1, k2, k3, k4].into_iter().enumerate() {
            bend.take(stage, k[i].value());
        }
        most = most.max(bend.share());
    }
    most
}

/// How far the rate of one state [bends](bend).
#[doc(hidden)]
#[derive(Clone, Copy, Debug, Default)]
pub struct Bend {
    off: f64,
    most: f64,
}

impl Bend {
    /// Takes the rate at a stage, of which 0 begins anew.
    #[inline(always)]
    pub fn take(&mut self, stage: usize, rate: f64) {
        let size = libm::fabs(rate);
        match stage {
            0 => (self.off, self.most) = (rate, size),
            1 | 2 => (self.off, self.most) = (self.off - rate, self.most.max(size)),
            _ => (self.off, self.most) = (self.off + rate, self.most.max(size)),
        }
    }

    /// What it comes to after all stages; nothing where the state rests.
    #[inline(always)]
    pub fn share(self) -> f64 {
        if self.off == 0.0 {
            0.0
        } else {
            libm::fabs(self.off) / self.most
        }
    }
}

/// The same, where the rate is told the stage, 0 to 3, as in [`Rk4::step`]; returns the rates at the stages.
#[inline(always)]
pub(crate) fn rk4_stages<S: Real, A: Array<S>>(
    x: &mut A,
    h: S,
    mut f: impl FnMut(usize, &A) -> A,
) -> [A; 4] {
    let half = h * S::of(0.5);
    let two = S::of(2.0);
    let along = |x: &A, rate: &A, h: S| A::from_fn(|i| x[i] + rate[i].times(h));
    let k1 = f(0, x);
    let k2 = f(1, &along(x, &k1, half));
    let k3 = f(2, &along(x, &k2, half));
    let k4 = f(3, &along(x, &k3, h));
    let sixth = h * S::of(1.0 / 6.0);
    for i in 0..A::LENGTH {
        x[i] += (k1[i] + k2[i].times(two) + k3[i].times(two) + k4[i]).times(sixth);
    }
    [k1, k2, k3, k4]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Global error of the pendulum against a hundred times finer run falls with the fourth power.
    #[test]
    fn order_is_four() {
        let run = |steps: usize| {
            let mut rk4 = Rk4::new([0.0f64; 2]);
            let mut x = [1.0, 0.0];
            for _ in 0..steps {
                rk4.step(&mut x, 2.0 / steps as f64, |_, x, dx| {
                    dx[0] = x[1];
                    dx[1] = -libm::sin(x[0]);
                });
            }
            x[0]
        };
        let exact = run(20_000);
        let ratio = (run(50) - exact) / (run(100) - exact);
        assert!((ratio - 16.0).abs() < 1.0, "{ratio}");
    }

    /// How far the rate of one state bends over a step of `h`.
    fn bends(h: f64, rate: impl Fn(f64, f64) -> f64) -> f64 {
        let times = [0.0, 0.5, 0.5, 1.0];
        bend(&rk4_stages(&mut [1.0], h, |stage, x: &[f64; 1]| {
            [rate(times[stage] * h, x[0])]
        }))
    }

    #[test]
    fn a_rate_bends_with_the_square_of_the_step() {
        for z in [0.01, 0.1, 0.5] {
            let expected = z * z / 4.0 * (1.0 - z);
            assert!((bends(z, |_, x| -x) - expected).abs() < 1e-12, "{z}");
        }
        assert_eq!(bends(0.5, |_, _| 3.0), 0.0);
        assert_eq!(bends(0.5, |_, _| 0.0), 0.0);
        assert!(bends(0.5, |t, _| 3.0 - t).abs() < 1e-12);
    }

    /// A force that sets in shows wherever in the step that is, by its share of the rate.
    #[test]
    fn what_sets_in_within_a_step_bends_the_rate() {
        for from in [0.1, 0.4, 0.6, 0.9] {
            let bent = bends(1.0, |t, _| if t > from { 1.5 } else { 1.0 });
            assert!((bent - 0.5 / 1.5).abs() < 1e-12, "{from}: {bent}");
        }
    }

    #[test]
    fn a_known_size_gives_the_same_digits() {
        let rate = |x: &[f64]| [x[1], -libm::sin(x[0]) - 0.1 * x[1], x[0] * x[1]];
        let (mut slice, mut array) = ([1.0, 0.3, 0.0], [1.0, 0.3, 0.0]);
        let mut rk4 = Rk4::new([0.0; 3]);
        for _ in 0..1000 {
            rk4.step(&mut slice, 0.01, |_, x, dx| dx.copy_from_slice(&rate(x)));
            rk4_step(&mut array, 0.01, |x| rate(x));
            assert_eq!(slice, array);
        }
    }

    #[test]
    fn the_rule_never_exceeds_the_longest_step() {
        for i in 1..1000 {
            let span = f64::from(i) * 1.7e-4;
            let n = substeps(span, 0.0025);
            assert!(span / n as f64 <= 0.0025 * (1.0 + 1e-5));
        }
        assert_eq!(substeps(f64::NAN, 0.01), 1);
        assert_eq!(substeps(-1.0, 0.01), 1);
    }
}
