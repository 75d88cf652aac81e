//! Simulation of a composed model: the free run.

pub(crate) mod bound;
mod by_motion;
mod follow;
mod foresee;
pub(crate) mod history;
mod length;
mod lengthen;
mod observer;
mod plan;
mod present;
mod push;
mod ramp;
mod sensing;
mod shorten;
mod start;
mod state_observer;
mod step;
mod stiff;
mod values;
mod watch;

use std::borrow::Cow;
use std::collections::BTreeSet;

use crate::log_map::Hold;
use crate::model::Model;
use crate::registry::HostReal;
use loopsight_core::{NoPast, Place, Rk4};

use bound::{Bounds, Scene};
pub use follow::{follow, free_run, try_follow};
use history::{Between, History};
use length::Length;
use lengthen::Lengthened;
use plan::Plan;
use push::Pushed;
use sensing::{Integral, Sensing, sense};
pub use state_observer::StateObserver;
use stiff::{Implicit, Way};
use watch::Watched;

/// Integrates a model through time.
///
/// The extended state is the plant's, then the effects' states, then running integrals of those
/// measured signals whose mean or past is needed and whose integral the plant does not know.
///
/// Order of evaluation at each stage: effects on inputs, the plant's outputs, efforts, the plant,
/// effects on the rates of its states. Effects with memory on inputs come first, once per
/// integration step, and laws of an actuator's output last; effects on sensors act on what is measured.
#[derive(Clone)]
pub struct Simulator<'m, S> {
    model: Cow<'m, Model>,
    p: Vec<S>,
    values: Vec<S>,
    bounds: Bounds,
    plan: Plan,
    sensors: Vec<Sensing>,
    histories: Vec<History<S>>,
    rk4: Rk4<Vec<S>>,
    implicit: Implicit<S>,
    way: Way,
    x: Vec<S>,
    scratch: Scratch<S>,
    pushed: Pushed<S>,
    /// Integrals behind means at the start of the last interval, one per sensor.
    before: Vec<S>,
    /// What output effects added to angles then, one per output effect.
    added_before: Vec<S>,
    /// Looked at within a step.
    needed: Needed,
    /// Looked at between steps.
    shown: Needed,
    /// Whether those are up to date.
    fresh: bool,
    /// Whether the plant's trail is simulated, too.
    trail: bool,
    time: f64,
    interval: f64,
    /// How long the integration steps are.
    length: Length,
    /// Steps as long as the motion allows, in a search.
    watched: Watched<S>,
    /// Steps longer than that where the samples are far apart and the motion allows them; none where the
    /// file gives the step.
    lengthened: Option<Lengthened<S>>,
    /// How fast each input changes within the interval that is integrated, per second.
    slopes: Vec<f64>,
    /// Inputs that run on straight lines between samples.
    ramped: Vec<usize>,
    /// Samples of a run whose inputs are known to effects that look ahead; 0 where the future is not known.
    foreseen: usize,
}

/// Signals that are looked at, each by its index among its kind. Only these are kept up to date: computing and copying
/// the rest of them took a fifth of a diagnosis.
#[derive(Clone)]
struct Needed {
    states: Vec<usize>,
    inputs: Vec<usize>,
    outputs: Vec<usize>,
}

impl Needed {
    /// Of signals by index among states, inputs and outputs; there are `nx` states and `nu` inputs.
    fn of(signals: impl Iterator<Item = usize>, nx: usize, nu: usize) -> Self {
        let all: BTreeSet<usize> = signals.collect();
        Self {
            states: all.range(..nx).copied().collect(),
            inputs: all.range(nx..nx + nu).map(|i| i - nx).collect(),
            outputs: all.range(nx + nu..).map(|i| i - nx - nu).collect(),
        }
    }
}

#[derive(Clone)]
struct Scratch<S> {
    /// Inputs after the effects with memory.
    held: Vec<S>,
    /// Inputs after all effects.
    u: Vec<S>,
    w: Vec<S>,
    signals: Vec<S>,
}

impl<S: HostReal> Simulator<'static, S> {
    /// As [`Simulator::new`], keeping the model: for a driver, which outlives who builds it.
    ///
    /// # Panics
    ///
    /// When there are fewer values than the model has parameters.
    pub fn owning(model: Model, values: &[S]) -> Self {
        Self::compose(Cow::Owned(model), values)
    }
}

impl<'m, S: HostReal> Simulator<'m, S> {
    /// A simulator of `model` with the parameter `values` (as long as `model.parameters`), at rest.
    ///
    /// # Panics
    ///
    /// When there are fewer values than the model has parameters.
    pub fn new(model: &'m Model, values: &[S]) -> Self {
        Self::compose(Cow::Borrowed(model), values)
    }

