//! `loopsight convert`.

use crate::cli::arguments::ConvertArguments;
use crate::cli::{files, output};
use crate::error::{Error, Result};
use crate::{InspectOptions, Log, Model, Session, inspect};

pub(crate) fn run(arguments: &ConvertArguments) -> Result<()> {
    let out = &arguments.output;
    let session = match arguments.files.as_slice() {
        // Without a model: the signals that `inspect` takes its channels for.
        [log] if log.extension().is_none_or(|e| e != "toml") => {
            files::check([out], &[std::slice::from_ref(log)])?;
            let log = Log::read(log)?;
            let found = inspect(&log, &InspectOptions::default())?;
            let text = found.model_toml.ok_or_else(|| {
                Error::request(format!(
                    "{}: no plant fits its channels by their names; give a model file before it, as in \
                     `loopsight convert model.toml {} -o {}`",
                    found.file,
                    found.file,
                    out.display()
                ))
            })?;
            if let Some(plant) = found.plants.first() {
                output::note(&format!(
                    "its channels are taken for those of `{}`",
                    plant.plant
                ));
            }
            Session::new(
                Model::from_toml(&format!("model for {}", found.file), &text)?,
                log,
            )?
        }
        both => files::session([out], both, &[], &[], None)?,
    };
    let answer = session.convert(out)?;
    files::wrote(answer.written());
    output::answer(&answer, &answer.summary, arguments.json)
}
