//! A Kalman filter whose only unknown is a force.

use loopsight_core::{Place, Real};
use loopsight_model::model::{Model, pseudo_inverse};
use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;
use loopsight_model::simulate::Simulator;
use nalgebra::{Cholesky, DMatrix, DVector};
use rayon::prelude::*;

use super::linear::Linear;
use crate::criteria::LogCriteria;
use crate::floor::{Part, noise};
use crate::prediction::Solution;
use crate::progress::{Cancelled, Work};

/// Sizes of the unknown force that are tried, in the size of the channels. What a slow plant lacks is small beside what drives it,
/// since it adds up over its time constant.
const SIZES: [f64; 8] = [0.0008, 0.004, 0.02, 0.1, 0.4, 1.2, 3.5, 10.0];
/// Least noise of a sensor, as a share of the signal's standard deviation: no sensor is perfect.
const LEAST_NOISE: f64 = 1e-4;
/// How much less certain an initial state is than the sensors make it.
const INITIAL: f64 = 4.0;

/// A run through the filter.
pub(super) struct Filtered {
    /// Correction by what the measurement says beyond the prediction, by sample: of the plant's
    /// state, then of the rounding of the counts.
    pub(super) gains: Vec<DMatrix<f64>>,
    /// The matrix that makes the innovations of a sample white, by sample.
    pub(super) whiteners: Vec<DMatrix<f64>>,
    /// White innovations, sample by sample, signal by signal.
    pub(super) innovations: Vec<f64>,
    /// All signals of the plant in the middle of the interval that ends with each sample.
    pub(super) signals: Vec<Vec<f64>>,
    /// Sum of squares of the innovations that the noise of the sensors alone would give.
    pub(super) noise: f64,
    likelihood: f64,
}

impl Filtered {
    /// A sample that is not looked at.
    fn pass(&mut self, nx: usize, ny: usize, signals: Vec<f64>) {
        self.gains.push(DMatrix::zeros(nx + ny, ny));
        self.whiteners.push(DMatrix::zeros(ny, ny));
        self.innovations.extend(std::iter::repeat_n(0.0, ny));
        self.signals.push(signals);
    }
}

/// An extended Kalman filter whose unknown is a force. Between two samples each effort has an unknown constant
/// added to it, or each input where the plant has no efforts. The size of that constant is found by maximum
/// likelihood. Returns one filtered run per run, and how many standard deviations that size is from the least one: the
/// root of twice the gain in log-likelihood.
///
/// ```text
/// [x; y]⁻ = F(x) ≈ A x + B w      P⁻ = A P Aᵀ + B Q Bᵀ      S = P⁻_yy + R
/// x⁺ = x⁻ + K (y - y⁻)            K = P⁻_xy S⁻¹              P⁺ = P⁻_xx - K S Kᵀ
/// ```
///
/// `y⁻` is what the sensors would read, which for a mean depends on the whole interval. What was rounded off a
/// count comes back in the next difference, so the state contains it too. Effects keep their own states and
/// memories. `A` and `B` are those of the plant alone: they determine only the gain, which need not be exact.
///
/// Reference: A. H. Jazwinski (1970), "Stochastic Processes and Filtering Theory", section 8.3;
/// the likelihood is that of the innovations, F. C. Schweppe (1965), IEEE Trans. Information Theory
/// 11, 61–70.
pub(super) fn filter(
    model: &Model,
    solution: &Solution,
    runs: &[Run],
    work: &Work<'_>,
) -> Result<(Vec<Filtered>, f64), Cancelled> {
    let tried: Vec<Vec<Filtered>> = SIZES
        .par_iter()
        .map(|size| {
            runs.iter()
                .zip(&solution.states)
                .map(|(run, x0)| filtered(model, &solution.values, run, x0, *size, work))
                .collect()
        })
        .collect::<Result<_, Cancelled>>()?;
    let likelihood = |of: &Vec<Filtered>| of.iter().map(|f| f.likelihood).sum::<f64>();
    let least = tried.first().map_or(0.0, likelihood);
    let best = tried
        .into_iter()
        .max_by(|a, b| likelihood(a).total_cmp(&likelihood(b)))
        .unwrap_or_default();
    let gained = 2.0 * (likelihood(&best) - least);
    Ok((best, gained.max(0.0).sqrt()))
}

