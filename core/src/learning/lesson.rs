//! What an estimator learned from a sample, or why it learned nothing.

use core::fmt;

use crate::{Command, Innovation, Real, Sample};

/// Why nothing was learned from a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Withheld {
    /// No regressor yet: the run begins, or samples are missing.
    NoRegressor,
    /// The measurement is older than its tick.
    Stale,
    /// An actuator was asked for more than it can give.
    Saturated,
    /// The controller repeated its last command.
    HeldCommand,
    /// A number that is not finite, or a regressor of another length.
    NotFinite,
    /// The innovation is within the dead zone.
    DeadZone,
    /// The regressor has no part along an excited direction.
    Unexcited,
}

impl Withheld {
    /// Identifier, for logs.
    pub const fn id(self) -> &'static str {
        match self {
            Withheld::NoRegressor => "no_regressor",
            Withheld::Stale => "stale",
            Withheld::Saturated => "saturated",
            Withheld::HeldCommand => "held_command",
            Withheld::NotFinite => "not_finite",
            Withheld::DeadZone => "dead_zone",
            Withheld::Unexcited => "unexcited",
        }
    }

    /// What of a tick forbids to learn from it; from saturated ticks only where `while_saturated`.
    pub fn by<S>(sample: &Sample<S>, outcome: Command, while_saturated: bool) -> Option<Self> {
        if !sample.fresh {
            Some(Withheld::Stale)
        } else if outcome.held {
            Some(Withheld::HeldCommand)
        } else if outcome.saturated && !while_saturated {
            Some(Withheld::Saturated)
        } else {
            None
        }
    }
}

impl fmt::Display for Withheld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Withheld::NoRegressor => "no regressor yet",
            Withheld::Stale => "the sample is stale",
            Withheld::Saturated => "an actuator saturates",
            Withheld::HeldCommand => "the last command is repeated",
            Withheld::NotFinite => "a number is not finite",
            Withheld::DeadZone => "the innovation is within the dead zone",
            Withheld::Unexcited => "nothing is excited",
        })
    }
}

/// What one sample taught.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lesson<S> {
    /// Prediction error `y - φᵀθ` before the update, in the unit of `y`; NaN without a regressor.
    pub innovation: S,
    /// Its variance over that of the noise; NaN where nothing was learned.
    pub relative_variance: S,
    /// Why nothing was learned; `None` where something was.
    pub withheld: Option<Withheld>,
    /// The estimate left its range and was brought back.
    pub projected: bool,
}

impl<S: Real> Lesson<S> {
    /// Nothing learned, and no innovation either.
    pub fn none(why: Withheld) -> Self {
        Self {
            innovation: S::of(f64::NAN),
            relative_variance: S::of(f64::NAN),
            withheld: Some(why),
            projected: false,
        }
    }

    /// As an innovation; `None` where there was no prediction.
    pub fn innovation(&self) -> Option<Innovation<S>> {
        let accepted = self.withheld.is_none();
        self.innovation.is_finite().then_some(Innovation {
            innovation: self.innovation,
            relative_variance: if accepted {
                self.relative_variance
            } else {
                S::one()
            },
            accepted,
        })
    }
}
