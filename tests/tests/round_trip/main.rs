//! What a file says survives being read, written and read again.

#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "what is written here can be read, and a panic is how this program fails"
)]

mod parts;

use std::collections::BTreeMap;
use std::fmt::Debug;

use loopsight_core::{Parameter, PlaceKind};
use loopsight_model::config::TomlSource;
use loopsight_model::excitation::{Between, Excitation};
use loopsight_model::identification::LearningSettings;
use loopsight_model::log_map::{Column, ColumnMap, Hold, Labels, LogMap, Measured, Ranges};
use loopsight_model::loop_file::LoopFile;
use loopsight_model::model::{FitTable, Model, ModelFile, SimulationTable, misfit};
use loopsight_model::registry::{
    ControllerPart, DriverPart, EstimatorPart, effects, parts as linked, plants,
};
use loopsight_model::regression::Scheme;
use loopsight_model::sensor::{Encoder, Sensor};
use loopsight_plants as _;
use loopsight_tests as _;
use parts::{controller, driver, estimator, limits, supervisor};
use proptest::collection::{btree_map, btree_set, vec};
use proptest::option;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::RngSeed;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// Seeded: a failure on one machine is a failure on every machine.
fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(37),
        failure_persistence: None,
        ..ProptestConfig::default()
    }
}

/// Any admissible value of a parameter, the ends of its range included where they belong to it.
fn admissible(parameter: &'static Parameter) -> BoxedStrategy<f64> {
    let (low, high) = (parameter.min, parameter.max);
    let from = if low.is_finite() { low } else { -1e12 };
    let to = if high.is_finite() { high } else { 1e12 };
    prop_oneof![
        from..=to,
        // Small numbers have digits too.
        (-12i32..12, -1.0..1.0f64).prop_map(move |(power, m)| {
            let value = m * 10f64.powi(power);
            value.clamp(from, to)
        }),
        Just(from),
        Just(to),
        Just(parameter.default.unwrap_or(1.0)),
    ]
    .prop_filter("in the range", move |v| parameter.admits(*v))
    .boxed()
}

/// A table with some of the parameters.
fn table(parameters: &'static [Parameter]) -> BoxedStrategy<String> {
    let entries: Vec<_> = parameters
        .iter()
        .map(|p| option::of(admissible(p)).prop_map(|v| (p.id, v)))
        .collect();
    entries
        .prop_map(|entries| {
            let given = entries.into_iter().filter_map(|(id, v)| Some((id, v?)));
            given.map(|(id, v)| format!("{id} = {v:?}\n")).collect()
        })
        .boxed()
}

