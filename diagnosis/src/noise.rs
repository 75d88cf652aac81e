//! Standard errors in coloured noise.

use nalgebra::DMatrix;

use crate::progress::{Cancelled, Work};
use crate::window::{bartlett, lags};

/// A first-order noise model `e(k) = a e(k-1) + ε(k) + c ε(k-1)` with white `ε`.
///
/// Rounding to encoder counts and differencing gives `a = 0, c = -1`; a model error that lasts
/// gives `a` near 1. (G. E. P. Box, G. M. Jenkins, 1976, "Time Series Analysis", section 3.4; the
/// parameters by conditional least squares, chapter 7.)
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Arma {
    pub(crate) a: f64,
    pub(crate) c: f64,
    /// Variance of `ε`.
    pub(crate) variance: f64,
}

/// Largest magnitude of `a`: at 1 the noise would have no finite variance.
const LARGEST_A: f64 = 0.999;

impl Arma {
    /// Fits the model to the residuals of several runs (missing samples are zero).
    pub(crate) fn fit(series: &[&[f64]], work: &Work<'_>) -> Result<Self, Cancelled> {
        let n: usize = series.iter().map(|s| s.len()).sum();
        if n < 10 {
            let variance = series
                .iter()
                .flat_map(|s| s.iter())
                .map(|e| e * e)
                .sum::<f64>()
                / n.max(1) as f64;
            return Ok(Self {
                a: 0.0,
                c: 0.0,
                variance,
            });
        }
        // The surface is smooth but has a ridge along a = -c: a coarse grid, then a pattern search.
        let mut best = (f64::INFINITY, 0.0, 0.0);
        for a in [-0.6, 0.0, 0.5, 0.9, 0.98] {
            let points = [-1.0, -0.9, -0.5, 0.0, 0.5].map(|c| (a, c));
            best = least(series, points, best, work)?;
        }
        let mut step: f64 = 0.2;
        while step > 1e-4 {
            let (_, a, c) = best;
            let points = [
                (1., 0.),
                (-1., 0.),
                (0., 1.),
                (0., -1.),
                (1., 1.),
                (-1., -1.),
                (1., -1.),
                (-1., 1.),
            ];
            let points = points.map(|(da, dc)| {
                let a: f64 = a + da * step;
                let c: f64 = c + dc * step;
                (a.clamp(-LARGEST_A, LARGEST_A), c.clamp(-1.0, 0.99))
            });
            let better = least(series, points, best, work)?;
            if better.0 < best.0 {
                best = better;
            } else {
                step *= 0.5;
            }
        }
        Ok(Self {
            a: best.1,
            c: best.2,
            variance: best.0 / n as f64,
        })
    }

    /// `ε = H⁻¹ e`.
    pub(crate) fn whiten(&self, e: &[f64]) -> Vec<f64> {
        let (mut e_before, mut eps) = (0.0, 0.0);
        e.iter()
            .map(|e| {
                eps = e - self.a * e_before - self.c * eps;
                e_before = *e;
                eps
            })
            .collect()
    }

    /// Transposed colouring: `Hᵀ j` with `e = H ε`, in place. With it
    /// `jᵀ cov(e) j = variance · |Hᵀ j|²`.
    pub(crate) fn transpose(&self, j: &mut [f64]) {
        // H = (I - a L)⁻¹ (I + c L), so Hᵀ = (I + c Lᵀ)(I - a Lᵀ)⁻¹ runs backwards in time.
        let mut later = 0.0;
        for value in j.iter_mut().rev() {
            *value += self.a * later;
            later = *value;
        }
        for k in 0..j.len() {
            let next = j.get(k + 1).copied().unwrap_or(0.0);
            j[k] += self.c * next;
        }
    }
}

/// The least sum of squares `Σ ε²` with its `a` and `c`: that of `best`, or of some points.
///
/// All points are computed in one pass, side by side: each waits for its last `ε`, and the machine computes the others
/// meanwhile.
fn least<const N: usize>(
    series: &[&[f64]],
    points: [(f64, f64); N],
    mut best: (f64, f64, f64),
    work: &Work<'_>,
) -> Result<(f64, f64, f64), Cancelled> {
    work.go_on()?;
    let mut squares = [0.0; N];
    for s in series {
        let (mut e_before, mut eps, mut sums) = (0.0, [0.0; N], [0.0; N]);
        for e in *s {
            for (((a, c), eps), sum) in points.iter().zip(&mut eps).zip(&mut sums) {
                *eps = e - a * e_before - c * *eps;
                *sum += *eps * *eps;
            }
            e_before = *e;
        }
        for (all, sum) in squares.iter_mut().zip(sums) {
            *all += sum;
        }
    }
    for (value, (a, c)) in squares.into_iter().zip(points) {
        if value < best.0 {
            best = (value, a, c);
        }
    }
    Ok(best)
}

/// Residuals and sensitivities of one signal in one run.
pub(crate) struct Block {
    /// Residuals by sample.
    pub(crate) residual: Vec<f64>,
    /// Sensitivities: samples × unknowns, weighted as in the fit.
    pub(crate) jacobian: DMatrix<f64>,
}

/// The noise model of each of so many signals, whose residuals are in the blocks of some runs.
pub(crate) fn models(
    runs: &[Vec<Block>],
    n_signals: usize,
    work: &Work<'_>,
) -> Result<Vec<Arma>, Cancelled> {
    let of_signal = |signal: usize| {
        let series = runs.iter().map(|blocks| &*blocks[signal].residual);
        Arma::fit(&series.collect::<Vec<_>>(), work)
    };
    (0..n_signals).map(of_signal).collect()
}

