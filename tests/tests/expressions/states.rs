//! Fits of effects of one's own that have states: the models of `examples/own-states`.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use loopsight_diagnosis::{Fit, FitSettings, Measurements, Work, compare, fit};
use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_tests::{Random, repository};

use super::model;

fn example(name: &str) -> Model {
    let path = repository().join("examples/own-states").join(name);
    Model::load(&path).unwrap().0
}

fn fitted(model: &Model, run: &Run) -> Fit {
    let run = [run.clone()];
    let data = Measurements::new(&run);
    fit(model, &data, &FitSettings::default(), &Work::quiet()).unwrap()
}

fn noise(signal: &str, size: f64) -> Simulated {
    Simulated {
        seed: 11,
        noise: BTreeMap::from([(signal.to_owned(), size)]),
        ..Simulated::default()
    }
}

/// A lag of one's own is fitted like that of the library: the same value, the same interval, the same error.
#[test]
fn a_lag_of_ones_own_is_fitted_like_that_of_the_library() {
    let axis = "[plant.dc_axis]\nK_A = -4.0\nK_C = 3.0\n[log.measured.speed]\n[[effect]]\n";
    let library = format!("{axis}[effect.actuator_lag]\nat = [\"input\"]\nlag = 0.06\n");
    let own = format!(
        "{axis}[effect.expression]\nname = \"own\"\nat = [\"input\"]\n\
         force = \"(z - nominal) * T / max(T, 0.004)\"\n[effect.expression.states]\n\
         z = {{ unit = \"V\", rate = \"(nominal - z) / max(T, 0.004)\", start = \"nominal\" }}\n\
         [effect.expression.parameters]\n\
         T = {{ value = 0.06, unit = \"s\", range = [0.0, 2.0], scale = 0.02 }}\n"
    );
    let time: Vec<f64> = (0..800).map(|k| 0.01 * f64::from(k)).collect();
    let input: Vec<f64> = time
        .iter()
        .map(|t| if (t * 1.7).sin() > 0.2 { 6.0 } else { -4.0 })
        .collect();
    let run = simulate_inputs(&model(&library), &noise("speed", 0.02), &time, &input).unwrap();
    let guess = |text: &str| {
        fitted(
            &model(&text.replace("= 0.06", "= 0.02").replace("-4.0", "-3.0")),
            &run,
        )
    };
    let (library, own) = (guess(&library), guess(&own));
    for (a, b) in [
        ("actuator_lag.lag", "own.T"),
        ("K_A", "K_A"),
        ("K_C", "K_C"),
    ] {
        let (a, b) = (&library.parameters[a], &own.parameters[b]);
        let error = a.std_error.unwrap();
        assert!((a.value - b.value).abs() < 1e-3 * error, "{a:?} {b:?}");
        assert!((error - b.std_error.unwrap()).abs() < 1e-3 * error);
    }
    let lag = &own.parameters["own.T"];
    assert!((lag.value - 0.06).abs() < 4.0 * lag.std_error.unwrap());
    assert!((library.nrmse_fit - own.nrmse_fit).abs() < 1e-9);
}

/// Friction with presliding: from a first guess a fit finds what bends, what sticks and what slides.
#[test]
fn lugre_friction_is_found_in_a_log_with_noise() {
    let truth = example("slide.toml");
    let points = [
        [0.0, 0.0],
        [0.15, 1.3],
        [0.3, -1.3],
        [0.4, 1.0],
        [0.5, 0.0],
        [0.65, 4.0],
        [0.8, -4.0],
        [1.0, 3.0],
    ];
    let time: Vec<f64> = (0..1000).map(|k| 0.001 * f64::from(k)).collect();
    let force = |t: f64| {
        let after = points
            .iter()
            .position(|p| p[0] > t)
            .unwrap_or(points.len() - 1);
        let ([a, from], [b, to]) = (points[after - 1], points[after]);
        from + (to - from) * (t - a) / (b - a)
    };
    let input: Vec<f64> = time.iter().map(|t| force(*t)).collect();
    let run = simulate_inputs(&truth, &noise("position", 1e-6), &time, &input).unwrap();
    // Below break-away it gives by 20 um and comes back nearly all the way.
    let at = |k: usize| run.sample(k)[0];
    assert!(at(150) > 1.5e-5 && at(150) < 4e-5, "{}", at(150));
    let found = fitted(&example("slide_first_guess.toml"), &run);
    let before = found.nrmse_before.unwrap();
    assert!(
        found.nrmse_fit < 0.01 * before,
        "{before} to {}",
        found.nrmse_fit
    );
    for parameter in truth.parameters.iter().filter(|p| p.free) {
        let estimate = &found.parameters[&parameter.name];
        let (error, value) = (estimate.std_error.unwrap(), parameter.value.unwrap());
        assert!(
            (estimate.value - value).abs() < 4.0 * error && error < 0.05 * value,
            "{}: {} ± {error}, made with {value}",
            parameter.name,
            estimate.value
        );
    }
}

