//! What every effect owes to those who use it: neutral defaults, influence, exact derivatives, and
//! a declaration that reads.

#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::BTreeMap;

use loopsight_core::{EffectMeta, Place, Real, unit};
use loopsight_model::model::{Model, misfit};
use loopsight_model::registry;
use loopsight_model::run::Run;
use loopsight_model::sensor::{Encoder, Sensor};
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_model::{Dual, derivative, variable};
use loopsight_plants as _;

mod sharp;

const DDMR: &str = "[plant.ddmr]\nK_A = -15.146\nK_B = 0.005\nK_C = 0.136\nK_D = -9.573\n\
                    K_E = -3.945\nK_F = 0.656\nhalf_track = 0.131\nwheel_radius = 0.05\n";
const AXIS: &str = "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n";
const TANKS: &str = "[plant.tank_pair]\npump = 2.0e-3\noutlet_upper = 4.0e-3\ninlet_lower = 4.0e-3\noutlet_lower = 3.5e-3\n";

fn model(text: &str) -> Model {
    Model::from_toml("test.toml", text).unwrap().0
}

/// Levels that change every 0.25 s, among them pauses, for 10 s.
fn run(model: &Model) -> Run {
    let n_inputs = model.plant.inputs.len();
    let mut state = 12_345u32;
    let mut level = vec![0.0; n_inputs];
    let mut run = Run::empty(n_inputs, model.measured.len());
    for k in 0..1000 {
        if k % 25 == 0 {
            for u in &mut level {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                *u = f64::from((state >> 24) % 9) * 2.31 - 9.24;
            }
        }
        let missing = vec![f64::NAN; run.n_measured()];
        run.push(0.01 * f64::from(k), &level, &missing).unwrap();
    }
    run
}

fn simulate<S: registry::HostReal>(model: &Model, values: &[S]) -> Vec<Vec<S>> {
    let mut simulator = Simulator::new(model, values);
    let mut all = Vec::new();
    let x0 = vec![S::zero(); model.n_states()];
    free_run(&mut simulator, &x0, &run(model), |_, y| {
        all.push(y.to_vec())
    });
    all
}

/// The largest difference of two simulations, by signal, relative to the size of the second.
fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let signals = a[0].len();
    assert!(signals > 0, "nothing is compared");
    (0..signals)
        .map(|i| {
            let largest = b.iter().fold(0.0f64, |m, y| m.max(y[i].abs()));
            let off = a
                .iter()
                .zip(b)
                .fold(0.0f64, |m, (a, b)| m.max((a[i] - b[i]).abs()));
            off / largest.max(1e-12)
        })
        .fold(0.0, f64::max)
}

/// The channels an effect fits: singly, or by family where it acts on all of them only.
fn channel_sets(model: &Model, meta: &EffectMeta) -> Vec<Vec<&'static str>> {
    let fitting = model
        .plant
        .channels
        .iter()
        .filter(|c| misfit(c, meta).is_none());
    if !meta.shared_only {
        return fitting.map(|c| vec![c.id]).collect();
    }
    let mut families: BTreeMap<&str, Vec<&'static str>> = BTreeMap::new();
    for channel in fitting {
        let family = channel.id.split('.').next().unwrap();
        families.entry(family).or_default().push(channel.id);
    }
    families.into_values().collect()
}

/// What is measured to see an effect at these channels: a few ways of measuring.
fn sensors(model: &Model, at: &[&str]) -> Vec<Vec<(String, Sensor)>> {
    let signals: Vec<&str> = loopsight_model::model::signals(model.plant)
        .map(|s| s.id)
        .collect();
    let outputs: Vec<usize> = model
        .plant
        .channels
        .iter()
        .filter(|c| at.contains(&c.id))
        .filter_map(|c| match c.place {
            Place::Output(i) => Some(i),
            _ => None,
        })
        .collect();
    if outputs.is_empty() {
        let with = |sensor: Sensor| {
            model
                .plant
                .controlled
                .iter()
                .map(move |i| (*i, sensor.clone()))
        };
        return vec![
            with(Sensor::IntervalMean)
                .map(|(i, s)| (signals[i].to_owned(), s))
                .collect(),
        ];
    }
    [Sensor::Instantaneous, Sensor::IntervalMean]
        .iter()
        .map(|sensor| {
            outputs
                .iter()
                .map(|i| (signals[*i].to_owned(), sensor.clone()))
                .collect()
        })
        .collect()
}

