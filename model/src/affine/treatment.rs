//! What a controller can do about each effect of a model, found by evaluating the effect.

use crate::model::{Model, signals};
use crate::simulate::bound::{Bound, Bounds, Scene};
use loopsight_core::{NoPast, Place, PlaceKind};

/// How a loop treats an effect.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Treatment {
    /// Its force is part of the drift, or its action on a command is inverted.
    Compensated(String),
    /// It delays commands or measurements, or distorts measurements: the state is predicted.
    Predicted(String),
    /// The predictor simulates it, but nothing compensates it: which, and why.
    Simulated(String, String),
    /// It is left out: which, and why.
    Unknown(String, String),
}

impl Treatment {
    /// It acts on the plant at once, and is known well enough to be simulated.
    pub(super) fn acts_at_once(&self) -> bool {
        matches!(self, Self::Compensated(_) | Self::Simulated(..))
    }

    /// See [`Treatment::Compensated`].
    pub fn is_compensated(&self) -> bool {
        matches!(self, Self::Compensated(_))
    }

    /// Anything but [`Treatment::Unknown`].
    pub(super) fn is_known(&self) -> bool {
        !matches!(self, Self::Unknown(..))
    }

    /// See [`Treatment::Predicted`].
    pub(super) fn is_predicted(&self) -> bool {
        matches!(self, Self::Predicted(_))
    }

    /// In words, for the notes of a loop.
    pub fn say(&self) -> String {
        match self {
            Self::Compensated(which) => format!("compensated: {which}"),
            Self::Predicted(which) => format!("predicted over: {which}"),
            Self::Simulated(which, why) | Self::Unknown(which, why) => {
                format!("not compensated: {which}, because {why}")
            }
        }
    }
}

/// Values with which every effect shows: zeros and what is not known yet at their scale.
pub(super) fn lively(model: &Model) -> Vec<f64> {
    let value = |(i, p): (usize, &crate::model::ModelParameter)| match p.value {
        Some(value) if value != 0.0 || i < model.n_plant_parameters => value,
        _ => p.scale().max(p.declaration.min).min(p.declaration.max),
    };
    model.parameters.iter().enumerate().map(value).collect()
}

/// How each effect of `model` is treated.
pub(super) fn treatments(model: &Model) -> Vec<Treatment> {
    let trial = Trial::new(model);
    (0..model.effects.len()).map(|i| trial.treat(i)).collect()
}

/// Effects are tried at a state without symmetry.
struct Trial<'m> {
    model: &'m Model,
    bounds: Bounds,
    values: Vec<f64>,
    p: Vec<f64>,
    /// States that nothing measured says anything about.
    unknown: Vec<usize>,
}

impl<'m> Trial<'m> {
    fn new(model: &'m Model) -> Self {
        let values = lively(model);
        let nx = model.n_states();
        let (jacobian, _) = model.measurement_jacobian(&values, &vec![0.0; nx]);
        let unknown = (0..nx)
            .filter(|i| !model.plant.controlled.contains(i))
            .filter(|i| jacobian.column(*i).iter().all(|v| *v == 0.0))
            .collect();
        Self {
            bounds: Bounds::of(model),
            p: model.lower(&values),
            values,
            unknown,
            model,
        }
    }

    /// What is read at `bound` at the state `x` with the inputs `u`: nominal value and all signals.
    fn reading(&self, bound: &Bound, x: &[f64], u: &[f64]) -> (f64, Vec<f64>) {
        let mut signals = vec![0.0; self.model.n_signals()];
        self.model.signals_at(&self.p, x, u, &mut signals);
        let nominal = match bound.place {
            Place::Input(i) => u[i],
            Place::Output(i) => signals[i],
            Place::Effort(_) => 0.0,
            Place::Rate(_) => 1.0,
        };
        (nominal, signals)
    }

