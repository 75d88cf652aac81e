//! Starts of a fit that is lost: scattered over what a machine of its kind may be.

use loopsight_model::model::ModelParameter;
use nalgebra::DMatrix;

use crate::arrive::{OTHERS, Start};
use crate::error::FitError;
use crate::prediction::least_squares;
use crate::problem::Problem;

/// Scattered starts. Each costs one free run; the best of them are followed.
const SCATTERED: usize = 32;
/// Where a parameter has no range, scattered starts reach this many decades above and below its value.
const DECADES: f64 = 1.5;
/// The same where the file gives no value: only the unit is known.
const DECADES_UNKNOWN: f64 = 3.0;
/// Sizes from which a usual value is far from zero, and how many of them scattered starts reach above and below it.
const FAR: f64 = 10.0;
const SIZES: f64 = 2.0;

impl Problem<'_> {
    /// Starts scattered over the ranges of the parameters, or some decades around `values`, the best first.
    /// They are always the same ones. Where values are missing, each start is a machine of another quickness as well, of which
    /// the log can have period and duration: a declaration is for a machine of the usual size, an oven or a hair dryer.
    pub(crate) fn scattered(&self, values: &[f64]) -> Result<Vec<Start>, FitError> {
        let mut starts = Vec::new();
        let quickness = self.quickness();
        for k in 0..SCATTERED {
            let mut scattered = values.to_vec();
            let quicker = match quickness {
                Some([slow, quick]) => slow * (quick / slow).powf(spread(k, self.free.len())),
                None => 1.0,
            };
            for (dimension, i) in self.free.iter().enumerate() {
                let parameter = &self.model.parameters[*i];
                let value = match parameter.value {
                    None => values[*i] * quicker.powi(rate_of(&parameter.unit)),
                    Some(_) => values[*i],
                };
                scattered[*i] = scatter(parameter, value, spread(k, dimension));
            }
            let from = format!("scattered values, {} of {SCATTERED}", k + 1);
            if let Some(start) = self.start(&from, scattered)? {
                starts.push(self.amplified(start)?);
            }
        }
        starts.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        starts.truncate(OTHERS);
        Ok(starts)
    }

    /// A start with the one of its parameters changed that lowers its cost most, together with the initial states: the gain of
    /// an input, as a rule. What the starts are then judged by is the shape of their response and not its size. A response that is
    /// ten times too large makes a fit take the input away altogether.
    fn amplified(&self, mut start: Start) -> Result<Start, FitError> {
        let at = self.pack(&start.values, &start.states);
        let linear = self.linearise(&at)?;
        let (residual, jacobian) = (&linear.residual, &linear.jacobian);
        let (lower, upper) = (&self.lower, &self.upper);
        let mut best: Option<(f64, nalgebra::DVector<f64>)> = None;
        for parameter in 0..self.free.len() {
            let unknowns: Vec<usize> = [parameter]
                .into_iter()
                .chain(self.free.len()..jacobian.ncols())
                .collect();
            let columns: DMatrix<f64> = jacobian.select_columns(&unknowns);
            let Some(step) = least_squares(&columns, residual) else {
                continue;
            };
            let left = (residual - &columns * &step).norm_squared();
            if left.is_finite() && best.as_ref().is_none_or(|(least, _)| left < *least) {
                let mut there = at.clone();
                for (unknown, step) in unknowns.iter().zip(step.iter()) {
                    let moved = there[*unknown] - step;
                    there[*unknown] = moved.max(lower[*unknown]).min(upper[*unknown]);
                }
                best = Some((left, there));
            }
        }
        if let Some((_, there)) = best {
            let cost = self.residual_vector(&there)?.norm_squared();
            if cost < start.cost {
                let solution = self.solution(&there);
                (start.values, start.states, start.cost) = (solution.values, solution.states, cost);
            }
        }
        Ok(start)
    }

    /// How much slower and quicker than its declarations say a machine may be that these logs show something of: its rates
    /// lie between one over the duration of a log and one over its period. None where no value is missing that is a rate.
    fn quickness(&self) -> Option<[f64; 2]> {
        let parameters = self.free.iter().map(|i| &self.model.parameters[*i]);
        let rates = parameters
            .filter(|p| p.value.is_none() && p.unit == "1/s")
            .map(|p| p.declaration.nearest(p.scale()).abs())
            .filter(|rate| *rate > 0.0);
        let (logs, count) = rates.fold((0.0, 0.0), |(sum, n), rate| (sum + rate.ln(), n + 1.0));
        let usual = (count > 0.0).then(|| f64::exp(logs / count))?;
        let run = self.runs.iter().max_by_key(|run| run.len())?;
        let rates = [run.duration().recip(), run.median_period().recip()];
        let quickness = rates.map(|rate| rate / usual);
        (quickness.iter().all(|q| q.is_normal()) && quickness[0] < quickness[1])
            .then_some(quickness)
    }
}

