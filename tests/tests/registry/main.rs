//! Every part that is linked says of itself what a person needs, and what it says is true.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "a part that breaks its word is how this program fails"
)]

mod parts;

use std::collections::BTreeSet;

use loopsight_core::unit::parse;
use loopsight_core::{EffectMeta, Parameter, Place, PlaceKind, PlantMeta, Real, Signal};
use loopsight_model::model::{Model, misfit, signals};
use loopsight_model::registry::{effects, parts, plants};
use loopsight_model::sensor::Sensor;
use loopsight_model::simulate::Simulator;
use loopsight_model::{Dual, derivative, variable};

fn said(of: &str, what: &str, text: &str) {
    assert!(!text.trim().is_empty(), "{of}: the {what} is empty");
}

fn snake_case(of: &str, id: &str) {
    let mut letters = id.chars();
    let first = letters.next().is_some_and(|c| c.is_ascii_lowercase());
    let rest = letters.all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
    assert!(first && rest, "{of}: `{id}` is not snake_case");
}

fn unit(of: &str, text: &str) {
    if let Err(error) = parse(text) {
        panic!("{of}: the unit `{text}`: {error}");
    }
}

fn distinct<'a>(of: &str, ids: impl IntoIterator<Item = &'a str>) {
    let mut seen = BTreeSet::new();
    for id in ids {
        assert!(seen.insert(id), "{of}: `{id}` is there twice");
    }
}

fn parameters(of: &str, list: &[Parameter]) {
    distinct(of, list.iter().map(|p| p.id));
    for parameter in list {
        let of = format!("{of}, parameter `{}`", parameter.id);
        said(&of, "symbol", parameter.symbol);
        said(&of, "doc", parameter.doc);
        assert!(parameter.min <= parameter.max, "{of}: an empty range");
        assert!(
            parameter.scale > 0.0 && parameter.scale.is_finite(),
            "{of}: scale"
        );
        if let Some(default) = parameter.default {
            assert!(
                parameter.admits(default),
                "{of}: the default {default} is out of range"
            );
        }
    }
}

fn check_signals(of: &str, list: &[Signal]) {
    for signal in list {
        let of = format!("{of}, signal `{}`", signal.id);
        snake_case(&of, signal.id);
        said(&of, "symbol", signal.symbol);
        said(&of, "doc", signal.doc);
        unit(&of, signal.unit);
    }
}

#[test]
fn something_is_linked_and_nothing_twice() {
    assert!(loopsight_model::registry::duplicates().is_empty());
    for (what, n) in [
        ("plants", plants().len()),
        ("effects", effects().len()),
        ("parts", parts().len()),
    ] {
        assert!(n >= 2, "{n} {what}");
    }
    // `loopsight explain` takes an id without its role.
    let ids = plants().iter().map(|m| m.id).collect::<Vec<_>>();
    let ids = ids.into_iter().chain(effects().into_iter().map(|m| m.id));
    distinct("the registry", ids.chain(parts().into_iter().map(|m| m.id)));
}

#[test]
fn plants_keep_their_word() {
    for meta in plants() {
        let of = format!("plant `{}`", meta.id);
        snake_case(&of, meta.id);
        for (what, text) in [
            ("summary", meta.summary),
            ("equation", meta.equation),
            ("reference", meta.reference),
            ("assumptions", meta.assumptions),
            ("example", meta.example),
        ] {
            said(&of, what, text);
        }
        let all: Vec<Signal> = signals(meta).copied().collect();
        distinct(&of, all.iter().map(|s| s.id));
        check_signals(&of, &all);
        assert!(!meta.states.is_empty() && !meta.inputs.is_empty(), "{of}");
        parameters(&of, meta.parameters);
        for parameter in meta.parameters {
            unit(&format!("{of}, `{}`", parameter.id), parameter.unit);
        }
        for set in meta.parameterizations {
            let of = format!("{of}, parameters `{}`", set.id);
            snake_case(&of, set.id);
            said(&of, "summary", set.summary);
            parameters(&of, set.parameters);
            for parameter in set.parameters {
                unit(&format!("{of}, `{}`", parameter.id), parameter.unit);
            }
            let key = meta.parameters.iter().find(|p| p.id == set.id);
            assert!(key.is_none(), "{of}: also the name of a parameter");
        }
        for quantity in loopsight_model::registry::derived(meta.id) {
            said(&of, quantity.id, quantity.equation);
            said(&of, quantity.id, quantity.doc);
            unit(&of, quantity.unit);
        }
        for state in meta.controlled {
            assert!(
                *state < meta.states.len(),
                "{of}: no state {state} to control"
            );
        }
        channels(&of, meta);
        let (model, _) = Model::from_toml("example", meta.example).unwrap();
        assert_eq!(model.plant.id, meta.id);
        assert_eq!(
            model.missing_values(),
            Vec::<&str>::new(),
            "{of}: the example"
        );
        let derived = model.derived(&model.values());
        assert!(derived.iter().all(|(_, v)| v.is_finite()), "{of}: derived");
    }
}

