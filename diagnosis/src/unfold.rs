//! The sign of a signal whose sensor gives the magnitude only, guessed from the input.

use loopsight_model::run::Run;

/// Largest share of its root mean square at which a signal may pass through zero between two samples.
const NEAR: f64 = 0.3;

/// The runs with the sign that the measured `signal` probably had: it follows `input`, so it passes through zero once
/// after each change of that input's sign, where it is least before the next one.
///
/// A guess to start a fit from, and nothing else.
pub(crate) fn unfolded(runs: &[Run], signal: usize, input: usize) -> Vec<Run> {
    runs.iter()
        .map(|run| {
            let signs = signs(run, signal, input);
            let mut measured: Vec<f64> = (0..run.len())
                .flat_map(|k| run.sample(k))
                .copied()
                .collect();
            let width = run.n_measured();
            for (row, sign) in measured.chunks_exact_mut(width).zip(signs) {
                row[signal] *= sign;
            }
            run.clone()
                .with_measured(measured)
                .unwrap_or_else(|_| run.clone())
        })
        .collect()
}

/// The sign at each sample.
fn signs(run: &Run, signal: usize, input: usize) -> Vec<f64> {
    let ways = ways(run, input);
    let size = |k: usize| run.sample(k)[signal].abs();
    let known = |k: &usize| size(*k).is_finite();
    let sum: f64 = (0..run.len()).filter(known).map(|k| size(k).powi(2)).sum();
    let near = NEAR * (sum / run.len().max(1) as f64).sqrt();
    let mut signs = Vec::with_capacity(run.len());
    let mut sign = ways.first().copied().unwrap_or(1.0);
    for part in ways.chunk_by(|a, b| a == b) {
        let (start, end) = (signs.len(), signs.len() + part.len());
        let least = (start..end)
            .filter(known)
            .min_by(|a, b| size(*a).total_cmp(&size(*b)));
        let through = least.filter(|k| part[0] != sign && size(*k) <= near);
        signs.resize(through.unwrap_or(end), sign);
        if through.is_some() {
            sign = part[0];
        }
        signs.resize(end, sign);
    }
    signs
}

/// The sign of an input at each sample; that of the time before where it is zero.
fn ways(run: &Run, input: usize) -> Vec<f64> {
    let of = |k: usize| run.input(k)[input];
    let first = (0..run.len()).map(of).find(|u| *u != 0.0).unwrap_or(1.0);
    let mut way = first.signum();
    let step = |k| {
        if of(k) != 0.0 {
            way = of(k).signum();
        }
        way
    };
    (0..run.len()).map(step).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A motor of 0.3 s that is reversed now and then, at last by a command too short to turn it round.
    #[test]
    fn the_sign_changes_where_the_magnitude_is_least() {
        let command = |k: usize| match k {
            0..50 | 400..402 => 0.0,
            50..200 | 300..500 => 5.0,
            200..300 | 500..505 => -5.0,
            _ => 5.0,
        };
        let (mut run, mut speed, mut expected) = (Run::empty(1, 1), 0.0f64, Vec::new());
        for k in 0..700 {
            let missing = k % 90 == 7;
            let read = if missing { f64::NAN } else { speed.abs() };
            run.push(0.01 * k as f64, &[command(k)], &[read]).unwrap();
            expected.push(speed);
            speed += 0.01 / 0.3 * (command(k) - speed);
        }
        let [found] = &unfolded(&[run], 0, 0)[..] else {
            panic!("one run");
        };
        for (k, expected) in expected.iter().enumerate() {
            let y = found.sample(k)[0];
            assert!(
                y.is_nan() || (y - expected).abs() < 0.2,
                "{k}: {y} {expected}"
            );
        }
    }
}
