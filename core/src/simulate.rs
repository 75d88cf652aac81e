//! A composed model in motion: the free run that everything is judged by.

use std::borrow::Cow;

use crate::model::{Attached, Model};
use crate::registry::HostReal;
use crate::run::Run;
use crate::{NoPast, Past, Place, Reading, Rk4, Role, substeps};

/// Instants of the past that are kept per channel with memory.
const HISTORY: usize = 4096;

/// The past of a piecewise constant signal, kept in a ring so that it never grows.
#[derive(Clone, Debug)]
struct History<S> {
    /// When each value began, s.
    times: Vec<f64>,
    /// The value from then on.
    values: Vec<S>,
    /// Integral of the signal up to then.
    integrals: Vec<S>,
    /// Index of the oldest entry once the ring is full.
    oldest: usize,
}

impl<S: HostReal> History<S> {
    fn new() -> Self {
        Self {
            times: Vec::with_capacity(HISTORY),
            values: Vec::with_capacity(HISTORY),
            integrals: Vec::with_capacity(HISTORY),
            oldest: 0,
        }
    }

    fn clear(&mut self) {
        self.times.clear();
        self.values.clear();
        self.integrals.clear();
        self.oldest = 0;
    }

    /// Index in the vectors of the `i`-th oldest entry.
    fn slot(&self, i: usize) -> usize {
        let n = self.times.len();
        if n < HISTORY {
            i
        } else {
            (self.oldest + i) % HISTORY
        }
    }

    /// From `time` on the signal has `value`.
    fn push(&mut self, time: f64, value: S) {
        let n = self.times.len();
        let integral = if n == 0 {
            S::zero()
        } else {
            let last = self.slot(n - 1);
            self.integrals[last] + self.values[last] * S::of(time - self.times[last])
        };
        if n < HISTORY {
            self.times.push(time);
            self.values.push(value);
            self.integrals.push(integral);
        } else {
            let slot = self.oldest;
            self.times[slot] = time;
            self.values[slot] = value;
            self.integrals[slot] = integral;
            self.oldest = (slot + 1) % HISTORY;
        }
    }

    fn integral_at(&self, time: S) -> S {
        let n = self.times.len();
        if n == 0 {
            return S::zero();
        }
        // The last entry that began before `time`; the oldest one reaches back for ever.
        let (mut low, mut high) = (0, n);
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            if self.times[self.slot(middle)] <= time.value() {
                low = middle
            } else {
                high = middle
            }
        }
        let slot = self.slot(low);
        self.integrals[slot] + self.values[slot] * (time - S::of(self.times[slot]))
    }
}

impl<S: HostReal> Past<S> for History<S> {
    fn mean(&self, from: S, to: S) -> S {
        let span = to - from;
        if span.value() > 0.0 {
            return (self.integral_at(to) - self.integral_at(from)) / span;
        }
        let n = self.times.len();
        let mut value = S::zero();
        for i in 0..n {
            let slot = self.slot(i);
            if i == 0 || self.times[slot] <= to.value() {
                value = self.values[slot];
            }
        }
        value
    }
}

/// An effect at one channel, ready to be evaluated.
#[derive(Clone, Debug)]
struct Bound {
    effect: usize,
    place: Place,
    side: f64,
    reads: [Option<usize>; Role::COUNT],
    /// First of its states in the extended state vector.
    z: usize,
    /// Index into the histories, for effects with memory.
    history: Option<usize>,
}

/// Integrates a model through time.
///
/// The extended state is the plant's, then the effects' states, then one running integral per
/// measured signal that is a mean over the sampling interval.
#[derive(Clone)]
pub struct Simulator<'m, S> {
    model: Cow<'m, Model>,
    p: Vec<S>,
    values: Vec<S>,
    memory: Vec<Bound>,
    inputs: Vec<Bound>,
    efforts: Vec<Bound>,
    bodies: Vec<Bound>,
    outputs: Vec<Bound>,
    histories: Vec<History<S>>,
    rk4: Rk4<Vec<S>>,
    x: Vec<S>,
    scratch: Scratch<S>,
    means: Vec<usize>,
    integrals_before: Vec<S>,
    needs_signals: bool,
    n_effect_states: usize,
    time: f64,
    interval: f64,
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
    pub fn owning(model: Model, values: &[S]) -> Self {
        Self::compose(Cow::Owned(model), values)
    }
}

