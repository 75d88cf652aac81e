//! Residuals over another quantity: a cloud of points and its means.

use loopsight_diagnosis::RunTrace;

use crate::chart::{Abscissae, Chart, Role, Trace};
use crate::errors::{residual, signal};
use crate::numbers::axis;
use crate::thin::spread;
use crate::words::significant;

/// Most points of a cloud.
const MOST_POINTS: usize = 3000;
/// Bins over the greater part of the abscissae.
const BINS: f64 = 20.0;
/// Bins with fewer samples say nothing.
const FEWEST: usize = 5;

/// The samples of one bin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Bin {
    /// Mean abscissa.
    pub(crate) x: f64,
    /// Mean and standard deviation of the ordinates.
    pub(crate) mean: f64,
    pub(crate) std: f64,
    pub(crate) count: usize,
}

/// Averages `points` in bins of equal width. Zero is an edge between bins and exact zeros have a
/// bin of their own, so that what changes with the direction of motion shows as a jump.
pub(crate) fn bins(points: &[(f64, f64)]) -> Vec<Bin> {
    let mut sorted: Vec<(f64, f64)> = points
        .iter()
        .copied()
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let Some(last) = sorted.len().checked_sub(1) else {
        return Vec::new();
    };
    // A few outliers must not widen the bins.
    let at = |share: f64| sorted[(share * last as f64).round() as usize].0;
    let width = (at(0.99) - at(0.01)) / BINS;
    let key = |x: f64| match x {
        0.0 => (0.0, false),
        _ if width > 0.0 => ((x / width).floor(), true),
        _ => (0.0, x > 0.0),
    };
    sorted
        .chunk_by(|a, b| key(a.0) == key(b.0))
        .filter(|chunk| chunk.len() >= FEWEST)
        .map(|chunk| {
            let n = chunk.len() as f64;
            let mean = chunk.iter().map(|p| p.1).sum::<f64>() / n;
            let squares = chunk.iter().map(|p| (p.1 - mean).powi(2)).sum::<f64>();
            Bin {
                x: chunk.iter().map(|p| p.0).sum::<f64>() / n,
                mean,
                std: (squares / n).sqrt(),
                count: chunk.len(),
            }
        })
        .collect()
}

/// A small chart for each quantity that the residual of signal `id` may depend on: the measured signals, then
/// the inputs. `after` are the runs of another model with its name; of them only the means are drawn.
pub(crate) fn charts(
    runs: &[RunTrace],
    after: Option<(&str, &[RunTrace])>,
    id: &str,
    unit: &str,
) -> Vec<String> {
    let Some(first) = runs.first() else {
        return Vec::new();
    };
    let signals = first
        .signals
        .iter()
        .map(|s| (s.id.as_str(), s.unit.as_str(), true));
    let inputs = first
        .inputs
        .iter()
        .map(|(id, unit, _)| (id.as_str(), unit.as_str(), false));
    signals
        .chain(inputs)
        .map(|(name, of_unit, measured)| {
            let points = cloud(runs, id, name, measured);
            let after = after.map(|(of, runs)| (of, cloud(runs, id, name, measured)));
            let against = if measured {
                format!("measured {name}")
            } else {
                name.to_owned()
            };
            chart(
                &points,
                after.as_ref().map(|(of, points)| (*of, points.as_slice())),
                axis(&against, of_unit),
                axis(&format!("residual of {id}"), unit),
            )
        })
        .collect()
}

/// The residuals of signal `id` over the quantity `name`.
fn cloud(runs: &[RunTrace], id: &str, name: &str, measured: bool) -> Vec<(f64, f64)> {
    runs.iter()
        .filter_map(|run| {
            let residual = residual(signal(run, id)?);
            let values = if measured {
                &signal(run, name)?.measured
            } else {
                &run.inputs.iter().find(|input| input.0 == name)?.2
            };
            Some(values.iter().copied().zip(residual).collect::<Vec<_>>())
        })
        .flatten()
        .filter(|(x, y)| x.is_finite() && y.is_finite())
        .collect()
}

fn chart(
    points: &[(f64, f64)],
    after: Option<(&str, &[(f64, f64)])>,
    x_title: String,
    y_title: String,
) -> String {
    let column = |values: &mut dyn Iterator<Item = f64>| {
        values.map(|v| significant(v, 4)).collect::<Vec<f64>>()
    };
    let mean = |name: &str, role: Role, points: &[(f64, f64)]| {
        let bins = bins(points);
        Trace {
            name: name.into(),
            role,
            x: Abscissae::Own(column(&mut bins.iter().map(|b| b.x))),
            y: column(&mut bins.iter().map(|b| b.mean)),
            spread: Some(column(&mut bins.iter().map(|b| b.std))),
            step: false,
            hidden: false,
        }
    };
    let mut chart = Chart::over(x_title);
    chart.small = true;
    chart.panel(y_title, 190);
    let drawn: Vec<(f64, f64)> = spread(points.len(), MOST_POINTS)
        .into_iter()
        .map(|k| points[k])
        .collect();
    chart.push(Trace {
        name: "samples".into(),
        role: Role::Points,
        x: Abscissae::Own(column(&mut drawn.iter().map(|p| p.0))),
        y: column(&mut drawn.iter().map(|p| p.1)),
        spread: None,
        step: false,
        hidden: false,
    });
    chart.push(mean("mean ± standard deviation", Role::Mean, points));
    if let Some((name, points)) = after {
        chart.push(mean(name, Role::MeanAfter, points));
    }
    chart.html()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::{friction_runs, opened};

    #[test]
    fn friction_jumps_at_zero() {
        let points: Vec<(f64, f64)> = (-500..=500)
            .map(|k| {
                let x = f64::from(k) / 100.0;
                (x, if x == 0.0 { 0.0 } else { -0.03 * x.signum() })
            })
            .chain([
                (0.0, 0.1),
                (0.0, -0.1),
                (0.0, 0.0),
                (0.0, 0.0),
                (f64::NAN, 1.0),
            ])
            .collect();
        let bins = bins(&points);
        assert!(bins.len() >= 20, "{}", bins.len());
        for bin in bins.iter().filter(|b| b.x < 0.0) {
            assert!((bin.mean - 0.03).abs() < 1e-12 && bin.std < 1e-12);
        }
        let at_rest: Vec<&Bin> = bins.iter().filter(|b| b.x == 0.0).collect();
        assert_eq!(at_rest.len(), 1);
        assert_eq!(at_rest[0].count, 5);
        assert!((at_rest[0].std - 0.004_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn two_levels_are_two_bins() {
        let points: Vec<(f64, f64)> = (0..100)
            .map(|k| if k % 2 == 0 { (9.0, 1.0) } else { (-9.0, 2.0) })
            .collect();
        let bins = bins(&points);
        assert_eq!(
            bins.iter().map(|b| (b.x, b.mean)).collect::<Vec<_>>(),
            [(-9.0, 2.0), (9.0, 1.0)]
        );
        assert_eq!(super::bins(&[(1.0, 1.0); 9]).len(), 1);
        assert!(super::bins(&[]).is_empty());
    }

    #[test]
    fn clouds_are_thinned() {
        let runs = friction_runs(2, 20_000);
        let charts = charts(&runs, None, "linear_velocity", "m/s");
        assert_eq!(charts.len(), 4);
        assert!(charts[0].len() < 40_000, "{}", charts[0].len());
        assert!(opened(&charts[2]).contains("voltage_right, V"));
        assert!(super::charts(&[], None, "v", "m").is_empty());
    }
}