fn channels(of: &str, meta: &PlantMeta) {
    distinct(of, meta.channels.iter().map(|c| c.id));
    let n_signals = meta.states.len() + meta.inputs.len() + meta.outputs.len();
    let mut efforts = Vec::new();
    for channel in meta.channels {
        let of = format!("{of}, channel `{}`", channel.id);
        for piece in channel.id.split('.') {
            snake_case(&of, piece);
        }
        said(&of, "equation", channel.equation);
        said(&of, "doc", channel.doc);
        unit(&of, channel.unit);
        assert!(
            [-1, 0, 1].contains(&channel.side),
            "{of}: side {}",
            channel.side
        );
        distinct(&of, channel.reads.iter().map(|r| r.0.name()));
        for read in channel.reads {
            assert!(
                meta.states
                    .iter()
                    .chain(meta.inputs)
                    .chain(meta.outputs)
                    .any(|s| s.id == read.1),
                "{of}: the {} is `{}`, which is no signal",
                read.0.name(),
                read.1
            );
        }
        // What is added to a signal has its unit.
        let (limit, index, of_unit) = match channel.place {
            Place::Effort(i) => {
                efforts.push(i);
                continue;
            }
            Place::Input(i) => (meta.inputs.len(), i, meta.inputs.get(i).map(|s| s.unit)),
            Place::Rate(i) => (meta.states.len(), i, None),
            Place::Output(i) => {
                let all = meta.states.iter().chain(meta.inputs).chain(meta.outputs);
                (n_signals, i, all.clone().nth(i).map(|s| s.unit))
            }
        };
        assert!(index < limit, "{of}: place {index} of {limit}");
        if let Some(expected) = of_unit {
            assert_eq!(parse(channel.unit), parse(expected), "{of}: unit");
        }
    }
    efforts.sort_unstable();
    let without_gaps: Vec<usize> = (0..efforts.len()).collect();
    assert_eq!(
        efforts, without_gaps,
        "{of}: numbers of the effort channels"
    );
}

/// `plant` with `effect` at `channel` and the values given.
fn with_effect(plant: &PlantMeta, effect: &EffectMeta, channel: &str) -> Model {
    let text = format!(
        "{}\n[[effect]]\n[effect.{}]\nat = [\"{channel}\"]\n",
        plant.example, effect.id
    );
    Model::from_toml("model.toml", &text).unwrap().0
}

#[test]
fn effects_keep_their_word() {
    for meta in effects() {
        let of = format!("effect `{}`", meta.id);
        snake_case(&of, meta.id);
        for (what, text) in [
            ("summary", meta.summary),
            ("symptom", meta.symptom),
            ("remedy", meta.remedy),
            ("equation", meta.equation),
            ("reference", meta.reference),
            ("example", meta.example),
        ] {
            said(&of, what, text);
        }
        assert!(!meta.places.is_empty(), "{of}: no place");
        parameters(&of, meta.parameters);
        for parameter in meta.parameters {
            snake_case(&of, parameter.id);
            said(&format!("{of}, `{}`", parameter.id), "unit", parameter.unit);
            assert!(parameter.id != "at", "{of}: `at` names the channels");
        }
        let fits: Vec<(&PlantMeta, &str)> = fitting(meta);
        assert!(!fits.is_empty(), "{of}: fits nowhere");
        let built = plants().iter().any(|plant| {
            let text = format!("{}\n{}", plant.example, meta.example);
            Model::from_toml("example", &text)
                .is_ok_and(|(model, _)| model.effects.iter().all(|e| e.meta.id == meta.id))
        });
        assert!(built, "{of}: the example builds with no plant");
    }
}

/// Where an effect fits: all channels of all plants.
fn fitting(effect: &EffectMeta) -> Vec<(&'static PlantMeta, &'static str)> {
    plants()
        .into_iter()
        .flat_map(|plant| plant.channels.iter().map(move |channel| (plant, channel)))
        .filter(|(_, channel)| misfit(channel, effect).is_none())
        .map(|(plant, channel)| (plant, channel.id))
        .collect()
}

/// An admissible value at which a parameter matters, away from whole multiples of the sampling
/// period, where a delay has a kink.
fn lively(parameter: &Parameter) -> f64 {
    match parameter.default {
        Some(value) if value != 0.0 => value,
        Some(value) => parameter.nearest(value + 1.37 * parameter.scale),
        None => parameter.nearest(f64::NAN),
    }
}

/// All signals of the plant that a sensor could read, driven for half a second.
fn trajectory<S: loopsight_model::registry::HostReal>(model: &Model, values: &[S]) -> Vec<S> {
    let mut simulator = Simulator::new(model, values);
    let nu = model.plant.inputs.len();
    let start = vec![0.0; nu];
    simulator.reset(&vec![S::of(0.0); model.n_states()], &start);
    let mut all = Vec::new();
    let mut row = vec![S::of(0.0); model.measured.len()];
    for k in 0..50 {
        let time = f64::from(k) * 0.01;
        let input: Vec<f64> = (0..nu)
            .map(|i| {
                let phase = i as f64;
                6.0 * (9.0 * time + 0.7 + phase).sin() + 2.0 * (31.0 * time + phase).cos()
            })
            .collect();
        simulator.advance(time + 0.01, &input);
        simulator.measure(&mut row);
        all.extend_from_slice(&row);
    }
    all
}

