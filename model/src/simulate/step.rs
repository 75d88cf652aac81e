//! One integration step: what acts on the plant, and by which method it moves.

use super::bound::Scene;
use super::ramp::{hold_means, ramped};
use super::sensing::Integral;
use super::stiff::Way;
use super::{Scratch, Simulator};
use crate::model::Model;
use crate::registry::HostReal;
use loopsight_core::{NoPast, Place};

impl<S: HostReal> Simulator<'_, S> {
    /// One integration step, from the inputs in `held`; leaves those at its end there.
    pub(super) fn step(&mut self, from: f64, h: f64) {
        self.fresh = false;
        let Self {
            model,
            p,
            values,
            bounds,
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
        scratch.w.copy_from_slice(&pushed.efforts);
        let (nx, nu) = (model.n_states(), model.plant.inputs.len());
        let dynamics = S::dynamics(model.dynamics);
        let plain = bounds.idle() && x.len() == nx && pushed.rates.is_empty() && !ramping;
        if plain && *way == Way::Explicit {
            // Nothing changes what acts on the plant within the step: half the time.
            let (h, held, w) = (S::of(h), &scratch.held, &scratch.w);
            if *trail {
                dynamics.step(x, h, held, w, p);
            } else {
                dynamics.step_motion(x, h, held, w, p);
            }
            return;
        }
        let Scratch {
            held,
            u,
            w,
            signals,
        } = scratch;
        let changing = ramping || !bounds.inputs.is_empty();
        let rates = |stage: usize, x: &[S], dx: &mut [S]| {
            let time = from + h * [0.0, 0.5, 0.5, 1.0][stage];
            let plant_x = &x[..nx];
            let u: &mut [S] = if changing {
                u.copy_from_slice(held);
                u
            } else {
                held
            };
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
            let now = Scene {
                values,
                x,
                signals: &[],
                time,
                interval: (time, time),
            };
            if !bounds.inputs.is_empty() {
                let scene = Scene { signals, ..now };
                for bound in &bounds.inputs {
                    let Place::Input(i) = bound.place else {
                        continue;
                    };
                    scene.rates(bound, u[i], &NoPast, dx);
                    let add = scene.contribution(bound, u[i], &NoPast);
                    u[i] += add;
                }
                refresh(u, signals);
            }
            let scene = Scene { signals, ..now };
            if !bounds.efforts.is_empty() {
                w.copy_from_slice(&pushed.efforts);
                for bound in &bounds.efforts {
                    let Place::Effort(i) = bound.place else {
                        continue;
                    };
                    scene.rates(bound, w[i], &NoPast, dx);
                    let add = scene.contribution(bound, w[i], &NoPast);
                    w[i] += add;
                }
            }
            let dx_of_plant = &mut dx[..nx];
            if *trail {
                dynamics.derivative(plant_x, u, w, p, dx_of_plant);
            } else {
                dynamics.motion(plant_x, u, w, p, dx_of_plant);
            }
            for (rate, push) in dx.iter_mut().zip(&pushed.rates) {
                *rate += *push;
            }
            for bound in &bounds.bodies {
                let Place::Rate(i) = bound.place else {
                    continue;
                };
                let nominal = dx[i];
                scene.rates(bound, nominal, &NoPast, dx);
                dx[i] += scene.contribution(bound, nominal, &NoPast);
            }
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
