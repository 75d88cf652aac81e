//! `loopsight experiment`.

use crate::answers::ExperimentAnswer;
use crate::cli::arguments::ExperimentArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::{Ask, ExperimentOptions, Model, Session};

/// Stands for no second effect.
const NOTHING: &str = "nothing";

/// Experiments that are shown.
const SHOWN: usize = 6;

pub(crate) fn run(arguments: &ExperimentArguments) -> Result<()> {
    files::writable(&arguments.output)?;
    let session = Session::of_model(Model::from_file(&arguments.model)?);
    let bar = Bar::new();
    let mut options = ExperimentOptions::default()
        .ask(ask(arguments))
        .period_s(arguments.period)
        .watch(bar.watch());
    options.limit = arguments.limit;
    options.duration_s = arguments.duration;
    let answer = session.experiment(&options);
    drop(bar);
    let mut answer = answer?;
    if answer.answers() {
        answer.save(&arguments.output)?;
    }
    output::answer(&answer, &text(&answer), arguments.json)?;
    output::note(&if answer.answers() {
        format!(
            "wrote {}: {} samples over {} s; record it with the robot at rest and free to move",
            arguments.output.display(),
            answer.samples(),
            answer.duration_s
        )
    } else {
        "no plan was written".to_owned()
    });
    Ok(())
}

fn ask(arguments: &ExperimentArguments) -> Ask {
    match (&arguments.separate[..], &arguments.pin) {
        ([first, second], _) if second == NOTHING => Ask::IsThere(first.clone()),
        ([first, second], _) => Ask::Separate(first.clone(), second.clone()),
        (_, Some(name)) => Ask::Pin(name.clone()),
        _ => Ask::All,
    }
}

fn text(answer: &ExperimentAnswer) -> String {
    let mut text = answer.summary.clone();
    if answer.answers() {
        let rows: Vec<Vec<String>> = answer
            .considered
            .iter()
            .take(SHOWN)
            .map(|c| vec![c.experiment.clone(), format!("{:.1}", c.detectability)])
            .collect();
        let what = if answer.pins.is_empty() {
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
