//! `loopsight experiment`.

use std::path::Path;

use loopsight_diagnosis::{
    Limits, Plan, Promise, Question, QuestionError, Work, experiment, place,
};
use loopsight_model::model::Model;
use loopsight_recordings::{header, write_csv};
use serde::Serialize;

use crate::cli::arguments::ExperimentOptions;
use crate::cli::commands::simulate::rounded;
use crate::cli::failure::{self, Failure};
use crate::cli::load::writable;
use crate::cli::{output, progress};

/// Largest magnitude of the inputs where nobody says one, in their SI unit.
const LIMIT: f64 = 9.0;
/// Stands for no second effect.
const NOTHING: &str = "nothing";

/// The plan, as the contract has it.
#[derive(Serialize)]
struct Told<'a> {
    #[serde(flatten)]
    plan: &'a Plan,
    limit: f64,
    period_s: f64,
    /// The file written; none when no inputs answer the question.
    file: Option<String>,
}

pub(crate) fn run(options: &ExperimentOptions) -> Result<(), Failure> {
    writable(&options.output)?;
    let (model, _) = Model::load(&options.model)?;
    let limits = Limits {
        limit: options.limit.unwrap_or_else(|| default_limit(&model)),
        period: options.period,
        duration: options.duration,
    };
    let bar = progress::bar("simulating experiments", 1);
    let shown = progress::shown(&bar);
    let work = Work::reporting(&shown);
    let plan = question(options, &model).and_then(|q| experiment(&model, &q, &limits, &work));
    bar.finish_and_clear();
    let plan = plan.map_err(wrong)?;
    let answers = plan.verdict != Promise::CannotBeSeparated;
    if answers {
        write(&options.output, &model, &plan)?;
    }
    output::people(&text(&plan), options.json);
    if answers {
        output::note(&format!(
            "wrote {}: {} samples over {} s; record it with the robot at rest and free to move",
            options.output.display(),
            plan.drive.time.len(),
            plan.duration_s
        ));
    } else {
        output::note("no plan was written");
    }
    if options.json {
        output::json(&Told {
            plan: &plan,
            limit: limits.limit,
            period_s: limits.period,
            file: answers.then(|| options.output.display().to_string()),
        })?;
    }
    Ok(())
}

fn question(options: &ExperimentOptions, model: &Model) -> Result<Question, QuestionError> {
    match (&options.separate[..], &options.pin) {
        ([a, b], _) => {
            let first = place(model, a)?;
            let second = if b == NOTHING {
                None
            } else {
                Some(place(model, b)?)
            };
            Ok(Question::Separate(first, second))
        }
        (_, Some(name)) => Ok(Question::Pin(name.clone())),
        _ => Ok(Question::All),
    }
}

fn wrong(error: QuestionError) -> Failure {
    match error {
        QuestionError::Unstable | QuestionError::Excitation(_) => Failure::work(error.to_string()),
        _ => Failure::request(error.to_string()),
    }
}

/// What the model says its inputs can give, if that is less than the usual.
fn default_limit(model: &Model) -> f64 {
    model
        .effects
        .iter()
        .filter(|e| e.meta.id == "input_saturation")
        .filter_map(|e| model.parameters.get(e.first_parameter)?.value)
        .fold(LIMIT, f64::min)
}

/// Writes the inputs as CSV, with the header of a log.
fn write(path: &Path, model: &Model, plan: &Plan) -> Result<(), Failure> {
    let mut headers = vec!["time_s".to_owned()];
    headers.extend(model.plant.inputs.iter().map(header));
    let n = model.plant.inputs.len();
    let drive = &plan.drive;
    let rows: Vec<f64> = drive
        .time
        .iter()
        .zip(drive.inputs.chunks_exact(n))
        .flat_map(|(t, row)| std::iter::once(*t).chain(row.iter().copied()))
        .map(rounded)
        .collect();
    write_csv(path, &headers, &rows).map_err(|e| failure::recording(path, &e))
}

fn text(plan: &Plan) -> String {
    let mut text = match plan.verdict {
        Promise::CannotBeSeparated => plan.reason.clone(),
        _ => format!("run for {} s: {}", plan.duration_s, plan.reason),
    };
    if plan.verdict != Promise::CannotBeSeparated {
        let rows: Vec<Vec<String>> = plan
            .considered
            .iter()
            .take(SHOWN)
            .map(|c| vec![c.experiment.clone(), format!("{:.1}", c.detectability)])
            .collect();
        let what = if plan.pins.is_empty() {
            "standard deviations apart"
        } else {
            "value / std error"
        };
        text.push_str("\n\n");
        text.push_str(&output::table(
            &["experiments compared at one length", what],
            &rows,
        ));
    }
    text
}

/// Experiments that are shown.
const SHOWN: usize = 6;
