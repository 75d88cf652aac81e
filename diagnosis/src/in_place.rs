//! What two effects begin with that take the place of one.
//!
//! Friction of two directions and dry friction beside a weight have no parameter in common, yet move a machine alike. Where its
//! motion is known, the second begin with the values that give the rates of the first there: linear least squares.

use loopsight_model::model::{Model, pseudo_inverse};
use loopsight_model::run::Run;
use loopsight_model::simulate::{Simulator, try_follow};
use nalgebra::{DMatrix, DVector};

use crate::progress::{Cancelled, Work};

/// Instants of all runs at which rates are compared at most: a handful of parameters needs no more.
const INSTANTS: usize = 1000;

/// A motion of a model, at some instants of its free runs.
pub(crate) struct Motion {
    instants: Vec<Instant>,
    /// Root mean squares of the rates of the plant's states.
    rms: Vec<f64>,
}

struct Instant {
    time: f64,
    /// The plant's state, and behind it those of the effects.
    state: Vec<f64>,
    /// What effects with a memory pass on.
    inputs: Vec<f64>,
    /// Of the plant's state, as the model has them.
    rates: Vec<f64>,
}

impl Motion {
    /// That of `model` from `states`.
    pub(crate) fn of(
        model: &Model,
        states: &[DVector<f64>],
        runs: &[Run],
        work: &Work<'_>,
    ) -> Result<Self, Cancelled> {
        let total: usize = runs.iter().map(Run::len).sum();
        let every = total.div_ceil(INSTANTS).max(1);
        let mut instants = Vec::new();
        let values = model.values();
        let mut simulator = Simulator::new(model, &values);
        let mut still = Simulator::new(model, &values);
        for (run, x0) in runs.iter().zip(states) {
            try_follow(&mut simulator, x0.as_slice(), run, |k, _, now| {
                if k % every == 0 {
                    let mut instant = Instant {
                        time: now.time(),
                        state: now.whole_state_mut().to_vec(),
                        inputs: now.passed_on().to_vec(),
                        rates: Vec::new(),
                    };
                    instant.rates = instant.rates_of(&mut still);
                    instants.push(instant);
                }
                work.go_on()
            })?;
        }
        let mut rms = vec![0.0; model.n_states()];
        for instant in &instants {
            for (sum, rate) in rms.iter_mut().zip(&instant.rates) {
                *sum += rate * rate;
            }
        }
        let n = instants.len().max(1) as f64;
        rms.iter_mut().for_each(|sum| *sum = f64::sqrt(*sum / n));
        Ok(Self { instants, rms })
    }

    /// Gives the linear parameters of `model` the values with which its rates come nearest to those of the motion. Those of its
    /// `effects`, by index, begin at nothing. It stays as it is where no values do.
    pub(crate) fn begin(&self, model: &mut Model, effects: &[usize]) {
        let linear = |i: &usize| {
            let parameter = &model.parameters[*i];
            parameter.free && parameter.declaration.linear
        };
        let sizes: Vec<usize> = (0..model.parameters.len()).filter(linear).collect();
        let mut values = model.values();
        for effect in effects.iter().map(|i| &model.effects[*i]) {
            let own = effect.own();
            for i in own.filter(|i| sizes.contains(i)) {
                values[i] = model.parameters[i].declaration.default.unwrap_or(0.0);
            }
        }
        let begun = self.rates(model, &values);
        let mut columns = DMatrix::zeros(begun.len(), sizes.len());
        let mut units = vec![0.0; sizes.len()];
        for (k, i) in sizes.iter().enumerate() {
            let mut more = values.clone();
            more[*i] += model.parameters[*i].scale();
            let column = self.rates(model, &more) - &begun;
            let norm = column.norm();
            if norm.is_normal() {
                units[k] = model.parameters[*i].scale() / norm;
                columns.set_column(k, &(column / norm));
            }
        }
        let wanted = self.relative(|instant| instant.rates.clone()) - begun;
        let inverse = pseudo_inverse(&columns.tr_mul(&columns));
        let Some(steps) = inverse.map(|inverse| inverse * columns.tr_mul(&wanted)) else {
            return;
        };
        if steps.iter().all(|step| step.is_finite()) {
            for ((i, step), unit) in sizes.iter().zip(&steps).zip(&units) {
                let parameter = &mut model.parameters[*i];
                let value = values[*i] + step * unit;
                parameter.value = Some(parameter.declaration.nearest(value));
            }
        }
    }

    /// The relative rates of `model` with these `values`.
    fn rates(&self, model: &Model, values: &[f64]) -> DVector<f64> {
        let mut simulator = Simulator::new(model, values);
        self.relative(|instant| instant.rates_of(&mut simulator))
    }

    /// All rates at all instants, relative to those of the motion.
    fn relative(&self, mut of: impl FnMut(&Instant) -> Vec<f64>) -> DVector<f64> {
        let mut all = Vec::with_capacity(self.instants.len() * self.rms.len());
        for instant in &self.instants {
            let rates = of(instant);
            let each = rates.iter().zip(&self.rms).filter(|(_, rms)| **rms > 0.0);
            all.extend(each.map(|(rate, rms)| rate / rms));
        }
        DVector::from_vec(all)
    }
}

impl Instant {
    /// The rates of the plant's states then.
    fn rates_of(&self, simulator: &mut Simulator<'_, f64>) -> Vec<f64> {
        let plant = simulator.state().len();
        simulator.stand(self.time, &self.state[..plant], &self.inputs);
        let whole = simulator.whole_state_mut();
        if whole.len() == self.state.len() {
            whole.copy_from_slice(&self.state);
        }
        simulator.rates().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;
    use crate::prediction::InitialStates;
    use crate::swing::swing;

    /// Friction of two directions is dry friction, drag and a weight.
    #[test]
    fn two_effects_begin_with_what_one_did() {
        let text = "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n\
                    [[effect]]\n[effect.directional_friction]\nat = [\"shaft\"]\n\
                    level_forward = 0.9\nlevel_backward = 0.5\n\
                    viscous_forward = 0.02\nviscous_backward = 0.02\nwidth = 0.01\n";
        let (whole, _) = Model::from_toml("axis.toml", text).unwrap();
        let runs = [swing(&whole, 600)];
        let states = InitialStates::guess(&whole, &whole.values(), &runs).states;
        let motion = Motion::of(&whole, &states, &runs, &Work::quiet()).unwrap();

        let dry = whole.with_effect_replaced(0, "coulomb_friction", &["shaft"]);
        let mut both = dry
            .unwrap()
            .with_effect("constant_force", &["shaft"])
            .unwrap();
        motion.begin(&mut both, &[0, 1]);
        let value = |name: &str| {
            let named = both.parameters.iter().find(|p| p.name == name);
            named.unwrap().value.unwrap()
        };
        let near = |name: &str, wanted: f64| {
            let found = value(name);
            // Beside a sign that is a little soft.
            assert!((found - wanted).abs() < 0.01, "{name}: {found}");
        };
        near("coulomb_friction.level", 0.7);
        near("coulomb_friction.width", 0.01);
        near("constant_force.force", -0.2);
        // The plant takes the drag: 0.02 V of 8 rad/s² for each.
        near("K_A", -2.0 - 8.0 * 0.02);
        near("K_C", 8.0);
    }
}
