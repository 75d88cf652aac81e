//! A run of a SysId log in windows, and the regression that SysId itself makes,
//!
//! ```text
//! u = kS sign(y) + kV y + kA y'
//! ```
//!
//! over them, so that noise and lateness matter little.

use nalgebra::{Matrix3, Vector3};

/// Share of the large speed above which a machine clearly moves.
const MOVES: f64 = 0.1;
/// Fewest windows in motion that say anything.
pub(super) const ENOUGH: usize = 10;

/// Means over a window.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) start: f64,
    pub(super) end: f64,
    pub(super) voltage: f64,
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

/// `[kS, kV, kA]`, and the share of the voltage that they leave.
pub(super) struct Feedforward {
    pub(super) terms: Vector3<f64>,
    pub(super) left: f64,
}

/// The largest voltage, either way.
pub(super) fn highest<'w>(windows: impl IntoIterator<Item = &'w Window>) -> f64 {
    let volts = windows.into_iter().map(|w| w.voltage.abs());
    volts.fold(0.0, f64::max)
}

/// Windows of a run, each half over the one before.
pub(super) fn windows<'t>(
    rows: impl Iterator<Item = &'t [f64]>,
    length: f64,
    voltage: usize,
    speed: usize,
) -> Vec<Window> {
    let rows: Vec<[f64; 3]> = rows
        .filter_map(|row| Some([*row.first()?, *row.get(voltage)?, *row.get(speed)?]))
        .filter(|row| row.iter().all(|v| v.is_finite()))
        .collect();
    let mut windows = Vec::new();
    let mut first = 0;
    while let Some(start) = rows.get(first) {
        let later = |t: f64| rows.partition_point(|row| row[0] < t);
        let last = later(start[0] + length);
        let (Some(end), Some(within)) = (rows.get(last), rows.get(first..last)) else {
            break;
        };
        let n = within.len().max(1) as f64;
        let mean = |column: usize| within.iter().map(|row| row[column]).sum::<f64>() / n;
        let span = end[0] - start[0];
        // A gap is no window.
        if span > 0.0 && span < 2.0 * length {
            windows.push(Window {
                start: start[0],
                end: end[0],
                voltage: mean(1),
                speed: mean(2),
                acceleration: (end[2] - start[2]) / span,
            });
        }
        first = later(start[0] + 0.5 * length).max(first + 1);
    }
    windows
}

/// What the regression makes of a window.
pub(super) fn phi(w: &Window) -> Vector3<f64> {
    Vector3::new(w.speed.signum(), w.speed, w.acceleration)
}

/// The windows in motion.
pub(super) fn moving<'w>(windows: impl Iterator<Item = &'w Window>, large: f64) -> Vec<&'w Window> {
    windows.filter(|w| w.speed.abs() > MOVES * large).collect()
}

/// The regression over the windows in motion; none where they are too few.
pub(super) fn feedforward<'w>(
    windows: impl Iterator<Item = &'w Window>,
    large: f64,
) -> Option<Feedforward> {
    let moving = moving(windows, large);
    let (mut gram, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for window in &moving {
        let phi = phi(window);
        gram += phi * phi.transpose();
        right += phi * window.voltage;
    }
    let terms = gram.try_inverse()? * right;
    let left = left(&terms, &moving)?;
    (moving.len() >= ENOUGH).then_some(Feedforward { terms, left })
}

/// The share of the voltage that `terms` leave; none without voltage.
pub(super) fn left(terms: &Vector3<f64>, windows: &[&Window]) -> Option<f64> {
    let wasted = |w: &&Window| (w.voltage - terms.dot(&phi(w))).powi(2);
    let (left, square): (f64, f64) = (
        windows.iter().map(wasted).sum(),
        windows.iter().map(|w| w.voltage.powi(2)).sum(),
    );
    (square > 0.0).then(|| (left / square).sqrt())
}
