//! How fast and how strong a machine is: what is sampled faster than a robot is done sooner.

use loopsight_model::model::Model;
use loopsight_model::run::{Run, shortest_period};

use crate::commands::Commands;
use crate::criteria::Criteria;
use crate::progress::Work;
use crate::suited::scale_efforts;

/// A model, and criteria to decide by, in the time of the machine that was recorded, and with effects of the size of its commands.
///
/// Times of motion among the criteria (how long a run must be, how long a machine rests) and times of effects (where the fit of a delay
/// begins) are those of robots. A converter of voltages does in milliseconds what a robot does in seconds. For it they are as many samples as they are at
/// [`fast_hz`](crate::criteria::LogCriteria::fast_hz).
pub(crate) struct Paced {
    pub(crate) model: Model,
    criteria: Criteria,
}

impl Paced {
    /// The `model`, and the criteria of a `work`, for `runs`.
    pub(crate) fn of(model: &Model, runs: &[Run], work: &Work<'_>) -> Self {
        let given = work.criteria();
        let pace = pace(runs, given);
        let mut model = model.at_time_scale(pace);
        if !model.effects.is_empty() {
            let commands = Commands::of(&model, runs);
            scale_efforts(&mut model, &commands);
        }
        Self {
            model,
            criteria: given.at_time_scale(pace),
        }
    }

    /// The work, decided by these criteria.
    pub(crate) fn work<'a>(&'a self, work: &Work<'a>) -> Work<'a> {
        work.clone().decided_by(&self.criteria)
    }
}

/// How long the machine in `runs` takes for what takes a robot a second, s: 1 s up to `log.fast_hz`, and where a measured signal changes as slowly as that
/// of a robot, however fast it is sampled.
fn pace(runs: &[Run], criteria: &Criteria) -> f64 {
    let by_rate = criteria.log.fast_hz * shortest_period(runs);
    if by_rate >= 1.0 || by_rate.is_nan() {
        return 1.0;
    }
    let longest = runs
        .iter()
        .max_by(|a, b| a.duration().total_cmp(&b.duration()));
    let slowest = longest.map_or(f64::INFINITY, slowest);
    by_rate.max(slowest / criteria.log.changes_s).min(1.0)
}

/// How long the slowest measured signal of a run takes to be another one, s; infinite where it never is.
///
/// That is the shortest lag, among powers of two samples, over which a signal changes by as much as it varies: by its
/// variance in the mean square, where its correlation with itself is a half.
fn slowest(run: &Run) -> f64 {
    let of = |signal: usize| {
        let values: Vec<f64> = (0..run.len()).map(|k| run.sample(k)[signal]).collect();
        let known = values.iter().filter(|v| v.is_finite());
        let (mut n, mut mean, mut squares) = (0.0, 0.0, 0.0);
        for v in known {
            n += 1.0;
            let off = v - mean;
            mean += off / n;
            squares += off * (v - mean);
        }
        let variance = squares / n;
        let changed = |lag: usize| {
            let pairs = values
                .iter()
                .zip(&values[lag..])
                .map(|(a, b)| (b - a).powi(2));
            let (n, sum) = (pairs.filter(|d| d.is_finite()))
                .fold((0.0, 0.0), |(n, sum), d| (n + 1.0, sum + d));
            sum >= variance * n && n > 0.0
        };
        let lags = std::iter::successors(Some(1), |lag| Some(2 * lag));
        let mut lags = lags.take_while(|lag| 2 * lag <= values.len());
        let lag = lags.find(|lag| changed(*lag));
        lag.map_or(f64::INFINITY, |lag| lag as f64 * run.median_period())
    };
    (0..run.n_measured()).map(of).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use loopsight_plants as _;

    use super::*;
    use crate::commands::tests::MIRROR;

    /// The mirror is sampled at 100 kHz.
    #[test]
    fn effects_of_a_model_are_as_small_and_as_fast_as_its_machine() {
        let text = format!(
            "{MIRROR}[[effect]]\n[effect.coulomb_friction]\nat = [\"axle\"]\n\
             [[effect]]\n[effect.input_delay]\nat = [\"input\"]\n"
        );
        let (given, _) = Model::from_toml("mirror.toml", &text).unwrap();
        let mut run = Run::empty(1, 1);
        for k in 0..2000 {
            let current = if k % 40 < 20 { 2.0 } else { -2.0 };
            run.push(1e-5 * f64::from(k), &[current], &[current])
                .unwrap();
        }
        let runs = [run];
        let mut model = given.clone();
        for _ in 0..2 {
            model = Paced::of(&model, &runs, &Work::quiet()).model;
            let grown = |name: &str| {
                let at = model.parameters.iter().position(|p| p.name == name);
                let at = at.unwrap();
                model.parameters[at].scale() / given.parameters[at].scale()
            };
            assert!((grown("coulomb_friction.level") - 0.008).abs() < 1e-9);
            assert!((grown("input_delay.delay") - 0.01).abs() < 1e-9);
            assert!((model.max_step / given.max_step - 0.01).abs() < 1e-9);
        }
    }

    /// The pace of a machine that is sampled at `rate` and follows a command with the time constant `lag`; the command changes
    /// every five of these.
    fn pace_of(rate: f64, lag: f64) -> f64 {
        let mut run = Run::empty(1, 1);
        let mut speed = 0.0;
        for k in 0..20_000 {
            let time = f64::from(k) / rate;
            let u = if (time / (5.0 * lag)) % 2.0 < 1.0 {
                1.0
            } else {
                -1.0
            };
            run.push(time, &[u], &[speed]).unwrap();
            speed += (u - speed) / (rate * lag);
        }
        pace(&[run], &Criteria::DEFAULT)
    }

    #[test]
    fn a_robot_is_no_faster_for_being_sampled_fast() {
        for rate in [50.0, 1e3, 1e4] {
            assert_eq!(pace_of(rate, 0.2), 1.0, "{rate}");
        }
    }

    #[test]
    fn a_coil_is_as_fast_as_its_samples() {
        assert!((pace_of(1e5, 2.5e-4) - 0.01).abs() < 1e-9);
        // What is sampled much faster than it moves is no faster than it moves.
        let oversampled = pace_of(1e6, 5e-3);
        assert!(oversampled > 0.01 && oversampled < 0.1, "{oversampled}");
    }
}
