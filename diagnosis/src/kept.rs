//! The free runs that a fit ended with, so that who judges it need not simulate them again.

use nalgebra::DVector;

use crate::prediction::Solution;

/// The free runs of the solution of least error so far.
#[derive(Default)]
pub(crate) struct Kept(Option<Runs>);

struct Runs {
    /// The root of the cost.
    error: f64,
    solution: Solution,
    predicted: Vec<Vec<f64>>,
}

impl Kept {
    /// Keeps what was `predicted` with these values, run by run and row by row, where none had a smaller error.
    pub(crate) fn keep(
        &mut self,
        error: f64,
        values: &[f64],
        states: &[DVector<f64>],
        predicted: Vec<Vec<f64>>,
    ) {
        if error.is_finite() && self.0.as_ref().is_none_or(|best| error < best.error) {
            let (values, states) = (values.to_vec(), states.to_vec());
            self.0 = Some(Runs {
                error,
                solution: Solution { values, states },
                predicted,
            });
        }
    }

    /// The free runs of a solution; none where those of another one are kept.
    pub(crate) fn of(self, solution: &Solution) -> Option<Vec<Vec<f64>>> {
        let runs = self.0.filter(|runs| runs.solution == *solution)?;
        Some(runs.predicted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_runs_of_the_least_error_are_kept() {
        let solution = |value: f64| Solution {
            values: vec![value],
            states: vec![DVector::zeros(1)],
        };
        let kept = || {
            let mut kept = Kept::default();
            for (error, value) in [(0.3, 1.0), (0.1, 2.0), (0.2, 3.0), (f64::NAN, 4.0)] {
                kept.keep(error, &[value], &solution(value).states, vec![vec![value]]);
            }
            kept
        };
        assert_eq!(kept().of(&solution(2.0)), Some(vec![vec![2.0]]));
        assert_eq!(kept().of(&solution(3.0)), None);
        assert_eq!(Kept::default().of(&solution(1.0)), None);
    }
}
