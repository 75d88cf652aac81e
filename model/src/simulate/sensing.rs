//! How measured signals are made from the extended state.

use crate::model::Model;
use crate::sensor::Sensor;
use loopsight_core::Place;

use super::bound::Bounds;

/// How one measured signal is made.
#[derive(Clone, Debug)]
pub(super) struct Sensing {
    /// The signal.
    pub(super) index: usize,
    /// Its integral, if a mean or the past is needed.
    pub(super) integral: Integral,
    pub(super) is_mean: bool,
    /// Output effects (by position) on angles behind it, with the gain from the angle's rate.
    pub(super) through: Vec<(usize, f64)>,
}

impl Sensing {
    /// The signals that it is made from.
    pub(super) fn signals(&self) -> impl Iterator<Item = usize> {
        let integral = match self.integral {
            Integral::Signal(i) => Some(i),
            Integral::None | Integral::State(_) => None,
        };
        std::iter::once(self.index).chain(integral)
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Integral {
    /// Not needed.
    None,
    /// A signal of the plant is it.
    Signal(usize),
    /// An extended state is it.
    State(usize),
}

/// How a measured signal is made; `next` is the extended state its integral would get.
pub(super) fn sense(
    model: &Model,
    bounds: &Bounds,
    index: usize,
    sensor: &Sensor,
    next: usize,
) -> Sensing {
    let acts = |b: &super::bound::Bound| b.place == Place::Output(index);
    let direct = bounds.outputs.iter().any(acts);
    let past = bounds.output_memory.iter().any(acts);
    let known = model.integral_of(index);
    let integral = match (sensor.is_mean() || past, direct, known) {
        (false, _, _) => Integral::None,
        (true, false, Some(signal)) => Integral::Signal(signal),
        (true, _, _) => Integral::State(next),
    };
    let mut through = Vec::new();
    if let Sensor::EncoderCounts(encoder) = sensor {
        for (shaft, gain) in &encoder.of {
            let Ok(angle) = model.find_signal(shaft) else {
                continue;
            };
            for (i, bound) in bounds.outputs.iter().enumerate() {
                if bound.place == Place::Output(angle) {
                    through.push((i, *gain));
                }
            }
        }
    }
    Sensing {
        index,
        integral,
        is_mean: sensor.is_mean(),
        through,
    }
}
