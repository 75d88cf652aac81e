//! The nearest point of a box, in the metric of a covariance.

use crate::Real;

/// Sweeps over the bounds; what is left after them is cut off.
const SWEEPS: usize = 32;

/// Replaces `theta` by the point of the box that is nearest in the metric of `covariance⁻¹`; false
/// when it was inside already.
///
/// ```text
/// min (ϑ - ϑ̂)ᵀ P⁻¹ (ϑ - ϑ̂)  subject to  low ≤ ϑ ≤ high
/// ϑ = ϑ̂ - P λ        λ_i > 0 at an upper bound, < 0 at a lower one, 0 within
/// ```
///
/// The multipliers `λ` (as long as `theta`, any content) are found one after the other, each so that
/// its own bound holds. Where `covariance` has no usable diagonal entry, that parameter alone is
/// taken to its bound. The result is within the box to the last digit.
///
/// Reference: C. Hildreth (1957), "A quadratic programming procedure", Naval Research Logistics
/// Quarterly 4, 79–85; G. C. Goodwin, K. S. Sin (1984), "Adaptive Filtering, Prediction and Control",
/// section 3.7.
pub(super) fn into_box<S: Real>(
    theta: &mut [S],
    covariance: &[S],
    low: &[S],
    high: &[S],
    multipliers: &mut [S],
) -> bool {
    let n = theta.len();
    if (0..n).all(|i| theta[i] >= low[i] && theta[i] <= high[i]) {
        return false;
    }
    multipliers.fill(S::zero());
    if covariance.iter().all(|v| v.is_finite()) {
        for _ in 0..SWEEPS {
            let mut moved = false;
            for i in 0..n {
                let variance = covariance[i * n + i];
                if variance <= S::zero() {
                    continue;
                }
                let before = multipliers[i];
                let above = before + (theta[i] - high[i]) / variance;
                let below = before + (theta[i] - low[i]) / variance;
                let after = if above > S::zero() {
                    above
                } else if below < S::zero() {
                    below
                } else {
                    S::zero()
                };
                let change = after - before;
                if change != S::zero() {
                    let reach = (change * variance).abs();
                    moved |= reach > S::of(1e-6) * (S::one() + theta[i].abs());
                    multipliers[i] = after;
                    for (k, value) in theta.iter_mut().enumerate() {
                        *value -= covariance[i * n + k] * change;
                    }
                }
            }
            if !moved {
                break;
            }
        }
    }
    for i in 0..n {
        theta[i] = theta[i].clamp(low[i], high[i]);
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bound_moves_what_is_correlated_with_it() {
        // P with correlation 0.9: taking the first from 2 to 1 takes the second by 0.9.
        let p = [1.0, 0.9, 0.9, 1.0];
        let mut theta = [2.0, 0.0];
        let free = [-1e9; 2];
        assert!(into_box(&mut theta, &p, &free, &[1.0, 1e9], &mut [0.0; 2]));
        assert!((theta[0] - 1.0f64).abs() < 1e-12 && (theta[1] + 0.9).abs() < 1e-12);
        let inside = theta;
        assert!(!into_box(&mut theta, &p, &free, &[1.0, 1e9], &mut [0.0; 2]));
        assert_eq!(theta, inside);
    }

    /// Against a search over the box.
    #[test]
    fn two_bounds_give_the_nearest_point() {
        let p = [2.0, -0.8, -0.8, 0.5];
        let [a, b, d] = [0.5, 0.8, 2.0].map(|v| v / (2.0 * 0.5 - 0.8 * 0.8));
        let start = [1.7, -2.0];
        let (low, high) = ([-1.0, -1.0], [1.0, 1.0]);
        let cost = |x: f64, y: f64| {
            let (x, y) = (x - start[0], y - start[1]);
            a * x * x + 2.0 * b * x * y + d * y * y
        };
        let mut theta = start;
        assert!(into_box(&mut theta, &p, &low, &high, &mut [0.0; 2]));
        let found = cost(theta[0], theta[1]);
        for i in 0..=200 {
            for j in 0..=200 {
                let (x, y) = (f64::from(i) / 100.0 - 1.0, f64::from(j) / 100.0 - 1.0);
                assert!(found <= cost(x, y) + 1e-6, "{theta:?} against {x} {y}");
            }
        }
    }

    #[test]
    fn without_a_covariance_each_goes_to_its_own_bound() {
        let mut theta = [3.0f32, -5.0, 0.5];
        let nan = [f32::NAN; 9];
        let (low, high) = ([-1.0; 3], [1.0, f32::INFINITY, 1.0]);
        assert!(into_box(&mut theta, &nan, &low, &high, &mut [0.0; 3]));
        assert_eq!(theta, [1.0, -1.0, 0.5]);
    }
}
