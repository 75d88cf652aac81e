//! What is known before long work ends.

use serde::Serialize;

use crate::effect_at::EffectAt;

/// Most candidates that are told with their promises.
pub(crate) const TOLD: usize = 5;

/// A result that is known before the work ends. What comes later may change it.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Early {
    /// Round of an [`improve`](crate::improve()), from 0; 0 in any other work.
    pub round: usize,
    /// What was found.
    #[serde(flatten)]
    pub finding: Finding,
}

/// What is known before a diagnosis ends, in the order in which it is. Errors are those of the free run on the
/// validation data, relative to the standard deviation.
///
/// Of a long log a search reads windows, and what it tells is then told again for all of the log.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "finding", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Finding {
    /// What the model as it is leaves once it is fitted.
    Compared {
        /// Its error.
        nrmse: f64,
        /// The part of it that is noise of the sensors.
        floor: f64,
    },
    /// The effects that promise most, the best first, each at its most promising place.
    Promised {
        /// At most five.
        candidates: Vec<Promised>,
    },
    /// A candidate was fitted to its end.
    Finalist(Fitted),
    /// An [`improve`](crate::improve()) added what it found missing.
    Added(Fitted),
}

/// An effect, and the error that it promises: what one step of a fit is expected to leave, on the data that it is fitted to.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Promised {
    /// The effect and where.
    #[serde(flatten)]
    pub place: EffectAt,
    /// What it is expected to leave.
    pub nrmse: f64,
}

/// A model with an effect, fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Fitted {
    /// The effect and where.
    #[serde(flatten)]
    pub place: EffectAt,
    /// Its error.
    pub nrmse: f64,
}
