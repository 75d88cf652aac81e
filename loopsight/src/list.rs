//! The parts that are known.

use loopsight_model::model::fitting_channels;
use loopsight_model::registry;

use crate::answers::{ListAnswer, Listed};
use crate::error::Result;
use crate::model;

/// What parts are listed.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ListOptions {
    /// Only those of this role: by default all.
    pub role: Option<PartRole>,
}

impl ListOptions {
    /// Only those of this role.
    #[must_use]
    pub fn role(mut self, role: PartRole) -> Self {
        self.role = Some(role);
        self
    }
}

/// What a part is in a loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum PartRole {
    /// The equations of a machine.
    Plant,
    /// Physics that a plain plant lacks.
    Effect,
    /// What learns while a loop runs.
    Estimator,
    /// A control law.
    Controller,
    /// What stands between a loop and a robot.
    Driver,
}

impl PartRole {
    /// All of them.
    pub const ALL: [PartRole; 5] = [
        PartRole::Plant,
        PartRole::Effect,
        PartRole::Estimator,
        PartRole::Controller,
        PartRole::Driver,
    ];

    /// The role as it is written.
    pub fn name(self) -> &'static str {
        match self {
            PartRole::Plant => "plant",
            PartRole::Effect => "effect",
            PartRole::Estimator => "estimator",
            PartRole::Controller => "controller",
            PartRole::Driver => "driver",
        }
    }
}

/// The plants, effects, estimators, controllers and drivers that this program knows.
///
/// ```
/// use loopsight::{ListOptions, PartRole, list};
///
/// let plants = list(&ListOptions::default().role(PartRole::Plant));
/// assert!(plants.parts.iter().any(|part| part.id == "ddmr"));
/// ```
pub fn list(options: &ListOptions) -> ListAnswer {
    let wanted = |part: &Listed| options.role.is_none_or(|role| part.role == role.name());
    ListAnswer::new(all().into_iter().filter(wanted).collect())
}

/// The effects that fit a plant, each with the channels it can act on.
///
/// ```
/// let fitting = loopsight::effects_for("dc_axis")?;
/// let friction = fitting.parts.iter().find(|part| part.id == "coulomb_friction");
/// assert_eq!(friction.map(|part| part.at.as_slice()), Some(&["shaft", "load"][..]));
/// assert!(!fitting.parts.iter().any(|part| part.id == "scrub_friction"));
/// # Ok::<(), loopsight::Error>(())
/// ```
///
/// # Errors
///
/// There is no such plant.
pub fn effects_for(plant: &str) -> Result<ListAnswer> {
    let plant = model::plant(plant)?;
    let effects = registry::effects();
    let fitting = effects.iter().filter_map(|effect| {
        let at = fitting_channels(plant, effect);
        (!at.is_empty()).then_some(Listed {
            role: PartRole::Effect.name(),
            id: effect.id,
            summary: effect.summary,
            at,
        })
    });
    Ok(ListAnswer::new(fitting.collect()))
}

fn all() -> Vec<Listed> {
    let plants = registry::plants();
    let plants = plants.iter().map(|m| ("plant", m.id, m.summary));
    let effects = registry::effects();
    let effects = effects.iter().map(|m| ("effect", m.id, m.summary));
    let others = registry::written().into_iter().chain(registry::parts());
    let others = others.map(|m| (m.role, m.id, m.summary));
    let mut parts: Vec<Listed> = plants
        .chain(effects)
        .chain(others)
        .map(|(role, id, summary)| Listed {
            role,
            id,
            summary,
            at: Vec::new(),
        })
        .collect();
    // Those that a model file defines stand behind the library's own.
    let roles = ["plant", "effect"];
    let rank = |role: &str| roles.iter().position(|r| *r == role);
    parts.sort_by_key(|part| rank(part.role).unwrap_or(roles.len()));
    parts
}
