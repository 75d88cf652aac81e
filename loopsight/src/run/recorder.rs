//! What a loop does, tick by tick: kept for the page, summed up for the summary, as rows for the log.

use std::collections::BTreeMap;

use loopsight_core::supervisor::Event;
use loopsight_core::{Signal, TickRecord};
use loopsight_model::loop_file::Composed;
use loopsight_model::model::Model;
use loopsight_model::supervisor::{described, turning};
use loopsight_recordings::{column, header};
use loopsight_report::{ControlledTrace, InnovationTrace, InputTrace, LoopRecord, ParameterTrace};

use super::timing::Stopwatch;
use crate::columns::rounded;

/// Most ticks that are kept for the page; each time it is reached, every second one is dropped.
const MOST_KEPT: usize = 200_000;

/// Most events of one kind that are logged.
const MOST_ALIKE: usize = 200;

/// Sums over all ticks, also those that are not kept.
#[derive(Clone, Copy, Default)]
pub(crate) struct Sums {
    squares: f64,
    n: u64,
    pub(crate) largest: f64,
    pub(crate) last: f64,
}

impl Sums {
    fn take(&mut self, value: f64) {
        if value.is_finite() {
            self.squares += value * value;
            self.n += 1;
            self.largest = self.largest.max(value.abs());
            self.last = value;
        }
    }

    /// Root mean square; `None` of nothing.
    pub(crate) fn rms(&self) -> Option<f64> {
        (self.n > 0).then(|| (self.squares / self.n as f64).sqrt())
    }
}

/// Collects what a loop does.
pub(crate) struct Recorder {
    pub(crate) record: LoopRecord,
    /// Tracking error of each controlled signal, and innovation of each regression.
    pub(crate) errors: Vec<Sums>,
    pub(crate) innovations: Vec<Sums>,
    pub(crate) excitations: Vec<Sums>,
    /// Of each parameter, its value in the model file, its estimate, and the deviation of that.
    pub(crate) starts: Vec<f64>,
    pub(crate) estimates: Vec<f64>,
    pub(crate) deviations: Vec<f64>,
    /// Ticks that taught each regression nothing, by reason.
    pub(crate) withheld: Vec<BTreeMap<&'static str, usize>>,
    /// Ticks with a flag.
    pub(crate) saturated: usize,
    pub(crate) stale: usize,
    pub(crate) fallen: usize,
    row: Vec<f64>,
    signals: Vec<Signal>,
    turning: Vec<String>,
    /// Parameters that the loop's estimator learns; those that follow are learned by the controller.
    identified: usize,
    stopwatch: Option<Stopwatch>,
    was: [bool; 2],
    alike: [usize; 2],
    /// Events that happened at the tick before, for the log.
    fresh: Vec<(f64, String)>,
}

/// The unit of the rate of a signal.
fn rate(unit: &str) -> String {
    match unit.strip_suffix("/s") {
        Some(of) => format!("{of}/s^2"),
        None => format!("{unit}/s"),
    }
}

