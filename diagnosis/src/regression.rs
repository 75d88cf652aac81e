//! Regressions over whole recordings.

use loopsight_model::log_map::Hold;
use loopsight_model::model::{Model, pseudo_inverse};
pub(crate) use loopsight_model::regression::Regression;
use loopsight_model::regression::Scheme;
use loopsight_model::run::Run;
use nalgebra::{DMatrix, DVector};

use crate::error::FitError;
use crate::progress::{Cancelled, Work};
use crate::speeds::Speeds;

/// Calls `each(row, time, φ, y)` for every regression that the samples of `runs` give, read as `speeds` say.
///
/// A sample less than `span` s after the last one used is skipped, and its inputs are averaged into the next: a
/// difference over a longer time has less noise.
pub(crate) fn for_each_row(
    regression: &mut Regression,
    speeds: &Speeds<'_>,
    runs: &[Run],
    span: f64,
    work: &Work<'_>,
    mut each: impl FnMut(usize, f64, &[f64], f64),
) -> Result<(), Cancelled> {
    let mut offset = 0.0;
    for run in runs {
        regression.restart();
        let mut input = vec![0.0; run.n_inputs()];
        let mut last = 0;
        let mut read = Vec::new();
        for k in 0..run.len() {
            work.go_on()?;
            if k > 0 && run.time()[k] - run.time()[last] < span {
                continue;
            }
            // The mean of what was applied since the last sample used.
            input.fill(0.0);
            let elapsed = run.time()[k] - run.time()[last];
            for i in last..k {
                let share = (run.time()[i + 1] - run.time()[i]) / elapsed;
                let ends = run.input(i).iter().zip(run.input(i + 1));
                for (index, (mean, (value, next))) in input.iter_mut().zip(ends).enumerate() {
                    *mean += share
                        * match regression.hold(index) {
                            Hold::ZeroOrder => *value,
                            Hold::FirstOrder => 0.5 * (value + next),
                        };
                }
            }
            speeds.read(run, last, k, &mut read);
            last = k;
            if regression.push(run.time()[k], &read, &input) {
                for row in 0..regression.len() {
                    let (phi, y) = regression.row(row);
                    each(row, offset + run.time()[k], phi, y);
                }
            }
        }
        offset += run.duration();
    }
    Ok(())
}

/// Ordinary least squares over all samples: a starting point for a fit that needs one.
///
/// Parameters that are free but enter non-linearly, and those that move the rate of no state that is measured, keep the model's
/// value, or have the typical size of their declaration. Values that the samples do not determine are those of least norm. For `span` see
/// [`for_each_row`]. What differs from run to run has one value for all of them.
pub(crate) fn batch(
    model: &Model,
    runs: &[Run],
    scheme: Scheme,
    span: f64,
    work: &Work<'_>,
) -> Result<Vec<f64>, FitError> {
    let mut linear = model.shared().into_owned();
    for parameter in &mut linear.parameters {
        if parameter.free && !parameter.declaration.linear {
            let size = parameter.declaration.nearest(parameter.scale());
            parameter.value = parameter.value.or(Some(size));
            parameter.free = false;
        }
    }
    let speeds = Speeds::of(&linear);
    let mut regression = Regression::new(&speeds.model, scheme)?;
    let normals = normal_equations(&mut regression, &speeds, runs, span, work)?;
    let mut values: Vec<f64> = (linear.parameters.iter().zip(0..))
        .map(|(p, index)| {
            let known = p.value.or(linear.tie(index).map(|_| 0.0));
            known.unwrap_or_else(|| p.declaration.nearest(p.scale()))
        })
        .collect();
    let mut told = vec![0.0; values.len()];
    for (row, normal) in normals.iter().enumerate() {
        if let Some(theta) = normal.solution() {
            normal.tell(&theta, regression.parameters(row), &mut told, &mut values);
        }
    }
    Ok(values)
}

/// The normal equations of the regression of a row.
pub(crate) struct Normal {
    /// Sum of φφᵀ.
    gram: DMatrix<f64>,
    /// Sum of φy.
    right: DVector<f64>,
    /// Sum of y².
    square: f64,
}

impl Normal {
    fn zeros(parameters: usize) -> Self {
        Self {
            gram: DMatrix::zeros(parameters, parameters),
            right: DVector::zeros(parameters),
            square: 0.0,
        }
    }

    fn add(&mut self, phi: &[f64], y: f64) {
        for (i, a) in phi.iter().enumerate() {
            self.right[i] += a * y;
            for (j, b) in phi.iter().enumerate() {
                self.gram[(i, j)] += a * b;
            }
        }
        self.square += y * y;
    }

    /// The values of least norm that leave least.
    pub(crate) fn solution(&self) -> Option<DVector<f64>> {
        Some(pseudo_inverse(&self.gram)? * &self.right)
    }

    /// Sum of squares that the values `theta` leave.
    pub(crate) fn left(&self, theta: &DVector<f64>) -> f64 {
        self.square - 2.0 * theta.dot(&self.right) + theta.dot(&(&self.gram * theta))
    }

    /// Puts `theta` into the `values` of the `parameters` of this row. A parameter that is tied to another one's row is in both.
    /// The row that determines it better counts: `told` is how well each is determined so far.
    pub(crate) fn tell(
        &self,
        theta: &DVector<f64>,
        parameters: &[usize],
        told: &mut [f64],
        values: &mut [f64],
    ) {
        for (k, j) in parameters.iter().enumerate() {
            if self.gram[(k, k)] >= told[*j] {
                told[*j] = self.gram[(k, k)];
                values[*j] = theta[k];
            }
        }
    }
}

/// The normal equations of each row of a `regression`, see [`for_each_row`].
pub(crate) fn normal_equations(
    regression: &mut Regression,
    speeds: &Speeds,
    runs: &[Run],
    span: f64,
    work: &Work<'_>,
) -> Result<Vec<Normal>, FitError> {
    let mut normals: Vec<Normal> = (0..regression.len())
        .map(|row| Normal::zeros(regression.parameters(row).len()))
        .collect();
    for_each_row(regression, speeds, runs, span, work, |row, _, phi, y| {
        normals[row].add(phi, y);
    })?;
    Ok(normals)
}