/// A plant's table: its own parameters or another set.
fn plant_table() -> BoxedStrategy<(&'static str, String)> {
    let mut all: Vec<BoxedStrategy<(&'static str, String)>> = Vec::new();
    for meta in plants() {
        let own = table(meta.parameters);
        all.push(
            own.prop_map(|t| (meta.id, format!("[plant.{}]\n{t}", meta.id)))
                .boxed(),
        );
        for set in meta.parameterizations {
            let other = table(set.parameters);
            all.push(
                other
                    .prop_map(|t| (meta.id, format!("[plant.{}.{}]\n{t}", meta.id, set.id)))
                    .boxed(),
            );
        }
    }
    proptest::strategy::Union::new(all).boxed()
}

/// An effect's table on channels of `plant` where it fits, and whether it shifts an input in time.
fn effect_table(plant: &'static str) -> BoxedStrategy<(bool, String)> {
    let meta = plants().into_iter().find(|p| p.id == plant).unwrap();
    let all: Vec<BoxedStrategy<(bool, String)>> = effects()
        .into_iter()
        .filter_map(|effect| {
            let channels: Vec<&str> = meta
                .channels
                .iter()
                .filter(|c| misfit(c, effect).is_none())
                .map(|c| c.id)
                .collect();
            let at = (!channels.is_empty()).then(|| vec(select(channels), 1..3))?;
            let shifts = effect.memory && effect.places == [PlaceKind::Input];
            let text = (at, table(effect.parameters)).prop_map(move |(at, t)| {
                let id = effect.id;
                (
                    shifts,
                    format!("\n[[effect]]\n[effect.{id}]\nat = {at:?}\n{t}"),
                )
            });
            Some(text.boxed())
        })
        .collect();
    proptest::strategy::Union::new(all).boxed()
}

fn model_text() -> impl Strategy<Value = String> {
    plant_table()
        .prop_flat_map(|(plant, text)| (Just(text), vec(effect_table(plant), 0..4)))
        .prop_map(|(plant, effects)| {
            // An input is shifted once.
            let first = effects.iter().position(|(shifts, _)| *shifts);
            let kept = effects.iter().enumerate();
            let kept = kept.filter(|(i, (shifts, _))| !shifts || Some(*i) == first);
            kept.fold(plant, |text, (_, (_, effect))| text + effect)
        })
}

/// Reads, writes and reads; returns both readings.
fn twice<T: DeserializeOwned + Serialize>(text: &str) -> (T, T) {
    let first: T = TomlSource::parse("first.toml", text)
        .unwrap()
        .read()
        .unwrap();
    let written = toml::to_string(&first).unwrap();
    let second = TomlSource::parse("second.toml", &written).unwrap().read();
    (first, second.unwrap_or_else(|e| panic!("{e}\n{written}")))
}

fn same<T: PartialEq + Debug + DeserializeOwned + Serialize>(
    value: &T,
) -> Result<(), TestCaseError> {
    let written = toml::to_string(value).unwrap();
    let back: T = TomlSource::parse("written.toml", &written)
        .unwrap()
        .read()
        .unwrap();
    prop_assert_eq!(value, &back, "{}", written);
    Ok(())
}

proptest! {
    #![proptest_config(config(512))]
    #[test]
    fn models(text in model_text()) {
        let (first, second): (ModelFile, ModelFile) = twice(&text);
        prop_assert_eq!(first.plant.meta().id, second.plant.meta().id);
        prop_assert_eq!(first.plant.values(), second.plant.values());
        prop_assert_eq!(first.effect.len(), second.effect.len());
        for (a, b) in first.effect.iter().zip(&second.effect) {
            prop_assert_eq!(a.meta().id, b.meta().id);
            prop_assert_eq!(a.at(), b.at());
            prop_assert_eq!(a.values(), b.values());
        }
        prop_assert_eq!(format!("{:?}", &first), format!("{:?}", &second));

        // What a fit writes back into the file is what it reads to.
        let (model, source) = Model::from_toml("model.toml", &text).unwrap();
        let halved: Vec<_> = model
            .parameters
            .iter()
            .filter_map(|p| {
                let moved = 0.5 * p.value?;
                p.declaration.admits(moved).then(|| (p.path.clone(), moved))
            })
            .collect();
        let (again, _) = Model::from_toml("fitted.toml", &source.with_values(&halved)).unwrap();
        for (path, value) in halved {
            let found = again.parameters.iter().find(|p| p.path == path).unwrap();
            prop_assert_eq!(found.value, Some(value));
        }
    }
}

fn finite() -> BoxedStrategy<f64> {
    prop_oneof![-100.0..100.0, any::<f64>()]
        .prop_filter("finite", |v: &f64| v.is_finite())
        .boxed()
}

/// Whole numbers that TOML has.
fn seed() -> std::ops::RangeInclusive<u64> {
    0..=(i64::MAX as u64)
}

fn excitation() -> impl Strategy<Value = Excitation> {
    let random = (finite(), finite(), seed(), any::<bool>(), 2u32..);
    let between = prop_oneof![
        Just(Between::Held),
        Just(Between::Straight),
        Just(Between::Smooth)
    ];
    let leaf = prop_oneof![
        finite().prop_map(Excitation::Constant),
        (
            vec(proptest::array::uniform2(finite()), 0..5),
            between.clone()
        )
            .prop_map(|(at, between)| Excitation::Waypoints { at, between }),
        (proptest::option::of("[a-z]{1,4}"), between).prop_map(|(column, between)| {
            Excitation::File {
                path: "wave.csv".into(),
                column,
                between,
            }
        }),
        vec(proptest::array::uniform2(finite()), 0..5).prop_map(|at| Excitation::Steps { at }),
        (finite(), finite(), finite(), finite()).prop_map(|(from, to, start_s, duration_s)| {
            Excitation::Ramp {
                from,
                to,
                start_s,
                duration_s,
            }
        }),
        (finite(), finite(), finite()).prop_map(|(amplitude, frequency_hz, phase_rad)| {
            Excitation::Sine {
                amplitude,
                frequency_hz,
                phase_rad,
            }
        }),
        (finite(), finite(), finite(), finite()).prop_map(
            |(amplitude, from_hz, to_hz, duration_s)| Excitation::Chirp {
                amplitude,
                from_hz,
                to_hz,
                duration_s,
            }
        ),
        random
            .clone()
            .prop_map(|(amplitude, hold_s, seed, common, _)| Excitation::Prbs {
                amplitude,
                hold_s,
                seed,
                common,
            }),
        random.prop_map(
            |(amplitude, hold_s, seed, common, levels)| Excitation::MultiLevel {
                amplitude,
                hold_s,
                levels,
                seed,
                common,
            }
        ),
    ];
    leaf.prop_recursive(3, 12, 3, |inner| vec(inner, 0..4).prop_map(Excitation::Sum))
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Inputs {
    inputs: BTreeMap<String, Excitation>,
}

proptest! {
    #![proptest_config(config(256))]
    #[test]
    fn excitations(inputs in btree_map("[a-z_]{1,12}", excitation(), 0..3)) {
        same(&Inputs { inputs })?;
    }
}

/// Names as people write them, quotes and umlauts included.
fn name() -> &'static str {
    "[a-zA-Z0-9_ .äµ\"'\\\\#=-]{0,12}"
}

fn sensor() -> impl Strategy<Value = Sensor> {
    prop_oneof![
        Just(Sensor::Instantaneous),
        Just(Sensor::IntervalMean),
        (finite(), btree_map(name(), finite(), 0..3)).prop_map(|(counts, of)| {
            Sensor::EncoderCounts(Encoder {
                counts_per_revolution: counts,
                of,
            })
        }),
    ]
}

fn column() -> impl Strategy<Value = ColumnMap> {
    prop_oneof![
        name().prop_map(ColumnMap::Name),
        (
            name(),
            option::of(name()),
            finite(),
            option::of(name()),
            finite(),
            select(vec![Hold::ZeroOrder, Hold::FirstOrder]),
        )
            .prop_map(|(column, unit, scale, scale_unit, offset, hold)| {
                ColumnMap::Full(Column {
                    column,
                    unit,
                    scale,
                    scale_unit,
                    offset,
                    hold,
                })
            }),
    ]
}

fn ranges() -> impl Strategy<Value = Ranges> {
    let part = (finite(), finite()).prop_map(|(a, b)| (a.min(b), a.max(b)));
    vec(part, 0..3).prop_map(Ranges::of)
}

fn measured() -> impl Strategy<Value = Measured> {
    let scale = option::of(finite());
    let unit = || option::of(name());
    let offset = option::of(finite());
    (option::of(name()), unit(), scale, unit(), offset, sensor()).prop_map(
        |(column, unit, scale, scale_unit, offset, sensor)| Measured {
            column,
            unit,
            scale,
            scale_unit,
            offset,
            sensor,
        },
    )
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Tables {
    log: LogMap,
    simulation: SimulationTable,
    fit: FitTable,
}

proptest! {
    #![proptest_config(config(256))]
    #[test]
    fn the_other_tables_of_a_model(
        time in option::of(column()),
        period_s in option::of(finite()),
        run in option::of(name()),
        side_by_side in btree_set(name(), 0..3),
        inputs_measured in any::<bool>(),
        parts in (ranges(), ranges()),
        inputs in btree_map(name(), column(), 0..3),
        measured in btree_map(name(), measured(), 0..3),
        max_step_s in option::of(finite()),
        free in vec(name(), 0..3),
        fixed in vec(name(), 0..3),
    ) {
        same(&Tables {
            log: LogMap {
                time,
                period_s,
                run,
                side_by_side: Labels::of(side_by_side),
                inputs_measured,
                rows: parts.0,
                times_s: parts.1,
                inputs,
                measured,
            },
            simulation: SimulationTable { max_step_s },
            fit: FitTable {
                per_run: free.clone(),
                free,
                fixed,
                tied: Vec::new(),
            },
        })?;
    }
}

proptest! {
    #![proptest_config(config(256))]
    #[test]
    fn loops(
        head in (option::of(name()), name(), finite(), option::of(finite()), any::<bool>()),
        driver in driver(),
        controller in controller(),
        estimator in option::of(estimator()),
        euler in any::<bool>(),
        reference in btree_map(name(), excitation(), 0..3),
        log in option::of(name()),
        certainty_equivalence in option::of(any::<bool>()),
        limits in btree_map(name(), limits(), 0..3),
        supervisor in option::of(supervisor()),
    ) {
        let learning = certainty_equivalence.map(|certainty_equivalence| LearningSettings {
            certainty_equivalence,
            ..LearningSettings::default()
        });
        let (name, model, period_s, duration_s, real_time) = head;
        let file = LoopFile {
            name,
            model,
            period_s,
            duration_s,
            real_time,
            driver,
            controller: Box::new(controller),
            estimator: estimator.map(|part| Box::new(part) as Box<dyn EstimatorPart>),
            regression: if euler { Scheme::Euler } else { Scheme::Integrated },
            learning,
            reference,
            limits,
            supervisor,
            log,
        };
        let written = toml::to_string(&file).unwrap();
        let source = TomlSource::parse("written.toml", &written).unwrap();
        let back = LoopFile::parse(&source).unwrap();
        // Parts behind traits are compared by what they print, which holds every digit.
        prop_assert_eq!(format!("{:?}", &file), format!("{:?}", &back), "{}", written);
    }

    /// Every part that is linked, also one this file has never heard of, by its example.
    #[test]
    fn examples_of_parts(index in any::<Index>()) {
        #[derive(Debug, Serialize, Deserialize)]
        struct Example {
            #[serde(skip_serializing_if = "Option::is_none")]
            estimator: Option<Box<dyn EstimatorPart>>,
            #[serde(skip_serializing_if = "Option::is_none")]
            controller: Option<Box<dyn ControllerPart>>,
            #[serde(skip_serializing_if = "Option::is_none")]
            driver: Option<Box<dyn DriverPart>>,
        }
        let all = linked();
        let (first, second): (Example, Example) = twice(index.get(&all).example);
        prop_assert_eq!(format!("{first:?}"), format!("{second:?}"));
    }
}

/// Files as the examples have them, by what they print.
#[test]
fn models_of_the_registry() {
    let examples = plants().into_iter().map(|meta| meta.example.to_owned());
    let files = [
        "expressions/pendulum.toml",
        "expressions/robot.toml",
        "expressions/twil.toml",
        "own-states/clutch.toml",
        "own-states/clutch_candidate.toml",
        "own-states/oscillator.toml",
    ];
    let own = files.map(|name| {
        let path = loopsight_tests::repository().join("examples");
        std::fs::read_to_string(path.join(name)).unwrap()
    });
    for text in examples.chain(own) {
        let (first, second): (ModelFile, ModelFile) = twice(&text);
        assert_eq!(format!("{first:?}"), format!("{second:?}"));
        // Written anew, it is the same model.
        let written = toml::to_string(&first).unwrap();
        let models = [&text, &written].map(|t| Model::from_toml("model.toml", t).unwrap().0);
        assert_eq!(models[0].parameters, models[1].parameters);
    }
}
