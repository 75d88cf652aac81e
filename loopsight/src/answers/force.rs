//! A force that no effect of the library explains.

use serde::Serialize;

use super::common::all;

/// A force that would make the model agree with the measurements.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct MissingForce {
    /// Channels it acts at.
    pub at: Vec<String>,
    /// Its unit.
    pub unit: String,
    /// What it depends on, in words.
    pub statement: String,
    /// Quantities it depends on, the most telling first.
    pub depends_on: Vec<ForceDependence>,
    /// A first expression; `null` where no term stands out from the noise.
    pub expression: Option<WrittenForce>,
}

/// A force as an expression, to be edited.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct WrittenForce {
    /// The expression with its numbers.
    pub force: String,
    /// Share of the force's variance that it accounts for, on held-out blocks of time: of the whole force, or of what the
    /// model's own parameters cannot do, whichever is less.
    pub share_of_variance: f64,
    /// `[[effect]]` entries for the model file.
    pub toml: String,
}

/// How a force depends on one quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ForceDependence {
    /// The quantity, by its name in an expression.
    pub quantity: String,
    /// Its unit.
    pub unit: String,
    /// One turn, where the quantity is an angle that makes turns. The angle is reduced to it.
    pub period: Option<f64>,
    /// Share of the force's variance that its mean over the quantity accounts for, on held-out blocks of time: of the whole
    /// force, or of what the model's own parameters cannot do, whichever is less.
    pub share_of_variance: f64,
    /// The mean force over the quantity: one curve for each direction of motion, or one for all.
    pub curves: Vec<ForceCurve>,
}

/// A mean force over a quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ForceCurve {
    /// `forwards`, `backwards`, or `all`.
    pub direction: String,
    /// In the order of the quantity.
    pub bins: Vec<ForceBin>,
}

/// A stretch of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[non_exhaustive]
pub struct ForceBin {
    /// Mean of the quantity.
    pub center: f64,
    /// Mean force.
    pub mean: f64,
    /// Standard error of the mean.
    pub std_error: f64,
    /// Number of samples.
    pub count: usize,
    /// Mean of the expression over the same samples.
    pub expression: Option<f64>,
}

impl From<&loopsight_diagnosis::ResidualForce> for MissingForce {
    fn from(force: &loopsight_diagnosis::ResidualForce) -> Self {
        let expression = force.expression.as_ref().map(|e| WrittenForce {
            force: e.force.clone(),
            share_of_variance: e.share_of_variance,
            toml: e.toml.clone(),
        });
        Self {
            at: force.at.clone(),
            unit: force.unit.clone(),
            statement: force.statement.clone(),
            depends_on: all(&force.depends_on),
            expression,
        }
    }
}

impl From<&loopsight_diagnosis::ForceDependence> for ForceDependence {
    fn from(dependence: &loopsight_diagnosis::ForceDependence) -> Self {
        Self {
            quantity: dependence.quantity.clone(),
            unit: dependence.unit.clone(),
            period: dependence.period,
            share_of_variance: dependence.share_of_variance,
            curves: all(&dependence.curves),
        }
    }
}

impl From<&loopsight_diagnosis::ForceCurve> for ForceCurve {
    fn from(curve: &loopsight_diagnosis::ForceCurve) -> Self {
        Self {
            direction: curve.direction.to_owned(),
            bins: all(&curve.bins),
        }
    }
}

impl From<&loopsight_diagnosis::ForceBin> for ForceBin {
    fn from(bin: &loopsight_diagnosis::ForceBin) -> Self {
        Self {
            center: bin.center,
            mean: bin.mean,
            std_error: bin.std_error,
            count: bin.count,
            expression: bin.expression,
        }
    }
}