    fn compose(model: Cow<'m, Model>, values: &[S]) -> Self {
        let nx = model.n_states();
        let nu = model.plant.inputs.len();
        let bounds = Bounds::of(&model);
        let mut size = nx + bounds.states;
        let sensors: Vec<Sensing> = model
            .measured
            .iter()
            .map(|m| {
                let sensing = sense(&model, &bounds, m.index, &m.sensor, size);
                size += usize::from(matches!(sensing.integral, Integral::State(_)));
                sensing
            })
            .collect();
        let integrated = sensors
            .iter()
            .filter(|s| matches!(s.integral, Integral::State(_)))
            .map(|s| s.index);
        let needed = Needed::of(bounds.read().chain(integrated), nx, nu);
        let sensed = sensors.iter().flat_map(Sensing::signals);
        let shown = Needed::of(bounds.shown().chain(sensed), nx, nu);
        // Not cloned from one: a clone of an empty history has no room kept for what is to come.
        let histories = (0..bounds.histories)
            .map(|i| {
                let smooth = bounds.output_memory.iter().any(|b| b.history == Some(i));
                let mut inputs = bounds.input_memory.iter();
                match inputs.find(|b| b.history == Some(i) && b.ahead > 0.0) {
                    Some(bound) => foresee::history(&model, bound.place),
                    None if smooth => History::new(Between::Smooth),
                    None => History::new(Between::Held),
                }
            })
            .collect();
        let lengthened = (!model.step_given).then(|| Lengthened::new(size));
        let mut simulator = Self {
            p: model.lower(values),
            values: values.to_vec(),
            histories,
            rk4: Rk4::new(vec![S::zero(); size]),
            implicit: Implicit::new(),
            way: Way::Explicit,
            x: vec![S::zero(); size],
            scratch: Scratch {
                held: vec![S::zero(); nu],
                u: vec![S::zero(); nu],
                w: vec![S::zero(); model.n_efforts()],
                signals: vec![S::zero(); model.n_signals()],
            },
            pushed: Pushed::nothing(&model),
            before: vec![S::zero(); sensors.len()],
            added_before: vec![S::zero(); bounds.outputs.len()],
            needed,
            shown,
            fresh: false,
            trail: true,
            sensors,
            plan: Plan::of(&bounds, nx, size),
            bounds,
            time: 0.0,
            interval: 0.0,
            length: Length::of(&model),
            watched: Watched::new(),
            lengthened,
            slopes: vec![0.0; nu],
            ramped: (0..nu)
                .filter(|i| model.hold(*i) == Hold::FirstOrder)
                .collect(),
            foreseen: 0,
            model,
        };
        simulator.reset(&vec![S::zero(); nx], &vec![0.0; nu]);
        simulator.shorten();
        simulator
    }

    /// Time since the start of the run, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The plant state.
    pub fn state(&self) -> &[S] {
        &self.x[..self.model.n_states()]
    }

    /// The plant state, to be corrected.
    pub fn state_mut(&mut self) -> &mut [S] {
        self.fresh = false;
        let nx = self.model.n_states();
        &mut self.x[..nx]
    }

    /// All signals of the plant (states, inputs, outputs) now.
    pub fn signals(&mut self) -> &[S] {
        let nx = self.model.n_states();
        let Scratch { held, signals, .. } = &mut self.scratch;
        self.model.signals_at(&self.p, &self.x[..nx], held, signals);
        &self.scratch.signals
    }

    /// Brings the signals that are looked at between steps up to date.
    fn refresh(&mut self) {
        if std::mem::replace(&mut self.fresh, true) {
            return;
        }
        let (nx, nu) = (self.model.n_states(), self.model.plant.inputs.len());
        let Scratch { held, signals, .. } = &mut self.scratch;
        let x = &self.x[..nx];
        for i in &self.shown.states {
            signals[*i] = x[*i];
        }
        for i in &self.shown.inputs {
            signals[nx + i] = held[*i];
        }
        let dynamics = S::dynamics(self.model.dynamics);
        dynamics.outputs(
            &self.shown.outputs,
            x,
            held,
            &self.p,
            &mut signals[nx + nu..],
        );
    }

