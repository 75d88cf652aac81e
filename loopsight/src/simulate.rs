//! A simulated robot, driven with an experiment.

use std::collections::BTreeMap;
use std::path::Path;

use loopsight_drivers::{Simulated, simulate_inputs};
use loopsight_model::config::{ConfigError, TomlSource, read_text};
use loopsight_model::excitation::{self, Excitation, sample_rows};
use loopsight_model::loop_file::placed;
use loopsight_model::model::Model as Composed;
use loopsight_model::run::Run;
use loopsight_recordings::{ColumnName, Table, TableRun, header};
use serde::Deserialize;

use crate::answers::{ExperimentAnswer, SimulateAnswer};
use crate::bounded;
use crate::columns;
use crate::error::{Error, Result};
use crate::files::Reads;
use crate::log::Log;
use crate::session::Session;

/// What a robot is driven with and how it is measured: an experiment file.
///
/// ```
/// use loopsight::{Experiment, Model, Session, SimulateOptions};
///
/// let robot = Model::from_toml("robot.toml", "[plant.oscillator]\nstiffness_per_mass = 40.0\n\
///     damping_per_mass = 1.0\ninverse_mass = 2.0\n[log.measured.position]\n")?;
/// let experiment = Experiment::from_toml("push.toml", "duration_s = 2.0\nperiod_s = 0.01\n\
///     [inputs]\nforce = { prbs = { amplitude = 5.0, hold_s = 0.2, seed = 1 } }\n")?;
/// let answer = Session::of_model(robot).simulate(&SimulateOptions::new(experiment))?;
/// assert_eq!(answer.samples, 201);
/// assert_eq!(answer.log().columns(), ["time_s", "force_N", "position_m"]);
/// # Ok::<(), loopsight::Error>(())
/// ```
#[derive(Debug)]
pub struct Experiment {
    pub(crate) written: Written,
    /// Name and text of the file.
    file: String,
    text: String,
    /// Inputs in the place of those that the file names: instants, and rows of values by signal.
    planned: Option<Planned>,
}

#[derive(Clone, Debug)]
struct Planned {
    time: Vec<f64>,
    rows: Vec<f64>,
}

/// An experiment file, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Written {
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
    inputs_from: Option<String>,
    /// The robot's integration step, noise, seed, limits: the settings of the driver `simulated`.
    #[serde(default)]
    robot: Simulated,
}

/// Most samples of one experiment: beyond it a number was mistyped.
const MOST_SAMPLES: f64 = 1e7;

