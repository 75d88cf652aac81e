//! One blind recording: made, diagnosed, and whether the diagnosis is right.

use std::fmt::Write as _;
use std::path::Path;

use loopsight_core::Signal;
use loopsight_diagnosis::{
    Conclusion, Criteria, Diagnosis, EffectAt, Explanation, Measurements, Work, diagnose,
};
use loopsight_hidden::{Experiment, Hidden, Recording, Robot, record_with, refit};
use loopsight_model::model::Model;
use loopsight_recordings::{Source, map, read_csv_from};

/// A refit of the plain model leaves less than this multiple of the floor: nothing shows.
pub(crate) const INVISIBLE: f64 = 1.15;

/// Writes a page, and says so.
pub(crate) fn write(file: &Path, page: &str) {
    match std::fs::write(file, page) {
        Ok(()) => eprintln!("wrote {}", file.display()),
        Err(error) => eprintln!("{}: {error}", file.display()),
    }
}

/// What is recorded.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Case {
    /// The machine.
    pub(crate) robot: Robot,
    /// What it hides; nothing in a clean recording.
    pub(crate) effect: Option<Hidden>,
    /// What it is driven with.
    pub(crate) experiment: Experiment,
    /// Size of the effect, in noticeable ones.
    pub(crate) size: f64,
    /// Of the experiment and the noise.
    pub(crate) seed: u64,
}

/// The log, and the multi-level recording that judges.
pub(crate) struct Recorded {
    pub(crate) case: Case,
    pub(crate) log: Recording,
    pub(crate) test: Recording,
    /// A refit of the plain model leaves what cannot be told from the floor: nothing to be found.
    pub(crate) hidden_well: bool,
}

impl Case {
    /// Makes both recordings of a machine whose windings have this time constant (s); none where the
    /// machine cannot be driven so.
    pub(crate) fn record(self, windings: f64) -> Option<Recorded> {
        let hidden: Vec<(Hidden, f64)> = self.effect.map(|e| (e, self.size)).into_iter().collect();
        let of =
            |experiment, seed| record_with(self.robot, &hidden, experiment, seed, windings).ok();
        let log = of(self.experiment, self.seed)?;
        let test = of(Experiment::MultiLevel, 1000 + self.seed)?;
        let invisible = || refit(&log).left(&log) < INVISIBLE * log.floor();
        Some(Recorded {
            case: self,
            hidden_well: self.effect.is_some() && invisible(),
            log,
            test,
        })
    }
}

impl Recorded {
    /// What a diagnosis by these criteria says.
    pub(crate) fn diagnose(&self, criteria: &Criteria) -> Option<Diagnosis> {
        let (model, _) = Model::from_toml("hidden", &self.log.model_toml).ok()?;
        let [log, test] = [&self.log, &self.test].map(|log| read(&model, &csv(log)));
        let (log, test) = (log?, test?);
        let measurements = Measurements::new(&log.runs).tested_on(Some(&test.runs));
        diagnose(&model, &measurements, &Work::quiet().decided_by(criteria)).ok()
    }

    /// Whether a diagnosis is right.
    pub(crate) fn right(&self, diagnosis: &Diagnosis) -> bool {
        match self.log.truth.hidden.first() {
            None => diagnosis.verdict == Conclusion::NothingMissing,
            // Where the log cannot show the effect at all, the right answer is to say so.
            Some(_) if self.hidden_well && diagnosis.missing.is_none() => matches!(
                diagnosis.verdict,
                Conclusion::DataInsufficient | Conclusion::NothingMissing
            ),
            // Or that it can be told from nothing that explains the log as well.
            Some(truth) if diagnosis.verdict == Conclusion::DataInsufficient => {
                let best = diagnosis.candidates.first();
                best.is_some_and(|best| among(&best.place, best, truth.effect.id(), &truth.at))
            }
            Some(truth) => named(diagnosis, truth.effect.id(), &truth.at),
        }
    }
}

/// A log as it would be read from a file, in the units of the model.
pub(crate) fn read(model: &Model, csv: &str) -> Option<loopsight_recordings::Recording> {
    let table = read_csv_from(csv.as_bytes(), "hidden.csv").ok()?;
    let signals = model.plant.states.iter().chain(model.plant.outputs);
    let signals: Vec<Signal> = signals.copied().collect();
    let source = Source::Table(table);
    map(&source, model.plant.inputs, &signals, &model.log).ok()
}

/// A recording as a CSV of all digits.
fn csv(log: &Recording) -> String {
    let mut text = log.columns().join(",");
    for k in 0..log.run.len() {
        let _ = write!(text, "\n{}", log.run.time()[k]);
        for value in log.run.input(k).iter().chain(log.run.sample(k)) {
            let _ = write!(text, ",{value}");
        }
    }
    text
}

/// Whether the missing effect, or one that the diagnosis says it cannot tell from it, is the true
/// one at the true channels.
fn named(diagnosis: &Diagnosis, id: &str, at: &[&str]) -> bool {
    let (Some(missing), Some(best)) = (&diagnosis.missing, diagnosis.candidates.first()) else {
        return false;
    };
    among(missing, best, id, at)
}

/// Whether the effect is `first`, or in the class that `best` leads.
fn among(first: &EffectAt, best: &Explanation, id: &str, at: &[&str]) -> bool {
    let mut class = vec![first];
    class.extend(&best.indistinguishable_from);
    class.into_iter().any(|place| is(place, id, at))
}

/// Whether this is the effect `id` at the channels `at`.
pub(crate) fn is(place: &EffectAt, id: &str, at: &[&str]) -> bool {
    // On an axis an effort at the load is one at the shaft times a constant.
    let one = |c: &str| if c == "load" { "shaft" } else { c }.to_owned();
    place.effect == id
        && place.at.len() == at.len()
        && (at.iter()).all(|c| place.at.iter().any(|x| one(x) == one(c)))
}
