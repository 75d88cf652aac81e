//! How forces pass through the plain model: what an effect without influence would change, without a simulation.

use loopsight_core::{Place, Real};
use loopsight_model::model::{Attached, Model};
use loopsight_model::registry::HostReal;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use loopsight_model::{DualOf, NARROW_WIDTH, TINY_WIDTH, derivative, variable_of};
use nalgebra::DMatrix;

use crate::along::{Along, along, reduced, showing};
use crate::linearised::zeros;
use crate::positions::Positions;
use crate::prediction::{Solution, for_each_run};
use crate::progress::{Cancelled, Work};

/// Most numbers that are kept: 32 MB. A longer log is simulated for each promise.
const MOST: usize = 1 << 22;

/// A model linearised once along its free run. What an effect without influence would change by its parameters `θ` is what it
/// would add to forces, at states that are known.
///
/// ```text
/// δx(k) = A δx(k-1) + B f                    f = (w(k-1) + 4 w(k-½) + w(k))/6
/// δy(k) = C δx(k-1) + D f
/// ```
///
/// | symbol | what |
/// |---|---|
/// | `δx`, `δy` | derivatives of the state and of the measured signals by `θ` |
/// | `w` | derivatives of what the effect adds to efforts and to rates of states, at a sample and halfway between two |
/// | `A`, `B`, `C`, `D` | derivatives of an interval's end by its beginning, and by a force that is constant over it; exact, by dual numbers through the integrator |
///
/// So a promise costs two evaluations of the effect a sample, and no integration. A force that turns within an interval is its
/// mean there: where it turns by 2.4 rad between samples, derivatives are off by a fiftieth.
///
/// A plant's effects come before the force here: a wheel that slips takes no more of it than it can, where a simulation with
/// the effect behind the slip would add it to what the wheel takes.
pub(crate) struct Passage {
    places: Vec<Place>,
    /// Rows of a step: states that show, then measured signals. Columns: these states, then places.
    size: (usize, usize),
    runs: Vec<Along>,
    /// The longest integration step, s.
    step: f64,
}

impl Passage {
    /// That of a model at a solution. None where it keeps more of its past than states, or the log is long.
    pub(crate) fn of(
        model: &Model,
        solution: &Solution,
        positions: Option<&Positions>,
        runs: &[Run],
        work: &Work<'_>,
    ) -> Result<Option<Self>, Cancelled> {
        let mut places = Vec::new();
        for channel in model.plant.channels {
            let is_force = matches!(channel.place, Place::Effort(_) | Place::Rate(_));
            if is_force && !places.contains(&channel.place) {
                places.push(channel.place);
            }
        }
        let acts_on_sensor = |e: &Attached| {
            let of_sensor = |place: &Place| matches!(place, Place::Output(_));
            e.at.iter().any(|channel| of_sensor(&channel.place))
        };
        let remembers = |e: &Attached| e.meta.memory && acts_on_sensor(e);
        let keeps = model.effects.iter().any(remembers)
            || model.per_run().next().is_some()
            || runs.iter().any(|run| run.observer().is_some());
        let states: usize = model
            .effects
            .iter()
            .map(|e| e.meta.states * e.at.len())
            .sum();
        let n = model.n_states() + states;
        let (rows, columns) = (n + model.measured.len(), n + places.len());
        let samples: usize = runs.iter().map(Run::len).sum();
        if keeps || places.is_empty() || samples * rows * columns > MOST {
            return Ok(None);
        }
        let mut all = for_each_run(runs, &solution.states, |run, x0| {
            let values = &solution.values;
            along(model, values, positions, run, x0, &places, n, work)
        })?;
        let showing = showing(&all, (rows, columns), n);
        for along in &mut all {
            along.steps = reduced(&along.steps, (rows, columns), n, &showing);
        }
        let size = (
            showing.len() + model.measured.len(),
            showing.len() + places.len(),
        );
        Ok(Some(Self {
            places,
            size,
            runs: all,
            step: model.max_step,
        }))
    }

    /// Derivatives of the measured signals by some `parameters` of the last effect of `model`, run by run. None where that
    /// effect reads no position, acts on anything but forces, has states or a memory, needs shorter steps, or has an influence
    /// already. (Other effects start with an influence: the derivatives of a sign at rest say nothing of it in motion.)
    pub(crate) fn slopes(
        &self,
        model: &Model,
        values: &[f64],
        parameters: &[usize],
        runs: &[Run],
        work: &Work<'_>,
    ) -> Result<Option<Vec<DMatrix<f64>>>, Cancelled> {
        let Some(effect) = model.effects.last() else {
            return Ok(None);
        };
        let passes = |place: &Place| self.places.contains(place);
        let suits = Positions::matter_to(effect.meta)
            && !effect.meta.is_dynamic()
            && effect.at.iter().all(|channel| passes(&channel.place))
            && model.max_step >= self.step;
        if !suits {
            return Ok(None);
        }
        match parameters.len() {
            n if n <= TINY_WIDTH => {
                self.slopes_by::<TINY_WIDTH>(model, values, parameters, runs, work)
            }
            n if n <= NARROW_WIDTH => {
                self.slopes_by::<NARROW_WIDTH>(model, values, parameters, runs, work)
            }
            _ => Ok(None),
        }
    }