impl Written {
    fn parse(source: &TomlSource) -> std::result::Result<Self, Box<ConfigError>> {
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
        let step = experiment.robot.longest_step();
        if let Some(message) = bounded::robot(experiment.duration_s, step) {
            return Err(source.error(&["duration_s".into()], &message, None));
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
}

impl Experiment {
    /// Reads an experiment file.
    ///
    /// # Errors
    ///
    /// The file cannot be read, or says something that cannot be: with line, column, and the nearest right
    /// thing.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::from_toml(&path.display().to_string(), &read_text(path)?)
    }

    /// Makes an experiment of a text; `name` stands for the file in messages, and files that it names lie
    /// beside it.
    ///
    /// # Errors
    ///
    /// As [`Experiment::from_file`].
    pub fn from_toml(name: &str, text: &str) -> Result<Self> {
        let source = TomlSource::parse(name, text)?;
        Ok(Self {
            written: Written::parse(&source)?,
            file: name.to_owned(),
            text: text.to_owned(),
            planned: None,
        })
    }

    /// The experiment that [`Session::experiment`] has planned, on a robot without noise.
    ///
    /// # Errors
    ///
    /// No inputs answer the question, so there is no plan.
    pub fn of_plan(plan: &ExperimentAnswer) -> Result<Self> {
        let drive = &plan.engine.drive;
        let Some(last) = drive.time.last().filter(|last| **last > 0.0) else {
            return Err(Error::request(
                "there is no plan: no inputs answer the question",
            ));
        };
        let text = format!("duration_s = {last:?}\nperiod_s = {:?}\n", plan.period_s);
        let mut this = Self::from_toml("the plan", &text)?;
        this.planned = Some(Planned {
            time: drive.time.clone(),
            rows: drive.inputs.clone(),
        });
        Ok(this)
    }

    /// Length of the log, s.
    pub fn duration_s(&self) -> f64 {
        self.written.duration_s
    }

    /// Sampling period, s.
    pub fn period_s(&self) -> f64 {
        self.written.period_s
    }

    /// Runs the experiment on the robot `model`; `reads` gets the files that this reads.
    pub(crate) fn simulate(&self, model: &Composed, reads: &Reads) -> Result<Run> {
        let source = TomlSource::parse(&self.file, &self.text)?;
        let written = &self.written;
        let steps = (written.duration_s / written.period_s + 1e-9).floor() as usize;
        let time: Vec<f64> = (0..=steps).map(|k| k as f64 * written.period_s).collect();
        let n = model.plant.inputs.len();
        let rows = match (&self.planned, &written.inputs_from) {
            (Some(planned), _) if planned.rows.len() == n * planned.time.len() => {
                planned.held_at(&time, n)
            }
            (Some(_), _) => {
                let message = "the plan was made for a plant with other inputs";
                return Err(Error::request(message));
            }
            (None, Some(name)) => replayed(&source, name, model, &time, reads)?,
            (None, None) => {
                let beside = Path::new(&source.file);
                let read = |name: &str, column: &str| {
                    columns::read(&reads.note(beside.with_file_name(name)), column)
                };
                let inputs = excitation::build_with(&written.inputs, model.plant.inputs, &read)
                    .map_err(|e| placed(&source, &["inputs".into()], e))?;
                sample_rows(&inputs, &time)
            }
        };
        let run = simulate_inputs(model, &written.robot, &time, &rows)
            .map_err(|e| placed(&source, &["robot".into()], e))?;
        Ok(run)
    }
}

impl Planned {
    /// The rows that hold at the instants `time`; 0 before the first.
    fn held_at(&self, time: &[f64], n: usize) -> Vec<f64> {
        let rows: Vec<&[f64]> = self.rows.chunks_exact(n.max(1)).collect();
        held(
            &self.time,
            time,
            |row, i| match row {
                Some(k) => rows[k][i],
                None => 0.0,
            },
            n,
        )
    }
}

/// Values of `n` inputs at the instants `time`, each row held from its stamp on.
fn held(
    stamps: &[f64],
    time: &[f64],
    value: impl Fn(Option<usize>, usize) -> f64,
    n: usize,
) -> Vec<f64> {
    let mut all = Vec::with_capacity(time.len() * n);
    for t in time {
        // Stamps are rounded sums of periods.
        let come = stamps.partition_point(|stamp| *stamp <= t + 1e-9);
        let row = come.checked_sub(1);
        all.extend((0..n).map(|i| value(row, i)));
    }
    all
}

/// The inputs that the CSV `name`, beside the experiment file, holds at the instants `time`; 0
/// before its first row.
fn replayed(
    source: &TomlSource,
    name: &str,
    model: &Composed,
    time: &[f64],
    reads: &Reads,
) -> std::result::Result<Vec<f64>, Box<ConfigError>> {
    let path = reads.note(Path::new(&source.file).with_file_name(name));
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
    let inputs: Vec<usize> = inputs.collect::<std::result::Result<_, _>>()?;
    let rows = table.runs.iter().flat_map(|run| &run.rows);
    let values: Vec<f64> = rows.copied().collect();
    let rows: Vec<&[f64]> = values.chunks_exact(table.columns.len()).collect();
    let stamps: Vec<f64> = rows.iter().map(|row| row[stamp]).collect();
    let value = |row: Option<usize>, i: usize| row.map_or(0.0, |k| rows[k][inputs[i]]);
    Ok(held(&stamps, time, value, inputs.len()))
}

/// What is simulated.
#[derive(Debug)]
#[non_exhaustive]
pub struct SimulateOptions {
    /// What the robot is driven with.
    pub experiment: Experiment,
}

impl SimulateOptions {
    /// Drives the robot with this experiment.
    pub fn new(experiment: Experiment) -> Self {
        Self { experiment }
    }
}

impl Session {
    /// Drives a simulated robot, which is the model, with an experiment: the answer has its log.
    ///
    /// # Errors
    ///
    /// The model lacks values or measures nothing, or the experiment does not fit it.
    pub fn simulate(&self, options: &SimulateOptions) -> Result<SimulateAnswer> {
        let model = &self.model.composed;
        let missing = model.missing_values();
        if !missing.is_empty() {
            return Err(Error::request(format!(
                "{} gives no value for {}: a robot needs all its values",
                self.model.file,
                missing.join(", ")
            )));
        }
        if model.measured.is_empty() {
            let first = model.plant.states.first().map_or("", |state| state.id);
            return Err(Error::request(format!(
                "{} names no measured signal: add for instance [log.measured.{first}]",
                self.model.file,
            )));
        }
        let reads = Reads::default();
        let run = options.experiment.simulate(model, &reads)?;
        let log = Log::of_table(table(model, &run));
        Ok(SimulateAnswer::new(&run, log, reads.all()))
    }
}

/// A run as a log has it.
fn table(model: &Composed, run: &Run) -> Table {
    let mut headers = vec!["time_s".to_owned()];
    headers.extend(model.plant.inputs.iter().map(header));
    headers.extend(model.measured.iter().map(|m| header(m.signal)));
    let mut rows = Vec::with_capacity(run.len() * headers.len());
    for k in 0..run.len() {
        rows.push(columns::rounded(run.time()[k]));
        let values = run.input(k).iter().chain(run.sample(k));
        rows.extend(values.map(|v| columns::rounded(*v)));
    }
    Table {
        source: "simulated".to_owned(),
        columns: headers.iter().map(|text| ColumnName::new(text)).collect(),
        runs: vec![TableRun {
            rows,
            ..TableRun::default()
        }],
        ..Table::default()
    }
}
