//! Least squares within bounds: Levenberg–Marquardt with a projected step.

use std::rc::Rc;

use loopsight_model::model::pseudo_inverse;
use nalgebra::{DMatrix, DVector};

use crate::gram::gram;
use crate::linearised::Linearised;
use crate::solve::Effort;

/// Damping at the start, over the largest diagonal entry of `JᵀJ`.
const DAMPING: f64 = 1e-6;
/// Change of the unknowns, over their size, below which nothing moves any more.
const STILL: f64 = 1e-10;
/// Share of the promised gain from which a step is taken.
const TAKEN: f64 = 1e-4;
/// A step that gained what it promised, give or take this share, shows that the derivatives hold where it ended.
const STEADY: f64 = 0.5;
/// Most times in a row that a damped step is not taken.
const REFUSED: u32 = 8;
/// Share of the way to a bound that a step ends at. At a bound of zero an unknown takes the influence of what it is
/// multiplied with, and the first steps of the others are too rough for that.
const SHORT: f64 = 0.9;
/// Steps in a row that end short of an unknown's bound before it goes there.
const PUSHES: u32 = 2;

/// Residuals `r(x)` whose sum of squares is to become least, and the bounds of their unknowns.
pub(crate) trait LeastSquares {
    /// What ends the work early.
    type Error;

    /// `r` at `x`.
    fn residual(&self, x: &DVector<f64>) -> Result<DVector<f64>, Self::Error>;

    /// `r` at `x`, and its derivatives.
    fn linearise(&self, x: &DVector<f64>) -> Result<Rc<Linearised>, Self::Error>;

    /// Lower and upper bounds.
    fn bounds(&self) -> (&DVector<f64>, &DVector<f64>);
}

/// The unknowns of least squares from `start`, and whether the cost stopped falling before the iterations of the `effort`
/// ended: an iteration changed it by less than its tolerance, or no step lowers it.
///
/// ```text
/// (JᵀJ + μ I)_FF p_F = -(Jᵀ(r + J p_B))_F
/// ```
///
/// | symbol | what |
/// |---|---|
/// | `F`, `B` | unknowns that are free, and those at a bound that the cost would push beyond it |
/// | `p` | the step; one that would take an unknown beyond its bound ends short of it, but the third time in a row that unknown goes there, joins `B`, and the step of the others is computed again |
/// | `μ` | damping: divided by up to three after a step that lowers the cost as promised, doubled and more after one that does not |
///
/// Derivatives cost several simulations. A short fit, of which the effort says what it is `worth`, needs none at its end: after
/// a step that gained what it promised, a full step with the derivatives from before it (the simplified Newton correction)
/// would gain
///
/// ```text
/// rᵀJ (JᵀJ)⁺ Jᵀr
/// ```
///
/// with `r` from after it. Where that is less than the tolerance, the fit ends. Where what it would leave does not come below
/// what the fit must be worth, it is given up.
///
/// The columns of `J` should be of one size. An unknown at its bound does not hold the others back, as it does where one
/// step length serves all.
///
/// Reference: C. Kanzow, N. Yamashita, M. Fukushima (2004), "Levenberg–Marquardt methods with strong local convergence
/// properties for solving nonlinear equations with convex constraints", J. Comput. Appl. Math. 172, 375–397; the damping:
/// H. B. Nielsen (1999), "Damping parameter in Marquardt's method", IMM-REP-1999-05, Technical University of Denmark; the
/// simplified correction: P. Deuflhard (2004), "Newton Methods for Nonlinear Problems", Springer, chapters 2 and 4.
pub(crate) fn minimise<P: LeastSquares>(
    problem: &P,
    start: &DVector<f64>,
    effort: Effort,
) -> Result<(DVector<f64>, bool), P::Error> {
    let (iterations, tolerance) = (effort.iterations, effort.tolerance);
    let (lower, upper) = problem.bounds();
    let mut x = within(start, lower, upper);
    let mut at = Linear::of(problem.linearise(&x)?);
    let mut cost = at.cost;
    let mut mu = DAMPING * at.normal.diagonal().max().max(1.0);
    let mut growth = 2.0;
    let mut refused = 0;
    let mut pushes = vec![0; x.len()];
    for iteration in 0..iterations {
        let Some((step, stopped)) = step(&at.normal, &at.gradient, mu, [&x, lower, upper], &pushes)
        else {
            return Ok((x, false));
        };
        if step.norm() <= STILL * (x.norm() + STILL) {
            return Ok((x, true));
        }
        let promised = -(2.0 * at.gradient.dot(&step) + step.dot(&(&at.normal * &step)));
        let there = within(&(&x + &step), lower, upper);
        let residual = problem.residual(&there)?;
        let gained = cost - residual.norm_squared();
        let kept = gained / promised;
        if promised > 0.0 && kept > TAKEN {
            mu *= (1.0 - (2.0 * kept - 1.0).powi(3)).max(1.0 / 3.0);
            (growth, refused) = (2.0, 0);
            x = there;
            for (count, stopped) in pushes.iter_mut().zip(&stopped) {
                *count = if *stopped { *count + 1 } else { 0 };
            }
            let held_back = stopped.contains(&true);
            let settled = gained <= tolerance * cost && !held_back;
            cost -= gained;
            if settled {
                return Ok((x, true));
            }
            if let Some(worth) = effort.worth
                && !held_back
                && (kept - 1.0).abs() < STEADY
            {
                let gain = at.within_reach(&residual);
                if gain <= tolerance * cost {
                    return Ok((x, true));
                }
                if (cost - gain).max(0.0).sqrt() > worth {
                    return Ok((x, false));
                }
            }
            if iteration + 1 < iterations {
                at = Linear::of(problem.linearise(&x)?);
            }
        } else {
            refused += 1;
            if refused > REFUSED || promised <= f64::EPSILON * cost {
                return Ok((x, true));
            }
            mu *= growth;
            growth *= 2.0;
        }
    }
    Ok((x, false))
}