/// Every effect at all channels where it fits, with what is measured.
fn each_case(mut check: impl FnMut(&str, Model, std::ops::Range<usize>, &[Vec<f64>])) {
    for text in [DDMR, AXIS] {
        let plain = model(text);
        for meta in registry::effects() {
            for at in channel_sets(&plain, meta) {
                for measured in sensors(&plain, &at) {
                    let mut plain = plain.clone();
                    plain.measure(&measured).unwrap();
                    let with = plain.with_effect(meta.id, &at).unwrap();
                    let own = plain.parameters.len()..with.parameters.len();
                    let name = format!("{} at {at:?}, {}", meta.id, measured[0].1.name());
                    let nominal = simulate(&plain, &plain.values());
                    check(&name, with, own, &nominal);
                }
            }
        }
    }
}

/// Values that do nothing, with stops within reach of a motion: one that is far away shows nothing of its effect.
fn neutral_within(model: &Model, own: std::ops::Range<usize>) -> Vec<f64> {
    let mut values = model.values();
    for i in own {
        let parameter = &model.parameters[i];
        if let Some(end) = parameter.declaration.limits {
            values[i] = end.sign() * 0.2 * parameter.size;
        }
    }
    values
}

/// Values off neutral: those of the declaration's scale, or a start.
fn noticeable(model: &Model, own: std::ops::Range<usize>) -> Vec<f64> {
    let mut values = neutral_within(model, own.clone());
    for i in own {
        let parameter = &model.parameters[i];
        if parameter.free && parameter.declaration.limits.is_none() {
            let starts = parameter.starts(10.0);
            values[i] = match starts.get(1.min(starts.len().saturating_sub(1))) {
                Some(start) => 0.97 * start,
                None => values[i] + 0.73 * parameter.scale(),
            };
            assert!(
                parameter.declaration.admits(values[i]),
                "{}",
                parameter.name
            );
        } else if parameter.declaration.id == "reference" {
            // About the commands: the square of many volts would be too many.
            values[i] = 6.0;
        }
    }
    values
}

fn derivatives(model: &Model, values: &[f64], by: usize) -> Vec<Vec<f64>> {
    let mut dual: Vec<Dual> = values.iter().map(|v| Dual::of(*v)).collect();
    dual[by] = variable(values[by], 0);
    simulate(model, &dual)
        .iter()
        .map(|y| y.iter().map(|v| derivative(v, 0)).collect())
        .collect()
}

#[test]
fn every_effect_fits_somewhere_and_its_declaration_reads() {
    let mut cases: BTreeMap<&str, usize> = BTreeMap::new();
    for text in [DDMR, AXIS, TANKS] {
        let plain = model(text);
        for meta in registry::effects() {
            for at in channel_sets(&plain, meta) {
                *cases.entry(meta.id).or_default() += 1;
                let with = plain.with_effect(meta.id, &at).unwrap();
                for parameter in &with.parameters {
                    unit::parse(&parameter.unit).unwrap_or_else(|e| {
                        panic!("{}: {}: {e:?}", parameter.name, parameter.unit)
                    });
                }
            }
        }
    }
    for meta in registry::effects() {
        assert!(cases.contains_key(meta.id), "{} fits nowhere", meta.id);
        for text in [
            meta.summary,
            meta.symptom,
            meta.remedy,
            meta.equation,
            meta.reference,
        ] {
            assert!(!text.is_empty(), "{}", meta.id);
        }
        for simpler in meta.simpler {
            assert!(
                registry::effects().iter().any(|m| m.id == *simpler),
                "{simpler}"
            );
        }
        let reads = [DDMR, AXIS, TANKS].iter().any(|plant| {
            Model::from_toml("test.toml", &format!("{plant}{}", meta.example)).is_ok()
        });
        assert!(reads, "the example of {} does not read", meta.id);
    }
}

