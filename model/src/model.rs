//! A model: a plant with effects, sensors and parameter values, composed from TOML.

mod attached;
mod change;
mod error;
mod file;
mod parameter;
mod per_run;
mod proposed;
mod signals;
mod ties;
mod time_scale;

use std::path::Path;

use loopsight_core::{Derived, Parameter, Place, PlantMeta, Reading, Role, SHORTEST_LAG_S};

use crate::attach::{attach, make_names_unique};
pub use crate::attach::{fitting_channels, misfit, unit_at};
use crate::config::{ConfigError, PathSegment, TomlSource, nearest, read_text};
use crate::log_map::{ColumnMap, Hold, LogMap};
pub use crate::pseudo_inverse::pseudo_inverse;
use crate::registry::{AnyDynamics, HostReal};
use crate::sensor::{Encoder, Sensor};
pub use attached::{Attached, MeasuredSignal};
pub use error::ModelError;
pub use file::{FitTable, ModelFile, SimulationTable};
pub use loopsight_core::{Tie, Unshown};
pub use parameter::{ModelParameter, Origin};
pub use proposed::Proposed;
use proposed::proposed;
pub(crate) use signals::signal_index;
pub use signals::signals;
use ties::Tied;

/// A plant with effects, sensors and parameter values, checked.
#[derive(Clone)]
pub struct Model {
    /// Name of the robot.
    pub name: String,
    /// The plant's declaration.
    pub plant: &'static PlantMeta,
    /// Plant parameters first, then those of the effects.
    pub parameters: Vec<ModelParameter>,
    /// Effects in order.
    pub effects: Vec<Attached>,
    /// Effects of the file's own that are not in the model, and that a diagnosis tries.
    pub candidates: Vec<Proposed>,
    /// What is measured, in the order of the signals.
    pub measured: Vec<MeasuredSignal>,
    /// How a log maps on the signals.
    pub log: LogMap,
    /// Longest integration step, s.
    pub max_step: f64,
    /// The file gives it: then no step is longer, however far apart the samples are.
    pub step_given: bool,
    /// Steps may be longer than [`Model::max_step`], up to the time between samples, where the motion allows it: for a
    /// search, which ends with the usual ones. Nothing where the file gives the step.
    pub by_motion: bool,
    /// Shortest time constant that a simulation follows, s, see [`Model::follow`].
    pub shortest_lag: f64,
    /// How long the machine takes for what takes a robot a second, s, see [`Model::at_time_scale`].
    time_scale: f64,
    pub(crate) dynamics: &'static dyn AnyDynamics,
    pub(crate) set: usize,
    pub(crate) n_plant_parameters: usize,
    /// Parameters that follow from others.
    ties: Vec<Tied>,
}

impl std::fmt::Debug for Model {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Model")
            .field("name", &self.name)
            .field("plant", &self.plant.id)
            .field("parameters", &self.parameters)
            .finish_non_exhaustive()
    }
}

impl Model {
    /// Reads a model file.
    ///
    /// # Errors
    ///
    /// [`ModelError`] where the file cannot be read or is not a model file.
    pub fn load(path: &Path) -> Result<(Self, TomlSource), ModelError> {
        let text = read_text(path)?;
        Self::from_toml(&path.display().to_string(), &text)
    }

    /// Composes a model from TOML; `file` names it in messages.
    ///
    /// # Errors
    ///
    /// [`ModelError`] where the text is not a model file, or no plant is linked.
    pub fn from_toml(file: &str, text: &str) -> Result<(Self, TomlSource), ModelError> {
        crate::registry::check()?;
        let source = TomlSource::parse(file, text)?;
        let parsed: ModelFile = source.read()?;
        let model = Self::compose(&parsed, &source)?;
        Ok((model, source))
    }

