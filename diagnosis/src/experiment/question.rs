//! The question of an experiment: effects and parameters by name, and models with them at a noticeable size.

use loopsight_core::{EffectMeta, Place, Role};
use loopsight_model::config::nearest;
use loopsight_model::model::{Model, misfit};
use loopsight_model::registry::{self, BuildError};

use crate::EffectAt;
use crate::commands::Commands;
use crate::criteria::Criteria;
use crate::experiment::ExperimentLimits;
use crate::places::channel_sets;
use crate::progress::Cancelled;
use crate::suited::{last_rms, suit};

/// Why a question cannot be answered.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QuestionError {
    /// No such effect.
    #[error("there is no effect `{name}`{}", hint(.near.as_deref(), "`loopsight list effects` shows them"))]
    UnknownEffect {
        /// What was asked for.
        name: String,
        /// The nearest there is.
        near: Option<String>,
    },
    /// No such channel.
    #[error("the plant `{plant}` has no channel `{name}`, expected one of {}{}", .known.join(", "), near.as_ref().map_or_else(String::new, |n| format!("; did you mean `{n}`?")))]
    UnknownChannel {
        /// The plant.
        plant: &'static str,
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<&'static str>,
        /// The nearest of them.
        near: Option<String>,
    },
    /// The effect cannot act there.
    #[error("`{effect}` cannot act on `{channel}`: {why}")]
    Misfit {
        /// The effect.
        effect: String,
        /// The channel.
        channel: String,
        /// Why not.
        why: String,
    },
    /// The effect fits nowhere.
    #[error("`{effect}` fits no channel of the plant `{plant}` that shows in what is measured")]
    FitsNowhere {
        /// The effect.
        effect: String,
        /// The plant.
        plant: &'static str,
    },
    /// The model has the effect already.
    #[error("the model already has `{effect}` at {}: take it out of the model file to ask whether it is there", .at.join(", "))]
    Present {
        /// The effect.
        effect: String,
        /// Where.
        at: Vec<String>,
    },
    /// The same effect twice.
    #[error("both are `{0}` at the same channels: name two effects, or two places")]
    Same(String),
    /// No such parameter.
    #[error("the model has no parameter `{name}`, expected one of {}{}", .known.join(", "), near.as_ref().map_or_else(String::new, |n| format!("; did you mean `{n}`?")))]
    UnknownParameter {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
        /// The nearest of them.
        near: Option<String>,
    },
    /// Values are missing.
    #[error("the model gives no value for {}: an experiment is planned around values, rough ones will do (fit any recording first)", .0.join(", "))]
    NoValue(Vec<String>),
    /// Nothing is measured.
    #[error("the model names no measured signal: add for instance [log.measured.{0}]")]
    NothingMeasured(&'static str),
    /// The plant has no input.
    #[error("the plant has no input to experiment with")]
    NoInput,
    /// Every parameter is frozen.
    #[error("every parameter of the model is frozen: there is nothing to find")]
    NothingFree,
    /// The model leaves its rest, or the finite numbers.
    #[error(
        "the model is unstable: no input planned beforehand can keep it in range; record it under feedback, with steps of the reference and a disturbance added to the command"
    )]
    Unstable,
    /// A number out of its range.
    #[error("the {what} is {found} {unit}, expected {expected}")]
    Number {
        /// Which number.
        what: &'static str,
        /// What was found.
        found: f64,
        /// Its unit.
        unit: &'static str,
        /// What would do.
        expected: &'static str,
    },
    /// An excitation could not be built.
    #[error(transparent)]
    Excitation(#[from] BuildError),
    /// The work was cancelled.
    #[error(transparent)]
    Cancelled(#[from] Cancelled),
}

fn hint(near: Option<&str>, otherwise: &str) -> String {
    near.map_or_else(
        || format!("; {otherwise}"),
        |n| format!("; did you mean `{n}`?"),
    )
}

/// Reads an effect as typed: `dead_zone@input.right+input.left`, or `dead_zone` for the channels where a
/// diagnosis would try it first.
///
/// # Errors
///
/// [`QuestionError`] when there is no such effect or channel, or the effect does not fit.
pub fn effect_at(model: &Model, text: &str) -> Result<EffectAt, QuestionError> {
    let (name, channels) = match text.split_once('@') {
        Some((name, channels)) => (name, Some(channels)),
        None => (text, None),
    };
    let effects = registry::effects();
    let Some(meta) = effects.iter().copied().find(|m| m.id == name) else {
        let near = nearest(name, effects.iter().map(|m| m.id)).map(str::to_owned);
        let name = name.to_owned();
        return Err(QuestionError::UnknownEffect { name, near });
    };
    let at: Vec<String> = match channels {
        None => channel_sets(model, meta)
            .into_iter()
            .next()
            .ok_or_else(|| QuestionError::FitsNowhere {
                effect: name.to_owned(),
                plant: model.plant.id,
            })?
            .into_iter()
            .map(str::to_owned)
            .collect(),
        Some(list) => list
            .split('+')
            .map(|id| channel(model, meta, id.trim()))
            .collect::<Result<_, _>>()?,
    };
    let effect = name.to_owned();
    let present = model
        .effects
        .iter()
        .any(|e| e.meta.id == name && e.at.iter().any(|c| at.iter().any(|a| a == c.id)));
    if present {
        return Err(QuestionError::Present { effect, at });
    }
    Ok(EffectAt { effect, at })
}

fn channel(model: &Model, meta: &EffectMeta, id: &str) -> Result<String, QuestionError> {
    let channels = model.plant.channels;
    let Some(found) = channels.iter().find(|c| c.id == id) else {
        let known: Vec<&'static str> = channels.iter().map(|c| c.id).collect();
        return Err(QuestionError::UnknownChannel {
            plant: model.plant.id,
            name: id.to_owned(),
            near: nearest(id, known.iter().copied()).map(str::to_owned),
            known,
        });
    };
    match misfit(found, meta) {
        None => Ok(id.to_owned()),
        Some(why) => Err(QuestionError::Misfit {
            effect: meta.id.to_owned(),
            channel: id.to_owned(),
            why,
        }),
    }
}

/// Index of a parameter.
pub(super) fn parameter(model: &Model, name: &str) -> Result<usize, QuestionError> {
    let found = model.parameters.iter().position(|p| p.name == name);
    found.ok_or_else(|| {
        let known: Vec<String> = model.parameters.iter().map(|p| p.name.clone()).collect();
        QuestionError::UnknownParameter {
            name: name.to_owned(),
            near: nearest(name, known.iter().map(String::as_str)).map(str::to_owned),
            known,
        }
    })
}

/// Most samples of an experiment.
pub(super) const MOST_SAMPLES: f64 = 1e6;

pub(super) fn check(model: &Model, limits: &ExperimentLimits) -> Result<(), QuestionError> {
    let missing = model.missing_values();
    if !missing.is_empty() {
        let names = missing.iter().map(|n| (*n).to_owned()).collect();
        return Err(QuestionError::NoValue(names));
    }
    if model.measured.is_empty() {
        let first = model.plant.states.first().map_or("speed", |s| s.id);
        return Err(QuestionError::NothingMeasured(first));
    }
    if model.plant.inputs.is_empty() {
        return Err(QuestionError::NoInput);
    }
    let number = |what, found, unit, expected| {
        Err(QuestionError::Number {
            what,
            found,
            unit,
            expected,
        })
    };
    let ExperimentLimits {
        limit,
        period,
        duration,
    } = *limits;
    if !(limit > 0.0 && limit.is_finite()) {
        return number("limit", limit, "V", "a number above 0 V");
    }
    if !(period > 0.0 && period <= 0.5) {
        return number("period", period, "s", "a number above 0 s, at most 0.5 s");
    }
    if let Some(duration) = duration {
        if !(duration >= 2.0 && duration.is_finite()) {
            return number("duration", duration, "s", "2 s or more");
        }
        if duration / period > MOST_SAMPLES {
            return number("duration", duration, "s", "at most a million samples");
        }
    }
    Ok(())
}

/// A model that is taken as true, with its values, and a rival with the starts of its fit.
pub(super) struct Direction {
    pub(super) truth: (Model, Vec<f64>),
    pub(super) rival: (Model, Vec<Vec<f64>>),
}

/// Two rivals, ready to be simulated and fitted.
pub(super) struct Rivals {
    pub(super) places: Vec<EffectAt>,
    /// Which is true and which is fitted.
    pub(super) directions: Vec<Direction>,
    /// At which sizes, in words.
    pub(super) sizes: String,
}

pub(super) fn rivals(
    model: &Model,
    a: &EffectAt,
    b: Option<&EffectAt>,
    rms: &[f64],
    limit: f64,
    criteria: &Criteria,
) -> Result<Rivals, QuestionError> {
    let sign_width = criteria.search.sign_width;
    let with = |place: &EffectAt| Side::new(model, place, rms, limit, sign_width);
    let first = with(a)?;
    let Some(b) = b else {
        return Ok(Rivals {
            places: vec![a.clone()],
            sizes: first.size(),
            directions: vec![Direction {
                truth: (first.model, first.truth),
                rival: (model.clone(), vec![model.values()]),
            }],
        });
    };
    if a == b {
        return Err(QuestionError::Same(a.effect.clone()));
    }
    let second = with(b)?;
    // An effect that contains the other one can always follow it. Then the only question is whether the larger
    // one is needed.
    let contains = |one: &Side, other: &Side| {
        one.meta.simpler.contains(&other.meta.id) && one.place.at == other.place.at
    };
    let sizes = format!("{}, {}", first.size(), second.size());
    let both = (contains(&first, &second), contains(&second, &first));
    let one_way = |truth: &Side, rival: &Side| Direction {
        truth: (truth.model.clone(), truth.truth.clone()),
        rival: (rival.model.clone(), rival.starts.clone()),
    };
    let mut directions = Vec::new();
    if !both.1 {
        directions.push(one_way(&first, &second));
    }
    if !both.0 {
        directions.push(one_way(&second, &first));
    }
    Ok(Rivals {
        places: vec![a.clone(), b.clone()],
        directions,
        sizes,
    })
}

impl Rivals {
    pub(super) fn names(&self) -> String {
        let of = |p: &EffectAt| format!("{} at {}", p.effect, p.at.join("+"));
        match &self.places[..] {
            [one] => format!("{} and a model without it", of(one)),
            list => list.iter().map(of).collect::<Vec<_>>().join(" and "),
        }
    }

    /// Why no inputs separate them, and what would.
    pub(super) fn inseparable(&self, share: f64) -> String {
        let ids: Vec<&str> = self.places.iter().map(|p| p.effect.as_str()).collect();
        let either = |part: &str| ids.iter().any(|id| id.contains(part));
        let way = if self.places.len() < 2 {
            "another sensor (position from outside, current), or a wider limit"
        } else if either("delay") || either("lag") || either("window") {
            "a disturbance by hand, logged with the same clock (it passes the sensor and not the input), or a second sensor beside the first"
        } else if either("offset") || either("constant_force") || either("gravity") {
            "the motor disconnected (a force stays, an offset of the input does not), another orientation or a different load, or a meter at the motor's terminals"
        } else if either("sensor_scale") || either("radius") || either("gain") {
            "the position measured from outside, or a different load"
        } else {
            "a disturbance by hand, another sensor, or a different load"
        };
        let how = if self.places.len() < 2 || share > 0.5 {
            "under every experiment that was tried an effect of this kind hides in the model's own parameters".to_owned()
        } else {
            format!(
                "under every experiment that was tried, one of them refitted does the same as the other ({:.2} % of the effect is left)",
                100.0 * share
            )
        };
        format!(
            "{} cannot be separated with inputs alone: {how}. This would separate them: {way}",
            self.names()
        )
    }
}

/// Most starts of a fit.
const STARTS: usize = 5;
/// Share of the flow that a speed of an effect is taken to be.
const SPEED: f64 = 0.1;
/// A threshold of an input is assumed to lie below this share of the limit, so that the input reaches it.
const MET: f64 = 0.7;

/// One of the two.
struct Side {
    place: EffectAt,
    meta: &'static EffectMeta,
    model: Model,
    /// Its values at a noticeable size.
    truth: Vec<f64>,
    /// Where a fit of it starts, that of a noticeable size first.
    starts: Vec<Vec<f64>>,
}

impl Side {
    fn new(
        model: &Model,
        place: &EffectAt,
        rms: &[f64],
        limit: f64,
        sign_width: f64,
    ) -> Result<Self, QuestionError> {
        let at: Vec<&str> = place.at.iter().map(String::as_str).collect();
        let misfit = || QuestionError::FitsNowhere {
            effect: place.effect.clone(),
            plant: model.plant.id,
        };
        let mut with = model.with_effect(&place.effect, &at).ok_or_else(misfit)?;
        let meta = with.effects.last().map(|e| e.meta).ok_or_else(misfit)?;
        let flow = suit(
            &mut with,
            rms,
            &Commands::within(vec![limit; model.plant.inputs.len()]),
            sign_width,
        );
        let reach = last_rms(&with, Role::Position, rms).max(last_rms(&with, Role::Head, rms));
        let first = model.parameters.len();
        let on_input = with
            .effects
            .last()
            .is_some_and(|e| e.at.iter().all(|c| matches!(c.place, Place::Input(_))));
        let mut truth = with.values();
        let mut others: Vec<(usize, f64)> = Vec::new();
        for (i, parameter) in with.parameters.iter().enumerate().skip(first) {
            if !parameter.free {
                continue;
            }
            let declaration = parameter.declaration;
            let mut listed = parameter.starts(crate::experiment::HORIZON);
            if let Some(end) = declaration.limits {
                listed = vec![end.sign() * reach];
            } else if declaration.unit == "channel" && on_input {
                listed.retain(|s| *s < MET * limit);
                listed.reverse();
            } else if declaration.unit == "flow" && flow > 0.0 {
                listed = [1.0, 0.3, 3.0].map(|s| s * SPEED * flow).to_vec();
            } else if listed.len() > 1 {
                let middle = listed.len() / 2;
                listed.rotate_left(middle);
            }
            let mut listed = listed.into_iter().map(|v| declaration.nearest(v));
            truth[i] = listed.next().unwrap_or_else(|| {
                declaration.nearest(parameter.value.unwrap_or(0.0) + parameter.scale())
            });
            others.extend(listed.map(|v| (i, v)));
        }
        let mut starts = vec![truth.clone()];
        starts.extend(others.iter().take(STARTS - 1).map(|(i, v)| {
            let mut start = truth.clone();
            start[*i] = *v;
            start
        }));
        Ok(Self {
            place: place.clone(),
            meta,
            model: with,
            truth,
            starts,
        })
    }

    /// Its parameters at a noticeable size, in words.
    fn size(&self) -> String {
        let first = self.model.parameters.len() - self.meta.parameters.len();
        let words: Vec<String> = (first..self.truth.len())
            .filter(|i| self.model.parameters[*i].free)
            .map(|i| {
                let parameter = &self.model.parameters[i];
                let digits = (self.truth[i] * 1e4).round() / 1e4;
                let unit = if parameter.unit == "1" {
                    ""
                } else {
                    &parameter.unit
                };
                format!("{} {digits} {unit}", parameter.name)
                    .trim_end()
                    .to_owned()
            })
            .collect();
        words.join(" and ")
    }
}
