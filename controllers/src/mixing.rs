//! Which inputs move which controlled state.

use loopsight_core::Real;
use nalgebra::allocator::Allocator;
use nalgebra::{DefaultAllocator, Dim, OMatrix, OVector};

use crate::{Singular, solve};

/// Turns one demand per controlled state into inputs, so that each demand moves its own state.
///
/// ```text
/// V = M s      M = G⁻¹ D,  D so that the largest entry of each column of M is 1
/// y_i' = ... + g_i s_i      g_i = D_ii
/// ```
///
/// | symbol | what | unit |
/// |---|---|---|
/// | `s_i` | demand for the controlled state `i` | of the inputs |
/// | `G` | input matrix at rest | of the states per s, per input |
/// | `g_i` | what a unit of demand does to its state | of the state per s, per input |
///
/// For a robot with two wheels: `V_r = s_v + s_ω`, `V_l = s_v - s_ω`. Controllers without a model take
/// this much from it: directions.
///
/// Reference: S. Skogestad, I. Postlethwaite (2005), "Multivariable Feedback Control", 2nd edition,
/// Wiley, section 3.5 (decoupling at steady state).
#[derive(Clone, Debug)]
pub struct Mixing<S: Real, D: Dim>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// `M`, row by row: an [`OMatrix`] keeps columns together, so it is its transpose.
    rows: OMatrix<S, D, D>,
    /// `M⁻¹`, alike.
    back: OMatrix<S, D, D>,
    /// `g`.
    gain: OVector<S, D>,
}

impl<S: Real, D: Dim> Mixing<S, D>
where
    DefaultAllocator: Allocator<D> + Allocator<D, D>,
{
    /// From the input matrix `g`, row by row, as long as `like` squared.
    ///
    /// # Errors
    ///
    /// `g` has another length, is not finite, or has no inverse.
    pub fn new(g: &[f64], like: &OVector<f64, D>) -> Result<Self, Singular> {
        let n = like.len();
        let (dim, one) = like.shape_generic();
        if g.len() != n * n {
            return Err(Singular::NotFinite);
        }
        let mut mixing = Self {
            rows: OMatrix::zeros_generic(dim, dim),
            back: OMatrix::zeros_generic(dim, dim),
            gain: OVector::zeros_generic(dim, one),
        };
        let mut factors = OMatrix::<f64, D, D>::zeros_generic(dim, dim);
        let mut column = OVector::<f64, D>::zeros_generic(dim, one);
        let mut scale = OVector::<f64, D>::zeros_generic(dim, one);
        for j in 0..n {
            factors.as_mut_slice().copy_from_slice(g);
            column.fill(0.0);
            column[j] = 1.0;
            solve(
                factors.as_mut_slice(),
                column.as_mut_slice(),
                scale.as_mut_slice(),
            )?;
            let largest = column.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            mixing.gain[j] = S::of(1.0 / largest);
            for i in 0..n {
                mixing.rows.as_mut_slice()[i * n + j] = S::of(column[i] / largest);
                mixing.back.as_mut_slice()[j * n + i] = S::of(g[j * n + i] * largest);
            }
        }
        Ok(mixing)
    }

    /// `g_i`.
    pub fn gain(&self, i: usize) -> S {
        self.gain[i]
    }

    /// `V = M s`.
    pub fn mix(&self, demand: &[S], input: &mut [S]) {
        times(self.rows.as_slice(), demand, input);
    }

    /// `s = M⁻¹ V`.
    pub fn unmix(&self, input: &[S], demand: &mut [S]) {
        times(self.back.as_slice(), input, demand);
    }
}

fn times<S: Real>(rows: &[S], from: &[S], to: &mut [S]) {
    let n = from.len();
    for (value, row) in to.iter_mut().zip(rows.chunks_exact(n.max(1))) {
        *value = S::zero();
        for (entry, x) in row.iter().zip(from) {
            *value += *entry * *x;
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    #[test]
    fn each_demand_moves_its_own_state() {
        let g = [0.136, 0.136, 0.656, -0.656];
        let mixing = Mixing::<f64, _>::new(&g, &Vector2::zeros()).unwrap();
        let mut v = [0.0; 2];
        mixing.mix(&[3.0, 0.5], &mut v);
        assert!((v[0] - 3.5).abs() < 1e-12 && (v[1] - 2.5).abs() < 1e-12);
        assert!((mixing.gain(0) - 0.272).abs() < 1e-12);
        assert!((g[0] * v[0] + g[1] * v[1] - mixing.gain(0) * 3.0).abs() < 1e-12);
        let mut s = [0.0; 2];
        mixing.unmix(&v, &mut s);
        assert!((s[0] - 3.0).abs() < 1e-12 && (s[1] - 0.5).abs() < 1e-12);
        assert!(Mixing::<f64, _>::new(&[1.0, 1.0, 1.0, 1.0], &Vector2::zeros()).is_err());
    }
}
