//! How much of an effect the nominal model can take up in its own parameters.

use crate::machines::{self, Parts};
use crate::recording::{Recording, overall};
use crate::robot::{Kind, Robot};

/// The model without effect, fitted to a recording.
///
/// Of the machines of motors and wheels it is the lumped model without K_B and K_E, one first-order
/// lag per signal
///
/// ```text
/// y' = a y + c s      s = V_r + V_l for the forward speed, V_r - V_l for the yaw rate
/// ```
///
/// compared as the mean over each period, from rest, with the squared error of the free run made
/// least. For each `a` the best `c` is linear; `a` is found by golden section. Of the others it is
/// the machine itself without effect, its parts fitted by Gauss and Newton's method to what it does
/// under the same commands. It answers how large the error is that only another model can take away.
#[derive(Clone, Debug, PartialEq)]
pub enum Refit {
    /// `[K_A, K_C]`, and `[K_D, K_F]` on the robot.
    Lags(Vec<[f64; 2]>),
    /// Each part over its true value.
    Parts(Parts),
}

/// Least and largest damping considered, 1/s.
const DAMPING: [f64; 2] = [0.05, 300.0];

/// Fits the lumped model to `log`.
pub fn refit(log: &Recording) -> Refit {
    if let Kind::Rig(sheet) = log.truth.robot.kind() {
        return Refit::Parts(machines::refit(sheet, log));
    }
    let parameters = (0..log.run.n_measured())
        .map(|signal| {
            let gain_and_error = |damping: f64| {
                let unit = response(log, signal, damping);
                let y = measured(log, signal);
                let xx: f64 = unit.iter().map(|x| x * x).sum();
                let xy: f64 = unit.iter().zip(y).map(|(x, y)| x * y).sum();
                let c = if xx > 0.0 { xy / xx } else { 0.0 };
                let y = measured(log, signal);
                let error: f64 = unit.iter().zip(y).map(|(x, y)| (y - c * x).powi(2)).sum();
                (c, error)
            };
            let log_damping = golden(DAMPING.map(f64::ln), |x| gain_and_error(x.exp()).1);
            let damping = log_damping.exp();
            [-damping, gain_and_error(damping).0]
        })
        .collect();
    Refit::Lags(parameters)
}

impl Refit {
    /// Error of the fitted model's free run on `log`, over the standard deviation of the signal,
    /// root mean square over the signals.
    pub fn left(&self, log: &Recording) -> f64 {
        let lags = match (self, log.truth.robot.kind()) {
            (Refit::Lags(lags), _) => lags,
            (Refit::Parts(parts), Kind::Rig(sheet)) => return machines::left(sheet, parts, log),
            // Parts of another machine explain nothing.
            (Refit::Parts(_), Kind::Driven(_)) => return f64::NAN,
        };
        let n = log.run.len() as f64;
        let shares: Vec<f64> = lags
            .iter()
            .enumerate()
            .map(|(signal, [a, c])| {
                let unit = response(log, signal, -a);
                let mean = measured(log, signal).sum::<f64>() / n;
                let variance: f64 = measured(log, signal).map(|y| (y - mean).powi(2)).sum();
                let error: f64 = unit
                    .iter()
                    .zip(measured(log, signal))
                    .map(|(x, y)| (y - c * x).powi(2))
                    .sum();
                (error / variance).sqrt()
            })
            .collect();
        overall(&shares)
    }
}

fn measured(log: &Recording, signal: usize) -> impl Iterator<Item = f64> {
    (0..log.run.len()).map(move |k| log.run.sample(k)[signal])
}

/// Mean of `y` over the period before each sample for `y' = -damping y + s`, from rest, exactly.
fn response(log: &Recording, signal: usize, damping: f64) -> Vec<f64> {
    let run = &log.run;
    let mut y = 0.0;
    let mut mean = 0.0;
    (0..run.len())
        .map(|k| {
            let out = mean;
            let u = run.input(k);
            let s = match (log.truth.robot, signal) {
                (Robot::Twil, 0) => u[0] + u[1],
                (Robot::Twil, _) => u[0] - u[1],
                _ => u[0],
            };
            let h = match run.time().get(k + 1) {
                Some(next) => next - run.time()[k],
                None => return out,
            };
            let settled = s / damping;
            let x = damping * h;
            mean = settled + (y - settled) * -(-x).exp_m1() / x;
            y = settled + (y - settled) * (-x).exp();
            out
        })
        .collect()
}

/// Where a function with one minimum is least.
fn golden([mut low, mut high]: [f64; 2], f: impl Fn(f64) -> f64) -> f64 {
    let ratio = (5.0f64.sqrt() - 1.0) / 2.0;
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..45 {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - ratio * (high - low);
            fa = f(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + ratio * (high - low);
            fb = f(b);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::driven::Driven;
    use crate::{Experiment, record};

    /// The clean machine is a lumped model of the paper's parameters, but for the millisecond of its
    /// windings, and nothing but the rounding is left.
    #[test]
    fn a_clean_machine_is_found_as_it_is() {
        for (robot, driven) in [(Robot::Twil, Driven::Twil), (Robot::Axis, Driven::Axis)] {
            let log = record(robot, &[], Experiment::Prbs, 1).unwrap();
            let fit = refit(&log);
            let k = driven.lumped();
            let Refit::Lags(lags) = &fit else {
                panic!("{robot:?} has lags");
            };
            let expected = [[k.k_a, k.k_c], [k.k_d, k.k_f]];
            for (found, expected) in lags.iter().zip(expected) {
                for (found, expected) in found.iter().zip(expected) {
                    assert!((found / expected - 1.0).abs() < 0.01, "{found} {expected}");
                }
            }
            let left = fit.left(&log) / log.floor();
            assert!((0.9..1.2).contains(&left), "{left} times the floor");
            let test = record(robot, &[], Experiment::MultiLevel, 2).unwrap();
            assert!(fit.left(&test) < 1.2 * test.floor());
        }
    }
}
