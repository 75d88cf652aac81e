//! Which of two models explains the validation data better, and whether the difference is significant.

use crate::criteria::WindowCriteria;
use crate::progress::{Cancelled, Work};
use crate::window;

/// Weighted squared errors of the validation samples, in time order, one run after the other.
pub(crate) type Losses = Vec<f64>;

/// Mean difference of two loss series over its standard error (F. X. Diebold, R. S. Mariano, 1995,
/// "Comparing predictive accuracy", Journal of Business & Economic Statistics 13, 253–263, with
/// Bartlett's window): positive where `b` is the better one.
pub(crate) fn advantage(a: &Losses, b: &Losses, criteria: &WindowCriteria) -> f64 {
    let n = a.len().min(b.len());
    if n < 8 {
        return 0.0;
    }
    let differences: Vec<f64> = a.iter().zip(b).map(|(x, y)| x - y).collect();
    let mean = differences.iter().sum::<f64>() / n as f64;
    let lags = window::lags(criteria.advantage_lags, n, criteria.advantage_most);
    let gamma = |lag: usize| {
        differences[lag..]
            .iter()
            .zip(&differences)
            .map(|(x, y)| (x - mean) * (y - mean))
            .sum::<f64>()
            / n as f64
    };
    let mut variance = gamma(0);
    for lag in 1..=lags.min(n - 1) {
        variance += 2.0 * window::bartlett(lag, lags) * gamma(lag);
    }
    let error = (variance.max(0.0) / n as f64).sqrt();
    if error > 0.0 {
        mean / error
    } else if mean == 0.0 {
        0.0
    } else {
        mean.signum() * f64::INFINITY
    }
}

/// How sure it is that `with` explains more than `plain`, as a number of standard errors: the root of
/// the likelihood ratio `N (plain/with - 1)` of two Gaussian models, with `N` the number of samples
/// that are independent of each other, judged by the autocorrelation of the losses.
pub(crate) fn significance(
    plain: &Losses,
    with: &Losses,
    work: &Work<'_>,
) -> Result<f64, Cancelled> {
    let ratio = plain.iter().sum::<f64>() / with.iter().sum::<f64>() - 1.0;
    if ratio > 0.0 {
        Ok((independent(with, work)? * ratio).sqrt())
    } else {
        Ok(0.0)
    }
}

/// Number of samples over the sum of their autocorrelations (Bartlett's window).
fn independent(losses: &Losses, work: &Work<'_>) -> Result<f64, Cancelled> {
    let n = losses.len();
    if n < 8 {
        return Ok(1.0);
    }
    let mean = losses.iter().sum::<f64>() / n as f64;
    let lags = window::lags(work.criteria().window.independence_lags, n, usize::MAX);
    let gamma = |lag: usize| {
        losses[lag..]
            .iter()
            .zip(losses)
            .map(|(x, y)| (x - mean) * (y - mean))
            .sum::<f64>()
    };
    let variance = gamma(0);
    if variance <= 0.0 {
        return Ok(1.0);
    }
    let mut time = 1.0;
    for lag in 1..=lags.min(n - 1) {
        work.go_on()?;
        time += 2.0 * window::bartlett(lag, lags) * gamma(lag) / variance;
    }
    Ok(n as f64 / time.max(1.0))
}

/// Root of the mean loss: the `nrmse` over the validation samples.
pub(crate) fn nrmse(losses: &Losses) -> f64 {
    (losses.iter().sum::<f64>() / losses.len().max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chance::white;

    #[test]
    fn equal_models_are_seldom_told_apart() {
        let mut beyond = 0;
        for seed in 0..200 {
            let a: Losses = white(1000, 2 * seed + 1).iter().map(|e| e * e).collect();
            let b: Losses = white(1000, 2 * seed + 2).iter().map(|e| e * e).collect();
            if advantage(&a, &b, &WindowCriteria::DEFAULT).abs() > 1.96 {
                beyond += 1;
            }
        }
        assert!((2..=24).contains(&beyond), "{beyond} of 200");
    }

    #[test]
    fn a_smaller_error_wins() {
        let a: Losses = white(1000, 1).iter().map(|e| (1.2 * e).powi(2)).collect();
        let b: Losses = white(1000, 2).iter().map(|e| e * e).collect();
        assert!(advantage(&a, &b, &WindowCriteria::DEFAULT) > 4.0);
        assert!(advantage(&b, &a, &WindowCriteria::DEFAULT) < -4.0);
    }
}
