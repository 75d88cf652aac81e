//! How errors of the state grow in a free run.

use nalgebra::DMatrix;

use crate::criteria::FreeRunCriteria;

/// Growth beyond which a model is certainly unstable, and numbers would soon overflow.
const CERTAINLY: f64 = 1e9;
/// Instants of a run from which errors are followed, as fractions of its length.
const STARTS: [f64; 3] = [0.0, 0.25, 0.5];
/// One sample of a filter.
pub(crate) struct Linearised<'s> {
    pub(crate) k: usize,
    /// The corrected state.
    pub(crate) x: &'s [f64],
    /// Derivative of the state by the state before.
    pub(crate) a: &'s DMatrix<f64>,
    /// Derivative of the measurement by the state before.
    pub(crate) c: &'s DMatrix<f64>,
    pub(crate) gain: &'s DMatrix<f64>,
}

/// The linearisations along a run.
pub(crate) struct Path {
    time: Vec<f64>,
    a: Vec<DMatrix<f64>>,
    c: Vec<DMatrix<f64>>,
    /// States along it.
    x: Vec<Vec<f64>>,
}

impl Path {
    pub(crate) fn new(time: &[f64]) -> Self {
        Self {
            time: time.to_vec(),
            a: Vec::new(),
            c: Vec::new(),
            x: Vec::new(),
        }
    }

    pub(crate) fn push(&mut self, step: &Linearised<'_>) {
        self.a.push(step.a.clone());
        self.c.push(step.c.clone());
        self.x.push(step.x.to_vec());
    }
}

/// Whether errors grow exponentially along a path, by the eigenvalues of its transition.
pub(crate) fn unstable(path: &Path, criteria: &FreeRunCriteria) -> bool {
    let Some(first) = path.a.first() else {
        return false;
    };
    let mut transition = DMatrix::identity(first.nrows(), first.ncols());
    for a in &path.a {
        transition = a * transition;
        // Beyond that the model is certainly unstable, and numbers would soon overflow.
        if transition.amax() > CERTAINLY {
            break;
        }
    }
    radius(&transition, &vec![1.0; first.ncols()]) > criteria.exponential
}

/// How fast errors of the state grow, where that is too fast for a free run.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Growth {
    /// Time after which they are too large, s.
    pub(crate) horizon: f64,
    /// Time in which they double, where they grow exponentially, s.
    pub(crate) doubling: Option<f64>,
    /// States that show in what is measured, by index.
    pub(crate) observed: Vec<usize>,
}

impl Growth {
    /// Follows errors as large as the states' standard deviations along `paths`. `None` where they stay below a
    /// multiple (`growth` of the criteria) of the `deviation` of each measured signal.
    pub(crate) fn of(
        paths: &[Path],
        deviation: &[f64],
        criteria: &FreeRunCriteria,
    ) -> Option<Self> {
        let nx = paths.iter().find_map(|p| p.a.first())?.ncols();
        let size = deviations(paths, nx);
        let mut seen = vec![false; nx];
        let mut followed = 0usize;
        let mut times = Vec::new();
        let mut rates = Vec::new();
        let mut y = DMatrix::zeros(deviation.len(), nx);
        let mut next = DMatrix::zeros(nx, nx);
        for path in paths {
            for start in STARTS {
                let first = (start * path.a.len() as f64) as usize;
                let mut m = DMatrix::from_fn(nx, nx, |i, j| if i == j { size[i] } else { 0.0 });
                followed += usize::from(first < path.a.len());
                let mut grown = None;
                let mut late = 0.0f64;
                let ending =
                    path.a.len() - ((path.a.len() - first) as f64 * criteria.late_share) as usize;
                for k in first..path.a.len() {
                    path.c[k].mul_to(&m, &mut y);
                    path.a[k].mul_to(&m, &mut next);
                    std::mem::swap(&mut m, &mut next);
                    let mut most = 0.0f64;
                    for (row, deviation) in deviation.iter().enumerate() {
                        for column in 0..nx {
                            let share = y[(row, column)].abs() / deviation;
                            if share.is_finite() && share > 0.0 {
                                seen[column] = true;
                                most = most.max(share);
                            }
                        }
                    }
                    if most > criteria.growth && grown.is_none() {
                        let time = path.time[k + 1] - path.time[first];
                        grown = Some((time, radius(&m, &size).ln() / time));
                    }
                    if k >= ending {
                        late = late.max(most);
                    }
                    if most > CERTAINLY {
                        late = most;
                        break;
                    }
                }
                // In a stiff system an error becomes large for a moment, and then dies out.
                if let (Some((time, rate)), true) = (grown, late > criteria.growth) {
                    times.push(time);
                    rates.push(rate);
                }
            }
        }
        if times.is_empty() || (times.len() as f64) < criteria.starts_share * followed as f64 {
            return None;
        }
        let horizon = median(&mut times);
        let rate = median(&mut rates);
        Some(Self {
            horizon,
            doubling: (rate * horizon > criteria.exponential.ln()).then(|| 2f64.ln() / rate),
            observed: (0..nx).filter(|i| seen[*i]).collect(),
        })
    }
}

