//! Parameters, and combinations of parameters, that the data do not determine.

use nalgebra::{DMatrix, DVector};

use crate::criteria::ParameterCriteria;
use crate::estimate::ParameterVerdict;
use crate::problem::Problem;

/// A parameter among the unknowns of a fit.
pub(crate) struct Named<'a> {
    pub(crate) name: &'a str,
    /// Scale of its declaration.
    pub(crate) declared: f64,
    /// Parameter = unknown × scale.
    pub(crate) scale: f64,
}

/// Directions in which the data say nothing.
pub(crate) struct Flatness {
    /// Unknowns without influence.
    pub(crate) dead: Vec<bool>,
    /// Unknowns of which only a combination is determined.
    pub(crate) flat: Vec<bool>,
    /// The combinations, in words.
    pub(crate) words: Vec<String>,
    vectors: DMatrix<f64>,
    values: DVector<f64>,
    /// Eigenvalue, the square of a singular value, up to which a direction is flat.
    least: f64,
}

impl Flatness {
    /// What a fit says of an unknown that the data do not determine; none where they do.
    pub(crate) fn is_open(&self, unknown: usize) -> Option<ParameterVerdict> {
        let of = |list: &[bool]| list.get(unknown) == Some(&true);
        match (of(&self.dead), of(&self.flat)) {
            (true, _) => Some(ParameterVerdict::Dead),
            (_, true) => Some(ParameterVerdict::Flat),
            _ => None,
        }
    }
}

impl Problem<'_> {
    /// The directions that `JᵀJ` does not determine, and the inverse of the others.
    pub(crate) fn flat(&self, gram: &DMatrix<f64>) -> (Flatness, DMatrix<f64>) {
        let norms: Vec<f64> = (0..gram.ncols()).map(|i| gram[(i, i)].sqrt()).collect();
        let criteria = &self.work.criteria().parameters;
        let flatness = Flatness::of(gram, &norms, &self.named(), criteria);
        let inverse = flatness.inverse(&norms);
        (flatness, inverse)
    }
}

impl Flatness {
    /// Finds them from `JᵀJ` and its columns' norms; the first unknowns are the `named` ones.
    pub(crate) fn of(
        gram: &DMatrix<f64>,
        norms: &[f64],
        named: &[Named<'_>],
        criteria: &ParameterCriteria,
    ) -> Self {
        let least = criteria.flat * criteria.flat;
        let n = norms.len();
        // The unknowns are scaled by their influence, but whether one is dead is decided on the scale of its
        // declaration.
        let dead: Vec<bool> = norms
            .iter()
            .enumerate()
            .map(|(i, norm)| {
                let natural = named.get(i).map_or(1.0, |p| p.declared / p.scale);
                *norm * natural <= criteria.dead || !norm.is_finite()
            })
            .collect();
        let mut normalised = gram.clone();
        for i in 0..n {
            for j in 0..n {
                normalised[(i, j)] = if dead[i] || dead[j] {
                    f64::from(u8::from(i == j))
                } else {
                    gram[(i, j)] / (norms[i] * norms[j])
                };
            }
        }
        let eigen = normalised.symmetric_eigen();
        let mut flat = vec![false; n];
        let mut words = Vec::new();
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            if *value > least {
                continue;
            }
            let mut terms = Vec::new();
            for (i, parameter) in named.iter().enumerate() {
                let share = eigen.eigenvectors[(i, k)];
                if share.abs() > criteria.part_of_flat {
                    flat[i] = true;
                    let change = share / norms[i] * parameter.scale;
                    terms.push((parameter.name, change));
                }
            }
            let largest = terms.iter().fold(0.0f64, |a, (_, c)| a.max(c.abs()));
            let text: Vec<String> = terms
                .iter()
                .map(|(name, change)| format!("{:+.3} {name}", change / largest))
                .collect();
            if !text.is_empty() {
                words.push(format!("moving along {} changes nothing", text.join(" ")));
            }
        }
        Self {
            dead,
            flat,
            words,
            vectors: eigen.eigenvectors,
            values: eigen.eigenvalues,
            least,
        }
    }

    /// `(JᵀJ)⁻¹` without the flat directions.
    pub(crate) fn inverse(&self, norms: &[f64]) -> DMatrix<f64> {
        let n = norms.len();
        let mut inverse = DMatrix::zeros(n, n);
        for (k, value) in self.values.iter().enumerate() {
            if *value > self.least {
                let v = self.vectors.column(k);
                inverse += v * v.transpose() / *value;
            }
        }
        for i in 0..n {
            for j in 0..n {
                inverse[(i, j)] = if self.dead[i] || self.dead[j] {
                    0.0
                } else {
                    inverse[(i, j)] / (norms[i] * norms[j])
                };
            }
        }
        inverse
    }
}