/// Places of the unknown force, with their sizes.
pub(super) fn unknowns(model: &Model) -> Vec<(Place, f64)> {
    let of = |effort: bool| {
        model
            .plant
            .channels
            .iter()
            .filter(move |c| match c.place {
                Place::Effort(_) => effort,
                Place::Input(_) => !effort,
                _ => false,
            })
            .map(|c| (c.place, c.size))
            .collect::<Vec<_>>()
    };
    let efforts = of(true);
    if efforts.is_empty() {
        of(false)
    } else {
        efforts
    }
}

/// Variances of the sensors' noise, and of what is rounded off at a sample: that noise comes back,
/// with the opposite sign, in the next difference of counts.
fn sensors(model: &Model, run: &Run, criteria: &LogCriteria) -> (DVector<f64>, DVector<f64>) {
    let n = model.measured.len();
    let mut white = DVector::zeros(n);
    let mut rounding = DVector::zeros(n);
    for (i, measured) in model.measured.iter().enumerate() {
        let (noise, std) = noise(
            &measured.sensor,
            i,
            &Part::all(std::slice::from_ref(run)),
            criteria,
        );
        let least = (LEAST_NOISE * std).max(f64::MIN_POSITIVE.sqrt()).powi(2);
        if matches!(measured.sensor, Sensor::EncoderCounts(_)) {
            white[i] = least;
            rounding[i] = 0.5 * noise.powi(2);
        } else {
            white[i] = noise.powi(2).max(least);
        }
    }
    (white, rounding)
}

/// What is measured at a sample, beyond what is `predicted`; zero where nothing is.
pub(super) fn innovation<S: Real>(sample: &[f64], predicted: &[S], rounded: &[S], to: &mut [S]) {
    for (i, to) in to.iter_mut().enumerate() {
        *to = if sample[i].is_finite() && predicted[i].value().is_finite() {
            S::of(sample[i]) - predicted[i] + rounded[i]
        } else {
            S::zero()
        };
    }
}

/// The correction of a fitted start by its measurement. A model that lacks something is fitted with a wrong start, and that
/// would be most of what there is to explain. So nothing is taken from the fit that a sensor reads at an instant; a first mean
/// has no interval, and says nothing.
fn start(model: &Model, back: &DMatrix<f64>) -> DMatrix<f64> {
    let mut gain = back.clone();
    for (i, measured) in model.measured.iter().enumerate() {
        if measured.sensor != Sensor::Instantaneous {
            gain.column_mut(i).fill(0.0);
        }
    }
    gain
}

/// A covariance without what rounding made of it. Where a measurement replaces nearly all of a prediction, the part of it
/// that changes sign under a transposition would grow from sample to sample.
fn symmetric(covariance: DMatrix<f64>) -> DMatrix<f64> {
    let transposed = covariance.transpose();
    (covariance + transposed) * 0.5
}