/// Standard deviations of the states.
fn deviations(paths: &[Path], nx: usize) -> Vec<f64> {
    (0..nx)
        .map(|i| {
            let values = || paths.iter().flat_map(|p| p.x.iter().map(move |x| x[i]));
            let n = values().count().max(1) as f64;
            let mean = values().sum::<f64>() / n;
            (values().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n).sqrt()
        })
        .collect()
}

/// Largest magnitude of an eigenvalue of the transition `m` of states in units of `size`.
fn radius(m: &DMatrix<f64>, size: &[f64]) -> f64 {
    let mut transition = m.clone();
    for (j, size) in size.iter().enumerate() {
        transition
            .column_mut(j)
            .scale_mut(if *size > 0.0 { 1.0 / size } else { 0.0 });
    }
    nalgebra::Schur::try_new(transition, 1e-12, 1000).map_or(1.0, |schur| {
        schur
            .complex_eigenvalues()
            .iter()
            .fold(1.0, |most: f64, value| most.max(value.norm()))
    })
}

fn median(values: &mut [f64]) -> f64 {
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: f64 = 0.01;

    /// Samples of `x(k+1) = A x(k)` with the first state measured; the states swing by `size`.
    fn path(a: [f64; 4], size: [f64; 2]) -> Path {
        let n = 2000;
        let time: Vec<f64> = (0..=n).map(|k| PERIOD * f64::from(k)).collect();
        let mut path = Path::new(&time);
        for k in 0..n {
            let phase = 1.7 * PERIOD * f64::from(k);
            path.push(&Linearised {
                k: k as usize,
                x: &[size[0] * phase.sin(), size[1] * phase.cos()],
                a: &DMatrix::from_row_slice(2, 2, &a),
                c: &DMatrix::from_row_slice(1, 2, &a[..2]),
                gain: &DMatrix::zeros(2, 1),
            });
        }
        path
    }

    #[test]
    fn what_dies_out_needs_no_help() {
        let decay = (-2.0 * PERIOD).exp();
        let damped = [1.0, PERIOD, 0.0, decay];
        assert_eq!(
            Growth::of(
                &[path(damped, [1.0, 1.7])],
                &[0.7],
                &FreeRunCriteria::DEFAULT
            ),
            None
        );
    }

    /// A stiff oscillation makes a hundred units of speed of one of position, and dies out.
    #[test]
    fn a_swing_that_dies_out_is_no_growth() {
        let (decay, rate) = ((-2.0 * PERIOD).exp(), 100.0f64);
        let (sin, cos) = (rate * PERIOD).sin_cos();
        // The speed comes first: it is measured.
        let swing = [cos, -rate * sin, sin / rate, cos].map(|v| decay * v);
        assert_eq!(
            Growth::of(
                &[path(swing, [1.0, 1.7])],
                &[0.7],
                &FreeRunCriteria::DEFAULT
            ),
            None
        );
    }

    #[test]
    fn a_double_integral_grows_with_time() {
        let free = [1.0, PERIOD, 0.0, 1.0];
        let growth =
            Growth::of(&[path(free, [1.0, 1.7])], &[0.7], &FreeRunCriteria::DEFAULT).unwrap();
        // An error of the speed as large as its deviation 1.7/√2 moves the position by 7 after:
        let expected = 7.0 * 2f64.sqrt() / 1.7;
        assert!((growth.horizon - expected).abs() < 0.1, "{growth:?}");
        assert_eq!(growth.doubling, None);
        assert_eq!(growth.observed, [0, 1]);
    }

    #[test]
    fn an_unstable_mode_tells_its_rate() {
        let rate = 3.0f64;
        let grow = (rate * PERIOD).exp();
        let growth = Growth::of(
            &[path([grow, 0.0, 0.0, 1.0], [1.0, 1.7])],
            &[0.7],
            &FreeRunCriteria::DEFAULT,
        )
        .unwrap();
        assert!(
            (growth.horizon - 10f64.ln() / rate).abs() < 0.02,
            "{growth:?}"
        );
        let doubling = growth.doubling.unwrap();
        assert!((doubling - 2f64.ln() / rate).abs() < 1e-3, "{doubling}");
        // The second state never shows in what is measured.
        assert_eq!(growth.observed, [0]);
    }
}