    /// Composes a model from a parsed file; `source` places the errors.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] where a value is out of its range, or an effect or a sensor does not fit the plant.
    pub fn compose(file: &ModelFile, source: &TomlSource) -> Result<Self, Box<ConfigError>> {
        let prefix: [PathSegment; 2] = ["plant".into(), file.plant.meta().id.into()];
        let ready = file
            .plant
            .ready()
            .map_err(|mistake| source.mistake(&prefix, mistake))?;
        let (plant, values) = (ready.meta, ready.values);
        let declared: &'static [Parameter] = match values.set {
            0 => plant.parameters,
            set => plant.parameterizations[set - 1].parameters,
        };
        let mut parameters: Vec<ModelParameter> = declared
            .iter()
            .zip(values.given.iter().zip(ready.paths))
            .map(|(declaration, (given, path))| ModelParameter {
                name: declaration.id.to_owned(),
                declaration,
                unit: declaration.unit.to_owned(),
                value: given.or(declaration.default),
                origin: Origin::of(*given),
                free: declaration.estimated,
                per_run: false,
                size: 1.0,
                path: prefix.iter().cloned().chain(path).collect(),
            })
            .collect();
        let n_plant_parameters = parameters.len();

        let mut effects = Vec::new();
        for (index, part) in file.effect.iter().enumerate() {
            let part = part.as_ref();
            let attached = attach(plant, part, index, &mut parameters, source, &effects)?;
            effects.push(attached);
        }
        make_names_unique(&mut parameters, &effects);
        let candidates = proposed(plant, &file.candidate, &effects, source)?;

        let usual = <f64 as HostReal>::dynamics(ready.dynamics).max_step_s();
        let step = file.simulation.max_step_s.unwrap_or(usual);
        if !(step > 0.0 && step.is_finite()) {
            return Err(source.error(
                &["simulation".into(), "max_step_s".into()],
                &format!("the longest integration step is {step} s, expected a number above 0 s"),
                None,
            ));
        }
        for (list, free) in [(&file.fit.free, true), (&file.fit.fixed, false)] {
            for (i, name) in list.iter().enumerate() {
                let Some(found) = parameters.iter_mut().find(|p| p.name == *name) else {
                    let key = if free { "free" } else { "fixed" };
                    let names: Vec<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
                    return Err(source.error(
                        &["fit".into(), key.into(), i.into()],
                        &format!(
                            "unknown parameter `{name}`, expected one of {}",
                            names.join(", ")
                        ),
                        nearest(name, names).map(|n| format!("did you mean `{n}`?")),
                    ));
                };
                found.free = free;
            }
        }
        check_inputs(plant, &file.log, source)?;

