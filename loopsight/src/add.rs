//! An effect added to a model.

use loopsight_core::EffectMeta;
use loopsight_model::config::nearest;
use loopsight_model::model::{Model as Composed, fitting_channels, misfit};
use loopsight_model::registry;

use crate::answers::AddAnswer;
use crate::error::{Error, Result};
use crate::model::Model;
use crate::session::Session;

/// Which effect is added, and where.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct AddOptions {
    /// Id of the effect.
    pub effect: String,
    /// Channels it acts on; empty, as by default: all of the first kind it fits (both wheels, all inputs).
    pub at: Vec<String>,
}

impl AddOptions {
    /// An effect, by its id, on all channels of the first kind it fits.
    pub fn new(effect: &str) -> Self {
        Self {
            effect: effect.to_owned(),
            at: Vec::new(),
        }
    }

    /// Channels it acts on.
    #[must_use]
    pub fn at<C: Into<String>>(mut self, channels: impl IntoIterator<Item = C>) -> Self {
        self.at = channels.into_iter().map(Into::into).collect();
        self
    }
}

impl Session {
    /// Adds an effect to the model with neutral parameters: it does nothing until a fit finds them.
    ///
    /// ```
    /// use loopsight::{AddOptions, Model, Session};
    ///
    /// let model = Model::from_toml("robot.toml", "[plant.dc_axis]\n")?;
    /// let answer = Session::of_model(model).add(&AddOptions::new("coulomb_friction"))?;
    /// assert_eq!(answer.at, ["shaft"]);
    /// assert!(answer.model().to_toml().contains("[effect.coulomb_friction]"));
    /// # Ok::<(), loopsight::Error>(())
    /// ```
    ///
    /// # Errors
    ///
    /// There is no such effect or channel, or the effect does not fit there.
    pub fn add(&self, options: &AddOptions) -> Result<AddAnswer> {
        let model = &self.model.composed;
        let id = options.effect.as_str();
        let meta = effect(id)?;
        let fitting = fitting_channels(model.plant, meta);
        let at: Vec<&str> = if options.at.is_empty() {
            // All channels of the family of the first: both wheels, all inputs.
            let Some(first) = fitting.first() else {
                return Err(Error::request(format!(
                    "`{id}` fits no channel of the plant `{}`",
                    model.plant.id
                )));
            };
            let family = first.split('.').next();
            let alike = fitting.iter().copied();
            alike.filter(|c| c.split('.').next() == family).collect()
        } else {
            options.at.iter().map(String::as_str).collect()
        };
        for channel in &at {
            check(model, meta, channel, &fitting)?;
        }
        let Some(with) = model.with_effect(id, &at) else {
            return Err(Error::request(format!(
                "`{id}` does not fit {}",
                at.join(", ")
            )));
        };
        // The model knows what the defaults come to at these channels.
        let own = &with.parameters[model.parameters.len()..];
        let parameters: Vec<(&str, f64)> = own
            .iter()
            .filter_map(|p| Some((p.declaration.id, p.value?)))
            .collect();
        let text = self.model.source()?.with_effect(id, &at, &parameters);
        // What was written must read.
        let model = Model::from_toml(&self.model.file, &text)?;
        Ok(AddAnswer::new(id, &at, model))
    }
}

/// The effect of this id.
fn effect(id: &str) -> Result<&'static EffectMeta> {
    let effects = registry::effects();
    if let Some(meta) = effects.iter().find(|m| m.id == id) {
        return Ok(meta);
    }
    let mut message = format!("there is no effect `{id}`");
    match nearest(id, effects.iter().map(|m| m.id)) {
        Some(near) => message.push_str(&format!("; did you mean `{near}`?")),
        None => message.push_str("; `loopsight list effects` shows them"),
    }
    Err(Error::request(message))
}

fn check(model: &Composed, meta: &EffectMeta, channel: &str, fitting: &[&str]) -> Result<()> {
    let Some(found) = model.plant.channels.iter().find(|c| c.id == channel) else {
        let ids: Vec<&str> = model.plant.channels.iter().map(|c| c.id).collect();
        let near = nearest(channel, ids.iter().copied())
            .map_or_else(String::new, |n| format!("; did you mean `{n}`?"));
        return Err(Error::request(format!(
            "the plant `{}` has no channel `{channel}`, expected one of {}{near}",
            model.plant.id,
            ids.join(", ")
        )));
    };
    match misfit(found, meta) {
        None => Ok(()),
        Some(why) => Err(Error::request(format!(
            "`{}` cannot act on `{channel}`: {why}; it fits {}",
            meta.id,
            fitting.join(", ")
        ))),
    }
}