impl Recorder {
    pub(crate) fn new(model: &Model, composed: &Composed, period_s: f64, real_time: bool) -> Self {
        let controlled = composed
            .controlled
            .iter()
            .map(|s| ControlledTrace {
                id: s.id.to_owned(),
                unit: s.unit.to_owned(),
                ..ControlledTrace::default()
            })
            .collect();
        let inputs = model
            .plant
            .inputs
            .iter()
            .map(|s| InputTrace {
                id: s.id.to_owned(),
                unit: s.unit.to_owned(),
                ..InputTrace::default()
            })
            .collect();
        let mut parameters = Vec::new();
        let mut innovations = Vec::new();
        let mut starts = Vec::new();
        if let Some(identification) = &composed.host.observer {
            for row in 0..identification.len() {
                for j in identification.parameters(row) {
                    starts.push(model.parameters[*j].value.unwrap_or(0.0));
                    parameters.push(ParameterTrace {
                        name: model.parameters[*j].name.clone(),
                        unit: model.parameters[*j].unit.clone(),
                        values: Vec::new(),
                        std: Some(Vec::new()),
                    });
                }
                let signal = composed.controlled.get(row);
                innovations.push(InnovationTrace {
                    id: signal.map_or_else(String::new, |s| s.id.to_owned()),
                    unit: signal.map_or_else(String::new, |s| rate(s.unit)),
                    values: Vec::new(),
                });
            }
        }
        let identified = parameters.len();
        for own in composed.host.controller.quantities() {
            let Some(start) = own.start else {
                continue;
            };
            starts.push(start);
            parameters.push(ParameterTrace {
                name: format!("{} aboard", own.name),
                unit: own.unit.to_owned(),
                values: Vec::new(),
                std: None,
            });
        }
        Self {
            errors: vec![Sums::default(); composed.controlled.len()],
            innovations: vec![Sums::default(); innovations.len()],
            excitations: vec![Sums::default(); innovations.len()],
            withheld: vec![BTreeMap::new(); innovations.len()],
            estimates: starts.clone(),
            deviations: vec![f64::NAN; starts.len()],
            starts,
            record: LoopRecord {
                period_s,
                every: 1,
                controlled,
                inputs,
                parameters,
                excitations: innovations.clone(),
                innovations,
                ..LoopRecord::default()
            },
            saturated: 0,
            stale: 0,
            fallen: 0,
            row: Vec::new(),
            turning: turning(model),
            identified,
            signals: model.measured.iter().map(|m| *m.signal).collect(),
            stopwatch: real_time.then(Stopwatch::default),
            was: [false; 2],
            alike: [0; 2],
            fresh: Vec::new(),
        }
    }

    /// The columns of the log.
    pub(crate) fn headers(&self, model: &Model, composed: &Composed) -> Vec<String> {
        let mut headers = vec!["time_s".to_owned()];
        headers.extend(model.plant.inputs.iter().map(header));
        headers.extend(model.measured.iter().map(|m| header(m.signal)));
        let reference = |s: &&Signal| format!("reference_{}", header(s));
        headers.extend(composed.controlled.iter().map(reference));
        headers.extend(["saturated_1", "fresh_1"].map(str::to_owned));
        if composed.judges_learning {
            headers.push("fallen_back_1".to_owned());
        }
        let named = |prefix: &str, id: &str, unit: &str| format!("{prefix}_{}", column(id, unit));
        for p in &self.record.parameters[..self.identified] {
            headers.push(named("learned", &p.name, &p.unit));
        }
        for own in composed.host.controller.quantities() {
            headers.push(named("aboard", own.name, own.unit));
        }
        for i in &self.record.innovations {
            headers.push(named("innovation", &i.id, &i.unit));
            headers.push(named("excitation", &i.id, &i.unit));
            headers.push(format!("taught_{}_1", i.id));
        }
        if self.stopwatch.is_some() {
            headers.push("late_s".to_owned());
        }
        headers
    }

    /// Takes a tick.
    pub(crate) fn push(&mut self, step: &TickRecord<'_, f64>, supervised: bool) {
        let (time, outcome) = (step.tick.time, step.outcome);
        if let Some(event) = &step.event {
            self.happened(time, self.words(event));
        }
        let flags = [outcome.saturated, outcome.held];
        let says = ["an actuator saturates", "the last safe command is repeated"];
        for kind in 0..2 {
            if flags[kind] && !self.was[kind] && self.alike[kind] < MOST_ALIKE {
                self.alike[kind] += 1;
                // The page shades what comes again and again; the log has each time.
                if self.alike[kind] == 1 {
                    self.happened(time, format!("{} for the first time", says[kind]));
                } else {
                    self.fresh.push((time, says[kind].to_owned()));
                }
            }
        }
        self.was = flags;
        if let Some(stopwatch) = &mut self.stopwatch {
            stopwatch.take(step);
            self.record.timing = Some(stopwatch.timing());
        }
        let pairs = step.reference.iter().zip(step.measured);
        for (sums, (reference, measured)) in self.errors.iter_mut().zip(pairs) {
            sums.take(reference - measured);
        }
        self.saturated += usize::from(outcome.saturated);
        self.stale += usize::from(!step.sample.fresh);
        self.fallen += usize::from(step.fallen);
        self.record.ticks += 1;
        self.row.clear();
        self.row.push((time * 1e9).round() / 1e9);
        // Adding 0 makes -0 into 0.
        for values in [step.applied, step.measured, step.reference] {
            self.row.extend(values.iter().map(|v| rounded(*v) + 0.0));
        }
        let flag = |set: bool| f64::from(u8::from(set));
        self.row.push(flag(outcome.saturated));
        self.row.push(flag(step.sample.fresh));
        if supervised {
            self.row.push(flag(step.fallen));
        }
        if self.keeps() {
            self.keep(step);
        }
    }