/// Residuals near a point, as linear functions.
struct Linear {
    /// `rᵀr`
    cost: f64,
    /// `r` and `J`.
    of: Rc<Linearised>,
    /// `JᵀJ`
    normal: DMatrix<f64>,
    /// `Jᵀr`
    gradient: DVector<f64>,
}

impl Linear {
    fn of(linear: Rc<Linearised>) -> Self {
        Self {
            normal: gram(&linear.jacobian),
            gradient: linear.jacobian.tr_mul(&linear.residual),
            cost: linear.residual.norm_squared(),
            of: linear,
        }
    }

    /// What a full step gains, without bounds, from where the residuals are `residual`.
    fn within_reach(&self, residual: &DVector<f64>) -> f64 {
        let gradient = self.of.jacobian.tr_mul(residual);
        let inverse = pseudo_inverse(&self.normal);
        inverse.map_or(f64::INFINITY, |i| gradient.dot(&(i * &gradient)))
    }
}

/// The nearest point within the bounds.
fn within(x: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    x.zip_zip_map(lower, upper, |x, low, high| x.max(low).min(high))
}

/// The damped step from `x` within its bounds, and the unknowns for which it ends short of them, after the `pushes` before
/// it; none where the equations cannot be solved.
fn step(
    normal: &DMatrix<f64>,
    gradient: &DVector<f64>,
    mu: f64,
    [x, lower, upper]: [&DVector<f64>; 3],
    pushes: &[u32],
) -> Option<(DVector<f64>, Vec<bool>)> {
    let n = x.len();
    let mut stopped = vec![false; n];
    let mut step = DVector::zeros(n);
    let pushed =
        |i: usize| x[i] <= lower[i] && gradient[i] > 0.0 || x[i] >= upper[i] && gradient[i] < 0.0;
    let mut free: Vec<usize> = (0..n).filter(|i| !pushed(*i)).collect();
    loop {
        if free.is_empty() {
            return Some((step, stopped));
        }
        let mut a = normal.select_rows(&free).select_columns(&free);
        for i in 0..free.len() {
            a[(i, i)] += mu;
        }
        // What has gone to its bound changes the gradient of the others.
        let moved = gradient + normal * &step;
        let b = DVector::from_fn(free.len(), |i, _| -moved[free[i]]);
        let p = a.cholesky()?.solve(&b);
        if p.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let way = |i: usize, p: f64| if p > 0.0 { upper[i] } else { lower[i] } - x[i];
        let beyond = |(i, p): &(usize, f64)| p.abs() > way(*i, *p).abs();
        let moves = free.iter().copied().zip(p.iter().copied());
        let (out, kept): (Vec<_>, Vec<_>) = moves.clone().partition(beyond);
        // Those that were stopped often enough, or are at their bound, stay there.
        let (there, short): (Vec<_>, Vec<_>) = out
            .into_iter()
            .partition(|(i, p)| pushes[*i] >= PUSHES || way(*i, *p) == 0.0);
        if there.is_empty() {
            let shares = short.iter().map(|(i, p)| SHORT * way(*i, *p) / p);
            let share = shares.fold(1.0, f64::min);
            for (i, p) in moves {
                step[i] = share * p;
            }
            for (i, _) in short {
                stopped[i] = true;
            }
            return Some((step, stopped));
        }
        for (i, p) in there {
            step[i] = way(i, p);
        }
        free = kept.into_iter().chain(short).map(|(i, _)| i).collect();
        free.sort_unstable();
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;
    use std::convert::Infallible;

    use super::*;

    const EFFORT: Effort = Effort {
        iterations: 100,
        tolerance: 1e-12,
        worth: None,
    };

    type Function = fn(&DVector<f64>) -> (Vec<f64>, Vec<f64>);

    /// Residuals with their derivatives row by row, and how often these were asked for.
    struct Given {
        of: Function,
        linearised: Cell<usize>,
        lower: DVector<f64>,
        upper: DVector<f64>,
    }

    impl LeastSquares for Given {
        type Error = Infallible;

        fn residual(&self, x: &DVector<f64>) -> Result<DVector<f64>, Infallible> {
            Ok(DVector::from_vec((self.of)(x).0))
        }

        fn linearise(&self, x: &DVector<f64>) -> Result<Rc<Linearised>, Infallible> {
            self.linearised.set(self.linearised.get() + 1);
            let (r, j) = (self.of)(x);
            Ok(Rc::new(Linearised {
                at: x.clone(),
                residual: DVector::from_vec(r),
                jacobian: DMatrix::from_row_slice(j.len() / x.len(), x.len(), &j),
            }))
        }

        fn bounds(&self) -> (&DVector<f64>, &DVector<f64>) {
            (&self.lower, &self.upper)
        }
    }

    fn solved(of: Function, start: [f64; 2], bounds: [[f64; 2]; 2]) -> (Vec<f64>, bool) {
        let [lower, upper] = [0, 1].map(|k| DVector::from_fn(2, |i, _| bounds[i][k]));
        let problem = Given {
            of,
            linearised: Cell::new(0),
            lower,
            upper,
        };
        let start = DVector::from_row_slice(&start);
        let Ok((x, settled)) = minimise(&problem, &start, EFFORT);
        (x.as_slice().to_vec(), settled)
    }

    const ANYWHERE: [f64; 2] = [f64::NEG_INFINITY, f64::INFINITY];

    /// H. H. Rosenbrock (1960), with its least at (1, 1).
    fn valley(x: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
        (
            vec![10.0 * (x[1] - x[0] * x[0]), 1.0 - x[0]],
            vec![-20.0 * x[0], 10.0, -1.0, 0.0],
        )
    }

    #[test]
    fn it_follows_a_valley() {
        let (x, settled) = solved(valley, [-1.2, 1.0], [ANYWHERE; 2]);
        assert!(settled);
        assert!(
            (x[0] - 1.0).abs() < 1e-6 && (x[1] - 1.0).abs() < 1e-6,
            "{x:?}"
        );
        // At most 0.5 to the right: y is its square.
        let (x, settled) = solved(valley, [-1.2, 1.0], [[-2.0, 0.5], ANYWHERE]);
        assert!(settled);
        assert!(
            (x[0] - 0.5).abs() < 1e-9 && (x[1] - 0.25).abs() < 1e-6,
            "{x:?}"
        );
    }

    /// A short fit from 0; whether it ended by itself, how far off it ended, and how often derivatives were computed.
    fn short(of: Function, tolerance: f64, worth: Option<f64>) -> (bool, f64, usize) {
        let problem = Given {
            of,
            linearised: Cell::new(0),
            lower: DVector::from_element(2, f64::NEG_INFINITY),
            upper: DVector::from_element(2, f64::INFINITY),
        };
        let effort = Effort {
            tolerance,
            worth,
            ..EFFORT
        };
        let Ok((x, settled)) = minimise(&problem, &DVector::zeros(2), effort);
        let off = (x - DVector::from_element(2, 1.0)).norm();
        (settled, off, problem.linearised.get())
    }

    /// Slightly bent, and zero at (1, 1) but for a rest of 0.01.
    fn bent(x: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
        let (a, b) = (x[0], x[1]);
        (
            vec![a + 0.01 * a * a - 1.01, b - 0.01 * a * b - 0.99, 0.01],
            vec![1.0 + 0.02 * a, 0.0, -0.01 * b, 1.0 - 0.01 * a, 0.0, 0.0],
        )
    }

    #[test]
    fn a_short_fit_ends_without_derivatives_at_its_end() {
        let (settled, off, short_of) = short(bent, 1e-3, Some(f64::INFINITY));
        assert!(settled && off < 1e-3, "{off}");
        let (settled, _, full) = short(bent, 1e-3, None);
        assert!(settled && short_of < full, "{short_of} of {full}");
    }

    /// Beside 100 that nothing removes, the other residual is at most 1.
    #[test]
    fn what_cannot_become_good_enough_is_given_up() {
        let far: Function = |x| {
            (
                vec![100.0, x[0].atan() - 1.0],
                vec![0.0, 0.0, 1.0 / (1.0 + x[0] * x[0]), 0.0],
            )
        };
        assert!(!short(far, 1e-12, Some(50.0)).0);
        assert!(short(far, 1e-12, Some(101.0)).0 && short(far, 1e-12, None).0);
    }

    /// Nearly the same column twice: while the first unknown stays at its bound, the second goes all its way at once.
    fn twins(x: &DVector<f64>) -> (Vec<f64>, Vec<f64>) {
        let (a, b) = (x[0], x[1]);
        (
            vec![a + b - 3.0, 0.01 * (a - b) - 0.02],
            vec![1.0, 1.0, 0.01, -0.01],
        )
    }

    #[test]
    fn an_unknown_at_its_bound_does_not_hold_the_others() {
        // Without bounds (2.5, 0.5).
        let (x, settled) = solved(twins, [1.0, 0.0], [[0.0, 1.0], ANYWHERE]);
        assert!(settled);
        assert_eq!(x[0], 1.0);
        // Along the bound (b - 2)² + 1e-4 (b + 1)² is to be least.
        let b = (2.0 - 1e-4) / (1.0 + 1e-4);
        assert!((x[1] - b).abs() < 1e-6, "{x:?}");
        // From the wrong bound it goes to the other one.
        let (x, _) = solved(twins, [0.0, 0.0], [[0.0, 1.0], ANYWHERE]);
        assert_eq!(x[0], 1.0);
    }

    #[test]
    fn where_nothing_changes_it_stays() {
        let flat: Function = |_| (vec![1.0], vec![0.0, 0.0]);
        assert_eq!(
            solved(flat, [0.3, -4.0], [ANYWHERE; 2]),
            (vec![0.3, -4.0], true)
        );
    }

    /// Where the model has no number a step is made shorter.
    #[test]
    fn it_turns_back_from_where_there_are_no_numbers() {
        let root: Function = |x| {
            let s = x[0].sqrt();
            (vec![s - 0.1, x[1]], vec![0.5 / s, 0.0, 0.0, 1.0])
        };
        let (x, settled) = solved(root, [4.0, 1.0], [ANYWHERE; 2]);
        assert!(settled && (x[0] - 0.01).abs() < 1e-6, "{x:?}");
    }
}
