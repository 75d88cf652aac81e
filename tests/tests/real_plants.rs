//! The shipped plants against real measurements, beside what others published about them. The
//! recordings are not part of the project: the environment variable `LOOPSIGHT_DATA` names the folder
//! that holds them; the model files are in `fixtures/real`.

#![allow(
    clippy::unwrap_used,
    reason = "logs that are known to be readable, and a panic is how this program fails"
)]

use std::ops::Range;

use loopsight::answers::{CompareAnswer, DiagnoseAnswer, FitAnswer, Verdict};
use loopsight::{AddOptions, CompareOptions, DiagnoseOptions, FitOptions, Log, Model, Session};
use loopsight_tests::{real_data, repository};

/// The model file `name`, with what `edit` makes of its text.
fn model(name: &str, edit: impl Fn(&str) -> String) -> Model {
    let path = repository().join("tests/fixtures/real").join(name);
    let text = edit(&std::fs::read_to_string(path).unwrap());
    Model::from_toml(name, &text).unwrap()
}

/// The rows `rows` of a recording; none where there is no data.
fn recording(file: &str, rows: Range<usize>) -> Option<Log> {
    let log = Log::read(real_data(file)?.join(file)).unwrap();
    Some(log.part(rows))
}

const ALL: Range<usize> = 0..usize::MAX;

fn session(model: &Model, log: &Log) -> Session {
    Session::new(model.clone(), log.clone()).unwrap()
}

fn fitted(model: &Model, log: &Log) -> FitAnswer {
    session(model, log).fit(&FitOptions::default()).unwrap()
}

fn compared(model: &Model, log: &Log) -> CompareAnswer {
    let options = CompareOptions::default().series(true);
    session(model, log).compare(&options).unwrap()
}

fn diagnosed(session: &Session) -> DiagnoseAnswer {
    session.diagnose(&DiagnoseOptions::default()).unwrap()
}

fn value(fit: &FitAnswer, name: &str) -> f64 {
    fit.parameters[name].value
}

/// Root mean square of the free-run error of the only signal.
fn rmse(model: &Model, log: &Log) -> f64 {
    compared(model, log).errors.signals[0].rmse
}

/// Wigren, Schoukens (2013): the test is the first 40 650 samples, an arrowhead; a linear model leaves
/// 14.5 mV of it, one with a cubic term 1.8 mV.
#[test]
fn the_silverbox_has_a_cubic_spring() {
    let linear = model("silverbox.toml", str::to_owned);
    let file = "silverbox/silverbox_snls80mV.csv";
    let Some(train) = recording(file, 40_700..52_700) else {
        return;
    };
    let test = recording(file, 0..40_650).unwrap();
    let plain = fitted(&linear, &train);
    let spring = AddOptions::new("cubic_stiffness").at(["mass"]);
    let with = Session::of_model(linear).add(&spring).unwrap();
    let cubic = fitted(with.model(), &train);
    let (before, after) = (rmse(plain.model(), &test), rmse(cubic.model(), &test));
    println!(
        "Silverbox, free run over the arrowhead: linear {:.2} mV (published 14.5), cubic {:.2} mV \
         (published 1.8)",
        1e3 * before,
        1e3 * after
    );
    assert!((0.0135..0.0145).contains(&before), "{before}");
    assert!(after < 0.0018, "{after}");

    // From the linear model, and from little: the spring is named.
    let few = session(plain.model(), &train.part(0..6000));
    let ending = test.part(30_000..40_000);
    let diagnosis = diagnosed(&few.test(ending).unwrap());
    let missing = diagnosis.missing.unwrap();
    println!("Silverbox: the linear model lacks {missing:?}");
    assert_eq!(diagnosis.verdict, Verdict::EffectMissing);
    assert_eq!(
        (missing.effect.as_str(), &missing.at[..]),
        ("cubic_stiffness", &["mass".to_owned()][..])
    );
}