    fn scene<'a>(&'a self, x: &'a [f64], signals: &'a [f64], time: f64) -> Scene<'a, f64> {
        Scene {
            values: &self.values,
            x,
            signals,
            time,
            interval: (time, time),
        }
    }

    /// The extended state with the states of `bound` settled, and `beside` that.
    fn settled(&self, bound: &Bound, x: &[f64], u: &[f64], beside: f64) -> Vec<f64> {
        let (nominal, signals) = self.reading(bound, x, u);
        let mut extended = x.to_vec();
        extended.resize(x.len() + self.bounds.states, 0.0);
        let mut z = vec![0.0; bound.n_z];
        self.scene(&extended, &signals, 0.0)
            .initial(bound, nominal, &NoPast, &mut z);
        for (to, z) in extended[bound.z..].iter_mut().zip(&z) {
            *to = z + beside;
        }
        extended
    }

    /// What `bound` adds at the state `x` with the inputs `u` at `time`; states of its own are settled,
    /// or a little `beside` that.
    fn adds(&self, bound: &Bound, x: &[f64], u: &[f64], time: f64, beside: f64) -> f64 {
        let (nominal, signals) = self.reading(bound, x, u);
        let extended = self.settled(bound, x, u, beside);
        self.scene(&extended, &signals, time)
            .contribution(bound, nominal, &NoPast)
    }

    /// Its own states rest, and it adds nothing, when its input is constant: it only delays.
    fn only_delays(&self, bound: &Bound, x: &[f64], u: &[f64]) -> bool {
        let (nominal, signals) = self.reading(bound, x, u);
        let extended = self.settled(bound, x, u, 0.0);
        let scene = self.scene(&extended, &signals, 0.0);
        let mut rates = vec![0.0; extended.len()];
        scene.rates(bound, nominal, &NoPast, &mut rates);
        let small = 1e-9 * nominal.abs();
        rates.iter().all(|r| r.abs() <= small)
            && scene.contribution(bound, nominal, &NoPast).abs() <= small
    }

    fn treat(&self, index: usize) -> Treatment {
        let effect = &self.model.effects[index];
        let places: Vec<&str> = effect.at.iter().map(|c| c.id).collect();
        let which = format!("{} at {}", effect.meta.id, places.join(", "));
        let mut predicted = false;
        for bound in self.bounds.all().filter(|b| b.effect == index) {
            let (memory, kind) = (effect.meta.memory, bound.place.kind());
            let sensed = kind == PlaceKind::Output;
            if effect.meta.ahead_s > 0.0 {
                let why = "a command acts when it is sent, only its recording is late";
                return Treatment::Unknown(which, why.to_owned());
            }
            if memory && (sensed || kind == PlaceKind::Input) {
                predicted = true;
                continue;
            }
            let x: Vec<f64> = (0..self.model.n_states())
                .map(|i| 0.37 + 0.21 * i as f64)
                .collect();
            let u: Vec<f64> = (0..self.model.plant.inputs.len())
                .map(|i| 3.3 - 0.7 * i as f64)
                .collect();
            let first = self.adds(bound, &x, &u, 0.0, 0.0);
            if [0.1, 1.0, 10.0, 100.0, 1000.0]
                .iter()
                .any(|t| self.adds(bound, &x, &u, *t, 0.0) != first)
            {
                let why = "it changes with the time of a recording".to_owned();
                return Treatment::Unknown(which, why);
            }
            if let Some(state) = self.unseen(bound, &x, &u, sensed) {
                let id = signals(self.model.plant).nth(state).map_or("?", |s| s.id);
                let why = format!("it depends on `{id}`, which is not measured");
                return Treatment::Unknown(which, why);
            }
            match kind {
                PlaceKind::Output => predicted = true,
                PlaceKind::Input if bound.n_z > 0 && self.only_delays(bound, &x, &u) => {
                    predicted = true;
                }
                PlaceKind::Input => {
                    if !self.grows(bound, &x, &u) {
                        let why = "what it leaves of a command does not grow with the command";
                        return Treatment::Simulated(which, why.to_owned());
                    }
                }
                PlaceKind::Effort | PlaceKind::Body => {
                    if bound.n_z > 0 || memory {
                        let why = "it has a state of its own that nothing measures";
                        return Treatment::Simulated(which, why.to_owned());
                    }
                    if !self.straight_in_inputs(bound, &x, &u) {
                        let why = "it depends on the command, and not in proportion to it";
                        return Treatment::Simulated(which, why.to_owned());
                    }
                }
            }
        }
        if predicted {
            Treatment::Predicted(which)
        } else {
            Treatment::Compensated(which)
        }
    }

    /// An unknown state that what `bound` adds depends on. A sensor that counts loses nothing by
    /// a dependence in proportion: only the start of the counting differs.
    fn unseen(&self, bound: &Bound, x: &[f64], u: &[f64], sensed: bool) -> Option<usize> {
        self.unknown.iter().copied().find(|i| {
            let at = |way: f64| {
                let mut x = x.to_vec();
                x[*i] += way;
                self.adds(bound, &x, u, 0.0, 0.0)
            };
            let [a, b, c] = [0.0, 0.31, 0.62].map(at);
            let (change, bend) = ((b - a).abs(), (c - 2.0 * b + a).abs());
            if sensed {
                bend > 1e-9 * (change + a.abs())
            } else {
                change > 1e-9 * a.abs().max(1e-9)
            }
        })
    }

    /// More of the command, either way from none, is at first nothing and then more at the plant, and never less
    /// while it is small.
    fn grows(&self, bound: &Bound, x: &[f64], u: &[f64]) -> bool {
        let Place::Input(i) = bound.place else {
            return false;
        };
        let at = |v: f64| {
            let mut u = vec![0.0; u.len()];
            u[i] = v;
            v + self.adds(bound, x, &u, 0.0, 0.1)
        };
        [-1.0, 1.0].iter().all(|sign| {
            let change = |k| sign * (at(sign * 0.01 * 2f64.powi(k)) - at(0.0));
            let first = (0..20).map(change).find(|c| c.abs() > 1e-9);
            first.is_some_and(|c| c > 0.0) && (0..8).map(change).all(|c| c > -1e-9)
        })
    }

    /// What it adds is a straight line in the inputs.
    fn straight_in_inputs(&self, bound: &Bound, x: &[f64], u: &[f64]) -> bool {
        (0..u.len()).all(|i| {
            [1.0, 10.0, 1000.0].iter().all(|way| {
                let at = |share: f64| {
                    let mut u = u.to_vec();
                    u[i] += way * share;
                    self.adds(bound, x, &u, 0.0, 0.0)
                };
                let [a, b, c] = [-1.0, 0.0, 1.0].map(at);
                (a - 2.0 * b + c).abs() <= 1e-9 * (a.abs() + b.abs() + c.abs())
            })
        })
    }
}