/// The oscillator of Noël and Schoukens (2016), integrated here: `m y'' + c y' + k y + z = u`,
/// `z' = α y' - β (γ |y'| z + δ y' |z|)`, with twenty sines of 16 N and 1 um of noise.
fn bouc_wen(seed: u64) -> Run {
    let [m, c, k, alpha, beta, gamma, delta] = [2.0, 10.0, 5e4, 5e4, 1e3, 0.8, -1.1];
    let mut random = Random::new(seed);
    let phases: Vec<f64> = (0..20).map(|_| TAU * random.share()).collect();
    let force = |t: f64| -> f64 {
        let sines = phases.iter().enumerate();
        sines
            .map(|(i, phase)| 16.0 * (TAU * (5.0 + 3.0 * i as f64) * t + phase).sin())
            .sum()
    };
    let rate = |x: [f64; 3], u: f64| {
        let [y, v, z] = x;
        [
            v,
            (u - c * v - k * y - z) / m,
            alpha * v - beta * (gamma * v.abs() * z + delta * v * z.abs()),
        ]
    };
    let mut run = Run::empty(1, 1);
    let mut x = [0.0; 3];
    let (period, steps) = (1.0 / 750.0, 40);
    for sample in 0..2250 {
        let time = f64::from(sample) * period;
        let u = force(time);
        // Sum of twelve: nearly normal.
        let noise: f64 = (0..12).map(|_| random.share()).sum::<f64>() - 6.0;
        run.push(time, &[u], &[x[0] + 1e-6 * noise]).unwrap();
        let h = period / f64::from(steps);
        let along = |x: [f64; 3], d: [f64; 3], h: f64| std::array::from_fn(|i| x[i] + h * d[i]);
        for _ in 0..steps {
            let a = rate(x, u);
            let b = rate(along(x, a, h / 2.0), u);
            let c = rate(along(x, b, h / 2.0), u);
            let d = rate(along(x, c, h), u);
            x = std::array::from_fn(|i| x[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]));
        }
    }
    run
}

#[test]
fn bouc_wen_hysteresis_is_found_and_holds_on_another_multisine() {
    let free_run = |model: &Model, seed: u64| {
        let run = [bouc_wen(seed)];
        compare(model, &Measurements::new(&run), &Work::quiet())
            .unwrap()
            .nrmse
    };
    // The model of the example is that oscillator.
    assert!(free_run(&example("oscillator.toml"), 1) < 0.002);
    let found = fitted(&example("oscillator_first_guess.toml"), &bouc_wen(1));
    assert!(found.nrmse_before.unwrap() > 0.5);
    for parameter in example("oscillator.toml")
        .parameters
        .iter()
        .filter(|p| p.free)
    {
        let estimate = &found.parameters[&parameter.name];
        let (error, value) = (estimate.std_error.unwrap(), parameter.value.unwrap());
        let off = (estimate.value - value).abs();
        assert!(
            off < 0.02 * value.abs() && error < 0.02 * value.abs(),
            "{}: {} ± {error}, made with {value}",
            parameter.name,
            estimate.value
        );
    }
    let other = free_run(&found.model, 2);
    assert!(other < 0.003, "{other}");
    // Without the hysteresis a fit leaves far more.
    let plain = fitted(&example("oscillator_plain.toml"), &bouc_wen(1));
    let plain = free_run(&plain.model, 2);
    assert!(plain > 0.1, "{plain}");
}
