//! `loopsight experiment`.

use crate::cli::arguments::ExperimentArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;
use crate::{Ask, ExperimentOptions, Model, Session};

/// Stands for no second effect.
const NOTHING: &str = "nothing";

pub(crate) fn run(arguments: &ExperimentArguments) -> Result<()> {
    files::check(
        [&arguments.output],
        &[std::slice::from_ref(&arguments.model)],
    )?;
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
    let written = if answer.answers() {
        Some(answer.save(&arguments.output)?)
    } else {
        None
    };
    output::answer(&answer, &report::plan::text(&answer.engine), arguments.json)?;
    output::note(&match written {
        Some(written) => format!(
            "{written}: {} samples over {} s; record it with the robot at rest and free to move",
            answer.samples(),
            answer.duration_s
        ),
        None => "no plan was written".to_owned(),
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
