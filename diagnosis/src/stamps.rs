//! How far time stamps are from each other, and may be from the instants they stand for.

use loopsight_model::run::Run;

/// Periods longer than that many usual ones are gaps, and no jitter.
const GAP: f64 = 1.5;

/// How late stamps that jitter may be on average, s: a shift in time that is smaller is the logger's, and no effect of the
/// machine.
///
/// ```text
/// √6/2 · standard deviation of the periods
/// ```
///
/// A stamp that is late by anything from nothing to `J` is late by `J/2` on average, and the difference of two of them has
/// a standard deviation of `J/√6`. Stamps that are exact give nothing.
pub(crate) fn shift(runs: &[Run]) -> f64 {
    let periods = |run: &Run| -> Vec<f64> {
        let periods = run.time().windows(2).map(|pair| pair[1] - pair[0]);
        periods.collect()
    };
    let (mut n, mut squares) = (0.0f64, 0.0f64);
    for mut periods in runs.iter().map(periods) {
        periods.sort_by(f64::total_cmp);
        let Some(usual) = periods.get(periods.len() / 2).copied() else {
            continue;
        };
        periods.retain(|period| *period < GAP * usual);
        let mean = periods.iter().sum::<f64>() / periods.len().max(1) as f64;
        n += periods.len() as f64;
        squares += periods.iter().map(|p| (p - mean).powi(2)).sum::<f64>();
    }
    (1.5 * squares / n.max(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use loopsight_model::run::Rows;

    use super::*;
    use crate::chance::uniform;

    fn run(late: impl FnMut() -> f64) -> Run {
        let mut late = late;
        let time: Vec<f64> = (0..4000).map(|k| 0.01 * f64::from(k) + late()).collect();
        let row = || Rows::new(1, vec![0.0; time.len()]);
        let (inputs, measured) = (row(), row());
        Run::new("", time, inputs, measured).unwrap()
    }

    #[test]
    fn it_is_the_mean_lateness() {
        let mut random = uniform(3);
        let jittering = run(|| 0.003 * (random() + 0.5));
        assert!((shift(&[jittering]) / 0.0015 - 1.0).abs() < 0.05);
        assert!(shift(&[run(|| 0.0)]) < 1e-12);
    }

    #[test]
    fn a_gap_is_no_jitter() {
        let mut k = 0;
        let gaps = run(|| {
            k += 1;
            0.05 * f64::from(k / 100)
        });
        assert!(shift(&[gaps]) < 1e-12);
    }
}
