//! Makes a robot's configuration message from a model file and a loop file.

use heapless::{String, Vec};
use loopsight_core::learning::Range;
use loopsight_core::{Place, PlantMeta};
use loopsight_estimators::{Forgetting, Rls, RlsSettings};
use loopsight_link::{Attachment, Configuration, ControllerGains, Learning, NAME, SIGNALS, Values};
use loopsight_model::model::Model;
use loopsight_model::registry::BuildError;
use nalgebra::DVector;

use super::Aboard;
use crate::acts_aboard;

/// Moves an error's key into a table within `[controller.aboard]`.
fn within(table: &str, error: BuildError) -> BuildError {
    let key = if error.key.is_empty() {
        table.to_owned()
    } else {
        format!("{table}.{}", error.key)
    };
    BuildError { key, ..error }
}

fn too_many(what: &str) -> BuildError {
    BuildError::at(
        "",
        format!("the model has more {what} than a robot is told"),
    )
}

fn short(name: &str) -> Result<String<NAME>, BuildError> {
    String::try_from(name).map_err(|_| BuildError::at("", format!("`{name}` is too long a name")))
}

fn numbers<const N: usize>(
    what: &str,
    values: impl IntoIterator<Item = f64>,
) -> Result<Vec<f32, N>, BuildError> {
    let mut list = Vec::new();
    for value in values {
        list.push(value as f32).map_err(|_| too_many(what))?;
    }
    Ok(list)
}

impl Aboard {
    /// The configuration message for `model`.
    ///
    /// # Errors
    ///
    /// What of the model or of this table a robot cannot run, with the key.
    pub fn configuration(&self, model: &Model, period: f64) -> Result<Configuration, BuildError> {
        let plant = model.plant;
        let n = plant.controlled.len();
        let affine = model.affine().ok_or_else(|| {
            BuildError::at(
                "",
                format!("the plant `{}` has no velocity to control", plant.id),
            )
        })?;
        let parameters = model.lower::<f64>(&model.values());
        let values: Values = numbers("parameters", parameters.iter().copied())?;
        let mut effects = Vec::new();
        for attached in &model.effects {
            let told = attachment(model, plant, attached)?;
            effects.push(told).map_err(|_| too_many("effects"))?;
        }
        let gains = self.law.gains(n).map_err(|e| within("law", e))?;
        let limits = self.law.limits(n).map_err(|e| within("law", e))?;
        let list = |values: std::vec::Vec<f64>| {
            Vec::from_slice(&values).map_err(|_| too_many("controlled states"))
        };
        let learning = match &self.rls {
            None => None,
            Some(rls) => Some(self.learning(rls, model, &parameters, period)?),
        };
        Ok(Configuration {
            plant: short(plant.id)?,
            parameters: values,
            effects,
            bands: numbers("controlled states", affine.bands().iter().copied())?,
            means: model.measured.iter().take(n).any(|m| m.sensor.is_mean()),
            learning,
            controller: ControllerGains {
                proportional: list(gains.iter().map(|g| g.0).collect())?,
                integral: list(gains.iter().map(|g| g.1).collect())?,
                limit: list(limits)?,
            },
            safety: self.safety.in_periods(period)?,
        })
    }

    fn learning(
        &self,
        rls: &RlsSettings,
        model: &Model,
        parameters: &[f64],
        period: f64,
    ) -> Result<Learning, BuildError> {
        if rls.rule != Forgetting::Constant {
            let message = format!("`rule` is {:?}, expected `constant` aboard", rls.rule);
            return Err(BuildError::at("rls.rule", message));
        }
        Rls::<f32, nalgebra::Dyn>::new(DVector::zeros(1), rls)
            .map_err(|e| within("rls", BuildError::at(e.key(), e.to_string())))?;
        let settings = &self.learning;
        if settings.while_saturated {
            let message = "`while_saturated` is true, expected false aboard";
            return Err(BuildError::at("learning.while_saturated", message));
        }
        let declared = model.plant.parameters;
        let (mut low, mut high) = (Values::new(), Values::new());
        for (declaration, value) in declared.iter().zip(parameters) {
            let named = model.parameters.iter().find(|p| p.name == declaration.id);
            let range = match settings.range.get(declaration.id) {
                // A parameter that the file freezes stays where it is.
                _ if named.is_some_and(|p| !p.free) => [*value; 2],
                Some([low, high])
                    if low < high
                        && low.is_finite()
                        && high.is_finite()
                        && (*low..=*high).contains(value) =>
                {
                    [*low, *high]
                }
                Some(range) => {
                    let id = declaration.id;
                    let message = format!(
                        "`{id}` is {range:?}, expected finite [low, high] with {value} within"
                    );
                    return Err(BuildError::at(&format!("learning.range.{id}"), message));
                }
                None => {
                    let range = Range::of(declaration, 1.0, *value, settings.clearance);
                    let range = range.within_reach(declaration.nearest(*value), settings.reach);
                    [range.low, range.high]
                }
            };
            low.push(range[0] as f32)
                .map_err(|_| too_many("parameters"))?;
            high.push(range[1] as f32)
                .map_err(|_| too_many("parameters"))?;
        }
        let n = model.plant.controlled.len();
        let guards: std::vec::Vec<_> = (0..n).map(|i| settings.guards(model, i, period)).collect();
        let states = "controlled states";
        Ok(Learning {
            forgetting: rls.forgetting,
            initial_covariance: rls.initial_covariance,
            covariance_limit: rls.covariance_limit.unwrap_or(rls.initial_covariance),
            low,
            high,
            scale: numbers("parameters", declared.iter().map(|d| d.scale))?,
            dead_zone: numbers::<SIGNALS>(states, guards.iter().map(|g| g.dead_zone))?,
            least_excitation: numbers(states, guards.iter().map(|g| g.least_excitation))?,
            window: guards.first().map_or(1.0, |g| g.window),
            certainty_equivalence: settings.certainty_equivalence,
        })
    }
}

/// An effect of the model as a robot is told it. Refused if no robot can compensate it.
fn attachment(
    model: &Model,
    plant: &PlantMeta,
    attached: &loopsight_model::model::Attached,
) -> Result<Attachment, BuildError> {
    let id = attached.meta.id;
    let wrong = |what: &str| {
        BuildError::at("", format!("the effect `{id}` of the model {what}"))
            .help("leave it out of the model that the robot is told, or run the law on the host")
    };
    let meta = attached.meta;
    if !acts_aboard(meta) {
        return Err(wrong("is not known aboard"));
    }
    let mut channels = Vec::new();
    for channel in &attached.at {
        let at = plant.channels.iter().position(|c| c.id == channel.id);
        let (Some(at), Place::Effort(_)) = (at, channel.place) else {
            return Err(wrong("acts where nothing is compensated aboard"));
        };
        channels.push(at as u8).map_err(|_| too_many("channels"))?;
    }
    let first = attached.first_parameter;
    let own = &model.parameters[first..first + meta.parameters.len()];
    Ok(Attachment {
        id: short(id)?,
        channels,
        values: numbers("parameters", own.iter().map(|p| p.value.unwrap_or(0.0)))?,
    })
}
