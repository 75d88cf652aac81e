//! `loopsight new`: a starting point that runs at once.

use crate::cli::arguments::NewArguments;
use crate::cli::{files, output};
use crate::error::Result;
use crate::scaffold::{robot, workshop};

pub(crate) fn run(arguments: &NewArguments) -> Result<()> {
    let made = match &arguments.plant {
        Some(plant) => robot(&arguments.folder, plant)?,
        None => workshop(&arguments.folder, arguments.loopsight.as_deref())?,
    };
    made.written.iter().for_each(files::wrote);
    if let Some(note) = &made.note {
        output::note(note);
    }
    output::result(&format!(
        "next:\n  cd {}\n  {}",
        arguments.folder.display(),
        made.next.join("\n  ")
    ));
    Ok(())
}
