//! A signal that counts the other way than the model.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight::{Answer, DiagnoseOptions, Log, Model, Session};
use loopsight_tests::Random;
use serde_json::Value;

/// What a diagnosis advises of two tanks in cascade whose lower level is read with this scale.
fn advice(scale: f64) -> Vec<(String, String)> {
    let mut random = Random::new(4);
    let (mut upper, mut lower, mut pump, mut until) = (0.1f64, 0.1f64, 4.0, 0);
    let mut log = "time_s,pump_V,level_upper_m,level_lower_m\n".to_owned();
    for k in 0..9000 {
        if k == until {
            pump = 2.0 + 6.0 * random.share();
            until = k + 300 + random.below(900);
        }
        if k % 10 == 0 {
            let seen = [upper, lower].map(|level| level + 1e-3 * (random.share() - 0.5));
            writeln!(log, "{},{pump:.3},{:.4},{:.4}", k / 10, seen[0], seen[1]).unwrap();
        }
        let flow = |level: f64| (2.0 * 9.81 * level.max(0.0)).sqrt();
        let between = 2e-3 * flow(upper);
        lower += 0.1 * (between - 1.8e-3 * flow(lower));
        upper += 0.1 * (7e-4 * pump - between);
    }
    let text = format!(
        "[plant.tank_pair]\n[log.measured.level_upper]\n[log.measured.level_lower]\nscale = {scale:.1}\n"
    );
    let model = Model::from_toml("tanks.toml", &text).unwrap();
    let log = Log::from_bytes("tanks.csv", log.as_bytes()).unwrap();
    let session = Session::new(model, log).unwrap();
    let answer = session.diagnose(&DiagnoseOptions::default()).unwrap();
    let answer: Value = serde_json::from_str(&answer.to_json().unwrap()).unwrap();
    let advice = answer["advice"].as_array().unwrap().iter();
    let text = |value: &Value| value.as_str().unwrap().to_owned();
    advice
        .map(|a| (text(&a["why"]), text(&a["experiment"])))
        .collect()
}

#[test]
fn a_level_that_counts_downwards_is_named() {
    let wrong = advice(-1.0);
    let (why, experiment) = wrong.first().unwrap();
    assert!(why.contains("`level_lower` the other way round"), "{why}");
    assert!(experiment.contains("`scale = 1` in [log.measured.level_lower]"));
    let right = advice(1.0);
    assert!(
        !right.iter().any(|(why, _)| why.contains("other way round")),
        "{right:?}"
    );
}
