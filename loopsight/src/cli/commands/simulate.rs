//! `loopsight simulate`.

use std::collections::BTreeMap;
use std::path::Path;

use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_model::config::{ConfigError, Source, read_text};
use loopsight_model::excitation::{self, Excitation, sample_rows};
use loopsight_model::loop_file::placed;
use loopsight_model::model::Model;
use loopsight_model::run::Run;
use loopsight_recordings::{header, write_csv};
use serde::Deserialize;

use crate::cli::arguments::SimulateOptions;
use crate::cli::failure::{self, Failure};
use crate::cli::load::{column as column_of, writable};
use crate::cli::output;

/// An experiment file: what a robot is driven with and how it is measured.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Experiment {
    /// Length of the log, s.
    pub(crate) duration_s: f64,
    /// Sampling period, s.
    pub(crate) period_s: f64,
    /// Inputs by id; 0 where none is given.
    #[serde(default)]
    pub(crate) inputs: BTreeMap<String, Excitation>,
    /// A CSV of inputs to replay instead, beside this file: columns named as in a log, each row
    /// held until the next.
    #[serde(default)]
    pub(crate) inputs_from: Option<String>,
    /// The robot's integration step, noise, seed, limits: the settings of the driver `simulated`.
    #[serde(default)]
    pub(crate) robot: Simulated,
}

/// Most samples of one experiment: beyond it a number was mistyped.
const MOST_SAMPLES: f64 = 1e7;

impl Experiment {
    pub(crate) fn parse(source: &Source) -> Result<Self, Box<ConfigError>> {
        let experiment: Self = source.read()?;
        for (key, value) in [
            ("duration_s", experiment.duration_s),
            ("period_s", experiment.period_s),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                let message = format!("`{key}` is {value} s, expected a number above 0 s");
                return Err(source.error(&[key.into()], &message, None));
            }
        }
        let samples = experiment.duration_s / experiment.period_s;
        if samples > MOST_SAMPLES {
            let message =
                format!("that is {samples:.1e} samples, expected at most {MOST_SAMPLES:e}");
            return Err(source.error(&["period_s".into()], &message, None));
        }
        if experiment.robot.model.is_some() {
            let message =
                "the robot's model is the MODEL of the command, so none can be named here";
            return Err(source.error(&["robot".into(), "model".into()], message, None));
        }
        if experiment.inputs_from.is_some() && !experiment.inputs.is_empty() {
            let message = "there are `inputs` as well, expected one of the two";
            return Err(source.error(&["inputs_from".into()], message, None));
        }
        Ok(experiment)
    }

    /// Runs the experiment on the robot `model`.
    pub(crate) fn simulate(&self, source: &Source, model: &Model) -> Result<Run, Box<ConfigError>> {
        let steps = (self.duration_s / self.period_s + 1e-9).floor() as usize;
        let time: Vec<f64> = (0..=steps).map(|k| k as f64 * self.period_s).collect();
        let rows = match &self.inputs_from {
            Some(name) => replayed(source, name, model, &time)?,
            None => {
                let beside = Path::new(&source.file);
                let read =
                    |name: &str, column: &str| column_of(&beside.with_file_name(name), column);
                let inputs = excitation::build_with(&self.inputs, model.plant.inputs, &read)
                    .map_err(|e| placed(source, &["inputs".into()], e))?;
                sample_rows(&inputs, &time)
            }
        };
        simulate_inputs(model, &self.robot, &time, &rows)
            .map_err(|e| placed(source, &["robot".into()], e))
    }
}

/// The inputs that the CSV `name`, beside the experiment file, holds at the instants `time`; 0
/// before its first row.
fn replayed(
    source: &Source,
    name: &str,
    model: &Model,
    time: &[f64],
) -> Result<Vec<f64>, Box<ConfigError>> {
    let path = Path::new(&source.file).with_file_name(name);
    let wrong = |why: String| {
        let why = format!("{}: {why}", path.display());
        source.error(&["inputs_from".into()], &why, None)
    };
    let log = loopsight_recordings::read(&path).map_err(|e| wrong(e.to_string()))?;
    let table = log.table();
    let column = |name: String| {
        let found = table.columns.iter().position(|c| c.text == name);
        found.ok_or_else(|| wrong(format!("there is no column `{name}`")))
    };
    let stamp = column("time_s".to_owned())?;
    let inputs = model
        .plant
        .inputs
        .iter()
        .map(|signal| column(header(signal)));
    let inputs: Vec<usize> = inputs.collect::<Result<_, _>>()?;
    let rows = table.runs.iter().flat_map(|run| &run.rows);
    let values: Vec<f64> = rows.copied().collect();
    let rows: Vec<&[f64]> = values.chunks_exact(table.columns.len()).collect();
    let replay = time.iter().flat_map(|t| {
        // Stamps are rounded sums of periods.
        let come = rows.partition_point(|row| row[stamp] <= t + 1e-9);
        let row = come.checked_sub(1).map(|k| rows[k]);
        inputs.iter().map(move |i| row.map_or(0.0, |row| row[*i]))
    });
    Ok(replay.collect())
}

pub(crate) fn run(options: &SimulateOptions) -> Result<(), Failure> {
    writable(&options.output)?;
    let (model, _) = Model::load(&options.model)?;
    let missing = model.missing_values();
    if !missing.is_empty() {
        return Err(Failure::request(format!(
            "{} gives no value for {}: a robot needs all its values",
            options.model.display(),
            missing.join(", ")
        )));
    }
    if model.measured.is_empty() {
        return Err(Failure::request(format!(
            "{} names no measured signal: add for instance [log.measured.{}]",
            options.model.display(),
            model.plant.states[0].id
        )));
    }
    let text = read_text(&options.experiment)?;
    let source = Source::parse(&options.experiment.display().to_string(), &text)?;
    let experiment = Experiment::parse(&source)?;
    let run = experiment.simulate(&source, &model)?;
    write(&options.output, &model, &run)?;
    output::note(&format!(
        "wrote {}: {} samples over {} s",
        options.output.display(),
        run.len(),
        run.duration()
    ));
    Ok(())
}

/// Writes a run as CSV.
fn write(path: &Path, model: &Model, run: &Run) -> Result<(), Failure> {
    let mut headers = vec!["time_s".to_owned()];
    headers.extend(model.plant.inputs.iter().map(header));
    headers.extend(model.measured.iter().map(|m| header(m.signal)));
    let mut rows = Vec::with_capacity(run.len() * headers.len());
    for k in 0..run.len() {
        rows.push(rounded(run.time()[k]));
        rows.extend(
            run.input(k)
                .iter()
                .chain(run.sample(k))
                .map(|v| rounded(*v)),
        );
    }
    write_csv(path, &headers, &rows).map_err(|e| failure::recording(path, &e))
}

/// Without the digits that are rounding errors of the simulation.
pub(crate) fn rounded(value: f64) -> f64 {
    (value * 1e12).round() / 1e12
}
