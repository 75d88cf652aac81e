//! `loopsight simulate`.

use crate::answers::Answer as _;
use crate::cli::arguments::SimulateArguments;
use crate::cli::{files, output};
use crate::error::Result;
use crate::{Experiment, Model, Session, SimulateOptions};

pub(crate) fn run(arguments: &SimulateArguments) -> Result<()> {
    let inputs = [&arguments.model, &arguments.experiment].map(std::slice::from_ref);
    files::check([&arguments.output], &inputs)?;
    let session = Session::of_model(Model::from_file(&arguments.model)?);
    let experiment = Experiment::from_file(&arguments.experiment)?;
    let answer = session.simulate(&SimulateOptions::new(experiment))?;
    files::apart(&arguments.output, &[answer.reads()])?;
    let written = answer.log().save(&arguments.output)?;
    output::note(&format!("{written}: {}", answer.summary));
    if arguments.json {
        output::result(&answer.to_json()?);
    }
    Ok(())
}
