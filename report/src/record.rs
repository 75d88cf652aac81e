//! What a closed loop did, as plain data.

/// A loop at work: every series is as long as [`LoopRecord::time`]; NaN marks a missing value.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoopRecord {
    /// Period of the loop, s.
    pub period_s: f64,
    /// Ticks that were run; 0 where all of them are kept.
    pub ticks: usize,
    /// One in so many ticks is kept; 0 and 1 mean all.
    pub every: usize,
    /// Time of each tick since the start, s.
    pub time: Vec<f64>,
    /// The signals under control.
    pub controlled: Vec<ControlledTrace>,
    /// What the controller did to the plant.
    pub inputs: Vec<InputTrace>,
    /// Ticks at which the controller wanted more than it could get.
    pub saturated: Vec<bool>,
    /// Ticks whose measurement was older than the tick; empty where none was.
    pub stale: Vec<bool>,
    /// Ticks at which the controller had the last good model instead of the learned one; empty where none was.
    pub fallen: Vec<bool>,
    /// Estimated parameters; empty without an estimator.
    pub parameters: Vec<ParameterTrace>,
    /// Innovations of the estimator; empty without one.
    pub innovations: Vec<InnovationTrace>,
    /// Excitation of each regression along the direction that is excited least; empty without an estimator.
    pub excitations: Vec<InnovationTrace>,
    /// How well real time was kept; `None` where time was simulated.
    pub timing: Option<Timing>,
    /// What happened when (s): resets, faults, lost samples.
    pub events: Vec<(f64, String)>,
    /// Sentences worth reading, e.g. the settling time asked for and the one reached.
    pub notes: Vec<String>,
    /// Why the loop ended, in words; empty where it is not known.
    pub end: String,
}

/// How well a loop kept to the clock on the wall.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Timing {
    /// Root mean square of the differences between periods and the period asked for, s.
    pub jitter_s: f64,
    /// Longest time after its time at which a tick began, s.
    pub latest_s: f64,
    /// Ticks that began more than a period late.
    pub missed: usize,
    /// Longest time from the beginning of a tick until its command was written, s.
    pub longest_s: f64,
}

impl LoopRecord {
    /// Ticks that were run.
    pub fn ticks(&self) -> usize {
        self.ticks.max(self.time.len())
    }

    /// Leaves out every second tick that is kept.
    pub fn halve(&mut self) {
        halve(&mut self.time);
        for trace in &mut self.controlled {
            halve(&mut trace.reference);
            halve(&mut trace.measured);
            trace.ideal.iter_mut().for_each(halve);
        }
        for trace in &mut self.inputs {
            halve(&mut trace.commanded);
            halve(&mut trace.applied);
        }
        for flags in [&mut self.saturated, &mut self.stale, &mut self.fallen] {
            halve(flags);
        }
        for trace in &mut self.parameters {
            halve(&mut trace.values);
            trace.std.iter_mut().for_each(halve);
        }
        for trace in self.innovations.iter_mut().chain(&mut self.excitations) {
            halve(&mut trace.values);
        }
        self.every = 2 * self.every.max(1);
    }
}

/// Keeps the elements with even indices.
fn halve<T>(values: &mut Vec<T>) {
    let mut index = 0;
    values.retain(|_| {
        index += 1;
        index % 2 == 1
    });
}

/// A signal under control.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ControlledTrace {
    /// The signal.
    pub id: String,
    /// Its unit.
    pub unit: String,
    /// Its reference.
    pub reference: Vec<f64>,
    /// Its measurement.
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
    /// What was applied, after limits; empty where it is what was commanded.
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

/// An innovation: the measurement minus what the estimator expected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct InnovationTrace {
    /// The output of the regression.
    pub id: String,
    /// Its unit; may be empty.
    pub unit: String,
    /// The innovation.
    pub values: Vec<f64>,
}

#[cfg(test)]
mod tests {
    use crate::fixtures::loop_record;

    #[test]
    fn half_a_record_has_every_second_tick() {
        let whole = loop_record(1001);
        let mut half = whole.clone();
        half.halve();
        assert_eq!((half.every, half.time.len()), (2, 501));
        let every = |values: &[f64]| values.iter().step_by(2).copied().collect::<Vec<f64>>();
        assert_eq!(half.time, every(&whole.time));
        assert_eq!(
            half.controlled[1].measured,
            every(&whole.controlled[1].measured)
        );
        assert_eq!(half.inputs[0].applied, every(&whole.inputs[0].applied));
        assert_eq!(
            half.parameters[0].values,
            every(&whole.parameters[0].values)
        );
        half.halve();
        assert_eq!((half.every, half.time.len()), (4, 251));
    }
}