/// Janot, Gautier, Brunot (2019): M 95.11 kg, F_v 203.5 N s/m, F_c 20.39 N, offset -3.16 N, relative
/// error of the force 4.08 %; 3.11 % with friction that depends on the direction; 5.98 % on the
/// validation with pulses. They fit inverse dynamics to filtered signals; here it is the free run
/// through the loop.
#[test]
fn emps_is_identified_through_its_loop() {
    let symmetric = model("emps.toml", str::to_owned);
    let Some(log) = recording("emps/emps_estimation.csv", ALL) else {
        return;
    };
    let pulses = recording("emps/emps_validation_pulses.csv", ALL).unwrap();
    let found = fitted(&symmetric, &log);
    for (name, published) in [
        ("mass", 95.11),
        ("viscous_friction", 203.5),
        ("coulomb_friction.level", 20.39),
        ("constant_force.force", 3.16),
    ] {
        let off = value(&found, name) / published - 1.0;
        println!(
            "EMPS {name}: {:.3} (published {published}, {:+.2} %)",
            value(&found, name),
            100.0 * off
        );
        assert!(off.abs() < 0.01, "{name}: {off}");
    }
    let directional = model("emps.toml", |text| {
        text.replace("coulomb_friction]", "directional_friction]")
            .replace(
                "level = 10.0",
                "level_forward = 20.0\nlevel_backward = 20.0",
            )
            // What the directions have in common is the plant's.
            .replace("viscous_friction = 100.0", "viscous_friction = 0.0")
            .replace(
                "[\"velocity_lag\"]",
                "[\"velocity_lag\"]\nfixed = [\"viscous_friction\"]",
            )
    });
    let directed = fitted(&directional, &log);
    let errors = |fit: &FitAnswer| {
        [&log, &pulses].map(|log| {
            let found = compared(fit.model(), log);
            [relative(&found, |x| x.to_vec()), relative(&found, low_pass)]
        })
    };
    let (of_one, of_two) = (errors(&found), errors(&directed));
    for (what, [log, pulses], published) in [
        ("one friction", of_one, "4.08 %, validation 5.98 %"),
        ("one for each direction", of_two, "3.11 %"),
    ] {
        println!(
            "EMPS, {what}: relative force error {:.2} %, below 40 Hz {:.2} %; validation {:.2} %, \
             below 40 Hz {:.2} % (published {published})",
            100.0 * log[0],
            100.0 * log[1],
            100.0 * pulses[0],
            100.0 * pulses[1]
        );
    }
    assert!(of_one[0][0] < 0.0435 && of_one[1][0] < 0.0598, "{of_one:?}");
    assert!(of_two[0][0] < 0.0335 && of_two[1][0] < 0.0598, "{of_two:?}");
    // In the band that the published figures are taken in.
    assert!(of_two[0][1] < 0.032, "{of_two:?}");
}

/// `‖F - F̂‖/‖F‖` of the only signal, both seen through `filter`.
fn relative(found: &CompareAnswer, filter: impl Fn(&[f64]) -> Vec<f64>) -> f64 {
    let series = &found.series.as_ref().unwrap()[0];
    let (measured, predicted) = (filter(&series.measured), filter(&series.model));
    let square = |x: f64| x * x;
    let off: f64 = measured
        .iter()
        .zip(&predicted)
        .map(|(a, b)| square(a - b))
        .sum();
    (off / measured.iter().map(|a| square(*a)).sum::<f64>()).sqrt()
}