impl<'m, S: HostReal> Simulator<'m, S> {
    /// A simulator of `model` with the parameter `values` (as long as `model.parameters`), at rest.
    pub fn new(model: &'m Model, values: &[S]) -> Self {
        Self::compose(Cow::Borrowed(model), values)
    }

    fn compose(model: Cow<'m, Model>, values: &[S]) -> Self {
        let nx = model.n_states();
        let (mut memory, mut inputs, mut efforts) = (Vec::new(), Vec::new(), Vec::new());
        let (mut bodies, mut outputs) = (Vec::new(), Vec::new());
        let mut histories = Vec::new();
        let mut z = nx;
        for (index, effect) in model.effects.iter().enumerate() {
            for (channel, reads) in effect.at.iter().zip(&effect.reads) {
                let history = effect.meta.memory.then(|| {
                    histories.push(History::new());
                    histories.len() - 1
                });
                let bound = Bound {
                    effect: index,
                    place: channel.place,
                    side: f64::from(channel.side),
                    reads: *reads,
                    z,
                    history,
                };
                z += effect.meta.states;
                match channel.place {
                    Place::Input(_) if effect.meta.memory => memory.push(bound),
                    Place::Input(_) => inputs.push(bound),
                    Place::Effort(_) => efforts.push(bound),
                    Place::Rate(_) => bodies.push(bound),
                    Place::Output(_) => outputs.push(bound),
                }
            }
        }
        let means: Vec<usize> = model
            .measured
            .iter()
            .filter(|m| m.sensor.is_mean())
            .map(|m| m.index)
            .collect();
        let reads_signals = inputs
            .iter()
            .chain(&efforts)
            .chain(&bodies)
            .any(|b| b.reads.iter().flatten().any(|i| *i >= nx));
        let needs_signals = reads_signals || means.iter().any(|i| *i >= nx);
        let size = z + means.len();
        let mut simulator = Self {
            p: model.lower(values),
            values: values.to_vec(),
            memory,
            inputs,
            efforts,
            bodies,
            outputs,
            histories,
            rk4: Rk4::new(vec![S::zero(); size]),
            x: vec![S::zero(); size],
            scratch: Scratch {
                held: vec![S::zero(); model.plant.inputs.len()],
                u: vec![S::zero(); model.plant.inputs.len()],
                w: vec![S::zero(); model.n_efforts()],
                signals: vec![S::zero(); model.n_signals()],
            },
            integrals_before: vec![S::zero(); means.len()],
            n_effect_states: z - nx,
            means,
            needs_signals,
            time: 0.0,
            interval: 0.0,
            model,
        };
        let input = vec![0.0; simulator.model.plant.inputs.len()];
        simulator.reset(&vec![S::zero(); nx], &input);
        simulator
    }

    /// Starts a run at time 0 from the plant state `x0`, as if `input` had been applied for ever.
    pub fn reset(&mut self, x0: &[S], input: &[f64]) {
        let nx = self.model.n_states();
        self.time = 0.0;
        self.interval = 0.0;
        for (to, from) in self.x.iter_mut().zip(x0) {
            *to = *from;
        }
        for value in &mut self.x[nx..] {
            *value = S::zero();
        }
        self.integrals_before.fill(S::zero());
        for bound in &self.memory {
            if let (Some(history), Place::Input(i)) = (bound.history, bound.place) {
                self.histories[history].clear();
                self.histories[history].push(0.0, S::of(input[i]));
            }
        }
        for (to, from) in self.scratch.held.iter_mut().zip(input) {
            *to = S::of(*from);
        }
        if self.n_effect_states > 0 {
            self.start_effect_states();
        }
    }

    fn start_effect_states(&mut self) {
        let Self {
            model,
            values,
            x,
            scratch,
            p,
            ..
        } = self;
        scratch.u.copy_from_slice(&scratch.held);
        let nx = model.n_states();
        model.signals_at(p, &x[..nx], &scratch.u, &mut scratch.signals);
        let bounds = self
            .memory
            .iter()
            .chain(&self.inputs)
            .chain(&self.efforts)
            .chain(&self.bodies)
            .chain(&self.outputs);
        for bound in bounds {
            let effect = &model.effects[bound.effect];
            let n = effect.meta.states;
            if n == 0 {
                continue;
            }
            let nominal = match bound.place {
                Place::Input(i) => scratch.u[i],
                Place::Output(i) => scratch.signals[i],
                Place::Effort(_) | Place::Rate(_) => S::zero(),
            };
            let reading = reading(bound, &scratch.signals, nominal, 0.0, (0.0, 0.0), &NoPast);
            S::physics(effect.physics).initial_state(
                &reading,
                parameters(effect, values),
                &mut x[bound.z..bound.z + n],
            );
        }
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
        let nx = self.model.n_states();
        &mut self.x[..nx]
    }