fn filtered(
    model: &Model,
    values: &[f64],
    run: &Run,
    x0: &DVector<f64>,
    size: f64,
    work: &Work<'_>,
) -> Result<Filtered, Cancelled> {
    let (nx, ny, n_signals) = (model.n_states(), model.measured.len(), model.n_signals());
    let mut out = Filtered {
        gains: Vec::new(),
        whiteners: Vec::new(),
        innovations: Vec::new(),
        signals: Vec::new(),
        noise: 0.0,
        likelihood: 0.0,
    };
    if run.is_empty() {
        return Ok(out);
    }
    let mut bare = model.clone();
    bare.effects.clear();
    let unknown = unknowns(model);
    let q = DMatrix::from_diagonal(&DVector::from_iterator(
        unknown.len(),
        unknown.iter().map(|(_, s)| (s * size).powi(2)),
    ));
    let places = unknown.iter().map(|(place, _)| *place).collect();
    let (of_run, state) = model.begun(values, x0.as_slice());
    let mut linear = Linear::new(&bare, &of_run, places, state, run.input(0));
    let (white, rounding) = sensors(model, run, &work.criteria().log);
    let nz = nx + ny;
    // Noise of a sample: rounding as a state, and all of it in what is measured.
    let mut sensing = DMatrix::zeros(nz + ny, nz + ny);
    for i in 0..ny {
        sensing[(nx + i, nx + i)] = rounding[i];
        sensing[(nx + i, nz + i)] = rounding[i];
        sensing[(nz + i, nx + i)] = rounding[i];
        sensing[(nz + i, nz + i)] = white[i] + rounding[i];
    }
    let (h, _) = model.measurement_jacobian(values, x0.as_slice());
    let back = pseudo_inverse(&h).unwrap_or_else(|| DMatrix::zeros(nx, ny));
    let initial = DMatrix::from_diagonal(&(&white + &rounding * 2.0));
    let mut p = DMatrix::zeros(nz, nz);
    p.view_mut((0, 0), (nx, nx))
        .copy_from(&(&back * initial * back.transpose() * INITIAL));
    p.view_mut((nx, nx), (ny, ny))
        .copy_from(&DMatrix::from_diagonal(&rounding));
    // The same, were the noise of the sensors all there is.
    let mut noisy = p.clone();
    let mut simulator = Simulator::new(model, values);
    simulator.reset(x0.as_slice(), run.input(0));
    let mut outputs = vec![0.0; ny];
    let mut rounded = vec![0.0; ny];
    let mut beyond = DVector::zeros(ny);
    out.pass(nx, ny, simulator.signals().to_vec());
    simulator.measure(&mut outputs);
    innovation(run.sample(0), &outputs, &rounded, beyond.as_mut_slice());
    let begun = start(model, &back);
    out.gains[0].rows_mut(0, nx).copy_from(&begun);
    for (x, add) in simulator
        .state_mut()
        .iter_mut()
        .zip((begun * &beyond).iter())
    {
        *x += add;
    }
    for k in 1..run.len() {
        work.go_on()?;
        let until = run.time()[k] - run.time()[0];
        let before: Vec<f64> = simulator.signals().to_vec();
        let ab = linear.step(simulator.state(), run, k);
        simulator.foresee(run, k);
        simulator.advance(until, run.input(k - 1));
        simulator.measure(&mut outputs);
        // Taken before the measurement corrects the state: the quantities that explain a residual must not depend
        // on that residual.
        let mut middle: Vec<f64> = simulator
            .signals()
            .iter()
            .zip(&before)
            .map(|(a, b)| 0.5 * (a + b))
            .collect();
        middle[nx..nx + run.n_inputs()].copy_from_slice(run.input(k - 1));
        innovation(run.sample(k), &outputs, &rounded, beyond.as_mut_slice());

        let mut a = DMatrix::zeros(nz + ny, nz);
        let mut b = DMatrix::zeros(nz + ny, q.ncols());
        a.view_mut((0, 0), (nx, nx))
            .copy_from(&ab.view((0, 0), (nx, nx)));
        b.view_mut((0, 0), (nx, q.ncols()))
            .copy_from(&ab.view((0, nx), (nx, q.ncols())));
        for i in 0..ny {
            // A missing sample corrects nothing.
            if run.sample(k)[i].is_finite() {
                a.view_mut((nz + i, 0), (1, nx))
                    .copy_from(&ab.view((nx + i, 0), (1, nx)));
                a[(nz + i, nx + i)] = -1.0;
                b.row_mut(nz + i)
                    .copy_from(&ab.view((nx + i, nx), (1, q.ncols())).row(0));
            }
        }
        let joint = &a * &p * a.transpose() + &b * &q * b.transpose() + &sensing;
        let s = joint.view((nz, nz), (ny, ny)).clone_owned();
        let Some(cholesky) = Cholesky::new(s.clone()) else {
            break;
        };
        let gain = joint.view((0, nz), (nz, ny)) * cholesky.inverse();
        p = symmetric(joint.view((0, 0), (nz, nz)) - &gain * &s * gain.transpose());
        let lower = cholesky.l();
        let whitener = lower
            .solve_lower_triangular(&DMatrix::identity(ny, ny))
            .unwrap_or_else(|| DMatrix::zeros(ny, ny));
        let joint = &a * &noisy * a.transpose() + &sensing;
        let s = joint.view((nz, nz), (ny, ny));
        let crossed = joint.view((0, nz), (nz, ny)) * gain.transpose();
        out.noise += (&whitener * s * whitener.transpose()).trace();
        noisy = symmetric(
            joint.view((0, 0), (nz, nz)) + &gain * s * gain.transpose()
                - &crossed
                - crossed.transpose(),
        );

        let white = &whitener * &beyond;
        out.likelihood -= 0.5 * white.norm_squared();
        out.likelihood -= lower.diagonal().iter().map(|d| d.ln()).sum::<f64>();
        let correction = &gain * &beyond;
        for (x, add) in simulator.state_mut().iter_mut().zip(correction.iter()) {
            *x += add;
        }
        rounded.copy_from_slice(&correction.as_slice()[nx..]);
        out.gains.push(gain);
        out.whiteners.push(whitener);
        out.innovations.extend(white.iter());
        out.signals.push(middle);
    }
    // Samples that the filter did not reach count nothing.
    for _ in out.gains.len()..run.len() {
        out.pass(nx, ny, vec![0.0; n_signals]);
    }
    Ok(out)
}