/// The power of a rate in a unit, as it is written: 1 for `1/s`, 2 for `m/s^2/V`.
fn rate_of(unit: &str) -> i32 {
    let mut factors = unit.split('/');
    let seconds = |factor: &str| match factor.trim().strip_prefix('s') {
        Some("") => 1,
        Some(power) => power
            .strip_prefix('^')
            .map_or(0, |p| p.parse().unwrap_or(0)),
        None => 0,
    };
    let above: i32 = factors
        .next()
        .map_or(0, |all| all.split(' ').map(seconds).sum());
    let below: i32 = factors.flat_map(|all| all.split(' ')).map(seconds).sum();
    below - above
}

/// One coordinate of the `k`-th of points that fill the unit cube evenly: the fractional part of `k` times the
/// root of a prime (H. Niederreiter, 1992, "Random Number Generation and Quasi-Monte Carlo Methods", theorem
/// 4.3).
fn spread(k: usize, dimension: usize) -> f64 {
    const PRIMES: [f64; 12] = [
        2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0, 23.0, 29.0, 31.0, 37.0,
    ];
    let root = PRIMES[dimension % PRIMES.len()].sqrt() * (1 + dimension / PRIMES.len()) as f64;
    ((k + 1) as f64 * root).fract()
}

/// The value of a parameter at the fraction `share` of its range.
fn scatter(parameter: &ModelParameter, value: f64, share: f64) -> f64 {
    let (low, high) = parameter.declaration.bounds();
    if low.is_finite() && high.is_finite() && low < 0.0 {
        return low + share * (high - low);
    }
    if low.is_finite() && high.is_finite() && low > 0.0 {
        return low * (high / low).powf(share);
    }
    let usual = parameter
        .declaration
        .default
        .filter(|usual| *usual == value);
    if usual.is_some_and(|usual| usual.abs() > FAR * parameter.scale()) {
        // A value on a scale whose zero is far away, as a temperature: it is some sizes more or less.
        let more = SIZES * (2.0 * share - 1.0) * parameter.scale();
        return parameter.declaration.nearest(value + more);
    }
    let size = if value == 0.0 {
        parameter.scale()
    } else {
        value
    };
    // Where the sign is not known, one half of the shares gives negative values and the other positive ones.
    let (sign, share) = if parameter.value.is_none() && low < 0.0 && high > 0.0 {
        let negative = share < 0.5;
        (if negative { -1.0 } else { 1.0 }, (2.0 * share).fract())
    } else {
        (size.signum(), share)
    };
    let decades = match parameter.value {
        Some(_) => DECADES,
        None => DECADES_UNKNOWN,
    };
    let value = sign * size.abs() * 10f64.powf(decades * (2.0 * share - 1.0));
    parameter.declaration.nearest(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scattered_points_fill_their_range() {
        for dimension in 0..30 {
            let mut eighths = [0; 4];
            for k in 0..64 {
                let share = spread(k, dimension);
                assert!((0.0..1.0).contains(&share));
                eighths[(4.0 * share) as usize] += 1;
            }
            assert!(eighths.iter().all(|n| *n >= 10), "{dimension}: {eighths:?}");
        }
    }

    #[test]
    fn rates_are_known_by_their_unit() {
        let rates = ["1/s", "rad/s^2/V", "K/s/W", "V s", "1", "m/s", "1/(N s)"].map(rate_of);
        assert_eq!(rates, [1, 2, 1, -1, 0, 1, 0]);
    }
}
