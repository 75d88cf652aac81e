//! Experiment design: inputs that separate two effects, or that determine a parameter.
//!
//! Two effects are separated as follows (T-optimality). One is taken as true, the other is fitted to its
//! response. The best inputs keep the two farthest apart, whichever of them is true:
//!
//! ```text
//! d²(u) = min over { A true, B fitted; B true, A fitted } of  min_θ Σ_k |(y(k) - ŷ(k, θ))/σ|²
//! u*    = argmax d²(u)      over a fixed list of inputs within the limits
//! ```
//!
//! with `y` the noise-free response of the model with an effect of noticeable size, `θ` all free
//! parameters of the model and of the rival, and `σ` the noise of the sensors. `d` is the number of
//! standard deviations between two exactly known models in white noise. A single test would need `d = 5`. A
//! recording must also tell what the noise is and leave validation data, so experiments are made long enough
//! for `d = 20`.
//!
//! A parameter is determined best by the inputs that make its standard error least (c-optimality). Where no
//! parameter is asked for, the largest relative standard error is made least. `J` are the exact sensitivities
//! over `σ`, and the noise of encoders is coloured by rounding:
//!
//! ```text
//! s² = cᵀ (JᵀJ)⁻¹ Jᵀ cov(e) J (JᵀJ)⁻¹ c
//! ```
//!
//! Assumptions:
//!
//! * The model's values are close enough to predict its response.
//! * The robot starts at rest.
//! * Noise is white, as in a diagnosis. (That of encoder counts is smaller at low frequencies.)
//! * The chosen inputs are the best of a list, not of all possible ones.
//!
//! References: A. C. Atkinson, V. V. Fedorov (1975), "The design of experiments for discriminating
//! between two rival models", Biometrika 62, 57–70; A. C. Atkinson, A. N. Donev (1992), "Optimum
//! Experimental Designs", chapters 10 (c-, D-optimality) and 20 (T-optimality); L. Ljung (1999),
//! "System Identification: Theory for the User", 2nd edition, chapter 13.

mod plan;
mod question;
mod rival;
mod shapes;

use std::sync::atomic::{AtomicU64, Ordering};

use loopsight_model::model::Model;
use loopsight_model::sensor::Sensor;
use rayon::prelude::*;

use crate::criteria::ExperimentCriteria;
use crate::observer::unstable_at_rest;
use crate::prediction::signal_rms;
use crate::progress::{Cancelled, Stage, Work};
pub use plan::{Considered, Drive, ExperimentLimits, Plan, Promise, Question};
pub use question::{QuestionError, effect_at};
use question::{Rivals, rivals};
use rival::{Distance, information, response, rival, standard_errors};
use shapes::Shape;

/// Length at which experiments are compared, s.
const HORIZON: f64 = 20.0;
/// Gauss–Newton steps at the first look, and for the best.
const STEPS: (usize, usize) = (2, 8);
/// Experiments that get a second, more exact look.
const BEST: usize = 6;
/// Longest integration step, s: far below what any sensor sees.
const LOOK_STEP: f64 = 0.005;
/// Finds the experiment that answers `question` about `model`, within `limits`.
///
/// # Errors
///
/// [`QuestionError`] when the question or the limits make no sense for this model, and when the work was
/// cancelled.
pub fn experiment(
    model: &Model,
    question: &Question,
    limits: &ExperimentLimits,
    work: &Work<'_>,
) -> Result<Plan, QuestionError> {
    question::check(model, limits)?;
    let mut model = model.clone();
    model.max_step = model
        .max_step
        .max(LOOK_STEP)
        .min(limits.period.max(model.max_step));
    let design = Design::new(&model, *limits, work)?;
    match question {
        Question::Separate(a, b) => design.separate(&rivals(
            &model,
            a,
            b.as_ref(),
            &design.rms,
            limits.limit,
            work.criteria(),
        )?),
        Question::Pin(name) => design.pin(&[question::parameter(&model, name)?], true),
        Question::All => {
            let free: Vec<usize> = (0..model.parameters.len())
                .filter(|i| model.parameters[*i].free)
                .collect();
            design.pin(&free, false)
        }
    }
}

struct Design<'m> {
    model: &'m Model,
    limits: ExperimentLimits,
    names: Vec<&'static str>,
    /// Of the sensors.
    noise: Vec<f64>,
    /// Of the plant's signals under the usual experiment.
    rms: Vec<f64>,
    work: &'m Work<'m>,
}