    /// The same with `N` derivatives.
    fn slopes_by<const N: usize>(
        &self,
        model: &Model,
        values: &[f64],
        parameters: &[usize],
        runs: &[Run],
        work: &Work<'_>,
    ) -> Result<Option<Vec<DMatrix<f64>>>, Cancelled>
    where
        DualOf<N>: HostReal,
    {
        let seed = |(i, value): (usize, &f64)| match parameters.iter().position(|p| *p == i) {
            Some(column) => variable_of(*value, column),
            None => DualOf::<N>::of(*value),
        };
        let values: Vec<DualOf<N>> = values.iter().enumerate().map(seed).collect();
        let mut simulator = Simulator::new(model, &values);
        let mut all = Vec::new();
        for (run, along) in runs.iter().zip(&self.runs) {
            match self.through(&mut simulator, along, parameters.len(), run, work)? {
                Some(slopes) => all.push(slopes),
                None => return Ok(None),
            }
        }
        Ok(Some(all))
    }

    /// What passes through the model along one run, by the first `m` derivatives. None where the effect has an influence.
    fn through<const N: usize>(
        &self,
        simulator: &mut Simulator<'_, DualOf<N>>,
        along: &Along,
        m: usize,
        run: &Run,
        work: &Work<'_>,
    ) -> Result<Option<DMatrix<f64>>, Cancelled>
    where
        DualOf<N>: HostReal,
    {
        let (rows, columns) = self.size;
        let np = self.places.len();
        let shown = columns - np;
        let ny = rows - shown;
        let mut slopes = zeros(run.len() * ny, m);
        let forces = || vec![[0.0; N]; np];
        let (mut before, mut between, mut now) = (forces(), forces(), forces());
        // Changes of the state, then forces.
        let mut from = vec![[0.0; N]; columns];
        let mut to = vec![[0.0; N]; rows];
        let of_sample = |all: &[f64]| all.len() / run.len().max(1);
        let (nx, nu) = (of_sample(&along.states), of_sample(&along.inputs));
        let mut middle = vec![0.0; nx];
        for k in 0..run.len() {
            work.go_on()?;
            let time = |k: usize| run.time()[k] - run.time()[0];
            let state = |k: usize| &along.states[k * nx..][..nx];
            let inputs = &along.inputs[k * nu..][..nu];
            if k > 0 {
                for (x, (a, b)) in middle.iter_mut().zip(state(k - 1).iter().zip(state(k))) {
                    *x = 0.5 * (a + b);
                }
                simulator.stand(0.5 * (time(k - 1) + time(k)), &middle, inputs);
                self.add(simulator, &mut between);
            }
            simulator.stand(time(k), state(k), inputs);
            if !self.add(simulator, &mut now) {
                return Ok(None);
            }
            if k > 0 {
                let known = before.iter().zip(&between).zip(&now);
                for (force, ((a, b), c)) in from[shown..].iter_mut().zip(known) {
                    *force = std::array::from_fn(|i| (a[i] + 4.0 * b[i] + c[i]) / 6.0);
                }
                let step = along.steps[k * rows * columns..].chunks_exact(columns);
                for (to, row) in to.iter_mut().zip(step) {
                    let mut sum = [0.0; N];
                    for (a, from) in row.iter().zip(&from) {
                        for (sum, from) in sum.iter_mut().zip(from) {
                            *sum += a * from;
                        }
                    }
                    *to = sum;
                }
                from[..shown].copy_from_slice(&to[..shown]);
                for (i, y) in to[shown..].iter().enumerate() {
                    for (c, y) in y.iter().take(m).enumerate() {
                        slopes[(k * ny + i, c)] = *y;
                    }
                }
            }
            std::mem::swap(&mut before, &mut now);
        }
        Ok(Some(slopes))
    }

