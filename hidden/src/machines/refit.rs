//! The machine without effect, its parts fitted to a recording.

use super::Sheet;
use crate::recording::{Recording, overall};

/// Each part of a machine over its true value, as a fit without the effect has it.
pub type Parts = Vec<f64>;

/// Steps of Gauss and Newton's method.
const STEPS: usize = 8;
/// Step of a part for its derivative.
const SMALL: f64 = 1e-4;

/// Fits the parts to `log`: least squares of the signals, each over its standard deviation.
///
/// Reference: J. Nocedal, S. J. Wright (2006), "Numerical Optimization", 2nd edition, section 10.3.
pub(crate) fn refit(sheet: &'static Sheet, log: &Recording) -> Parts {
    let number = (sheet.build)([0.0; 2], 1.0).parts().len();
    let mut parts = vec![1.0; number];
    let mut errors = residual(sheet, &parts, log);
    for _ in 0..STEPS {
        let columns: Vec<Vec<f64>> = (0..number)
            .map(|i| {
                let mut moved = parts.clone();
                moved[i] += SMALL;
                let there = residual(sheet, &moved, log);
                let pairs = there.iter().zip(&errors);
                pairs.map(|(a, b)| (a - b) / SMALL).collect()
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let normal: Vec<Vec<f64>> = columns
            .iter()
            .map(|a| columns.iter().map(|b| dot(a, b)).collect())
            .collect();
        let right: Vec<f64> = columns.iter().map(|a| -dot(a, &errors)).collect();
        let step = solve(normal, right);
        // Half as far until it helps.
        let before = dot(&errors, &errors);
        let better = (0..6).find_map(|halvings| {
            let share = 0.5f64.powi(halvings);
            let pairs = parts.iter().zip(&step);
            let moved: Parts = pairs.map(|(p, s)| p + share * s).collect();
            let there = residual(sheet, &moved, log);
            (moved.iter().all(|p| *p > 0.0) && dot(&there, &there) < before)
                .then_some((moved, there))
        });
        match better {
            Some((moved, there)) => {
                let gained = before - dot(&there, &there);
                (parts, errors) = (moved, there);
                if gained < 1e-6 * before {
                    break;
                }
            }
            None => break,
        }
    }
    parts
}

/// Error of the machine with these parts over the standard deviation of each signal, root mean
/// square over the signals.
pub(crate) fn left(sheet: &'static Sheet, parts: &Parts, log: &Recording) -> f64 {
    let errors = residual(sheet, parts, log);
    let n = log.run.len() as f64;
    let shares: Vec<f64> = errors
        .chunks(log.run.len())
        .map(|signal| (signal.iter().map(|e| e * e).sum::<f64>() / n).sqrt())
        .collect();
    overall(&shares)
}

/// What a machine with these parts does otherwise, under the same commands, without rounding: signal
/// by signal, over its standard deviation.
fn residual(sheet: &'static Sheet, parts: &[f64], log: &Recording) -> Vec<f64> {
    let time_constant = log.truth.winding_time_constant.unwrap_or_default();
    let mut rig = (sheet.build)([0.0; 2], time_constant);
    for (part, factor) in rig.parts().into_iter().zip(parts) {
        *part *= factor;
    }
    let rows: Vec<[f64; super::SIGNALS]> = log
        .commands
        .iter()
        .map(|[command, _]| {
            let row = rig.sample(*command);
            rig.advance();
            row.exact
        })
        .collect();
    let run = &log.run;
    let n = run.len() as f64;
    (0..run.n_measured())
        .flat_map(|j| {
            let measured = || (0..run.len()).map(move |k| run.sample(k)[j]);
            let mean = measured().sum::<f64>() / n;
            let variance = measured().map(|y| (y - mean).powi(2)).sum::<f64>() / n;
            let pairs = measured().zip(&rows);
            let off = pairs.map(|(y, row)| (y - row[j]) / variance.sqrt());
            off.collect::<Vec<f64>>()
        })
        .collect()
}

/// Gauss elimination with pivots on the diagonal: the matrix of least squares is symmetric and, where
/// the log tells the parts apart, positive definite. A part that it does not tell stays.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    let scale: Vec<f64> = (0..n).map(|i| a[i][i]).collect();
    for i in 0..n {
        if a[i][i] <= 1e-12 * scale[i] {
            a[i] = (0..n).map(|j| f64::from(u8::from(i == j))).collect();
            b[i] = 0.0;
        }
        for k in i + 1..n {
            let factor = a[k][i] / a[i][i];
            let above = a[i].clone();
            for (x, y) in a[k].iter_mut().zip(above) {
                *x -= factor * y;
            }
            b[k] -= factor * b[i];
        }
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|j| a[i][j] * b[j]).sum();
        b[i] = (b[i] - known) / a[i][i];
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equations_are_solved() {
        let a = vec![
            vec![4.0, 1.0, 0.5],
            vec![1.0, 3.0, -1.0],
            vec![0.5, -1.0, 2.0],
        ];
        let x = [1.0, -2.0, 0.25];
        let b: Vec<f64> = a
            .iter()
            .map(|row| row.iter().zip(x).map(|(a, x)| a * x).sum())
            .collect();
        for (found, expected) in solve(a, b).iter().zip(x) {
            assert!((found - expected).abs() < 1e-12);
        }
    }
}
