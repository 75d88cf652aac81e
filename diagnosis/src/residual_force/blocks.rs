//! Least squares, cross-validated on blocks of time.

use loopsight_model::run::Run;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::response::Responses;
use crate::progress::{Cancelled, Work};

/// Shortest and longest block, s.
const BLOCK: (f64, f64) = (0.4, 2.5);
/// Least samples of a block. Of a plant that is sampled every second fewer would be held out within one and the same motion,
/// and what their neighbours say of them is no test.
const SAMPLES: f64 = 40.0;
/// Blocks in all, about.
const BLOCKS: f64 = 40.0;
/// Every so many blocks one is left out of a fit.
const FOLDS: usize = 4;
/// Weight of a coefficient of zero, as a share of the weight of the samples. It decides where terms and the
/// model's own parameters do the same.
pub(super) const RIDGE: f64 = 1e-7;

/// Sums of products by block of time.
pub(super) struct Blocks {
    gram: Vec<DMatrix<f64>>,
    right: Vec<DVector<f64>>,
    /// Sum of squares of the values to explain.
    square: Vec<f64>,
    /// Number of residuals.
    rows: f64,
    /// Number of the first columns that stay at zero by [`RIDGE`] alone.
    known: usize,
    /// Weight of staying at zero of the other columns, as a share of each column's own square.
    ridge: f64,
}

/// Block of each sample.
fn blocks(runs: &[Run]) -> (Vec<usize>, usize) {
    let duration: f64 = runs.iter().map(Run::duration).sum();
    let samples: usize = runs.iter().map(Run::len).sum();
    let least = SAMPLES * duration / samples.max(1) as f64;
    let length = (duration / BLOCKS).clamp(BLOCK.0, BLOCK.1).max(least);
    let mut all = Vec::new();
    let mut first = 0;
    for run in runs {
        let mut last = first;
        for time in run.time() {
            last = first + ((time - run.time()[0]) / length) as usize;
            all.push(last);
        }
        first = last + 1;
    }
    (all, first)
}

impl Blocks {
    /// `ridge` is the weight of staying at zero, as a share of each column's own square, of all columns beyond the first `known`. It
    /// keeps the coefficients small of columns that are dependent, or zero in the fitting data.
    pub(super) fn new(
        responses: &Responses,
        runs: &[Run],
        (known, ridge): (usize, f64),
        work: &Work<'_>,
    ) -> Result<Self, Cancelled> {
        let (block, n) = blocks(runs);
        let per_sample = if block.is_empty() {
            1
        } else {
            responses.innovations.len() / block.len()
        };
        let mut parts = Vec::with_capacity(n);
        let mut from = 0;
        for part in block.chunk_by(|a, b| a == b) {
            let rows = part.len() * per_sample;
            parts.push((from, rows));
            from += rows;
        }
        let products = |(from, rows): (usize, usize)| {
            work.go_on()?;
            let x = responses.columns.rows(from, rows);
            let y = responses.innovations.rows(from, rows);
            let transposed = x.transpose();
            Ok((&transposed * x, &transposed * y))
        };
        let (gram, right) = (parts.par_iter().copied().map(products))
            .collect::<Result<Vec<_>, Cancelled>>()?
            .into_iter()
            .unzip();
        let square = |(from, rows): &(usize, usize)| {
            let y = responses.innovations.rows(*from, *rows);
            y.norm_squared()
        };
        Ok(Self {
            gram,
            right,
            square: parts.iter().map(square).collect(),
            rows: responses.innovations.iter().filter(|v| **v != 0.0).count() as f64,
            known,
            ridge,
        })
    }

