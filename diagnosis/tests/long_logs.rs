//! Logs that are longer than what a search reads: the verdict on all of such a log is that on its first 100 s.

#![allow(
    clippy::unwrap_used,
    reason = "logs that can be made, and a panic is how this program fails"
)]

use std::collections::BTreeSet;

use loopsight_diagnosis::{Conclusion, Diagnosis, FitSettings, Measurements, Work, diagnose, fit};
use loopsight_model::excitation::{Excitation, Sequence};
use loopsight_model::model::Model;
use loopsight_model::run::{Rows, Run};
use loopsight_model::simulate::{Simulator, free_run};
use loopsight_plants as _;

const AXIS: &str = "name = \"axis\"
[plant.dc_axis]
K_A = -6.0
K_C = 2.0
[log.measured.speed]
sensor = \"instantaneous\"
";
const OSCILLATOR: &str = "name = \"oscillator\"
[plant.oscillator.physical]
mass = 2.0
stiffness = 200.0
damping = 2.4
[log.measured.position]
sensor = \"instantaneous\"
";
const TWIL: &str = "name = \"twil\"
[plant.ddmr]
K_A = -15.146
K_B = 0.0
K_C = 0.136
K_D = -9.573
K_E = 0.0
K_F = 0.656
half_track = 0.131
wheel_radius = 0.05
[fit]
fixed = [\"K_B\", \"K_E\"]
[log.measured.linear_velocity]
sensor = \"instantaneous\"
[log.measured.angular_velocity]
sensor = \"instantaneous\"
";

fn levels(amplitude: f64, levels: u32, hold_s: f64) -> Excitation {
    Excitation::MultiLevel {
        amplitude,
        hold_s,
        levels,
        seed: 5,
        common: false,
    }
}

/// What is measured on a machine, with white noise of a hundredth of the signal's standard deviation.
fn log(truth: &str, samples: usize, period: f64, drive: &Excitation) -> Run {
    let (truth, _) = Model::from_toml("truth", truth).unwrap();
    let inputs = truth.plant.inputs.iter().filter(|i| !i.optional);
    let drives: Vec<Sequence> = inputs.map(|i| drive.build(i.id).unwrap()).collect();
    let time: Vec<f64> = (0..samples).map(|k| period * k as f64).collect();
    let applied: Vec<f64> = time
        .iter()
        .flat_map(|t| drives.iter().map(|drive| drive.sample(*t)))
        .collect();
    let n = truth.measured.len();
    let unknown = Rows::new(n, vec![f64::NAN; n * samples]);
    let driven = Run::new("", time, Rows::new(drives.len(), applied), unknown).unwrap();
    let mut exact = Vec::new();
    let mut simulator = Simulator::new(&truth, &truth.values());
    let rest = vec![0.0; truth.n_states()];
    free_run(&mut simulator, &rest, &driven, |_, y| {
        exact.extend_from_slice(y)
    });
    let deviation = |signal: usize| {
        let squares: f64 = exact.iter().skip(signal).step_by(n).map(|y| y * y).sum();
        (squares / samples as f64).sqrt()
    };
    let sizes: Vec<f64> = (0..n).map(|signal| 0.01 * deviation(signal)).collect();
    let mut state = 7u64;
    let mut uniform = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let noisy = exact.iter().enumerate();
    let measured = noisy.map(|(i, y)| y + sizes[i % n] * 12f64.sqrt() * uniform());
    driven.with_measured(measured.collect()).unwrap()
}

fn of(model: &str, runs: &[Run]) -> Diagnosis {
    let (model, _) = Model::from_toml("model", model).unwrap();
    diagnose(&model, &Measurements::new(runs), &Work::quiet()).unwrap()
}

/// The effect that is missing, with those that the log cannot tell from it.
fn named(found: &Diagnosis) -> BTreeSet<&str> {
    let best = found.candidates.iter().take(1);
    let others = best.flat_map(|best| &best.indistinguishable_from);
    let missing = found.missing.iter();
    missing
        .flat_map(|missing| std::iter::once(missing).chain(others.clone()))
        .map(|place| place.effect.as_str())
        .collect()
}

/// The diagnosis of a long log, which says what that of its first 100 s says, and finds `effect`. Of explanations that
/// cannot be told apart either may come first.
fn same_as_first(model: &str, run: Run, first: usize, effect: Option<&str>) {
    let first = of(model, &[run.part(0..first)]);
    let all = of(model, &[run]);
    println!("{:?} {:?}", all.verdict, [&all, &first].map(named));
    assert_eq!(all.verdict, first.verdict);
    for found in [&all, &first] {
        match effect {
            Some(effect) => assert!(named(found).contains(effect)),
            None => assert_eq!(found.verdict, Conclusion::NothingMissing),
        }
    }
}

/// Two runs, so that each has windows of its own. The values are those of a fit to all samples at once.
#[test]
fn friction_is_found_in_a_long_log_and_fitted_to_all_of_it() {
    let friction = "[[effect]]\n[effect.coulomb_friction]\nat = [\"shaft\"]\nlevel = 0.8\n";
    let truth = format!("{AXIS}{friction}");
    let drive = |hold| levels(9.0, 7, hold);
    let runs = [
        log(&truth, 100_000, 0.001, &drive(0.5)),
        log(&truth, 50_000, 0.001, &drive(0.3)),
    ];
    let found = of(AXIS, &runs);
    assert_eq!(found.missing.unwrap().effect, "coulomb_friction");
    let best = &found.candidates[0];
    let (id, level) = best.parameters.iter().next().unwrap();
    let settings = FitSettings::default();
    let measured = Measurements::new(&runs);
    let fitted = fit(&best.model, &measured, &settings, &Work::quiet()).unwrap();
    let mut named = fitted.parameters.iter();
    let (_, whole) = named.find(|(name, _)| name.ends_with(id.as_str())).unwrap();
    let errors = [level, whole].map(|estimate| estimate.std_error.unwrap());
    println!("{id}: {} and {}, ± {errors:?}", level.value, whole.value);
    // The fit sees the held-out blocks as well.
    assert!((level.value - whole.value).abs() < errors[0].max(errors[1]));
    assert!((0.7..1.6).contains(&(errors[0] / errors[1])));
}

#[test]
#[ignore = "a minute"]
fn nothing_is_missing_in_a_long_log_either() {
    let run = log(TWIL, 150_000, 0.004, &levels(9.0, 2, 0.4));
    same_as_first(TWIL, run, 25_001, None);
}

#[test]
#[ignore = "a minute"]
fn a_spring_that_hardens() {
    let cubic = "[[effect]]\n[effect.cubic_stiffness]\nat = [\"mass\"]\nstiffness = 3000.0\n";
    let random = levels(12.0, 9, 0.3);
    let run = log(&format!("{OSCILLATOR}{cubic}"), 300_000, 0.001, &random);
    same_as_first(OSCILLATOR, run, 100_001, Some("cubic_stiffness"));
}

#[test]
#[ignore = "a minute"]
fn a_late_command() {
    let late = "[[effect]]\n[effect.input_delay]\nat = [\"input\"]\ndelay = 0.012\n";
    let random = levels(9.0, 2, 0.25);
    let run = log(&format!("{AXIS}{late}"), 300_000, 0.001, &random);
    same_as_first(AXIS, run, 100_001, Some("input_delay"));
}