    /// Whether the present tick is one of those that are kept.
    fn keeps(&self) -> bool {
        (self.record.ticks - 1).is_multiple_of(self.record.every)
    }

    fn keep(&mut self, step: &TickRecord<'_, f64>) {
        let record = &mut self.record;
        record.time.push(step.tick.time);
        for (i, trace) in record.controlled.iter_mut().enumerate() {
            trace.reference.push(step.reference[i]);
            trace.measured.push(step.measured[i]);
        }
        for (i, trace) in record.inputs.iter_mut().enumerate() {
            trace.commanded.push(step.command[i]);
            trace.applied.push(step.applied[i]);
        }
        record.saturated.push(step.outcome.saturated);
        record.stale.push(!step.sample.fresh);
        record.fallen.push(step.fallen);
    }

    /// Takes what the tick taught; completes the row of the log.
    pub(crate) fn learn(&mut self, composed: &Composed, step_late: f64) {
        let keeps = self.keeps();
        if let Some(identification) = &composed.host.observer {
            let mut next = 0;
            for row in 0..identification.len() {
                let estimator = identification.estimator(row);
                for (i, theta) in estimator.theta().iter().enumerate() {
                    // Before the first lesson nothing is known of the noise.
                    let deviation = Some(estimator.deviation(i)).filter(|d| *d > 0.0);
                    let deviation = deviation.unwrap_or(f64::NAN);
                    self.row.push(*theta);
                    self.estimates[next] = *theta;
                    self.deviations[next] = deviation;
                    if keeps {
                        let trace = &mut self.record.parameters[next];
                        trace.values.push(*theta);
                        trace.std.iter_mut().for_each(|s| s.push(deviation));
                    }
                    next += 1;
                }
            }
        }
        let controller = &composed.host.controller;
        let mut next = self.identified;
        for (own, value) in controller.quantities().iter().zip(controller.told()) {
            self.row.push(*value);
            if own.start.is_some() {
                self.estimates[next] = *value;
                if keeps {
                    self.record.parameters[next].values.push(*value);
                }
                next += 1;
            }
        }
        if let Some(identification) = &composed.host.observer {
            for row in 0..identification.len() {
                let lesson = identification.lesson(row);
                let excitation = identification.estimator(row).excitation();
                self.innovations[row].take(lesson.innovation);
                self.excitations[row].take(excitation);
                self.row.extend([lesson.innovation, excitation]);
                self.row
                    .push(f64::from(u8::from(lesson.withheld.is_none())));
                if let Some(why) = lesson.withheld {
                    *self.withheld[row].entry(why.id()).or_default() += 1;
                }
                if keeps {
                    self.record.innovations[row].values.push(lesson.innovation);
                    self.record.excitations[row].values.push(excitation);
                }
            }
        }
        if self.stopwatch.is_some() {
            self.row.push(step_late);
        }
        if self.record.time.len() >= MOST_KEPT {
            self.record.halve();
        }
    }

    /// The present row of the log.
    pub(crate) fn row(&self) -> &[f64] {
        &self.row
    }

    /// What a supervisor did, in words.
    pub(crate) fn words(&self, event: &Event<f64>) -> String {
        let signals = self.signals.iter().map(|s| (s.id, s.unit));
        described(event, &signals.collect::<Vec<_>>(), &self.turning)
    }

    pub(crate) fn happened(&mut self, time: f64, text: String) {
        self.fresh.push((time, text.clone()));
        self.record.events.push((time, text));
    }

    /// Events since the last call.
    pub(crate) fn news(&mut self) -> Vec<(f64, String)> {
        std::mem::take(&mut self.fresh)
    }
}
