//! `loopsight compare`.

use crate::CompareOptions;
use crate::cli::arguments::CompareArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;

pub(crate) fn run(arguments: &CompareArguments) -> Result<()> {
    files::check(&arguments.html, &[&arguments.files])?;
    let session = files::session(&arguments.files, &[], &arguments.without, None)?;
    let bar = Bar::new();
    let options = CompareOptions::default()
        .series(arguments.series)
        .watch(bar.watch());
    let answer = session.compare(&options);
    drop(bar);
    let answer = answer?;
    for note in answer.notes() {
        output::note(note);
    }
    let text = report::comparison::text(&answer.engine);
    output::answer(&answer, &text, arguments.json)?;
    if let Some(path) = &arguments.html {
        files::save(path, &answer.page(&output::command_line()))?;
    }
    Ok(())
}
