//! How a run begins.

use crate::model::Model;
use crate::registry::HostReal;
use loopsight_core::{NoPast, Place};

use super::Simulator;

/// A time before a run: what is known of it holds for all times before, s.
const BEFORE: f64 = -1.0;

impl<S: HostReal> Simulator<'_, S> {
    /// Starts a run at time 0 from the plant state `x0`. Before it `input` was applied, or nothing:
    /// whichever the machine is closer to rest with. Behind the state may stand the parameters of the run's own
    /// ([`Model::per_run`]), which hold from now on.
    ///
    /// # Panics
    ///
    /// When there are fewer states or inputs than the plant has.
    pub fn reset(&mut self, x0: &[S], input: &[f64]) {
        let nx = self.model.n_states();
        if let Some(own) = x0.get(nx..).filter(|own| !own.is_empty()) {
            self.model.put_own(&mut self.values, own);
            self.model.lower_into(&self.values, &mut self.p);
        }
        self.time = 0.0;
        self.interval = 0.0;
        self.fresh = false;
        self.foreseen = 0;
        for (to, from) in self.x.iter_mut().zip(x0) {
            *to = *from;
        }
        self.x[nx..].fill(S::zero());
        for (to, from) in self.scratch.held.iter_mut().zip(input) {
            *to = S::of(*from);
        }
        let past = before(&self.model, &self.p, x0, input);
        for bound in &self.bounds.input_memory {
            if let (Some(history), Place::Input(i)) = (bound.history, bound.place) {
                self.histories[history].clear();
                self.histories[history].hold(BEFORE, S::of(past[i]));
                self.histories[history].hold(0.0, S::of(input[i]));
            }
        }
        self.refresh();
        if self.bounds.states > 0 {
            let mut z = vec![S::zero(); self.bounds.states];
            let scene = self.scene();
            for bound in self.bounds.all().filter(|b| b.n_z > 0) {
                let nominal = match bound.place {
                    Place::Input(i) => S::of(past[i]),
                    Place::Output(i) => self.scratch.signals[i],
                    Place::Effort(_) | Place::Rate(_) => S::zero(),
                };
                scene.initial(bound, nominal, &NoPast, &mut z[bound.z - nx..][..bound.n_z]);
            }
            self.x[nx..nx + z.len()].copy_from_slice(&z);
        }
        for bound in &self.bounds.output_memory {
            if let Some(history) = bound.history {
                self.histories[history].clear();
            }
        }
        self.remember();
        self.mark();
    }
}

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
fn before<S: HostReal>(model: &Model, p: &[S], x0: &[S], input: &[f64]) -> Vec<f64> {
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