        let mut model = Self {
            name: file.name.clone().unwrap_or_else(|| plant.id.to_owned()),
            plant,
            parameters,
            effects,
            candidates,
            measured: Vec::new(),
            log: file.log.clone(),
            max_step: step,
            step_given: file.simulation.max_step_s.is_some(),
            by_motion: false,
            shortest_lag: SHORTEST_LAG_S,
            time_scale: 1.0,
            dynamics: ready.dynamics,
            set: values.set,
            n_plant_parameters,
            ties: Vec::new(),
        };
        model.tie_named(&file.fit.tied, source)?;
        model.differ_named(&file.fit.per_run, source)?;
        let measured: Vec<(String, Sensor)> = file
            .log
            .measured
            .iter()
            .map(|(id, m)| (id.clone(), m.sensor.clone()))
            .collect();
        model.measure(&measured).map_err(|(id, message, help)| {
            source.error(
                &["log".into(), "measured".into(), id.as_str().into()],
                &message,
                help,
            )
        })?;
        Ok(model)
    }

    /// Says what is measured: ids of signals with their sensors. An error is `(id, message, help)`.
    ///
    /// # Errors
    ///
    /// There is no signal with the id, or its sensor does not suit it.
    pub fn measure(
        &mut self,
        list: &[(String, Sensor)],
    ) -> Result<(), (String, String, Option<String>)> {
        let mut measured = Vec::new();
        for (id, sensor) in list {
            let index = self.find_signal(id).map_err(|(m, h)| (id.clone(), m, h))?;
            if let Sensor::EncoderCounts(encoder) = sensor {
                let counts = encoder.counts_per_revolution;
                if !(counts > 0.0 && counts.is_finite()) {
                    return Err((
                        id.clone(),
                        format!("counts_per_revolution is {counts}, expected a number above 0"),
                        None,
                    ));
                }
                if let Some(problem) = self.counts_no_speed(index, encoder) {
                    return Err(problem);
                }
                for (shaft, gain) in &encoder.of {
                    self.find_signal(shaft)
                        .map_err(|(m, h)| (id.clone(), m, h))?;
                    if !gain.is_finite() {
                        return Err((id.clone(), format!("the gain of `{shaft}` is {gain}"), None));
                    }
                }
            }
            let signal = signals(self.plant).nth(index);
            if let Some(signal) = signal {
                measured.push(MeasuredSignal {
                    index,
                    signal,
                    sensor: sensor.clone(),
                });
            }
        }
        measured.sort_by_key(|m| m.index);
        self.measured = measured;
        Ok(())
    }

    /// What is wrong with counts behind a signal that is itself the angle or the way that is counted; none where it is not.
    fn counts_no_speed(
        &self,
        index: usize,
        encoder: &Encoder,
    ) -> Option<(String, String, Option<String>)> {
        let signal = signals(self.plant).nth(index)?;
        let (speed, _) =
            (self.plant.integrals.iter()).find(|(_, integral)| *integral == signal.id)?;
        let message = format!(
            "`{}` is what is counted: `encoder_counts` says how a speed, `{speed}`, is made of counts between two samples",
            signal.id
        );
        let scale = match signal.unit {
            "rad" => format!(
                "`unit = \"rev\"` and `scale = {}`",
                1.0 / encoder.counts_per_revolution
            ),
            unit => format!("`unit = \"{unit}\"`, and as `scale` what one count is"),
        };
        let help = format!(
            "leave `sensor` out, for it is read at the time stamp; of a column of counts say {scale}"
        );
        Some((signal.id.to_owned(), message, Some(help)))
    }

    /// Index among the measured signals of the plant's signal `index`; none where nothing measures it itself.
    pub fn measured_index(&self, index: usize) -> Option<usize> {
        self.measured.iter().position(|m| m.index == index)
    }

    /// Index of a signal by id; the error is `(message, help)`.
    ///
    /// # Errors
    ///
    /// There is no signal with the id.
    pub fn find_signal(&self, id: &str) -> Result<usize, (String, Option<String>)> {
        signal_index(self.plant, id).ok_or_else(|| {
            let ids: Vec<&str> = signals(self.plant).map(|s| s.id).collect();
            (
                format!(
                    "the plant `{}` has no signal `{id}`, expected one of {}",
                    self.plant.id,
                    ids.join(", ")
                ),
                nearest(id, ids).map(|n| format!("did you mean `{n}`?")),
            )
        })
    }

    /// Index of the signal that is the integral of the signal `index`, if the plant has it.
    pub fn integral_of(&self, index: usize) -> Option<usize> {
        let id = signals(self.plant).nth(index)?.id;
        let (_, integral) = self.plant.integrals.iter().find(|(rate, _)| *rate == id)?;
        signal_index(self.plant, integral)
    }

    /// Values of all parameters, in order; NaN where none is known yet.
    pub fn values(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .map(|p| p.value.unwrap_or(f64::NAN))
            .collect()
    }

    /// Values of all parameters, in order; where none is known yet, a size that is admissible.
    pub fn declared_values(&self) -> Vec<f64> {
        self.parameters
            .iter()
            .map(|p| p.value.unwrap_or_else(|| p.declaration.nearest(p.scale())))
            .collect()
    }

    /// Names of the parameters that have no value yet.
    pub fn missing_values(&self) -> Vec<&str> {
        self.parameters
            .iter()
            .filter(|p| p.value.is_none())
            .map(|p| p.name.as_str())
            .collect()
    }

    /// Sets all values, in order.
    pub fn set_values(&mut self, values: &[f64]) {
        for (parameter, value) in self.parameters.iter_mut().zip(values) {
            parameter.value = value.is_finite().then_some(*value);
        }
        self.follow_ties();
    }

    /// How the `index`-th input runs between the samples of a log.
    pub fn hold(&self, index: usize) -> Hold {
        let input = self.plant.inputs.get(index);
        input
            .and_then(|i| self.log.inputs.get(i.id))
            .map_or(Hold::ZeroOrder, ColumnMap::hold)
    }

    /// Number of plant states.
    pub fn n_states(&self) -> usize {
        self.plant.states.len()
    }

    /// Number of signals: states, inputs, outputs.
    pub fn n_signals(&self) -> usize {
        self.plant.states.len() + self.plant.inputs.len() + self.plant.outputs.len()
    }

    /// Number of effort channels.
    pub fn n_efforts(&self) -> usize {
        self.plant
            .channels
            .iter()
            .filter(|c| matches!(c.place, Place::Effort(_)))
            .count()
    }

    /// The same, to be simulated with steps [as long as the motion allows](Model::by_motion).
    #[must_use]
    pub fn with_steps_by_motion(self) -> Self {
        Self {
            by_motion: true,
            ..self
        }
    }

    /// Follows lags down to the `period` between samples, s, where that is shorter than [`SHORTEST_LAG_S`]: no step is longer
    /// than it. Of a shorter one the area after a step is right, and hardly anything else would show in such a log.
    pub fn follow(&mut self, period: f64) {
        if period > 0.0 {
            self.shortest_lag = period.min(SHORTEST_LAG_S);
        }
    }

    /// Longest integration step of the plant where no file gives one, s.
    pub fn usual_step(&self) -> f64 {
        self.time_scale * f64::dynamics(self.dynamics).max_step_s()
    }

    /// Longest usual integration step, s: [`Model::max_step`], or what an effect asks for with
    /// [`EffectMeta::max_step_s`](loopsight_core::EffectMeta::max_step_s). Where neither the file nor an effect says how long
    /// a step may be, one may be a quarter longer, so that a late sample takes no step more.
    pub fn step(&self) -> f64 {
        let effects = self.effects.iter().map(|e| e.meta.max_step_s);
        effects.fold(self.max_step, f64::min)
    }

    /// Parameters of the plant's equations from the model's values.
    ///
    /// # Panics
    ///
    /// When there are fewer values than the model has parameters.
    pub fn lower<S: HostReal>(&self, values: &[S]) -> Vec<S> {
        let mut p = vec![S::zero(); self.plant.parameters.len()];
        self.lower_into(values, &mut p);
        p
    }

    /// As [`Model::lower`], without allocation.
    pub(crate) fn lower_into<S: HostReal>(&self, values: &[S], p: &mut [S]) {
        let of_plant = values.get(..self.n_plant_parameters).unwrap_or(values);
        S::dynamics(self.dynamics).lower(self.set, of_plant, p);
        ties::apply(&self.ties, p);
    }

    /// What follows from the plant's parameters at the model's values.
    ///
    /// # Panics
    ///
    /// When there are fewer values than the model has parameters.
    pub fn derived<S: HostReal>(&self, values: &[S]) -> Vec<(&'static Derived, S)> {
        let p = self.lower(values);
        let dynamics = S::dynamics(self.dynamics);
        let of = |(index, meta)| (meta, dynamics.derived(index, &p));
        dynamics.derivable().iter().enumerate().map(of).collect()
    }

    /// What an effect without states adds at an effort where the flow is `flow` and nothing else is known.
    ///
    /// # Panics
    ///
    /// When there is no such effect, or there are fewer values than the model has parameters.
    pub fn effort_at<S: HostReal>(&self, effect: usize, values: &[S], flow: S) -> S {
        let effect = &self.effects[effect];
        let own = effect.own();
        let at = Reading::nothing().with(Role::Flow, &flow);
        S::physics(effect.physics).contribution(&at, &[], &values[own])
    }

    /// All signals (states, inputs, outputs) at a state and input, without effects.
    ///
    /// # Panics
    ///
    /// When `y` is shorter than states and inputs together, or one of `p`, `x`, `u` is shorter than the plant's.
    pub fn signals_at<S: HostReal>(&self, p: &[S], x: &[S], u: &[S], y: &mut [S]) {
        let (nx, nu) = (x.len(), u.len());
        y[..nx].copy_from_slice(x);
        y[nx..nx + nu].copy_from_slice(u);
        let dynamics = S::dynamics(self.dynamics);
        for (index, output) in y[nx + nu..].iter_mut().enumerate() {
            *output = dynamics.output(index, x, u, p);
        }
    }
}

fn check_inputs(
    plant: &'static PlantMeta,
    log: &LogMap,
    source: &TomlSource,
) -> Result<(), Box<ConfigError>> {
    for id in log.inputs.keys() {
        if !plant.inputs.iter().any(|s| s.id == id) {
            let ids: Vec<&str> = plant.inputs.iter().map(|s| s.id).collect();
            return Err(source.error(
                &["log".into(), "inputs".into(), id.as_str().into()],
                &format!(
                    "the plant `{}` has no input `{id}`, expected one of {}",
                    plant.id,
                    ids.join(", ")
                ),
                nearest(id, ids).map(|n| format!("did you mean `{n}`?")),
            ));
        }
    }
    Ok(())
}
