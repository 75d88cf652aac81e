//! The simulated robot driven by a given sequence, for recordings without a loop.

use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use loopsight_model::run::{Rows, Run};

use crate::robot::Robot;
use crate::simulated::Simulated;

/// The robot `model` driven by a given sequence: row `k` of `inputs` is applied from `time[k]` to
/// `time[k + 1]`, row `k` of the result was measured at `time[k]`. The robot starts at rest at
/// `time[0]`; the inputs of the result are those applied, within the limits; a sample that gets lost is
/// missing (NaN). `settings.model` is
/// not used: `model` is the robot.
///
/// # Errors
///
/// [`BuildError`] where the settings do not suit the model, where `time` and `inputs` do not form a run, or where
/// the simulation diverges.
pub fn simulate_inputs(
    model: &Model,
    settings: &Simulated,
    time: &[f64],
    inputs: &[f64],
) -> Result<Run, BuildError> {
    let mut robot = Robot::new(model.clone(), settings)?;
    let (n_inputs, n_measured) = (model.plant.inputs.len(), model.measured.len());
    if inputs.len() != time.len() * n_inputs {
        return Err(BuildError::at(
            "inputs",
            format!(
                "{} values for {} instants, expected {n_inputs} for each",
                inputs.len(),
                time.len()
            ),
        ));
    }
    if let Some(bad) = inputs.iter().position(|v| !v.is_finite()) {
        return Err(BuildError::at(
            "inputs",
            format!("row {} holds {}", bad / n_inputs, inputs[bad]),
        ));
    }
    let later = |pair: &&[f64]| !(pair[1] > pair[0] && (pair[1] - pair[0]).is_finite());
    if let Some(pair) = time.windows(2).find(later) {
        return Err(BuildError::at(
            "time",
            format!(
                "{} s is followed by {} s, expected times that increase",
                pair[0], pair[1]
            ),
        ));
    }
    let mut inputs = inputs.to_vec();
    for row in inputs.chunks_exact_mut(n_inputs.max(1)) {
        robot.limit(row);
    }
    let missing = Rows::new(n_measured, vec![f64::NAN; time.len() * n_measured]);
    let commands = Run::new("", time.to_vec(), Rows::new(n_inputs, inputs), missing)
        .map_err(|error| BuildError::at("time", error.to_string()))?;
    let mut measured = vec![0.0; time.len() * n_measured];
    for (k, row) in measured.chunks_exact_mut(n_measured).enumerate() {
        if k > 0 {
            robot.foresee(&commands, k);
            robot.advance(time[k] - time[0], commands.input(k - 1));
        }
        if !robot.measure(row) {
            return Err(BuildError::at(
                "model",
                format!("the simulated robot diverged before {} s", time[k]),
            )
            .help("its parameters make it unstable"));
        }
        if robot.loses() {
            row.fill(f64::NAN);
        }
    }
    commands
        .with_measured(measured)
        .map_err(|error| BuildError::at("time", error.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{HALF_TRACK, WHEEL, instants, model, twil, twil_encoders, voltages};

    fn errors(a: &Run, b: &Run, signal: usize) -> Vec<f64> {
        (1..a.len())
            .map(|k| a.sample(k)[signal] - b.sample(k)[signal])
            .collect()
    }

    /// `v' = a v + g u` from rest: `v(t) = -g u/a (1 - e^(a t))`, and its mean over a period.
    #[test]
    fn a_step_gives_the_exact_response() {
        let (a, g, u) = (-15.146, 0.136, 12.0);
        let time = instants(100);
        let inputs: Vec<f64> = time.iter().flat_map(|_| [7.0, 5.0]).collect();
        let model = twil("\"interval_mean\"", "\"instantaneous\"");
        let run = simulate_inputs(&model, &Simulated::default(), &time, &inputs).unwrap();
        assert_eq!(run.sample(0), [0.0, 0.0]);
        for k in 1..time.len() {
            let (from, to) = (time[k - 1], time[k]);
            let growth = ((a * to).exp() - (a * from).exp()) / (a * (to - from));
            let mean = -g * u / a * (1.0 - growth);
            assert!((run.sample(k)[0] - mean).abs() < 1e-12, "sample {k}");
            let (a, g) = (-9.573, 0.656);
            let omega = -g * 2.0 / a * (1.0 - (a * to).exp());
            assert!((run.sample(k)[1] - omega).abs() < 1e-12, "sample {k}");
        }
    }

    #[test]
    fn counting_is_off_by_less_than_a_count_with_zero_mean_and_known_deviation() {
        let model = twil_encoders();
        let n = 20_000;
        let (time, inputs) = (instants(n), voltages(n));
        let exact = Simulated {
            quantize: false,
            step_s: Some(1e-3),
            ..Simulated::default()
        };
        let counted = Simulated {
            quantize: true,
            ..exact.clone()
        };
        let truth = simulate_inputs(&model, &exact, &time, &inputs).unwrap();
        let run = simulate_inputs(&model, &counted, &time, &inputs).unwrap();
        let resolution = std::f64::consts::TAU / 8192.0;
        for (signal, gain) in [(0, WHEEL), (1, WHEEL / HALF_TRACK)] {
            let errors = errors(&run, &truth, signal);
            let bound = gain * resolution / 0.01;
            let mean = errors.iter().sum::<f64>() / n as f64;
            let power = errors.iter().map(|e| e * e).sum::<f64>() / n as f64;
            let lag = errors.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64 / power;
            assert!(errors.iter().all(|e| e.abs() < bound));
            // The errors telescope: their sum is one rounding at most.
            assert!(mean.abs() <= bound / (n - 1) as f64, "mean {mean}");
            let loopsight_model::sensor::Sensor::EncoderCounts(encoder) =
                &model.measured[signal].sensor
            else {
                panic!("no encoder");
            };
            let ratio = power.sqrt() / encoder.noise(0.01);
            assert!(
                (ratio - 1.0).abs() < 0.05,
                "deviation {ratio} of the expected"
            );
            assert!((lag + 0.5).abs() < 0.05, "lag-1 autocorrelation {lag}");
        }
        // Both signals come from the same two shafts: each wheel turned by whole counts.
        for k in 1..n {
            let [v, omega] = *run.sample(k) else {
                panic!("two signals");
            };
            let counts = (v + HALF_TRACK * omega) / WHEEL * 0.01 / resolution;
            assert!(
                (counts - counts.round()).abs() < 1e-6,
                "sample {k}: {counts}"
            );
        }
    }

    #[test]
    fn without_shafts_the_integral_of_the_signal_is_counted() {
        let model = model(
            "[plant.dc_axis]\nK_A = -2.0\nK_C = 8.0\n[log.measured.speed]\n\
             sensor = { encoder_counts = { counts_per_revolution = 100.0 } }\n",
        );
        let time = instants(500);
        let run = simulate_inputs(&model, &Simulated::default(), &time, &[3.0; 500]).unwrap();
        let resolution = std::f64::consts::TAU / 100.0;
        let mut turned = 0.0;
        for k in 1..500 {
            let counts = run.sample(k)[0] * (time[k] - time[k - 1]) / resolution;
            assert!((counts - counts.round()).abs() < 1e-9);
            turned += counts * resolution;
            let angle = 12.0 * (time[k] - (1.0 - (-2.0 * time[k]).exp()) / 2.0);
            assert!((turned - angle).abs() < resolution);
        }
    }

    #[test]
    fn noise_is_white_and_the_same_for_a_seed() {
        let model = twil("\"interval_mean\"", "\"interval_mean\"");
        let n = 20_000;
        let (time, inputs) = (instants(n), voltages(n));
        let settings = |seed, deviation: f64| Simulated {
            seed,
            step_s: Some(2.5e-3),
            noise: [("linear_velocity".to_owned(), deviation)].into(),
            ..Simulated::default()
        };
        let run = |s: &Simulated| simulate_inputs(&model, s, &time, &inputs).unwrap();
        let truth = run(&settings(1, 0.0));
        let noisy = run(&settings(1, 0.01));
        assert_eq!(noisy, run(&settings(1, 0.01)));
        assert_ne!(noisy, run(&settings(2, 0.01)));
        let noise = errors(&noisy, &truth, 0);
        let power = noise.iter().map(|e| e * e).sum::<f64>() / n as f64;
        let lag = noise.windows(2).map(|w| w[0] * w[1]).sum::<f64>() / n as f64 / power;
        assert!((power.sqrt() / 0.01 - 1.0).abs() < 0.03 && lag.abs() < 0.03);
        assert!(errors(&noisy, &truth, 1).iter().all(|e| *e == 0.0));
    }

    #[test]
    fn a_fine_robot_agrees_with_a_finer_one() {
        let model = twil("\"interval_mean\"", "\"interval_mean\"");
        let (time, inputs) = (instants(300), voltages(300));
        let run = |step_s| {
            let settings = Simulated {
                step_s,
                ..Simulated::default()
            };
            simulate_inputs(&model, &settings, &time, &inputs).unwrap()
        };
        let (default, finer) = (run(None), run(Some(1e-5)));
        for signal in 0..2 {
            assert!(
                errors(&default, &finer, signal)
                    .iter()
                    .all(|e| e.abs() < 1e-12)
            );
        }
    }

    #[test]
    fn limits_are_logged_and_bad_sequences_refused() {
        let model = twil("\"interval_mean\"", "\"interval_mean\"");
        let settings = Simulated {
            limit: Some(crate::Limit::All(6.0)),
            ..Simulated::default()
        };
        let run = simulate_inputs(&model, &settings, &[5.0, 5.1], &[9.0, -9.0, 3.0, 7.0]).unwrap();
        assert_eq!(run.inputs(), [6.0, -6.0, 3.0, 6.0]);
        let key = |time: &[f64], inputs: &[f64]| {
            simulate_inputs(&model, &settings, time, inputs)
                .unwrap_err()
                .key
        };
        assert_eq!(key(&[0.0, 0.0], &[0.0; 4]), "time");
        assert_eq!(key(&[0.0, 0.1], &[0.0; 3]), "inputs");
        assert_eq!(key(&[0.0], &[0.0, f64::NAN]), "inputs");
        assert!(
            simulate_inputs(&model, &settings, &[], &[])
                .unwrap()
                .is_empty()
        );
    }

    #[test]
    fn an_unstable_robot_is_named() {
        let model = model(
            "[plant.dc_axis]\nK_A = -90000.0\nK_C = 8.0\n[log.measured.speed]\nsensor = \"instantaneous\"\n",
        );
        let error =
            simulate_inputs(&model, &Simulated::default(), &[0.0, 1.0], &[1.0; 2]).unwrap_err();
        assert!(error.message.contains("diverged before"), "{error}");
    }
}