    /// Best coefficients of `columns` over all blocks but each `fold`-th of the folds, and the
    /// inverse of their Gram matrix.
    fn fit(
        &self,
        columns: &[usize],
        without: Option<usize>,
    ) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let n = columns.len();
        let mut gram: DMatrix<f64> = DMatrix::zeros(n, n);
        let mut right: DVector<f64> = DVector::zeros(n);
        for (block, (g, r)) in self.gram.iter().zip(&self.right).enumerate() {
            if without == Some(block % FOLDS) {
                continue;
            }
            for (i, a) in columns.iter().enumerate() {
                right[i] += r[*a];
                for (j, b) in columns.iter().enumerate() {
                    gram[(i, j)] += g[(*a, *b)];
                }
            }
        }
        // Columns are scaled to one size, taken over all blocks.
        let scale = DVector::from_fn(n, |i, _| {
            let of = (columns[i], columns[i]);
            let square: f64 = self.gram.iter().map(|g| g[of]).sum();
            if square > 0.0 {
                square.sqrt().recip()
            } else {
                0.0
            }
        });
        let mut scaled = gram;
        for i in 0..n {
            for j in 0..n {
                scaled[(i, j)] *= scale[i] * scale[j];
            }
            scaled[(i, i)] += match columns[i] {
                _ if scale[i] <= 0.0 => 1.0,
                column if column < self.known => RIDGE,
                _ => self.ridge,
            };
        }
        let inverse = Cholesky::new(scaled)?.inverse();
        let inverse = DMatrix::from_fn(n, n, |i, j| inverse[(i, j)] * scale[i] * scale[j]);
        Some((&inverse * right, inverse))
    }

    /// The share of a column's square that `others` cannot make.
    pub(super) fn own_share(&self, column: usize, others: &[usize]) -> f64 {
        let columns: Vec<usize> = others.iter().copied().chain([column]).collect();
        let square: f64 = self.gram.iter().map(|g| g[(column, column)]).sum();
        let own = self.fit(&columns, None).map(|(_, inverse)| {
            let last = columns.len() - 1;
            (inverse[(last, last)] * square).recip()
        });
        own.filter(|share| share.is_finite()).unwrap_or(0.0)
    }

    /// Best coefficients over all blocks, with standard errors.
    pub(super) fn solve(&self, columns: &[usize]) -> Option<Vec<(f64, f64)>> {
        let (coefficients, inverse) = self.fit(columns, None)?;
        let left: f64 = (0..self.gram.len())
            .map(|block| self.left(block, columns, &coefficients))
            .sum();
        let freedom = (self.rows - columns.len() as f64).max(1.0);
        let variance = left / freedom;
        Some(
            coefficients
                .iter()
                .enumerate()
                .map(|(i, c)| (*c, (variance * inverse[(i, i)]).max(0.0).sqrt()))
                .collect(),
        )
    }

    fn left(&self, block: usize, columns: &[usize], coefficients: &DVector<f64>) -> f64 {
        let mut left = self.square[block];
        for (i, a) in columns.iter().zip(coefficients.iter()) {
            left -= 2.0 * a * self.right[block][*i];
            for (j, b) in columns.iter().zip(coefficients.iter()) {
                left += a * b * self.gram[block][(*i, *j)];
            }
        }
        left
    }

    /// Sum of squares left in each block by coefficients that were found without it.
    pub(super) fn unseen(&self, columns: &[usize]) -> Vec<f64> {
        let fits: Vec<_> = (0..FOLDS)
            .map(|fold| self.fit(columns, Some(fold)))
            .collect();
        (0..self.gram.len())
            .map(|block| match &fits[block % FOLDS] {
                Some((coefficients, _)) => self.left(block, columns, coefficients),
                None => self.square[block],
            })
            .collect()
    }
}

/// By how much the second of two series of losses is less: the sum of the differences, and how many standard errors it
/// is from nothing. Losses are squares: what matters more and more with time makes a few blocks gain most of the sum, and
/// their scatter would hide it. So the mean of the signed roots of the differences is tested, which scatter less.
pub(super) fn gain(before: &[f64], after: &[f64]) -> (f64, f64) {
    let n = before.len().min(after.len());
    let differences: Vec<f64> = before.iter().zip(after).map(|(a, b)| a - b).collect();
    let sum: f64 = differences.iter().sum();
    if n < 2 {
        return (sum, 0.0);
    }
    let roots = || differences.iter().map(|d| d.signum() * d.abs().sqrt());
    let mean = roots().sum::<f64>() / n as f64;
    let squares: f64 = roots().map(|r| (r - mean).powi(2)).sum();
    let error = (squares / (n * (n - 1)) as f64).sqrt();
    (sum, if error > 0.0 { mean / error } else { 0.0 })
}