/// A power of what the lag leaves, wherever it stands in the file: half way up, the square is a quarter.
#[test]
fn the_law_of_an_actuator_acts_last() {
    let power =
        "[[effect]]\n[effect.input_power]\nat = [\"input\"]\nexponent = 2.0\nreference = 6.0\n";
    let lag = "[[effect]]\n[effect.actuator_lag]\nat = [\"input\"]\nlag = 0.1\n";
    let run = |effects: &str| {
        let seen = "[log.measured]\nspeed = { sensor = \"instantaneous\" }\n";
        let model = model(&format!("{AXIS}{effects}{seen}"));
        simulate(&model, &model.values())
    };
    let (first, second) = (run(&format!("{power}{lag}")), run(&format!("{lag}{power}")));
    assert!(difference(&first, &second) < 1e-12);
    assert!(difference(&first, &run(power)) > 0.01);
}

#[test]
fn defaults_change_nothing() {
    each_case(|name, with, _, nominal| {
        let off = difference(&simulate(&with, &with.values()), nominal);
        assert!(off < 1e-9, "{name}: {off}");
    });
}

#[test]
fn scales_are_noticed_and_every_parameter_has_its_exact_derivative() {
    each_case(|name, with, own, nominal| {
        let values = noticeable(&with, own.clone());
        let off = difference(&simulate(&with, &values), nominal);
        // An offset of an angle does not show in its rate.
        assert!(
            off > 1e-4 || name.starts_with("sensor_offset"),
            "{name}: {off}"
        );
        assert!(off < 3.0, "{name}: {off}");
        for i in own.filter(|i| with.parameters[*i].free) {
            let parameter = &with.parameters[i];
            let exact = derivatives(&with, &values, i);
            let largest = exact.iter().flatten().fold(0.0f64, |m, d| m.max(d.abs()));
            assert!(largest > 0.0, "{name}: {} has no influence", parameter.name);
            let at = |h: f64| {
                let mut values = values.clone();
                values[i] += h;
                simulate(&with, &values)
            };
            // A short step is rounded off where the influence is weak, a long one is bent where the law is, or a stop is
            // touched within it.
            let worst = [1e-4, 1e-5, 1e-6]
                .map(|share| {
                    let step = share * parameter.scale();
                    let (up, down) = (at(step), at(-step));
                    let numeric = (up.iter().flatten().zip(down.iter().flatten()))
                        .map(|(a, b)| (a - b) / (2.0 * step));
                    (exact.iter().flatten().zip(numeric))
                        .fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
                })
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            assert!(
                worst < 1e-5 * largest,
                "{name}: {}: {}",
                parameter.name,
                worst / largest
            );
        }
    });
}

/// A first look takes steps of 10 ms: they follow every effect, or it asks for shorter ones, which it gets.
#[test]
fn long_steps_follow_every_effect() {
    each_case(|name, with, own, _| {
        let values = noticeable(&with, own);
        let usual = simulate(&with, &values);
        let mut long = with.clone();
        long.max_step = 0.01;
        let asked = long.step() < long.max_step;
        let off = difference(&simulate(&long, &values), &usual);
        let most = if asked { 0.0 } else { 0.05 };
        assert!(off <= most, "{name}: {off}");
    });
}

/// A search takes steps as long as the motion allows, and they follow every effect.
#[test]
fn steps_by_the_motion_follow_every_effect() {
    let mut longer = 0;
    each_case(|name, with, own, _| {
        let values = noticeable(&with, own);
        let usual = simulate(&with, &values);
        let off = difference(&simulate(&with.with_steps_by_motion(), &values), &usual);
        assert!(off <= 2e-4, "{name}: {off}");
        longer += usize::from(off > 0.0);
    });
    assert!(longer > 100, "{longer}");
}

/// Where a fit starts from neutral, it must see which way to go.
#[test]
fn a_fit_can_leave_the_defaults() {
    each_case(|name, with, own, _| {
        let values = neutral_within(&with, own.clone());
        let neutral = simulate(&with, &values);
        for i in own {
            let parameter = &with.parameters[i];
            let declaration = parameter.declaration;
            let starts_elsewhere = declaration.limits.is_some() || !declaration.starts.is_empty();
            if !parameter.free || starts_elsewhere {
                continue;
            }
            let exact = derivatives(&with, &values, i);
            // Shorter than for a scale: a gear whose drive fades away comes to lie within any play.
            let step = 3e-7 * parameter.scale();
            let mut moved = values.clone();
            moved[i] += step;
            let moved = simulate(&with, &moved);
            let largest = exact.iter().flatten().fold(0.0f64, |m, d| m.max(d.abs()));
            let worst = exact
                .iter()
                .flatten()
                .zip(moved.iter().flatten().zip(neutral.iter().flatten()))
                .fold(0.0f64, |m, (d, (a, b))| m.max((d - (a - b) / step).abs()));
            assert!(largest > 0.0, "{name}: {}", parameter.name);
            assert!(
                worst < 1e-3 * largest,
                "{name}: {}: {}",
                parameter.name,
                worst / largest
            );
        }
    });
}

