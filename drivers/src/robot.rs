//! The robot behind the simulated driver: a model integrated finely, with sensors and limits.

use loopsight_model::config::nearest;
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use loopsight_model::run::Run;
use loopsight_model::simulate::Simulator;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::encoder::Encoders;
use crate::fault::Faults;
use crate::simulated::{Limit, Simulated};

/// Step of the robot where the file gives none, s.
pub(crate) const STEP: f64 = 1e-4;

/// A robot made of a model. Its steps allocate nothing.
#[derive(Clone)]
pub(crate) struct Robot {
    simulator: Simulator<'static, f64>,
    encoders: Encoders,
    /// Standard deviation per measured signal.
    noise: Vec<f64>,
    /// Largest magnitude per input.
    limits: Vec<f64>,
    random: ChaCha8Rng,
    faults: Faults,
    /// What was measured last, for signals that freeze.
    before: Vec<f64>,
    read_at: f64,
}

impl Robot {
    /// The robot `model` at rest at time 0.
    pub(crate) fn new(mut model: Model, settings: &Simulated) -> Result<Self, BuildError> {
        if model.measured.is_empty() {
            return Err(BuildError::at(
                "model",
                format!("nothing is measured on `{}`", model.name),
            )
            .help("say what is measured in the model file's `[log.measured]`"));
        }
        let missing = model.missing_values();
        if !missing.is_empty() {
            return Err(BuildError::at(
                "model",
                format!(
                    "a robot needs a value for every parameter, `{}` has none for {}",
                    model.name,
                    missing.join(", ")
                ),
            ));
        }
        model.max_step = step(settings.step_s, model.max_step)?;
        // A robot is the truth: its steps are never lengthened.
        model.step_given = true;
        let noise = noise(settings, &model)?;
        let limits = limits(settings.limit.as_ref(), &model)?;
        let mut random = ChaCha8Rng::seed_from_u64(settings.seed);
        let encoders = if settings.quantize {
            Encoders::new(&model, &mut random)?
        } else {
            Encoders::default()
        };
        // Noise has a stream of its own: whether counts are rounded does not change it.
        random.set_stream(1);
        random.set_word_pos(0);
        let ids: Vec<&str> = model.measured.iter().map(|m| m.signal.id).collect();
        let faults = Faults::new(&settings.fault, &encoders.shafts(), &ids, settings.seed)?;
        let values = model.values();
        let mut robot = Self {
            before: vec![0.0; model.measured.len()],
            simulator: Simulator::owning(model, &values),
            encoders,
            noise,
            limits,
            random,
            faults,
            read_at: 0.0,
        };
        robot.encoders.start(robot.simulator.signals());
        Ok(robot)
    }

    /// Integrates to `until` (s since the start) with `input` applied.
    pub(crate) fn advance(&mut self, until: f64, input: &[f64]) {
        self.simulator.advance(until, input);
    }

    /// The inputs of `run` are known as far ahead as effects see from its `k`-th sample.
    pub(crate) fn foresee(&mut self, run: &Run, k: usize) {
        self.simulator.foresee(run, k);
    }

    /// Clamps `input` to the limits.
    pub(crate) fn limit(&self, input: &mut [f64]) {
        for (value, limit) in input.iter_mut().zip(&self.limits) {
            *value = value.clamp(-limit, *limit);
        }
    }

    /// What the sensors read now; at the very first reading there is no interval to take a mean
    /// over, and the value is the instantaneous one. False when the simulation has diverged.
    pub(crate) fn measure(&mut self, measured: &mut [f64]) -> bool {
        let simulator = &mut self.simulator;
        simulator.measure(measured);
        let finite = measured.iter().all(|v| v.is_finite());
        let period = simulator.time() - self.read_at;
        self.read_at = simulator.time();
        if period > 0.0 {
            let (time, faults) = (self.read_at, &self.faults);
            let counts = |shaft| faults.counts(shaft, time);
            self.encoders
                .count(simulator.signals(), period, measured, counts);
        }
        for (value, deviation) in measured.iter_mut().zip(&self.noise) {
            if *deviation > 0.0 {
                let normal: f64 = StandardNormal.sample(&mut self.random);
                *value += *deviation * normal;
            }
        }
        for (signal, (value, before)) in measured.iter_mut().zip(&mut self.before).enumerate() {
            if self.faults.freezes(signal, self.read_at) {
                *value = *before;
            }
            *before = *value;
        }
        finite
    }

    /// Whether the sample just measured gets lost on its way; to be asked once for each.
    pub(crate) fn loses(&mut self) -> bool {
        self.faults.lose(self.read_at)
    }
}

fn step(given: Option<f64>, models: f64) -> Result<f64, BuildError> {
    let step = given.unwrap_or(STEP.min(models));
    if !(step > 0.0 && step.is_finite()) {
        return Err(BuildError::at(
            "step_s",
            format!("found {step} s, expected a number above 0 s"),
        ));
    }
    if step > models {
        return Err(BuildError::at(
            "step_s",
            format!("the robot's step of {step} s is coarser than its model's, {models} s"),
        )
        .help("a robot finer than the model keeps a fit from being tested against itself"));
    }
    Ok(step)
}

fn noise(settings: &Simulated, model: &Model) -> Result<Vec<f64>, BuildError> {
    let ids: Vec<&str> = model.measured.iter().map(|m| m.signal.id).collect();
    for (id, deviation) in &settings.noise {
        if !ids.contains(&id.as_str()) {
            return Err(unknown("noise", "measured signal", id, &ids));
        }
        if !(*deviation >= 0.0 && deviation.is_finite()) {
            return Err(BuildError::at(
                &format!("noise.{id}"),
                format!("found {deviation}, expected a standard deviation from 0 upwards"),
            ));
        }
    }
    Ok(ids
        .iter()
        .map(|id| settings.noise.get(*id).copied().unwrap_or(0.0))
        .collect())
}

fn limits(limit: Option<&Limit>, model: &Model) -> Result<Vec<f64>, BuildError> {
    let ids: Vec<&str> = model.plant.inputs.iter().map(|s| s.id).collect();
    let check = |key: &str, value: f64| {
        if value > 0.0 && value.is_finite() {
            Ok(())
        } else {
            let message = format!("found {value}, expected a number above 0");
            Err(BuildError::at(key, message))
        }
    };
    match limit {
        None => Ok(vec![f64::INFINITY; ids.len()]),
        Some(Limit::All(value)) => {
            check("limit", *value)?;
            Ok(vec![*value; ids.len()])
        }
        Some(Limit::Each(each)) => {
            for (id, value) in each {
                if !ids.contains(&id.as_str()) {
                    return Err(unknown("limit", "input", id, &ids));
                }
                check(&format!("limit.{id}"), *value)?;
            }
            Ok(ids
                .iter()
                .map(|id| each.get(*id).copied().unwrap_or(f64::INFINITY))
                .collect())
        }
    }
}

/// An id that names nothing.
pub(crate) fn unknown(key: &str, what: &str, found: &str, ids: &[&str]) -> BuildError {
    let error = BuildError::at(
        &if key == "model" {
            key.to_owned()
        } else {
            format!("{key}.{found}")
        },
        format!(
            "there is no {what} `{found}`, expected one of {}",
            ids.join(", ")
        ),
    );
    match nearest(found, ids.iter().copied()) {
        Some(name) => error.help(format!("did you mean `{name}`?")),
        None => error,
    }
}