    /// Derivatives of what the last effect adds now, by place. Whether it adds nothing yet.
    fn add<const N: usize>(
        &self,
        simulator: &mut Simulator<'_, DualOf<N>>,
        to: &mut [[f64; N]],
    ) -> bool
    where
        DualOf<N>: HostReal,
    {
        to.fill([0.0; N]);
        let mut nothing = true;
        simulator.adds(simulator.effects() - 1, |place, added| {
            nothing &= added.value() == 0.0;
            let places = self.places.iter().zip(&mut *to);
            for (_, sums) in places.filter(|(known, _)| **known == place) {
                for (c, sum) in sums.iter_mut().enumerate() {
                    *sum += derivative(&added, c);
                }
            }
        });
        nothing
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;
    use loopsight_model::simulate::free_run;
    use loopsight_plants as _;
    use nalgebra::DVector;

    use super::*;
    use crate::sensitivities::{By, sensitivities};

    const ROBOT: &str = "[plant.ddmr]\nK_A = -2.8\nK_B = 0.005\nK_C = 0.136\nK_D = -3.1\nK_E = -0.4\n\
                         K_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n\
                         [log.measured.linear_velocity]\n[log.measured.angular_velocity]\n";
    const FRICTION: &str = "[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\", \"wheel.left\"]\nlevel = 0.4\nwidth = 2.0\n";
    const DELAY: &str =
        "[[effect]]\n[effect.input_delay]\nat = [\"input.right\", \"input.left\"]\ndelay = 0.013\n";

    fn robot(effects: &str) -> Model {
        Model::from_toml("robot.toml", &format!("{ROBOT}{effects}"))
            .unwrap()
            .0
    }

    /// A robot with friction, driven by levels that change every 0.4 s, rests among them.
    fn driven() -> Run {
        let level = |k: usize, wheel: usize| ((5 * (k / 40) + 3 * wheel) % 7) as f64 * 2.5 - 7.5;
        let inputs: Vec<f64> = (0..600).flat_map(|k| [level(k, 0), level(k, 1)]).collect();
        let time = || (0..600).map(|k| 0.01 * f64::from(k)).collect();
        let run = |measured| Run::new("", time(), Rows::new(2, inputs.clone()), measured).unwrap();
        let (model, mut measured) = (robot(FRICTION), Vec::new());
        let mut simulator = Simulator::new(&model, &model.values());
        let x0 = vec![0.0; model.n_states()];
        let blank = run(Rows::new(2, vec![0.0; 1200]));
        free_run(&mut simulator, &x0, &blank, |_, outputs| {
            measured.extend_from_slice(outputs)
        });
        run(Rows::new(2, measured))
    }

    /// Derivatives by the free parameters of the last effect of a model: by way of the model without it, and by simulation.
    fn both(
        plain: &str,
        effect: &str,
        known: &[&str],
        measured: bool,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (before, model) = (robot(plain), robot(&format!("{plain}{effect}")));
        let runs = [driven()];
        let states = vec![DVector::zeros(before.n_states())];
        let positions = measured.then(|| Positions::of(&model, &model.values()).unwrap());
        let positions = positions.as_ref();
        let values = before.values();
        let solution = Solution { values, states };
        let work = Work::quiet();
        let passage = Passage::of(&before, &solution, positions, &runs, &work).unwrap()?;
        let own = before.parameters.len()..model.parameters.len();
        let free = |i: &usize| !known.contains(&model.parameters[*i].declaration.id);
        let parameters: Vec<usize> = own.filter(free).collect();
        let slopes = passage.slopes(&model, &model.values(), &parameters, &runs, &work);
        let by = By {
            parameters: &parameters,
            states: &[],
        };
        let x0 = solution.states[0].as_slice();
        let simulated = sensitivities(positions, &model, &model.values(), x0, &runs[0], by, &work);
        Some((slopes.unwrap()?.remove(0), simulated.unwrap().jacobian))
    }

    const RIPPLE: &str = "[[effect]]\n[effect.torque_ripple]\nat = [\"wheel.left\"]\nsine = 0.0\ncosine = 0.0\ncount = 12.0\n";
    const SPRING: &str = "[[effect]]\n[effect.linear_stiffness]\nat = [\"wheel.right\", \"wheel.left\"]\nstiffness = 0.0\n";

    /// The faster a force turns, the more is lost within an interval: 12 periods a turn are up to 2.4 rad between samples here.
    /// Measured positions jump at a sample, and halfway from one to the next they are the mean: half a hundredth of a slow force.
    #[test]
    fn a_force_passes_as_it_does_in_a_simulation() {
        let late = format!("{FRICTION}{DELAY}");
        let slow = RIPPLE.replace("count = 12.0", "count = 3.0");
        for (effect, known, most) in [
            (RIPPLE, "count", 0.02),
            (&slow, "count", 0.005),
            (SPRING, "rest", 0.005),
        ] {
            // At measured positions where nothing has a memory.
            for (plain, measured) in [
                ("", true),
                (FRICTION, true),
                (FRICTION, false),
                (&late, false),
            ] {
                let (passed, simulated) = both(plain, effect, &[known], measured).unwrap();
                let off = (&passed - &simulated).norm() / simulated.norm();
                assert!(off < most, "{plain} {effect} {measured}: {off}");
            }
        }
    }

    #[test]
    fn what_is_more_than_a_force_without_influence_is_simulated() {
        let of = |plain: &str, effect: &str| both(plain, effect, &["count"], false).is_some();
        assert!(of("", RIPPLE));
        assert!(
            !of("", &RIPPLE.replace("sine = 0.0", "sine = 0.1")),
            "has an influence"
        );
        assert!(!of("", FRICTION), "reads no position");
        let lag =
            "[[effect]]\n[effect.sensor_delay]\nat = [\"sensor.linear_velocity\"]\ndelay = 0.01\n";
        assert!(!of(lag, RIPPLE), "a late sensor");
    }
}
