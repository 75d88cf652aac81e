//! Weights of the first samples of a run, from which its initial state is estimated.

use loopsight_model::model::Model;
use loopsight_model::run::Run;

use crate::criteria::{Criteria, StartCriteria};
use crate::floor::noise;

/// How many times as much the first sample of each run counts as any other, by run and signal.
///
/// The first sample differs from the model only by the noise `σ` of its sensor; later samples differ by the
/// error of the model as well. With `std` the signal's standard deviation and `e` the share of it that a model
/// is commonly wrong by,
///
/// ```text
/// weight = e std/σ, between 1 and a limit
/// ```
///
/// the start stays where it was measured, and does not make up for missing physics. `σ` is the largest of
///
/// * the noise and resolution of the signal;
/// * the distance of the first sample from the line through the next two, so that an outlier counts little;
/// * how far the signal moves while a measurement may be late: a late sensor does not tell the state at the
///   first instant of a run that was cut out of a motion.
///
/// (The prior of a start is that of a Kalman filter, L. Ljung, 1999, "System Identification", 2nd edition,
/// section 4.3.)
pub(crate) fn first_weights(model: &Model, runs: &[Run], criteria: &Criteria) -> Vec<Vec<f64>> {
    let known: Vec<(f64, f64)> = (model.measured.iter().enumerate())
        .map(|(i, m)| noise(&m.sensor, i, runs, &criteria.log))
        .collect();
    runs.iter()
        .map(|run| {
            let weight = |(i, known): (usize, &(f64, f64))| of_run(run, i, *known, &criteria.start);
            known.iter().enumerate().map(weight).collect()
        })
        .collect()
}

fn of_run(run: &Run, signal: usize, (noise, std): (f64, f64), criteria: &StartCriteria) -> f64 {
    // An observer corrects the start.
    if run.len() < 3 || run.observer().is_some() {
        return 1.0;
    }
    let [a, b, c] = [0, 1, 2].map(|k| run.sample(k)[signal]);
    // White noise of variance `σ²` has `6 σ²` in second differences.
    let off = (a - 2.0 * b + c).abs() / 6f64.sqrt();
    let late = (run.time().iter().zip(0..))
        .take_while(|(t, _)| **t <= criteria.late_s)
        .map(|(_, k)| (run.sample(k)[signal] - a).abs())
        .fold(0.0, f64::max);
    let weight = criteria.wrong * std / noise.max(off).max(late);
    if off.is_nan() || weight.is_nan() {
        1.0
    } else {
        weight.clamp(1.0, criteria.most.max(1.0))
    }
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;

    use super::*;

    fn run(measured: Vec<f64>) -> Run {
        let time = (0..measured.len()).map(|k| 0.01 * k as f64).collect();
        Run::new("", time, Rows::default(), Rows::new(1, measured)).unwrap()
    }

    #[test]
    fn a_start_counts_as_much_as_its_sensor_is_good() {
        let criteria = &StartCriteria::DEFAULT;
        let smooth = run(vec![1.0; 10]);
        let of = |run: &Run, noise| of_run(run, 0, (noise, 1.0), criteria);
        assert!((of(&smooth, 0.01) - 10.0).abs() < 1e-9);
        // No better than the model, and no better than can be computed with.
        assert_eq!((of(&smooth, 0.5), of(&smooth, 0.0)), (1.0, criteria.most));
        let mut spike = vec![1.0; 10];
        spike[0] = 7.0;
        assert_eq!(of(&run(spike), 0.01), 1.0);
        // A run that is cut out of a motion.
        let moving = run((0..10).map(|k| f64::from(k) * 0.1).collect());
        assert_eq!(of(&moving, 0.001), 1.0);
        let mut missing = vec![1.0; 10];
        missing[0] = f64::NAN;
        assert_eq!(of(&run(missing), 0.01), 1.0);
    }
}