/// Covariance of a least-squares estimate when the noise of the signals is coloured:
/// `(JᵀJ)⁻¹ Jᵀ cov(e) J (JᵀJ)⁻¹`.
///
/// A noise model [`Arma`] for each signal removes most of the colour from the residuals: `ε = H⁻¹ e` and
/// `h = Hᵀ J`, so that `Jᵀ e = Σ_k s(k)` with the scores `s(k) = Σ_i h_i(k) ε_i(k)` over the signals `i`. Some
/// colour is left: rounding at constant speed is periodic, signals of the same encoders are rounded together,
/// and noise is larger in motion than at rest. The autocovariance of the scores accounts for it, weighted by
/// Bartlett's window:
///
/// ```text
/// Jᵀ cov(e) J ≈ Σ_|l|<=L (1 - |l|/(L+1)) Σ_k s(k) s(k-l)ᵀ
/// ```
///
/// (T. Söderström, P. Stoica, 1989, "System Identification", section 7.4, for the estimate;
/// prewhitening as D. W. K. Andrews, J. C. Monahan, 1992, Econometrica 60, 953–966, scores and
/// window as W. K. Newey, K. D. West, 1987, Econometrica 55, 703–708.)
///
/// `inverse_gram` is `(JᵀJ)⁻¹` or its pseudo-inverse; each run has one block per signal, and each signal its model among
/// the `models` of the noise.
pub(crate) fn covariance(
    runs: &[Vec<Block>],
    models: &[Arma],
    inverse_gram: &DMatrix<f64>,
    unknowns: usize,
    work: &Work<'_>,
) -> Result<DMatrix<f64>, Cancelled> {
    let n_signals = models.len();
    let samples: usize = runs.iter().flatten().map(|b| b.residual.len()).sum();
    let per_signal = samples / n_signals.max(1);
    let criteria = &work.criteria().window;
    let lags = lags(criteria.error_lags, per_signal, criteria.error_most).min(per_signal / 4);
    let columns = inverse_gram.ncols();
    let mut meat = DMatrix::<f64>::zeros(columns, columns);
    for blocks in runs {
        // The initial states of the other runs move nothing here.
        let moves = |column: &usize| {
            let mut blocks = blocks.iter();
            blocks.any(|block| block.jacobian.column(*column).iter().any(|v| *v != 0.0))
        };
        let own: Vec<usize> = (0..columns).filter(moves).collect();
        // One column per sample.
        let mut scores = DMatrix::<f64>::zeros(own.len(), blocks[0].residual.len());
        for (block, model) in blocks.iter().zip(models) {
            let white = model.whiten(&block.residual);
            for (mut row, column) in scores.row_iter_mut().zip(&own) {
                let mut h = block.jacobian.column(*column).into_owned();
                model.transpose(h.as_mut_slice());
                for ((score, h), eps) in row.iter_mut().zip(h.iter()).zip(&white) {
                    *score += h * eps;
                }
            }
        }
        let n = scores.ncols();
        let mut products = &scores * scores.transpose();
        for lag in 1..=lags.min(n.saturating_sub(1)) {
            work.go_on()?;
            let weight = bartlett(lag, lags);
            let product =
                scores.columns(lag, n - lag) * scores.columns(0, n - lag).transpose() * weight;
            products += product.transpose();
            products += product;
        }
        for (i, row) in own.iter().enumerate() {
            for (j, column) in own.iter().enumerate() {
                meat[(*row, *column)] += products[(i, j)];
            }
        }
    }
    // Degrees of freedom that the fit has used up.
    meat *= samples as f64 / (samples.saturating_sub(unknowns)).max(1) as f64;
    Ok(inverse_gram * meat * inverse_gram)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::white;

    #[test]
    fn differenced_rounding_is_recognised() {
        let q = white(3001, 1);
        let e: Vec<f64> = q.windows(2).map(|w| w[1] - w[0]).collect();
        let model = Arma::fit(&[&e], &Work::quiet()).unwrap();
        assert!(model.a.abs() < 0.1 && model.c < -0.97, "{model:?}");
        assert!((model.variance - 1.0 / 12.0).abs() < 0.01, "{model:?}");
    }

    #[test]
    fn a_slow_disturbance_is_recognised() {
        let mut e = white(4000, 2);
        for k in 1..e.len() {
            e[k] += 0.9 * e[k - 1];
        }
        let model = Arma::fit(&[&e], &Work::quiet()).unwrap();
        assert!(
            (model.a - 0.9).abs() < 0.03 && model.c.abs() < 0.1,
            "{model:?}"
        );
    }

    /// `jᵀ cov(e) j` against the covariance matrix written out.
    #[test]
    fn transposed_colouring_gives_the_quadratic_form() {
        let model = Arma {
            a: 0.6,
            c: -0.3,
            variance: 1.0,
        };
        let n = 12;
        let mut h = DMatrix::<f64>::zeros(n, n);
        for column in 0..n {
            let (mut e_before, mut eps_before) = (0.0, 0.0);
            for row in 0..n {
                let eps = if row == column { 1.0 } else { 0.0 };
                let e = model.a * e_before + eps + model.c * eps_before;
                h[(row, column)] = e;
                (e_before, eps_before) = (e, eps);
            }
        }
        let j = white(n, 3);
        let expected = (h.transpose() * nalgebra::DVector::from_vec(j.clone())).norm_squared();
        let mut coloured = j;
        model.transpose(&mut coloured);
        let got: f64 = coloured.iter().map(|v| v * v).sum();
        assert!((got - expected).abs() < 1e-12 * expected);
    }
}
