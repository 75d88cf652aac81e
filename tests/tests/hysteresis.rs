//! The hysteretic oscillator of the literature: what a diagnosis makes of it.

#![allow(
    clippy::unwrap_used,
    reason = "recordings that can be made, and a panic is how this program fails"
)]

use loopsight_diagnosis::{Conclusion, Measurements, Work, compare, diagnose};
use loopsight_hidden::hysteretic_benchmark;
use loopsight_model::model::Model;
use loopsight_plants as _;

/// Noise of the benchmark's estimation data, m; its test data have none.
const NOISE: f64 = 8e-6;
/// A period of its multisines.
const SAMPLES: usize = 8192;

/// Noël and Schoukens (2016): from a linear oscillator hysteresis is named at the mass, with the values of the paper, and
/// the free run of what was fitted leaves at most 1 % of another multisine.
///
/// What is left comes from straight lines between the samples of the force: at 36 Hz, where the machine moves most, they
/// have `sinc²(36/750)`, 0.8 % less than the sines that acted.
#[test]
fn the_oscillator_of_the_literature_is_followed() {
    let log = hysteretic_benchmark(1, SAMPLES, NOISE).unwrap();
    let other = hysteretic_benchmark(2, SAMPLES, 0.0).unwrap();
    let (linear, _) = Model::from_toml("hidden", &log.model_toml).unwrap();
    let (runs, unseen) = ([log.run], [other.run]);
    let found = diagnose(&linear, &Measurements::new(&runs), &Work::quiet()).unwrap();
    assert_eq!(found.verdict, Conclusion::EffectMissing);
    let missing = found.missing.unwrap();
    assert_eq!(
        (missing.effect.as_str(), &missing.at[..]),
        ("hysteresis", &["mass".to_owned()][..])
    );
    let best = &found.candidates[0];
    assert!(best.indistinguishable_from.is_empty());
    for quantity in &log.truth.hidden[0].fitted {
        let value = best.parameters[quantity.name].value;
        println!("{} {value:.5} (true {})", quantity.name, quantity.value);
        assert!((value - quantity.value).abs() < 0.02 * quantity.value.abs());
    }
    let left = |model: &Model| {
        let measured = Measurements::new(&unseen);
        compare(model, &measured, &Work::quiet()).unwrap().nrmse
    };
    let (plain, with) = (left(found.model.as_ref().unwrap()), left(&best.model));
    println!(
        "another multisine: linear {:.2} %, with hysteresis {:.2} %",
        100.0 * plain,
        100.0 * with
    );
    assert!(plain > 0.2 && with < 0.01, "{plain} {with}");
}