    /// Integrates to `until` (s since the start of the run) with `input` applied from now on.
    pub fn advance(&mut self, until: f64, input: &[f64]) {
        let n_extended = self.x.len();
        let n_means = self.means.len();
        self.integrals_before
            .copy_from_slice(&self.x[n_extended - n_means..]);
        for bound in &self.memory {
            if let (Some(history), Place::Input(i)) = (bound.history, bound.place) {
                self.histories[history].push(self.time, S::of(input[i]));
            }
        }
        let span = until - self.time;
        let start = self.time;
        let steps = substeps(span, self.model.max_step);
        let h = span / steps as f64;
        for step in 0..steps {
            self.step(start + h * step as f64, h, input);
        }
        self.time = until;
        self.interval = span;
    }

    /// One integration step.
    fn step(&mut self, from: f64, h: f64, input: &[f64]) {
        let to = from + h;
        for (held, value) in self.scratch.held.iter_mut().zip(input) {
            *held = S::of(*value);
        }
        for bound in &self.memory {
            let (Some(history), Place::Input(i)) = (bound.history, bound.place) else {
                continue;
            };
            let effect = &self.model.effects[bound.effect];
            let nominal = self.scratch.held[i];
            let past = &self.histories[history];
            let reading = reading(
                bound,
                &self.scratch.signals,
                nominal,
                from,
                (from, to),
                past,
            );
            self.scratch.held[i] += S::physics(effect.physics).contribution(
                &reading,
                &self.x[bound.z..bound.z + effect.meta.states],
                parameters(effect, &self.values),
            );
        }
        let Self {
            model,
            p,
            values,
            inputs,
            efforts,
            bodies,
            rk4,
            x,
            scratch,
            means,
            needs_signals,
            ..
        } = self;
        let model: &Model = model;
        let nx = model.n_states();
        let dynamics = S::dynamics(model.dynamics);
        if inputs.is_empty() && efforts.is_empty() && bodies.is_empty() && means.is_empty() {
            // Nothing acts on the plant within the step (`w` stays zero): half the time.
            dynamics.step(&mut x[..nx], S::of(h), &scratch.held, &scratch.w, p);
            return;
        }
        rk4.step(x, S::of(h), |stage, x, dx| {
            let time = from + h * [0.0, 0.5, 0.5, 1.0][stage];
            let plant_x = &x[..nx];
            scratch.u.copy_from_slice(&scratch.held);
            if !inputs.is_empty() {
                model.signals_at(p, plant_x, &scratch.u, &mut scratch.signals);
                for bound in inputs.iter() {
                    let Place::Input(i) = bound.place else {
                        continue;
                    };
                    let nominal = scratch.u[i];
                    let add = evaluate(model, bound, values, scratch, nominal, time, x, dx);
                    scratch.u[i] += add;
                }
            }
            if *needs_signals {
                model.signals_at(p, plant_x, &scratch.u, &mut scratch.signals);
            } else {
                scratch.signals[..nx].copy_from_slice(plant_x);
            }
            scratch.w.fill(S::zero());
            for bound in efforts.iter() {
                let Place::Effort(i) = bound.place else {
                    continue;
                };
                let nominal = scratch.w[i];
                let add = evaluate(model, bound, values, scratch, nominal, time, x, dx);
                scratch.w[i] += add;
            }
            dynamics.derivative(plant_x, &scratch.u, &scratch.w, p, &mut dx[..nx]);
            for bound in bodies.iter() {
                let Place::Rate(i) = bound.place else {
                    continue;
                };
                let nominal = dx[i];
                let add = evaluate(model, bound, values, scratch, nominal, time, x, dx);
                dx[i] += add;
            }
            let first_mean = x.len() - means.len();
            for (k, index) in means.iter().enumerate() {
                dx[first_mean + k] = scratch.signals[*index];
            }
        });
    }