/// Butterworth's filter of second order at 40 Hz for samples at 1 kHz, forwards and backwards: the band
/// that is left when the published figures are taken from every tenth sample.
fn low_pass(signal: &[f64]) -> Vec<f64> {
    let k = (std::f64::consts::PI * 0.04).tan();
    let norm = 1.0 + std::f64::consts::SQRT_2 * k + k * k;
    let (b, a1) = (k * k / norm, 2.0 * (k * k - 1.0) / norm);
    let a2 = (1.0 - std::f64::consts::SQRT_2 * k + k * k) / norm;
    let pass = |signal: &mut Vec<f64>| {
        let first = signal.first().copied().unwrap_or(0.0);
        let (mut x1, mut x2, mut y1, mut y2) = (first, first, first, first);
        for value in signal.iter_mut() {
            let y = b * (*value + 2.0 * x1 + x2) - a1 * y1 - a2 * y2;
            (x2, x1, y2, y1) = (x1, *value, y1, y);
            *value = y;
        }
        signal.reverse();
    };
    let mut filtered = signal.to_vec();
    pass(&mut filtered);
    pass(&mut filtered);
    filtered
}

/// Piyushiitk24's staircase: no motion below 2 V, which its author calls a dead zone. Quick fits: linear
/// 25 %, dead zone 4.4–5.3 %, dry friction 4.7–5.5 %, with breakaway 3.1 % of the standard
/// deviation; delay about 31 ms. One threshold says nearly the same as another, and so must the tool.
#[test]
fn a_geared_motor_has_a_threshold() {
    let file = "dc-motor-deadzone/dc_motor_staircase.csv";
    let plain = model("geared_motor.toml", str::to_owned);
    let Some(log) = recording(file, ALL) else {
        return;
    };
    let diagnosis = diagnosed(&session(&plain, &log));
    assert_eq!(diagnosis.verdict, Verdict::EffectMissing);
    let best = &diagnosis.candidates[0];
    let alike = best.indistinguishable_from.iter();
    let class: Vec<&str> = std::iter::once(&best.place)
        .chain(alike)
        .map(|p| p.effect.as_str())
        .collect();
    println!("geared motor: {class:?}");
    let thresholds = ["dead_zone", "coulomb_friction"];
    assert!(thresholds.iter().all(|id| class.contains(id)), "{class:?}");
    let with = |effects: &str| {
        let with = model("geared_motor.toml", |text| format!("{text}\n{effects}"));
        let found = fitted(&with, &log);
        println!(
            "geared motor with\n{effects}  error {:.2} %",
            100.0 * found.nrmse_fit
        );
        for (name, estimate) in &found.parameters {
            println!("  {name} {:.3} {}", estimate.value, estimate.unit);
        }
        found
    };
    let linear = with("");
    assert!((0.24..0.26).contains(&linear.nrmse_fit));
    for (effect, at, parameter) in [
        ("dead_zone", "input", "threshold"),
        ("coulomb_friction", "shaft", "level"),
    ] {
        let found = with(&format!(
            "[[effect]]\n[effect.{effect}]\nat = [\"{at}\"]\n{parameter} = 1.5\n"
        ));
        let volts = value(&found, &format!("{effect}.{parameter}"));
        assert!((1.6..2.2).contains(&volts), "{effect}: {volts}");
        assert!(found.nrmse_fit < 0.065, "{effect}: {}", found.nrmse_fit);
    }
    // Breakaway, the difference of the directions, and the delay.
    let found = with(
        "[[effect]]\n[effect.stribeck_friction]\nat = [\"shaft\"]\nlevel = 1.5\nextra = 0.8\n\
         speed = 2.0\nwidth = 0.02\n\
         [[effect]]\n[effect.constant_force]\nat = [\"shaft\"]\n\
         [[effect]]\n[effect.input_delay]\nat = [\"input\"]\ndelay = 0.03\n\
         [simulation]\nmax_step_s = 0.001\n",
    );
    assert!(found.nrmse_fit < 0.033, "{}", found.nrmse_fit);
    let [sideways, delay] = ["constant_force.force", "input_delay.delay"].map(|n| value(&found, n));
    assert!((-0.25..-0.12).contains(&sideways), "{sideways} V");
    assert!((0.02..0.06).contains(&delay), "{delay} s");
}