    fn scene(&self) -> Scene<'_, S> {
        Scene {
            values: &self.values,
            x: &self.x,
            signals: &self.scratch.signals,
            time: self.time,
            interval: (self.time - self.interval, self.time),
        }
    }

    /// The integral behind the mean of a sensor; signals must be fresh.
    fn integral(&self, sensor: &Sensing) -> S {
        match sensor.integral {
            Integral::None => S::zero(),
            Integral::Signal(i) => self.scratch.signals[i],
            Integral::State(i) => self.x[i],
        }
    }

    /// Keeps the integrals with which the next interval begins; signals must be fresh.
    fn mark(&mut self) {
        for i in 0..self.sensors.len() {
            self.before[i] = self.integral(&self.sensors[i]);
        }
        if self.sensors.iter().any(|s| !s.through.is_empty()) {
            for i in 0..self.bounds.outputs.len() {
                self.added_before[i] = self.added(i);
            }
        }
    }

    /// What the `i`-th output effect adds to its signal now.
    fn added(&self, i: usize) -> S {
        let bound = &self.bounds.outputs[i];
        let Place::Output(index) = bound.place else {
            return S::zero();
        };
        self.scene()
            .contribution(bound, self.scratch.signals[index], &NoPast)
    }

    /// Writes the present into the past of sensors with memory; signals must be fresh.
    fn remember(&mut self) {
        for k in 0..self.bounds.output_memory.len() {
            let bound = &self.bounds.output_memory[k];
            let (Some(history), Place::Output(index)) = (bound.history, bound.place) else {
                continue;
            };
            let Some(sensor) = self.sensors.iter().find(|s| s.index == index) else {
                continue;
            };
            let value = self.scratch.signals[index] + self.output_effects(index);
            let integral = self.integral(sensor);
            self.histories[history].pass(self.time, value, integral);
        }
    }

    /// The sum of what the effects without memory add to an output now.
    fn output_effects(&self, index: usize) -> S {
        let scene = self.scene();
        let mut value = self.scratch.signals[index];
        for bound in self
            .bounds
            .outputs
            .iter()
            .filter(|b| b.place == Place::Output(index))
        {
            value += scene.contribution(bound, value, &NoPast);
        }
        value - self.scratch.signals[index]
    }

    /// Integrates to `until` (s since the start of the run) with `input` applied from now on.
    ///
    /// # Panics
    ///
    /// When there are fewer inputs than the plant has.
    pub fn advance(&mut self, until: f64, input: &[f64]) {
        if !self.sensors.is_empty() {
            self.refresh();
            self.mark();
        }
        for bound in &self.bounds.input_memory {
            if let (Some(history), Place::Input(i)) = (bound.history, bound.place)
                && self.slopes[i] == 0.0
                && !bound.knows_ahead(self.foreseen)
            {
                self.histories[history].hold(self.time, S::of(input[i]));
            }
        }
        let span = until - self.time;
        let steps = self.length.steps(span);
        if self.lengthens(steps) {
            self.advance_lengthened(input, span, steps);
        } else if (steps > 1 || self.watched.steps_are_short(span)) && self.goes_by_motion() {
            self.advance_by_motion(input, span, steps);
        } else {
            self.integrate(input, span, steps, true);
        }
        for x in &mut self.x {
            *x = x.settled();
        }
        self.time = until;
        self.interval = span;
    }

    /// Integrates over `span` in so many equal `steps`, and writes down the past of sensors that need one
    /// where it is to `remember`.
    fn integrate(&mut self, input: &[f64], span: f64, steps: usize, remember: bool) {
        let start = self.time;
        // By the usual numbers without a division, which would wait for the number: to the same digits.
        let h = match steps {
            1 => span,
            2 => 0.5 * span,
            4 => 0.25 * span,
            _ => span / steps as f64,
        };
        let remember = remember && !self.bounds.output_memory.is_empty();
        if !remember && self.is_even() {
            self.apply(input, 0.0);
            return self.step(start, h, steps);
        }
        for step in 0..steps {
            let elapsed = h * step as f64;
            self.apply(input, elapsed);
            self.step(start + elapsed, h, 1);
            if remember {
                self.time = start + h * (step + 1) as f64;
                self.refresh();
                self.remember();
            }
        }
    }

    /// What the sensors read now. A mean is taken over the last [`Simulator::advance`]; at the
    /// start of a run it is the value itself.
    pub fn measure(&mut self, measured: &mut [S]) {
        self.refresh();
        for (i, (to, sensor)) in measured.iter_mut().zip(&self.sensors).enumerate() {
            let mean = sensor.is_mean && self.interval > 0.0;
            *to = if mean {
                (self.integral(sensor) - self.before[i]) / S::of(self.interval)
            } else {
                self.scratch.signals[sensor.index] + self.output_effects(sensor.index)
            };
            if mean {
                for (effect, gain) in &sensor.through {
                    let change = self.added(*effect) - self.added_before[*effect];
                    *to += change * S::of(gain / self.interval);
                }
            }
            let mut scene = self.scene();
            if !mean {
                scene.interval = (self.time, self.time);
            }
            for bound in &self.bounds.output_memory {
                if let (Some(history), true) =
                    (bound.history, bound.place == Place::Output(sensor.index))
                {
                    *to += scene.contribution(bound, *to, &self.histories[history]);
                }
            }
        }
    }
}