/// What is added to an encoder's angle acts on the speeds that are made from its counts.
#[test]
fn effects_on_encoders_reach_the_speeds_behind_them() {
    let mut plain = model(DDMR);
    let encoder = |left: f64| {
        Sensor::EncoderCounts(Encoder {
            counts_per_revolution: 8192.0,
            of: [
                ("shaft_angle_right".to_owned(), 0.025),
                ("shaft_angle_left".to_owned(), left),
            ]
            .into(),
        })
    };
    plain
        .measure(&[
            ("linear_velocity".to_owned(), encoder(0.025)),
            ("angular_velocity".to_owned(), encoder(-0.025)),
        ])
        .unwrap();
    let nominal = simulate(&plain, &plain.values());
    for (id, at) in [
        (
            "wheel_radius_mismatch",
            vec!["encoder.right", "encoder.left"],
        ),
        ("encoder_ripple", vec!["encoder.left"]),
        ("sensor_lag", vec!["encoder.left"]),
        ("sensor_scale", vec!["encoder.right"]),
    ] {
        let with = plain.with_effect(id, &at).unwrap();
        let own = plain.parameters.len()..with.parameters.len();
        assert!(
            difference(&simulate(&with, &with.values()), &nominal) < 1e-9,
            "{id}"
        );
        let values = noticeable(&with, own);
        assert!(
            difference(&simulate(&with, &values), &nominal) > 1e-3,
            "{id}"
        );
    }
}

/// What is pushed from outside acts as the effect that adds as much at the same place.
#[test]
fn a_push_is_a_constant_effect() {
    let text = format!(
        "{DDMR}[[effect]]\n[effect.coulomb_friction]\nat = [\"wheel.right\"]\nlevel = 0.5\nwidth = 1.0\n\
         [log.measured]\nlinear_velocity = {{ column = \"v_m_per_s\" }}\n\
         angular_velocity = {{ column = \"w_rad_per_s\" }}\n"
    );
    for (with_friction, text) in [(true, text.as_str()), (false, &text.replace("0.5", "0.0"))] {
        let base = model(text);
        for (id, channel, level) in [
            ("constant_force", "wheel.left", 0.7),
            ("constant_force", "body.yaw", -2.0),
            ("input_offset", "input.right", 1.1),
        ] {
            let mut with = base.with_effect(id, &[channel]).unwrap();
            with.parameters.last_mut().unwrap().value = Some(level);
            let expected = simulate(&with, &with.values());
            let place = base.plant.channels.iter().find(|c| c.id == channel);
            let values = base.values();
            let mut simulator = Simulator::new(&base, &values);
            simulator.push(place.unwrap().place, level);
            let mut pushed = Vec::new();
            let x0 = vec![0.0; base.n_states()];
            free_run(&mut simulator, &x0, &run(&base), |_, y| {
                pushed.push(y.to_vec())
            });
            let off = difference(&pushed, &expected);
            assert!(off < 1e-12, "{channel}, friction {with_friction}: {off}");
        }
    }
}

/// A push on the rate of a state is an acceleration.
#[test]
fn a_pushed_rate_is_a_slope() {
    let base = model(
        "[plant.dc_axis]\nK_A = 0.0\nK_C = 3.0\n[log.measured]\nspeed = { column = \"w_rad_per_s\" }\n",
    );
    let values = base.values();
    let mut simulator = Simulator::new(&base, &values);
    simulator.push(Place::Rate(0), 2.0);
    simulator.push(Place::Output(0), 9.0);
    simulator.reset(&[0.0, 0.0], &[0.0]);
    simulator.advance(1.5, &[0.0]);
    assert!((simulator.state()[0] - 3.0).abs() < 1e-12);
    simulator.push(Place::Rate(0), 0.0);
    simulator.advance(2.0, &[0.0]);
    assert!((simulator.state()[0] - 3.0).abs() < 1e-12);
}
