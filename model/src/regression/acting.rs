//! The effects of a model, where its regression is taken.

use crate::model::Model;
use crate::simulate::bound::{Bound, Bounds, Scene};
use crate::simulate::history::{Between, History};
use loopsight_core::{Dynamics, NoPast, Place};

/// Steps per period in which an effect with states of its own follows an input.
const STEPS: usize = 4;

/// The effects of a model between command and rate, at given values of all parameters.
///
/// Those that make an input late (with memory, or with states of their own) are followed through
/// time with the inputs applied; what an input comes to is its mean over the period. Those that act
/// at once are evaluated with the plant. Effects on efforts and rates that have states of their own,
/// and those on sensors, are left out.
#[derive(Clone)]
pub(super) struct Acting {
    pub(super) values: Vec<f64>,
    late: Vec<Bound>,
    inputs: Vec<Bound>,
    efforts: Vec<Bound>,
    bodies: Vec<Bound>,
    histories: Vec<History<f64>>,
    /// Extended state: that of the plant at the last sample, then those of the effects.
    x: Vec<f64>,
    rates: Vec<f64>,
    u: Vec<f64>,
    signals: Vec<f64>,
    period: f64,
    time: f64,
    begun: bool,
}

impl Acting {
    /// `None` where no effect acts between command and rate.
    pub(super) fn new(model: &Model, values: &[f64], period: f64) -> Option<Self> {
        let bounds = Bounds::of(model);
        let histories = (0..bounds.histories).map(|_| History::new(Between::Held));
        let (slow, inputs) = bounds.inputs.into_iter().partition(|b| b.n_z > 0);
        let late: Vec<Bound> = bounds.input_memory.into_iter().chain(slow).collect();
        let at_once = |list: Vec<Bound>| -> Vec<Bound> {
            list.into_iter()
                .filter(|b| b.n_z == 0 && b.history.is_none())
                .collect()
        };
        let size = model.n_states() + bounds.states;
        let acting = Self {
            values: values.to_vec(),
            late,
            inputs: at_once(inputs),
            efforts: at_once(bounds.efforts),
            bodies: at_once(bounds.bodies),
            histories: histories.collect(),
            x: vec![0.0; size],
            rates: vec![0.0; size],
            u: vec![0.0; model.plant.inputs.len()],
            signals: vec![0.0; model.n_signals()],
            period,
            time: 0.0,
            begun: false,
        };
        let lists = [
            &acting.late,
            &acting.inputs,
            &acting.efforts,
            &acting.bodies,
        ];
        lists.iter().any(|l| !l.is_empty()).then_some(acting)
    }

    /// Effects of `model` (by index) of which nothing is followed here: those on sensors, and those on
    /// efforts and rates that have states of their own.
    pub(super) fn left_out(model: &Model) -> Vec<usize> {
        let bounds = Bounds::of(model);
        let sensed = bounds.outputs.iter().chain(&bounds.output_memory);
        let slow = bounds.efforts.iter().chain(&bounds.bodies);
        let slow = slow.filter(|b| b.n_z > 0 || b.history.is_some());
        let mut list: Vec<usize> = sensed.chain(slow).map(|b| b.effect).collect();
        list.dedup();
        list
    }

    /// Follows the inputs through a period (the nominal one where `span` is not known), and replaces
    /// them by what they come to.
    pub(super) fn follow(
        &mut self,
        model: &Model,
        p: &[f64],
        span: Option<f64>,
        input: &mut [f64],
    ) {
        if self.late.is_empty() {
            return;
        }
        let span = span.unwrap_or(self.period);
        let (from, to) = (self.time, self.time + span);
        for i in 0..self.late.len() {
            let Place::Input(at) = self.late[i].place else {
                continue;
            };
            let nominal = input[at];
            model.signals_at(p, &self.x[..model.n_states()], input, &mut self.signals);
            input[at] += match self.late[i].history {
                Some(history) => {
                    self.histories[history].hold(from, nominal);
                    let scene = self.scene(from, (from, to));
                    scene.contribution(&self.late[i], nominal, &self.histories[history])
                }
                None => self.settle(i, nominal, span),
            };
        }
        self.time = to;
        self.begun = true;
    }

    /// Mean of what the `i`-th late effect adds to its constant input in a period, with its states
    /// integrated by the midpoint rule.
    fn settle(&mut self, i: usize, nominal: f64, span: f64) -> f64 {
        let z = self.late[i].z..self.late[i].z + self.late[i].n_z;
        let (at, h) = ((self.time, self.time), span / STEPS as f64);
        if !self.begun {
            let mut start = [0.0; 8];
            let n = z.len().min(start.len());
            self.scene(self.time, at)
                .initial(&self.late[i], nominal, &NoPast, &mut start[..n]);
            self.x[z.clone()][..n].copy_from_slice(&start[..n]);
        }
        let mut sum = 0.0;
        for _ in 0..STEPS {
            let mut before = [0.0; 8];
            for (to, k) in before.iter_mut().zip(z.clone()) {
                *to = self.x[k];
            }
            for share in [0.5, 1.0] {
                let mut rates = std::mem::take(&mut self.rates);
                self.scene(self.time, at)
                    .rates(&self.late[i], nominal, &NoPast, &mut rates);
                self.rates = rates;
                for (k, from) in z.clone().zip(before) {
                    self.x[k] = from + share * h * self.rates[k];
                }
                Scene::confine(&self.values, &self.late[i], &mut self.x);
                if share < 1.0 {
                    let scene = self.scene(self.time, at);
                    sum += scene.contribution(&self.late[i], nominal, &NoPast);
                }
            }
        }
        sum / STEPS as f64
    }

    /// Remembers where the plant was, for effects on inputs that read it.
    pub(super) fn remember(&mut self, x: &[f64]) {
        for (to, from) in self.x.iter_mut().zip(x) {
            *to = *from;
        }
    }

    /// The rate of the plant's states at `x` with the inputs `input` after what makes them late.
    pub(super) fn rate(
        &mut self,
        model: &Model,
        dynamics: &dyn Dynamics<f64>,
        at: (&[f64], &[f64]),
        p: &[f64],
        w: &mut [f64],
        dx: &mut [f64],
    ) {
        let (x, input) = at;
        self.remember(x);
        self.u.copy_from_slice(input);
        let mut u = std::mem::take(&mut self.u);
        model.signals_at(p, x, &u, &mut self.signals);
        for bound in &self.inputs {
            if let Place::Input(i) = bound.place {
                u[i] += self.added(bound, u[i]);
            }
        }
        if !self.inputs.is_empty() {
            model.signals_at(p, x, &u, &mut self.signals);
        }
        w.fill(0.0);
        for bound in &self.efforts {
            if let Place::Effort(i) = bound.place {
                w[i] += self.added(bound, w[i]);
            }
        }
        dynamics.derivative(x, &u, w, p, dx);
        for bound in &self.bodies {
            if let Place::Rate(i) = bound.place {
                dx[i] += self.added(bound, dx[i]);
            }
        }
        w.fill(0.0);
        self.u = u;
    }

    fn added(&self, bound: &Bound, nominal: f64) -> f64 {
        let at = (self.time, self.time);
        self.scene(self.time, at)
            .contribution(bound, nominal, &NoPast)
    }

    fn scene(&self, time: f64, interval: (f64, f64)) -> Scene<'_, f64> {
        Scene {
            values: &self.values,
            x: &self.x,
            signals: &self.signals,
            time,
            interval,
        }
    }
}