impl<'m> Design<'m> {
    fn new(
        model: &'m Model,
        limits: ExperimentLimits,
        work: &'m Work<'m>,
    ) -> Result<Self, QuestionError> {
        let names: Vec<&'static str> = model.plant.inputs.iter().map(|s| s.id).collect();
        let drive =
            Shape::usual(names.len()).drive(&names, limits.limit, limits.period, HORIZON)?;
        let values = model.values();
        let run = response(model, &values, &drive, work)?;
        let noise = work.criteria().experiment.noise;
        let noise = (0..run.n_measured())
            .map(|i| match &model.measured[i].sensor {
                Sensor::EncoderCounts(encoder) => encoder.noise(limits.period),
                Sensor::Instantaneous | Sensor::IntervalMean => {
                    let power = (0..run.len())
                        .map(|k| run.sample(k)[i].powi(2))
                        .sum::<f64>();
                    let std = (power / run.len().max(1) as f64).sqrt();
                    if std > 0.0 { noise * std } else { noise }
                }
            })
            .collect();
        let x0 = nalgebra::DVector::zeros(model.n_states());
        let rms = signal_rms(model, &values, &[x0], &[run], work)?;
        let falls = unstable_at_rest(model, &values, &drive.time, work)?;
        if falls || rms.iter().any(|v| !v.is_finite()) {
            return Err(QuestionError::Unstable);
        }
        Ok(Self {
            model,
            limits,
            names,
            noise,
            rms,
            work,
        })
    }

