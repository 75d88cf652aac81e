//! What a closed loop did, as plain data.

/// A loop at work: every series is as long as [`LoopRecord::time`]; NaN marks a missing value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopRecord {
    /// Period of the loop, s.
    pub period_s: f64,
    /// Time of each tick since the start, s.
    pub time: Vec<f64>,
    /// The signals under control.
    pub controlled: Vec<ControlledTrace>,
    /// What the controller did to the plant.
    pub inputs: Vec<InputTrace>,
    /// Ticks at which the controller wanted more than it could get.
    pub saturated: Vec<bool>,
    /// Estimated parameters; empty without an estimator.
    pub parameters: Vec<ParameterTrace>,
    /// Innovations of the estimator; empty without one.
    pub innovations: Vec<InnovationTrace>,
    /// What happened when (s): resets, faults, lost samples.
    pub events: Vec<(f64, String)>,
    /// Sentences worth reading, e.g. the settling time asked for and the one reached.
    pub notes: Vec<String>,
    /// Why the loop ended, in words; empty: not known.
    pub end: String,
}

/// A signal under control.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlledTrace {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// What it should be.
    pub reference: Vec<f64>,
    /// What it was.
    pub measured: Vec<f64>,
    /// What the design promises: the response of the linear closed loop to the reference.
    pub ideal: Option<Vec<f64>>,
}

/// An input of the plant.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InputTrace {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// What the controller asked for.
    pub commanded: Vec<f64>,
    /// What was applied, after limits; empty: the same.
    pub applied: Vec<f64>,
}

/// A parameter over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterTrace {
    /// Its name.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// The estimate.
    pub values: Vec<f64>,
    /// Its standard deviation.
    pub std: Option<Vec<f64>>,
}

/// What the estimator did not expect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InnovationTrace {
    /// The output of the regression.
    pub id: String,
    /// Its unit; may be empty.
    pub unit: String,
    /// Measurement less prediction.
    pub values: Vec<f64>,
}
