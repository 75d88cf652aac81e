//! One full Gauss–Newton step: the cost that it predicts, and the values it leads to.

use loopsight_model::model::pseudo_inverse;
use nalgebra::DVector;

use crate::gram::gram;
use crate::problem::Problem;
use crate::progress::Cancelled;

impl Problem<'_> {
    /// Cost at `values`, and the one that a full Gauss–Newton step would reach if the model were linear
    /// in its unknowns.
    ///
    /// None where there is no such step.
    pub(crate) fn promise(
        &self,
        values: &[f64],
        states: &[DVector<f64>],
    ) -> Result<Option<(f64, f64)>, Cancelled> {
        self.promise_at(&self.pack(values, states))
    }

    /// The same at scaled unknowns.
    pub(crate) fn promise_at(&self, at: &DVector<f64>) -> Result<Option<(f64, f64)>, Cancelled> {
        let linear = self.linearise(at)?;
        let (residual, jacobian) = (&linear.residual, &linear.jacobian);
        let gram = gram(jacobian);
        let right = jacobian.tr_mul(residual);
        let Some(inverse) = pseudo_inverse(&gram) else {
            return Ok(None);
        };
        let step = inverse * &right;
        let before = residual.norm_squared();
        let after = before - right.dot(&step);
        Ok(after.is_finite().then_some((before, after.max(0.0))))
    }

    /// The values that a full Gauss–Newton step from `values` leads to, those at `fixed` as they are.
    /// None where there is no such step.
    pub(crate) fn stride(
        &self,
        values: &[f64],
        states: &[DVector<f64>],
        fixed: &[usize],
    ) -> Result<Option<Vec<f64>>, Cancelled> {
        let start = self.pack(values, states);
        let linear = self.linearise(&start)?;
        let (residual, mut jacobian) = (&linear.residual, linear.jacobian.clone());
        for (column, index) in self.free.iter().enumerate() {
            if fixed.contains(index) {
                jacobian.column_mut(column).fill(0.0);
            }
        }
        let Some(inverse) = pseudo_inverse(&jacobian.tr_mul(&jacobian)) else {
            return Ok(None);
        };
        let step = inverse * jacobian.tr_mul(residual);
        let (mut values, _) = self.unpack(&(start - step));
        for index in &self.free {
            let declaration = self.model.parameters[*index].declaration;
            values[*index] = declaration.nearest(values[*index]);
        }
        Ok(values.iter().all(|v| v.is_finite()).then_some(values))
    }
}
