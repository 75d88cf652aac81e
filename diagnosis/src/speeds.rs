//! Speeds that a regression needs and no sensor reads, from the angles and ways that sensors read.

use std::borrow::Cow;

use loopsight_model::model::Model;
use loopsight_model::regression::told;
use loopsight_model::run::Run;
use loopsight_model::sensor::Sensor;

/// What a regression reads of a log.
///
/// Its left-hand side is the change of states, which are mostly speeds. Where a log has an angle and not its speed, those speeds
/// are differences over the time between two samples, that is means over it; so everything else is a mean over that time, too:
///
/// ```text
/// ω̄_k = (φ_k - φ_l)/(t_k - t_l)        φ̄_k = ∫ φ dt / (t_k - t_l)
/// ```
///
/// with `l` the last sample that was used, and the integral by the trapezoidal rule.
pub(crate) struct Speeds<'m> {
    /// With what it reads as its measured signals.
    pub(crate) model: Cow<'m, Model>,
    values: Vec<Value>,
}

/// How one number is made of those in the log, by the index of a measured signal.
#[derive(Clone, Copy)]
enum Value {
    Sample(usize),
    Mean(usize),
    Rate(usize),
}

impl<'m> Speeds<'m> {
    /// Of the log of a `model`; what is measured, where that tells the controlled states and the speed of each angle.
    pub(crate) fn of(model: &'m Model) -> Self {
        let as_measured = || Self {
            model: Cow::Borrowed(model),
            values: (0..model.measured.len()).map(Value::Sample).collect(),
        };
        let told = told(model);
        let rates = model.plant.integrals.iter();
        let rates = rates.filter_map(|(rate, _)| model.find_signal(rate).ok());
        let mut needed = rates.chain(model.plant.controlled.iter().copied());
        if needed.all(|signal| told.get(signal).is_none_or(|told| *told)) {
            return as_measured();
        }
        Self::differences(model).unwrap_or_else(as_measured)
    }

    /// With the speed behind each angle and way that is read at an instant; none where there is none.
    fn differences(model: &Model) -> Option<Self> {
        let instant = |k: usize| model.measured[k].sensor == Sensor::Instantaneous;
        // The measured signal whose rate is that signal of the plant.
        let behind = |rate: usize| {
            let integral = model.integral_of(rate)?;
            model.measured_index(integral).filter(|k| instant(*k))
        };
        let mut list: Vec<(String, Sensor)> = (model.measured.iter().enumerate())
            .map(|(k, m)| {
                let mean = if instant(k) {
                    Sensor::IntervalMean
                } else {
                    m.sensor.clone()
                };
                (m.signal.id.to_owned(), mean)
            })
            .collect();
        let measured = list.len();
        for (rate, _) in model.plant.integrals {
            let index = model.find_signal(rate).ok()?;
            if model.measured_index(index).is_none() && behind(index).is_some() {
                list.push(((*rate).to_owned(), Sensor::IntervalMean));
            }
        }
        if list.len() == measured {
            return None;
        }
        let mut with = model.clone();
        with.measure(&list).ok()?;
        let value = |index: usize| match model.measured_index(index) {
            Some(k) if instant(k) => Some(Value::Mean(k)),
            Some(k) => Some(Value::Sample(k)),
            None => behind(index).map(Value::Rate),
        };
        let values = with
            .measured
            .iter()
            .map(|m| value(m.index))
            .collect::<Option<_>>()?;
        Some(Self {
            model: Cow::Owned(with),
            values,
        })
    }

    /// What is read at the sample `k` of a run, after the `last` one that was used; not a number where it cannot be told.
    pub(crate) fn read(&self, run: &Run, last: usize, k: usize, to: &mut Vec<f64>) {
        let elapsed = run.time()[k] - run.time()[last];
        let sample = |i: usize, of: usize| run.sample(i)[of];
        to.clear();
        to.extend(self.values.iter().map(|value| match *value {
            Value::Sample(of) => sample(k, of),
            Value::Rate(of) => (sample(k, of) - sample(last, of)) / elapsed,
            Value::Mean(of) => {
                let area = (last..k).map(|i| {
                    0.5 * (sample(i, of) + sample(i + 1, of)) * (run.time()[i + 1] - run.time()[i])
                });
                area.sum::<f64>() / elapsed
            }
        }));
    }
}
