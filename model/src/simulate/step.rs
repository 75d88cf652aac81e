//! Integration steps: what acts on the plant, and by which method it moves.

use super::bound::Scene;
use super::ramp::{hold_means, ramped};
use super::sensing::Integral;
use super::stiff::Way;
use super::{Scratch, Simulator};
use crate::model::Model;
use crate::registry::HostReal;
use loopsight_core::{NoPast, Now, Place, Steps, Under};

/// Where the stages of a step lie, as parts of it.
const PARTS: [f64; 4] = [0.0, 0.5, 0.5, 1.0];

impl<S: HostReal> Simulator<'_, S> {
    /// Whether the steps of an interval differ in nothing but where they begin: the inputs are constant over it, for every
    /// effect.
    pub(super) fn is_even(&self) -> bool {
        self.way == Way::Explicit
            && self.bounds.input_memory.is_empty()
            && self.slopes.iter().all(|slope| *slope == 0.0)
    }

    /// So many integration `steps` of `h` seconds, from the inputs in `held`; leaves those at their end there. More than
    /// one where the interval [is even](Self::is_even).
    pub(super) fn step(&mut self, from: f64, h: f64, steps: usize) {
        self.fresh = false;
        let Self {
            model,
            p,
            values,
            bounds,
            plan,
            sensors,
            histories,
            rk4,
            implicit,
            way,
            x,
            scratch,
            pushed,
            needed,
            slopes,
            foreseen,
            trail,
            watched,
            ..
        } = self;
        let model: &Model = model;
        let ramping = slopes.iter().any(|s| *s != 0.0);
        if ramping {
            hold_means(
                bounds,
                histories,
                &mut scratch.held,
                slopes,
                (from, h),
                *foreseen,
            );
        }
        for bound in &bounds.input_memory {
            let (Some(history), Place::Input(i)) = (bound.history, bound.place) else {
                continue;
            };
            let scene = Scene {
                values,
                x,
                signals: &scratch.signals,
                time: from,
                interval: (from, from + h),
            };
            let nominal = scratch.held[i];
            scratch.held[i] += scene.contribution(bound, nominal, &histories[history]);
        }
        for (held, push) in scratch.held.iter_mut().zip(&pushed.inputs) {
            *held += *push;
        }
        let (nx, nu) = (model.n_states(), model.plant.inputs.len());
        let dynamics = S::dynamics(model.dynamics);
        let Scratch {
            held,
            u,
            w,
            signals,
        } = scratch;
        let changing = ramping || !plan.steady;
        // Nothing is copied for effects that are not there.
        let kept = !changing && plan.inputs.is_empty();
        if !changing && !kept {
            u.copy_from_slice(held);
            let now = Now {
                time: from,
                signals,
                z: &x[nx..],
            };
            for group in &plan.inputs {
                group.act(&now, values, u, &mut []);
            }
        }
        let offered = *way == Way::Explicit && !plan.beside && pushed.rates.is_empty() && !ramping;
        let span = Steps {
            count: steps,
            length: S::of(h),
            watched: watched.now,
        };
        if offered && plan.alone {
            let (u, w) = (if kept { held } else { u }, &pushed.efforts);
            let bend = if *trail {
                dynamics.steps(x, span, u, w, p)
            } else {
                dynamics.steps_of_motion(x, span, u, w, p)
            };
            watched.bend = watched.bend.max(bend);
            return;
        }
        if kept {
            u.copy_from_slice(held);
        }
        w.copy_from_slice(&pushed.efforts);
        if offered {
            let under = Under {
                span,
                u,
                w,
                p,
                states: &needed.states,
                outputs: &needed.outputs,
                trail: *trail,
            };
            let mut act = |(step, stage): (usize, usize), signals: &[S], w: &mut [S]| {
                let now = Now {
                    time: (from + h * step as f64) + h * PARTS[stage],
                    signals,
                    z: &[],
                };
                for group in &plan.efforts {
                    group.act(&now, values, w, &mut []);
                }
            };
            if let Some(bend) = dynamics.steps_under(x, &under, signals, &mut act) {
                watched.bend = watched.bend.max(bend);
                return;
            }
        }
        for step in 0..steps {
            let from = from + h * step as f64;
            let rates = |stage: usize, x: &[S], dx: &mut [S]| {
                let time = from + h * PARTS[stage];
                let (plant_x, z) = x.split_at(nx);
                let (plant_dx, dz) = dx.split_at_mut(nx);
                if changing {
                    u.copy_from_slice(held);
                }
                if ramping {
                    ramped(u, bounds, slopes, time - from);
                }
                for i in &needed.states {
                    signals[*i] = plant_x[*i];
                }
                let refresh = |u: &[S], signals: &mut [S]| {
                    for i in &needed.inputs {
                        signals[nx + i] = u[*i];
                    }
                    if !needed.outputs.is_empty() {
                        dynamics.outputs(&needed.outputs, plant_x, u, p, &mut signals[nx + nu..]);
                    }
                };
                refresh(u, signals);
                if changing && !plan.inputs.is_empty() {
                    let now = Now { time, signals, z };
                    for group in &plan.inputs {
                        group.act(&now, values, u, dz);
                    }
                    refresh(u, signals);
                }
                let now = Now { time, signals, z };
                if !plan.efforts.is_empty() {
                    w.copy_from_slice(&pushed.efforts);
                    for group in &plan.efforts {
                        group.act(&now, values, w, dz);
                    }
                }
                if *trail {
                    dynamics.derivative(plant_x, u, w, p, plant_dx);
                } else {
                    dynamics.motion(plant_x, u, w, p, plant_dx);
                }
                for (rate, push) in plant_dx.iter_mut().zip(&pushed.rates) {
                    *rate += *push;
                }
                for group in &plan.bodies {
                    group.act(&now, values, plant_dx, dz);
                }
                let scene = Scene {
                    values,
                    x,
                    signals,
                    time,
                    interval: (time, time),
                };
                for bound in bounds.outputs.iter().filter(|b| b.n_z > 0) {
                    let Place::Output(i) = bound.place else {
                        continue;
                    };
                    scene.rates(bound, signals[i], &NoPast, dx);
                }
                for sensor in sensors.iter() {
                    let Integral::State(to) = sensor.integral else {
                        continue;
                    };
                    let mut value = signals[sensor.index];
                    for bound in &bounds.outputs {
                        if bound.place == Place::Output(sensor.index) {
                            value += scene.contribution(bound, value, &NoPast);
                        }
                    }
                    dx[to] = value;
                }
            };
            match way {
                Way::Explicit if watched.now => watched.step(rk4, x, h, rates),
                Way::Explicit => rk4.step(x, S::of(h), rates),
                Way::Implicit => implicit.step(x, h, rates),
                Way::Linearise => implicit.linearise(x, rates),
            }
            if bounds.states > 0 {
                for bound in bounds.all() {
                    Scene::confine(values, bound, x);
                }
            }
            if ramping {
                ramped(held, bounds, slopes, h);
            }
        }
    }
}