/// Derivatives by the parameters `which` of `model`, through dual numbers, against differences.
fn derivatives_agree(of: &str, mut model: Model, which: std::ops::Range<usize>) {
    let ids: Vec<(String, Sensor)> = model
        .plant
        .states
        .iter()
        .chain(model.plant.outputs)
        .map(|s| (s.id.to_owned(), Sensor::Instantaneous))
        .collect();
    model.measure(&ids).unwrap();
    let values = model.values();
    let n = model.measured.len();
    for j in which {
        let parameter = &model.parameters[j];
        let of = format!("{of}, by `{}` at {}", parameter.name, values[j]);
        let seeded: Vec<Dual> = values
            .iter()
            .enumerate()
            .map(|(i, v)| {
                if i == j {
                    variable(*v, 0)
                } else {
                    Dual::of(*v)
                }
            })
            .collect();
        let exact = trajectory(&model, &seeded);
        let step = 1e-5 * parameter.declaration.scale.max(values[j].abs());
        let at = |value: f64| {
            let mut moved = values.clone();
            moved[j] = value;
            trajectory(&model, &moved)
        };
        let (above, below) = (at(values[j] + step), at(values[j] - step));
        for signal in 0..n {
            let pick = |k: usize| k * n + signal;
            let samples = exact.len() / n;
            let numeric = |k: usize| (above[pick(k)] - below[pick(k)]) / (2.0 * step);
            let largest = (0..samples).fold(0.0f64, |a, k| a.max(numeric(k).abs()));
            let size = (0..samples).fold(0.0f64, |a, k| a.max(above[pick(k)].abs()));
            // Rounding of the difference itself, and a few samples next to a kink.
            let band = 1e-4 * largest + 1e-12 * size / step + 1e-12;
            let off = (0..samples)
                .filter(|k| {
                    let error = (derivative(&exact[pick(*k)], 0) - numeric(*k)).abs();
                    error.is_nan() || error > band
                })
                .count();
            assert!(
                off * 20 <= samples,
                "{of}: {off} of {samples} derivatives of `{}` differ from the numeric ones by more \
                 than {band:e} (the largest is {largest:e})",
                model.measured[signal].signal.id
            );
        }
    }
}

#[test]
fn derivatives_by_the_parameters_of_effects_are_those_of_the_equations() {
    for effect in effects() {
        for (plant, channel) in fitting(effect) {
            let mut model = with_effect(plant, effect, channel);
            let first = model.effects[0].first_parameter;
            let last = first + effect.parameters.len();
            for parameter in &mut model.parameters[first..last] {
                parameter.value = Some(lively(parameter.declaration));
            }
            let of = format!("effect `{}` at `{channel}` of `{}`", effect.id, plant.id);
            derivatives_agree(&of, model, first..last);
        }
    }
}

#[test]
fn derivatives_by_the_parameters_of_plants_are_those_of_the_equations() {
    for plant in plants() {
        let of = format!("plant `{}`", plant.id);
        let (model, _) = Model::from_toml("example", plant.example).unwrap();
        let n = model.parameters.len();
        derivatives_agree(&of, model, 0..n);
        for set in plant.parameterizations {
            let mut text = format!("[plant.{}.{}]\n", plant.id, set.id);
            for parameter in set.parameters {
                text.push_str(&format!("{} = {:?}\n", parameter.id, lively(parameter)));
            }
            let (model, _) = Model::from_toml("example", &text).unwrap();
            let n = model.parameters.len();
            derivatives_agree(&format!("{of}, `{}`", set.id), model, 0..n);
        }
    }
}

/// Where an effect is added, the units and defaults that depend on the channel are filled in.
#[test]
fn effects_have_units_and_values_wherever_they_are_added() {
    for effect in effects() {
        for (plant, channel) in fitting(effect) {
            let model = with_effect(plant, effect, channel);
            for parameter in &model.parameters[model.effects[0].first_parameter..] {
                let of = format!("`{}` at `{channel}` of `{}`", parameter.name, plant.id);
                unit(&of, &parameter.unit);
                assert!(
                    parameter.value.is_some() || parameter.free,
                    "{of}: no default, and a fit does not estimate it"
                );
                if let Some(value) = parameter.value {
                    assert!(parameter.declaration.admits(value), "{of}: {value}");
                }
            }
        }
    }
}

#[test]
fn kinds_of_places_have_names_of_their_own() {
    let kinds = [
        PlaceKind::Effort,
        PlaceKind::Input,
        PlaceKind::Body,
        PlaceKind::Output,
    ];
    distinct("kinds of places", kinds.map(PlaceKind::name));
}
