//! `loopsight compare`.

use crate::CompareOptions;
use crate::cli::arguments::CompareArguments;
use crate::cli::progress::Bar;
use crate::cli::{files, output};
use crate::error::Result;
use crate::words::report;

pub(crate) fn run(arguments: &CompareArguments) -> Result<()> {
    let session = files::session(
        &arguments.html,
        &arguments.files,
        &[],
        &arguments.without,
        None,
    )?;
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
    files::page(arguments.html.as_ref(), |foot| answer.page(foot))
}