    fn criteria(&self) -> &'m ExperimentCriteria {
        &self.work.criteria().experiment
    }

    /// A length within what an experiment may take, s.
    fn allowed(&self, length: f64, longest: f64) -> f64 {
        let longest = longest.min(question::MOST_SAMPLES * self.limits.period);
        length.max(self.criteria().shortest_s).min(longest).ceil()
    }

    fn drive(&self, shape: Shape, duration: f64) -> Result<Drive, QuestionError> {
        let ExperimentLimits { limit, period, .. } = self.limits;
        Ok(shape.drive(&self.names, limit, period, duration)?)
    }

    /// One more experiment was tried.
    fn tell(&self, done: &AtomicU64, of: usize) {
        let now = done.fetch_add(1, Ordering::Relaxed) + 1;
        self.work.tell(Stage::Experiments, now, of as u64);
    }

    /// Squared distances over time, the least of those of the directions. And what share of the effect's own
    /// distance that is.
    fn distance(
        &self,
        rivals: &Rivals,
        drive: &Drive,
        steps: usize,
        starts: usize,
    ) -> Result<Apart, QuestionError> {
        let of = |truth: &(Model, Vec<f64>), other: &(Model, Vec<Vec<f64>>)| {
            let run = response(&truth.0, &truth.1, drive, self.work)?;
            let least = |model: &Model, from: &[Vec<f64>]| {
                let fitted: Vec<Distance> = (from.iter().take(starts))
                    .map(|start| rival(model, start, &run, &self.noise, steps, self.work))
                    .collect::<Result<_, Cancelled>>()?;
                let least = |a: &Distance, b: &Distance| a.total.total_cmp(&b.total);
                Ok::<_, Cancelled>(fitted.into_iter().min_by(least))
            };
            // The question whether an effect is there at all is asked without a refit, which may hide it.
            let own_steps = if rivals.places.len() > 1 { steps } else { 0 };
            let own = rival(
                self.model,
                &self.model.values(),
                &run,
                &self.noise,
                own_steps,
                self.work,
            )?;
            let far = least(&other.0, &other.1)?.filter(|d| d.total < own.total);
            let own_total = own.total;
            let far = far.unwrap_or(own);
            let share = if own_total > 0.0 {
                (far.total / own_total).sqrt()
            } else {
                0.0
            };
            Ok(Apart {
                by_sample: far.by_sample,
                total: far.total,
                share,
            })
        };
        let ways: Vec<Apart> = (rivals.directions.iter())
            .map(|way| of(&way.truth, &way.rival))
            .collect::<Result<_, Cancelled>>()?;
        let least = ways.into_iter().min_by(|a, b| a.total.total_cmp(&b.total));
        Ok(least.unwrap_or_default())
    }

    /// The shapes under which every signal moves that moves under the usual one. A recording in which one does
    /// not move cannot determine the whole model.
    fn moving(&self) -> Result<Vec<Shape>, QuestionError> {
        let moves = |shape: Shape| -> Result<Vec<bool>, QuestionError> {
            let run = response(
                self.model,
                &self.model.values(),
                &self.drive(shape, HORIZON)?,
                self.work,
            )?;
            let power = |i: usize| {
                (0..run.len())
                    .map(|k| run.sample(k)[i].powi(2))
                    .sum::<f64>()
            };
            let least =
                |i: usize| self.criteria().moves * self.noise[i] * (run.len() as f64).sqrt();
            Ok((0..run.n_measured())
                .map(|i| power(i).sqrt() > least(i))
                .collect())
        };
        let usual = moves(Shape::usual(self.names.len()))?;
        let mut shapes = Vec::new();
        for shape in Shape::all(self.names.len()) {
            if moves(shape)?
                .iter()
                .zip(&usual)
                .all(|(here, usual)| *here || !usual)
            {
                shapes.push(shape);
            }
        }
        Ok(shapes)
    }

    fn separate(&self, rivals: &Rivals) -> Result<Plan, QuestionError> {
        let criteria = self.criteria();
        let horizon = self.limits.duration.unwrap_or(HORIZON);
        let look = |shapes: &[Shape], steps: usize, starts: usize| {
            let done = AtomicU64::new(0);
            let mut all: Vec<(Shape, Apart)> = shapes
                .par_iter()
                .map(|shape| {
                    let drive = self.drive(*shape, horizon)?;
                    let apart = self.distance(rivals, &drive, steps, starts)?;
                    self.tell(&done, shapes.len());
                    Ok((*shape, apart))
                })
                .collect::<Result<_, QuestionError>>()?;
            all.sort_by(|a, b| b.1.total.total_cmp(&a.1.total));
            Ok::<_, QuestionError>(all)
        };
        let first = look(&self.moving()?, STEPS.0, 1)?;
        let best: Vec<Shape> = first.iter().take(BEST).map(|(shape, _)| *shape).collect();
        let second = look(&best, STEPS.1, usize::MAX)?;
        let considered: Vec<Considered> = second
            .iter()
            .chain(first.iter().skip(BEST))
            .map(|(shape, apart)| Considered {
                experiment: shape.name(),
                detectability: apart.total.sqrt(),
            })
            .collect();
        let Some((shape, mut apart)) = second.into_iter().next() else {
            return Err(QuestionError::NoInput);
        };
        let mut needed = self.needed(&apart, horizon);
        let mut duration = horizon;
        let same = apart.share < criteria.same || needed > criteria.hopeless_s;
        if self.limits.duration.is_none() && !same {
            // A rival that is refitted to a shorter recording comes closer: computed again at the new length.
            let mut longest = criteria.longest_s;
            for _ in 0..6 {
                duration = self.allowed(needed, longest);
                longest = (2.0 * duration).min(criteria.longest_s);
                let drive = self.drive(shape, duration)?;
                apart = self.distance(rivals, &drive, STEPS.1, usize::MAX)?;
                needed = self.needed(&apart, duration);
                if apart.total.sqrt() >= criteria.separated || duration >= criteria.longest_s {
                    break;
                }
            }
        }
        let detectability = apart.total.sqrt();
        let names = rivals.names();
        let (verdict, reason) = if same {
            (Promise::CannotBeSeparated, rivals.inseparable(apart.share))
        } else if detectability >= criteria.separated {
            (
                Promise::Answers,
                format!(
                    "{}: even after the best fit, {names} differ by {detectability:.0} standard deviations of the sensors' noise after {duration:.0} s, at noticeable sizes ({})",
                    shape.name(),
                    rivals.sizes,
                ),
            )
        } else {
            (
                Promise::TooShort,
                format!(
                    "{}: the best found, but {names} differ by only {detectability:.1} standard deviations of the sensors' noise after {duration:.0} s, and {} are needed. That takes about {needed:.0} s, a larger effect than {}, or a finer sensor",
                    shape.name(),
                    criteria.separated,
                    rivals.sizes,
                ),
            )
        };
        let drive = if same {
            Drive::default()
        } else {
            self.drive(shape, duration)?
        };
        Ok(Plan {
            experiment: if same { String::new() } else { shape.name() },
            duration_s: if same { 0.0 } else { duration },
            needed_s: if same { f64::INFINITY } else { needed },
            separates: rivals.places.clone(),
            pins: Vec::new(),
            detectability,
            verdict,
            reason,
            considered,
            drive,
        })
    }

    /// When the accumulated distance is enough, s.
    fn needed(&self, apart: &Apart, horizon: f64) -> f64 {
        let enough = self.criteria().separated.powi(2);
        let mut sum = 0.0;
        for (k, squared) in apart.by_sample.iter().enumerate() {
            sum += squared;
            if sum >= enough {
                return k as f64 * self.limits.period + 1.0;
            }
        }
        if sum > 0.0 && sum.is_finite() {
            horizon * enough / sum
        } else {
            f64::INFINITY
        }
    }

    /// `asked` are the parameters by index; `strict`: to a share of the value, however small.
    fn pin(&self, asked: &[usize], strict: bool) -> Result<Plan, QuestionError> {
        let parameters = &self.model.parameters;
        if asked.is_empty() {
            return Err(QuestionError::NothingFree);
        }
        let free: Vec<usize> = (0..parameters.len())
            .filter(|i| parameters[*i].free || asked.contains(i))
            .collect();
        let values = self.model.values();
        let reference = |i: usize| {
            let (value, scale) = (values[i].abs(), parameters[i].scale());
            if value == 0.0 || (!strict && value < scale) {
                scale
            } else {
                value
            }
        };
        // The largest relative standard error, and whose it is.
        let worst = |drive: &Drive| -> Result<(f64, usize), QuestionError> {
            let (model, noise) = (self.model, &self.noise);
            let known = information(model, &values, drive, &free, noise, self.work)?;
            let errors = standard_errors(&known, self.criteria().flat);
            let worst = free
                .iter()
                .zip(&errors)
                .filter(|(i, _)| asked.contains(i))
                .map(|(i, e)| (e * parameters[*i].scale() / reference(*i), *i))
                .max_by(|a, b| a.0.total_cmp(&b.0));
            Ok(worst.unwrap_or((f64::INFINITY, asked[0])))
        };
        let criteria = self.criteria();
        let horizon = self.limits.duration.unwrap_or(HORIZON);
        let (shapes, done) = (self.moving()?, AtomicU64::new(0));
        let mut all: Vec<(Shape, (f64, usize))> = shapes
            .par_iter()
            .map(|shape| {
                let worst = worst(&self.drive(*shape, horizon)?)?;
                self.tell(&done, shapes.len());
                Ok((*shape, worst))
            })
            .collect::<Result<_, QuestionError>>()?;
        all.sort_by(|a, b| a.1.0.total_cmp(&b.1.0));
        let considered = all
            .iter()
            .map(|(shape, (error, _))| Considered {
                experiment: shape.name(),
                detectability: 1.0 / error,
            })
            .collect();
        let Some((shape, (mut error, mut at))) = all.first().copied() else {
            return Err(QuestionError::NoInput);
        };
        let hopeless = !error.is_finite();
        let mut duration = horizon;
        let needed = |error: f64, duration: f64| duration * (error * criteria.pinned).powi(2);
        if self.limits.duration.is_none() && !hopeless {
            for _ in 0..3 {
                duration = self.allowed(needed(error, duration), criteria.longest_s);
                (error, at) = worst(&self.drive(shape, duration)?)?;
                if error * criteria.pinned <= 1.0 || duration >= criteria.longest_s {
                    break;
                }
            }
        }
        let parameter = &parameters[at];
        let name = &parameter.name;
        let standard_error = error * reference(at);
        let (verdict, reason) = if hopeless {
            (
                Promise::CannotBeSeparated,
                format!(
                    "{name} cannot be pinned with inputs alone: in the measured signals it has no influence of its own under any of the experiments; add a sensor, or measure another parameter with the same influence and freeze it"
                ),
            )
        } else {
            let least = if asked.len() > 1 {
                format!("the least certain parameter, {name},")
            } else {
                name.clone()
            };
            let text = format!(
                "{}: {least} gets a standard error of {standard_error:.2e} {} ({:.2} % of {:.4}) in {duration:.0} s",
                shape.name(),
                parameter.unit,
                100.0 * error,
                reference(at),
            );
            // The prediction is no better than that.
            if error * criteria.pinned <= criteria.pinned_about {
                (Promise::Answers, text)
            } else {
                let long = needed(error, duration);
                (
                    Promise::TooShort,
                    format!("{text}; one of 1 % takes about {long:.0} s"),
                )
            }
        };
        Ok(Plan {
            experiment: if hopeless {
                String::new()
            } else {
                shape.name()
            },
            duration_s: if hopeless { 0.0 } else { duration },
            needed_s: needed(error, duration),
            separates: Vec::new(),
            pins: asked.iter().map(|i| parameters[*i].name.clone()).collect(),
            detectability: 1.0 / error,
            verdict,
            reason,
            considered,
            drive: if hopeless {
                Drive::default()
            } else {
                self.drive(shape, duration)?
            },
        })
    }
}

/// What is left between two models.
#[derive(Clone, Debug, Default)]
struct Apart {
    by_sample: Vec<f64>,
    total: f64,
    /// Of the effect's own distance from the model without any.
    share: f64,
}
