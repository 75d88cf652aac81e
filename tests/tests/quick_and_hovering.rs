//! A machine that is quicker than most, logged at 2 kHz, and one that nothing holds where it is.

#![allow(
    clippy::unwrap_used,
    reason = "an answer without its keys is how this program fails"
)]

use std::fmt::Write;

use loopsight::{Answer, DiagnoseOptions, FitOptions, Log, Model, Session};
use loopsight_tests::Random;
use serde_json::Value;

fn session(model: &str, log: &str) -> Session {
    let model = Model::from_toml("model.toml", model).unwrap();
    let log = Log::from_bytes("log.csv", log.as_bytes()).unwrap();
    Session::new(model, log).unwrap()
}

fn json(text: String) -> Value {
    serde_json::from_str(&text).unwrap()
}

/// A stage on a spring that swings in 72 ms, and whose current follows its command by 3 ms: a lag that begins at 20 ms is another
/// machine, and one that is no lag below 4 ms is none here.
#[test]
fn the_current_of_a_quick_stage_lags_by_three_milliseconds() {
    const STEP: f64 = 1e-5;
    const LAG: f64 = 0.003;
    let mut random = Random::new(7);
    let (mut way, mut speed, mut force, mut command, mut until) = (0.0f64, 0.0f64, 0.0, 0.0, 0);
    let mut log = "time_s,force_N,position_m\n".to_owned();
    for k in 0..(5.0 / STEP) as usize {
        if k == until {
            command = 16.0 * (random.share() - 0.5);
            until = k + 400 * (2 + random.below(28));
            if k == 0 {
                force = command;
            }
        }
        if k % 50 == 0 {
            let seen = way + 1e-5 * (random.share() - 0.5);
            writeln!(log, "{:.4},{command:.4},{seen:.7}", k as f64 * STEP).unwrap();
        }
        force += STEP * (command - force) / LAG;
        let friction = 0.9 * (speed / 0.002).tanh();
        speed += STEP * (force - 900.0 * way - 0.8 * speed - friction) / 0.12;
        way += STEP * speed;
    }
    // Without friction nobody can tell a late force from a late sensor.
    let model = "
[plant.oscillator]
[[effect]]
[effect.coulomb_friction]
at = [\"mass\"]
level = 0.9
[log.measured.position]
";
    let stage = session(model, &log);
    let answer = stage.diagnose(&DiagnoseOptions::default()).unwrap();
    let answer = json(answer.to_json().unwrap());
    let best = &answer["candidates"][0];
    assert_eq!(best["effect"], "actuator_lag", "{best}");
    let lag = best["parameters"]["lag"]["value"].as_f64().unwrap();
    assert!((lag / LAG - 1.0).abs() < 0.02, "{lag}");
}

/// A craft held in the air by its pilot, whose thrust sinks with the battery and grows with a power of the throttle. A free run
/// of a model without that is a kilometre off after a minute, and over some seconds it tells what the throttle does.
#[test]
fn a_craft_whose_model_drifts_away_is_fitted_over_a_shorter_time() {
    const STEP: f64 = 0.002;
    let mut random = Random::new(2);
    let (mut height, mut climb, mut throttle) = (20.0f64, 0.0f64, 0.5f64);
    let mut log = "time_s,throttle_percent,altitude_m,climb_m_s\n".to_owned();
    for k in 0..(40.0 / STEP) as usize {
        let time = k as f64 * STEP;
        if k % 25 == 0 {
            let wanted = 20.0 + 5.0 * (0.44 * time).sin() + 3.0 * (1.19 * time + 1.0).sin();
            let asked =
                0.48 + 0.05 * (wanted - height) - 0.08 * climb + 0.1 * (random.share() - 0.5);
            throttle = asked.clamp(0.1, 0.9);
            let seen = [height, climb].map(|value| value + 0.1 * (random.share() - 0.5));
            writeln!(
                log,
                "{time:.3},{:.1},{:.1},{:.2}",
                100.0 * throttle,
                seen[0],
                seen[1]
            )
            .unwrap();
        }
        let battery = 1.0 - 0.006 * time;
        let thrust = 9.81 * (throttle / 0.45).powf(1.6) * battery;
        climb += STEP * (thrust - 9.81 - 0.06 * climb * climb.abs());
        height += STEP * climb;
    }
    let model = "
[plant.expression.states]
altitude = { unit = \"m\", rate = \"climb\" }
climb = { unit = \"m/s\", rate = \"k * throttle - 9.81\" }
[plant.expression.inputs]
throttle = { unit = \"1\" }
[plant.expression.parameters]
k = { value = 30.0, unit = \"m/s^2\" }
[log.measured]
altitude = {}
climb = {}
";
    let craft = session(model, &log);
    let answer = json(
        (craft.fit(&FitOptions::default()).unwrap())
            .to_json()
            .unwrap(),
    );
    let k = answer["parameters"]["k"]["value"].as_f64().unwrap();
    assert!((19.0..24.0).contains(&k), "{k}");
    let left = answer["nrmse"].as_f64().unwrap();
    let horizon = answer["observer"]["horizon_s"].as_f64().unwrap();
    assert!(left < 0.9 && horizon < 10.0, "{left} over {horizon} s");
}