    /// What the sensors read now. A mean is taken over the last [`Simulator::advance`]; at the
    /// start of a run it is the value itself.
    pub fn measure(&mut self, measured: &mut [S]) {
        let nx = self.model.n_states();
        let n_extended = self.x.len();
        let first_mean = n_extended - self.means.len();
        self.scratch.u.copy_from_slice(&self.scratch.held);
        self.model.signals_at(
            &self.p,
            &self.x[..nx],
            &self.scratch.u,
            &mut self.scratch.signals,
        );
        let mut mean = 0;
        for (to, m) in measured.iter_mut().zip(&self.model.measured) {
            *to = self.scratch.signals[m.index];
            if m.sensor.is_mean() {
                if self.interval > 0.0 {
                    *to = (self.x[first_mean + mean] - self.integrals_before[mean])
                        / S::of(self.interval);
                }
                mean += 1;
            }
        }
        for bound in &self.outputs {
            let Place::Output(index) = bound.place else {
                continue;
            };
            let effect = &self.model.effects[bound.effect];
            for (to, m) in measured.iter_mut().zip(&self.model.measured) {
                if m.index == index {
                    let reading = reading(
                        bound,
                        &self.scratch.signals,
                        *to,
                        self.time,
                        (self.time - self.interval, self.time),
                        &NoPast,
                    );
                    *to += S::physics(effect.physics).contribution(
                        &reading,
                        &self.x[bound.z..bound.z + effect.meta.states],
                        parameters(effect, &self.values),
                    );
                }
            }
        }
    }

    /// All signals of the plant (states, inputs, outputs) now.
    pub fn signals(&mut self) -> &[S] {
        let nx = self.model.n_states();
        self.scratch.u.copy_from_slice(&self.scratch.held);
        self.model.signals_at(
            &self.p,
            &self.x[..nx],
            &self.scratch.u,
            &mut self.scratch.signals,
        );
        &self.scratch.signals
    }
}

fn parameters<'v, S>(effect: &Attached, values: &'v [S]) -> &'v [S] {
    &values[effect.first_parameter..effect.first_parameter + effect.meta.parameters.len()]
}

fn reading<'a, S: HostReal>(
    bound: &Bound,
    signals: &[S],
    nominal: S,
    time: f64,
    (from, to): (f64, f64),
    past: &'a dyn Past<S>,
) -> Reading<'a, S> {
    let mut roles = [S::zero(); Role::COUNT];
    for (role, read) in roles.iter_mut().zip(&bound.reads) {
        if let Some(index) = read {
            *role = signals[*index];
        }
    }
    Reading {
        time,
        from,
        to,
        nominal,
        side: S::of(bound.side),
        roles,
        past,
    }
}

/// Contribution of one effect at one channel; its states' rates go into `dx`.
#[allow(
    clippy::too_many_arguments,
    reason = "the pieces of a borrowed simulator"
)]
fn evaluate<S: HostReal>(
    model: &Model,
    bound: &Bound,
    values: &[S],
    scratch: &Scratch<S>,
    nominal: S,
    time: f64,
    x: &[S],
    dx: &mut [S],
) -> S {
    let effect = &model.effects[bound.effect];
    let physics = S::physics(effect.physics);
    let p = parameters(effect, values);
    let n = effect.meta.states;
    let z = &x[bound.z..bound.z + n];
    let reading = reading(
        bound,
        &scratch.signals,
        nominal,
        time,
        (time, time),
        &NoPast,
    );
    if n > 0 {
        physics.state_derivative(&reading, z, p, &mut dx[bound.z..bound.z + n]);
    }
    physics.contribution(&reading, z, p)
}

/// The model simulated over a run from the inputs alone, from the plant state `x0`.
///
/// `each` gets the index of the sample and what the sensors would have read. The first sample is
/// the initial state itself.
pub fn free_run<S: HostReal>(
    simulator: &mut Simulator<'_, S>,
    x0: &[S],
    run: &Run,
    mut each: impl FnMut(usize, &[S]),
) {
    if run.is_empty() {
        return;
    }
    let mut predicted = vec![S::zero(); simulator.model.measured.len()];
    simulator.reset(x0, run.input(0));
    simulator.measure(&mut predicted);
    each(0, &predicted);
    for k in 1..run.len() {
        simulator.advance(run.time[k], run.input(k - 1));
        simulator.measure(&mut predicted);
        each(k, &predicted);
    }
}
