//! `loopsight check`.

use crate::answers::{Answer as _, Mistake};
use crate::check;
use crate::cli::arguments::CheckArguments;
use crate::cli::{failure, output};
use crate::error::{Error, Result};

pub(crate) fn run(arguments: &CheckArguments) -> Result<()> {
    let answer = check(&arguments.files);
    for file in answer.files.iter().filter(|file| file.right) {
        let text = format!("{}: {}", file.file, file.summary);
        if arguments.json {
            output::note(&text);
        } else {
            output::result(&text);
        }
    }
    if arguments.json {
        output::result(&answer.to_json()?);
    }
    let mistakes = answer.files.iter().filter_map(|file| file.mistake.as_ref());
    let mut errors: Vec<&Error> = mistakes.map(Mistake::error).collect();
    // The last one is shown by whoever ends the command with it.
    let last = errors.pop();
    for error in errors {
        failure::print(error);
    }
    last.map_or(Ok(()), |error| Err(error.clone()))
}
