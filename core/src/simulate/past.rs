//! What was applied before a recording began.

use crate::model::Model;
use crate::registry::HostReal;

/// The inputs that a run begins from: those of its first sample, or none where the machine stands as
/// it would without them.
///
/// A delay and a lag need to know what was applied before the first sample, and a recording does not
/// say. The machine had come to where it is: of `u_0` and 0, that input was on which leaves its state
/// `x_0` closer to rest,
///
/// ```text
/// Σ_i (f_i(x_0, u)/(f_i(x_0, u_0) - f_i(x_0, 0)))²
/// ```
///
/// over the rates `f_i` that the inputs change. A robot whose log begins at rest with its first
/// command has not been under it for ever; an arm that is held up, or a wheel that turns, has.
pub(super) fn before<S: HostReal>(model: &Model, p: &[S], x0: &[S], input: &[f64]) -> Vec<f64> {
    let nx = model.n_states();
    let dynamics = S::dynamics(model.dynamics);
    let efforts = vec![S::zero(); model.n_efforts()];
    let rates = |u: &[f64]| {
        let u: Vec<S> = u.iter().map(|v| S::of(*v)).collect();
        let mut rates = vec![S::zero(); nx];
        dynamics.derivative(&x0[..nx], &u, &efforts, p, &mut rates);
        rates
    };
    let nothing = vec![0.0; input.len()];
    let (with, without) = (rates(input), rates(&nothing));
    let (mut under, mut free) = (0.0, 0.0);
    for (a, b) in with.iter().zip(&without) {
        let (a, b) = (a.value(), b.value());
        if a != b {
            under += (a / (a - b)).powi(2);
            free += (b / (a - b)).powi(2);
        }
    }
    if free < under {
        nothing
    } else {
        input.to_vec()
    }
}
