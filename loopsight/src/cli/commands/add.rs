//! `loopsight add`.

use crate::cli::arguments::AddArguments;
use crate::cli::{files, output};
use crate::error::Result;
use crate::{AddOptions, Model, Session};

pub(crate) fn run(arguments: &AddArguments) -> Result<()> {
    let inputs = [std::slice::from_ref(&arguments.model)];
    files::check([&arguments.output], &inputs)?;
    let session = Session::of_model(Model::from_file(&arguments.model)?);
    let options = AddOptions::new(&arguments.effect).at(&arguments.at);
    let answer = session.add(&options)?;
    files::save(&arguments.output, answer.model().to_toml())?;
    output::answer(&answer, &answer.summary, arguments.json)
}
